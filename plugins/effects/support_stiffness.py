from rotorstudy.plugins import Effect, Entry, Parameter, outer


@Effect(
    source="Hooke; a negative value also describes magnetic pull",
    checked="response equal to that of a rotor built with K + k to 1e-11",
)
def support_stiffness(structure, node: int | None = None):
    """Additional stiffness to ground at a node, negative if too much was modelled: force -k z."""
    here = structure.unit(node)
    usual = 0.03 * structure.scales.stiffness(node)
    return [Parameter("support_stiffness", "N/m", (Entry(-outer(here)),), typical=usual)]
