from rotorstudy.options import Positive
from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.terms import Entry, Parameter


def unbalance(structure, node: int | None = None, mass_kg: Positive | None = None):
    """Mass centre off the shaft centre by e at angle phi from the crack edge: force m e w^2 e^{j(wt + phi)}."""
    node = structure.default_node() if node is None else node
    here = structure.unit(node)
    mass = here @ structure.mass @ here if mass_kg is None else mass_kg
    entry = Entry(mass * here, on="one", shift=1, gain=lambda speed: speed**2)
    return [Parameter("eccentricity", "m", (entry,), typical=1e-5, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "unbalance",
        unbalance,
        source="thesis Eq. (2.7)",
        twins=(
            ("bow", "grows with the square of the speed, a bow does not; a slow roll shows the bow alone"),
            ("runout", "a runout is the same at all speeds and does not resonate"),
        ),
    )
