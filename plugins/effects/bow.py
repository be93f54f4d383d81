import numpy as np

from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.terms import Entry, Parameter


def bow(structure, node: int | None = None):
    """Permanent bend r_0 that turns with the shaft, in the shape of a load at the node: force K r_0 e^{jwt}."""
    here = structure.unit(structure.default_node() if node is None else node)
    compliance = here @ np.linalg.solve(structure.stiffness, here)
    return [Parameter("bow", "m", (Entry(here / compliance, on="one", shift=1),), typical=1e-5, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "bow",
        bow,
        source="Nicholas, Gunter, Allaire 1976",
        twins=(
            ("unbalance", "an unbalance vanishes at slow roll"),
            ("runout", "equal at slow roll; a bow resonates at the critical speed, a runout does not"),
        ),
    )
