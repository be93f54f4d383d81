from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def stiffness_error(structure):
    """Shaft stiffer than modelled by a share of its stiffness: force -epsilon K q, on the static deflection too."""
    return [Parameter("stiffness_error", "1", (Entry(-structure.stiffness),), typical=0.05)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "stiffness_error",
        stiffness_error,
        source="Hooke; the modulus, or the diameter to the fourth, is wrong",
        checked="response equal to that of a rotor built with (1 + epsilon) K to 1e-11",
        confounders=(
            ("added_mass", "stiffness shows below the critical speed and at 0X, mass above it"),
            (
                "support_stiffness",
                "equal on a rotor of one coordinate; elsewhere more nodes tell them apart",
            ),
            ("speed_error", "a wrong speed moves no 0X"),
        ),
    )
