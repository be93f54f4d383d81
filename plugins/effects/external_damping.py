import numpy as np

from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.terms import Entry, Parameter


def external_damping(structure, node: int | None = None):
    """Viscous damping against the surroundings: force -c dz/dt."""
    here = structure.unit(structure.default_node() if node is None else node)
    return [Parameter("external_damping", "N s/m", (Entry(-np.outer(here, here), order=1),), typical=100.0)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "external_damping",
        external_damping,
        source="thesis Eq. (2.7)",
        twins=(("internal_damping", "equal at harmonics where n and n - 1 act alike; 1X and 0X tell them apart"),),
    )
