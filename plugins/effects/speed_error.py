from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def speed_error(structure):
    """Speed higher than its label by a share epsilon: force -epsilon w dD/dw q = -epsilon (2 M q'' - 2 j w G q').

    First order in epsilon, for inertia and gyroscopic moments; an unbalance takes 2 epsilon of its own.
    """
    entries = (Entry(-2 * structure.mass, order=2), Entry(2j * structure.gyroscopic, order=1, gain=lambda speed: speed))
    return [Parameter("speed_error", "1", entries, typical=0.01)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "speed_error",
        speed_error,
        source="derivative of the dynamic stiffness K - (n w)^2 M + n w^2 G by the speed",
        checked="derivative of the response to a constant force by the speed, by central differences, to 1e-6",
        confounders=(
            ("stiffness_error", "a wrong speed moves no 0X"),
            (
                "added_mass",
                "equal if all masses are wrong alike and nothing tilts; a second tachometer tells",
            ),
            ("gyroscopic_error", "a wrong speed moves the modes without tilt too"),
        ),
    )
