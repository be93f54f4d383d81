from rotorstudy.plugins import Effect, Entry, Parameter, outer


@Effect(
    source="Gasch, Nordmann, Pfuetzner, Rotordynamik, anisotropic bearings",
    fold=2,
    checked="with alpha = 0: x and y whirl apart with k_s + k and k_s - k, harmonics to 1e-12",
    confounders={"support_loss": "a loss along one direction lowers the mean stiffness too; load both directions"},
)
def support_anisotropy(structure, node: int | None = None):
    """Support stiffer by k along the angle alpha and softer by k across: force -k e^{2j alpha} conj(z).

    The phase of the amplitude is twice the angle alpha of the stiff direction.
    """
    here = structure.unit(node)
    entry = Entry(-outer(here), on="conj")
    usual = 0.03 * structure.scales.stiffness(node)
    return [Parameter("support_anisotropy", "N/m", (entry,), typical=usual, is_complex=True)]
