from rotorstudy.plugins import Effect, crack_parameters, registry


@Effect(
    source="thesis Eqs. (2.16) to (2.20); Mayes and Davies 1984",
    places=lambda structure, sensors: structure.crack_places(),
    candidate=False,  # the limit of breathing_crack at small vibration: one cause, one name
    positive=True,
    checked="force in time is sigma dk u_x along the crack to 1e-12, with and without tilt",
    confounders={
        "crack_force": "a crack has one stiffness loss for all harmonics, free forces have one amplitude each"
    },
)
def breathing_crack_weight(
    structure,
    crack: str = "switching",
    crack_angle_rad: float = 0.0,
    node: int | None = None,
    element: int | None = None,
):
    """Crack opened and closed by the weight, whose stiffness loss acts on the static deflection only.

    crack: name of a crack plugin, which gives the breathing function.  crack_angle_rad: angle of the middle of the
    crack edge from the reference line of the shaft, in the direction of rotation.
    """
    law = registry().get("crack", crack, "breathing_crack_weight")
    return crack_parameters(law, structure, True, node=node, element=element, angle_rad=crack_angle_rad)
