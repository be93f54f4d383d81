from rotorstudy.plugins import Effect, crack_parameters, hookimpl, registry


def breathing_crack(structure, crack: str = "switching", node: int | None = None, element: int | None = None):
    """Crack opened and closed by the weight, whose stiffness loss acts on the total motion (time-varying).

    crack: name of a crack plugin, which gives the breathing function.
    """
    return crack_parameters(
        registry().get("crack", crack, "breathing_crack"), structure, False, node=node, element=element
    )


def where_it_cracks(structure, sensors):
    """Places where the rotor can crack."""
    return structure.crack_places()


@hookimpl
def rotorstudy_effect():
    return Effect(
        "breathing_crack",
        breathing_crack,
        source="thesis Eqs. (2.16) to (2.18); Gasch 1993",
        places=where_it_cracks,
        positive=True,
        checked="force in time is sigma dk times the motion along the crack, to 1e-12",
        confounders=(
            ("shaft_asymmetry", "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too"),
            (
                "breathing_crack_weight",
                "equal if the vibration is small compared with the static deflection: change the unbalance",
            ),
        ),
    )
