from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="derivative of the dynamic stiffness K - (n w)^2 M + n w^2 G with respect to the speed",
    checked="central differences over speed of the response to a constant force, to 1e-6",
    confounders={"stiffness_error": "a wrong speed does not change 0X"},
)
def speed_error(structure):
    """True speed above the stated one by a share epsilon: force -epsilon w dD/dw q = -epsilon (2 M q'' - 2 j w G q').

    First order in epsilon, for inertia and gyroscopic moments; an unbalance force changes by 2 epsilon besides.
    """
    entries = (Entry(-2 * structure.mass, order=2), Entry(2j * structure.gyroscopic, order=1, gain=lambda speed: speed))
    return [Parameter("speed_error", "1", entries, typical=0.01)]
