from rotorstudy.plugins import Effect, crack_parameters, hookimpl, registry


def breathing_crack_weight(structure, crack: str = "switching", node: int | None = None, element: int | None = None):
    """Crack that weight opens and closes: its stiffness loss acts on the static deflection alone.

    crack: which breathing function of the plugin library.
    """
    return crack_parameters(
        registry().get("crack", crack, "breathing_crack_weight"), structure, True, node=node, element=element
    )


def where_it_cracks(structure, sensors):
    """Places where the rotor says it can crack."""
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
            ("shaft_asymmetry", "an open asymmetry has 2X from gravity alone; a crack that breathes has 1X and 3X too"),
            (
                "breathing_crack",
                "equal while the motion is small against the static deflection: change the unbalance",
            ),
            ("crack_force", "a crack has one stiffness loss for all harmonics, free forces have one each"),
            (
                "parallel_misalignment",
                "a misaligned coupling has its own node and no 0X tied to 2X; an uncoupled run tells",
            ),
            ("looseness", "a loose support depends on the size of the motion: change the unbalance"),
        ),
    )
