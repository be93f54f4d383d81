from rotorstudy.plugins import Effect, crack_parameters, hookimpl, registry


def breathing_crack_weight(structure, crack: str = "switching", node: int | None = None, element: int | None = None):
    """Crack opened and closed by the weight, whose stiffness loss acts on the static deflection only.

    crack: name of a crack plugin, which gives the breathing function.
    """
    return crack_parameters(
        registry().get("crack", crack, "breathing_crack_weight"), structure, True, node=node, element=element
    )


def where_it_cracks(structure, sensors):
    """Places where the rotor can crack."""
    return structure.crack_places()


@hookimpl
def rotorstudy_effect():
    return Effect(
        "breathing_crack_weight",
        breathing_crack_weight,
        source="thesis Eqs. (2.16) to (2.20); Mayes and Davies 1984",
        places=where_it_cracks,
        positive=True,
        checked="force in time is sigma dk u_x along the crack to 1e-12, with and without tilt",
        confounders=(
            ("shaft_asymmetry", "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too"),
            (
                "breathing_crack",
                "equal if the vibration is small compared with the static deflection: change the unbalance",
            ),
            ("crack_force", "a crack has one stiffness loss for all harmonics, free forces have one amplitude each"),
            (
                "parallel_misalignment",
                "a misaligned coupling acts at its own node and has no 0X related to 2X; run the rotor uncoupled",
            ),
            ("looseness", "the force of a loose support depends on the amplitude: change the unbalance"),
        ),
    )
