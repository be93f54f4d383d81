import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


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
        positive=True,
        checked="-c dz/dt in time to 1e-12",
        confounders=(
            (
                "internal_damping",
                "internal damping is silent at +1X and gives a static side force at 0X",
            ),
            ("shaft_damping", "shaft damping is silent at +1X and gives a static side force at 0X"),
            ("phase_reference", "a wrong mark turns the harmonics far from resonance too, where damping does little"),
            ("delay", "a delay turns the harmonics far from resonance too, where damping does little"),
        ),
    )
