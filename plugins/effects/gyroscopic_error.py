from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def gyroscopic_error(structure):
    """Gyroscopic moments larger than modelled, by a share of all: force j epsilon w G dq/dt."""
    entry = Entry(1j * structure.gyroscopic, order=1, gain=lambda speed: speed)
    return [Parameter("gyroscopic_error", "1", (entry,), typical=0.2)]


def whole_rotor(structure, sensors):
    """One place, on a rotor with gyroscopic moments."""
    return [{}] if structure.gyroscopic.any() else []


@hookimpl
def rotorstudy_effect():
    return Effect(
        "gyroscopic_error",
        gyroscopic_error,
        source="Green 1948; a polar moment is wrong, or its sign: then the error is -2",
        places=whole_rotor,
        checked="response equal to that of a rotor built with (1 + epsilon) G to 1e-11",
        confounders=(
            ("added_mass", "gyroscopic moments change sign between forward and backward harmonics, inertia does not"),
            ("speed_error", "a wrong speed moves the modes without tilt too"),
        ),
    )
