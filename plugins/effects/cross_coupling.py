from rotorstudy.plugins import Effect, Entry, Parameter, outer


@Effect(
    source="Alford 1965; Childs 1993, Turbomachinery Rotordynamics",
    positive=True,
    checked="stability limit k = c w_n of a Jeffcott rotor: growth rate zero there to 1e-6 of k",
    confounders={
        "seal": "the cross force of a seal grows with the speed, and a seal also damps",
        "internal_damping": "cross-coupling is the same at all speeds and acts at +1X, internal damping does not",
    },
)
def cross_coupling(structure, node: int | None = None):
    """Cross-coupled stiffness of a fluid that swirls with the shaft: force +j k z, F_x = -k y and F_y = k x.

    Positive k drives forward whirl.
    """
    here = structure.against_casing(node)
    usual = 0.007 * structure.scales.stiffness(node)
    return [Parameter("cross_coupling", "N/m", (Entry(1j * outer(here)),), typical=usual)]
