from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def gravity_direction(structure):
    """Weight off the x axis by an angle alpha towards y: static force j alpha f, linear in alpha (1 % at 8 degrees).

    A crack driven by the modelled weight keeps its direction; to turn everything, turn the probes.
    """
    return [Parameter("gravity_direction", "rad", (Entry(1j * structure.static_load, on="one"),), typical=0.03)]


def where_it_weighs(structure, sensors):
    """One place, on a rotor with weight that its shaft carries."""
    return [{}] if structure.static_load.any() else []


@hookimpl
def rotorstudy_effect():
    return Effect(
        "gravity_direction",
        gravity_direction,
        source="Newton",
        places=where_it_weighs,
        checked="0X of a Jeffcott rotor is j alpha m g / k to 1e-12",
        confounders=(
            (
                "static_preload",
                "equal on a rotor of one coordinate; a turned gravity pulls every mass, a preload one node",
            ),
            ("probe_angle", "turned probes turn every harmonic, a turned weight 0X and what it drives"),
        ),
    )
