from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Hooke; proportional to the modulus and to the fourth power of the diameter",
    checked="response equal to that of a rotor built with (1 + epsilon) K to 1e-11",
    confounders={
        "support_stiffness": "equal on a rotor of one coordinate; else measurements at more nodes separate them"
    },
)
def stiffness_error(structure):
    """Relative error epsilon of the shaft stiffness: force -epsilon K q, including the static deflection."""
    return [Parameter("stiffness_error", "1", (Entry(-structure.stiffness),), typical=0.05)]
