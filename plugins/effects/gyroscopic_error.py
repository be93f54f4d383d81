from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Green 1948; epsilon = -2 is a wrong sign",
    places=lambda structure, sensors: [{}] if structure.gyroscopic.any() else [],
    checked="response equal to that of a rotor built with (1 + epsilon) G to 1e-11",
    confounders={"speed_error": "a wrong speed also shifts modes without tilt"},
)
def gyroscopic_error(structure):
    """Relative error epsilon of all gyroscopic moments: force j epsilon w G dq/dt."""
    entry = Entry(1j * structure.gyroscopic, order=1, gain=lambda speed: speed)
    return [Parameter("gyroscopic_error", "1", (entry,), typical=0.2)]
