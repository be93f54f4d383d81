from rotorstudy.plugins import Effect, Entry, Parameter, Positive, hookimpl


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
        checked="whirl e eta^2 / |1 - eta^2| of a Jeffcott rotor to 1e-12",
        confounders=(
            ("bow", "an unbalance grows with the square of the speed and vanishes at slow roll, where the bow stays"),
            ("runout", "a runout is the same at all speeds and does not resonate"),
            (
                "couple_unbalance",
                "a couple tilts: two measuring planes, or the mode of the critical speed, tell them apart",
            ),
            (
                "base_motion",
                "base motion shakes all masses alike; equal on a rotor of one mass: measure the base",
            ),
            ("parallel_misalignment", "a misaligned coupling does not grow with the square of the speed, and has 2X"),
            (
                "phase_reference",
                "a wrong mark turns harmonic n by n times its angle: 1X alone cannot tell, 2X can",
            ),
            ("probe_gain", "a wrong gain scales every harmonic, an unbalance 1X alone"),
        ),
    )
