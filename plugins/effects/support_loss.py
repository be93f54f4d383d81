import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, at_supports, outer


@Effect(
    source="Hooke along one direction; Gasch, Nordmann, Pfuetzner, Rotordynamik, anisotropic supports",
    places=at_supports,
    shape={"direction_rad": (-np.pi / 2, np.pi / 2)},
    positive=True,
    checked="along x: harmonics of a rotor on k_x - k and k_y to 1e-12",
    confounders={"support_stiffness": "a loss along one direction leaves the other; apply a static load along both"},
)
def support_loss(structure, node: int | None = None, direction_rad: float = 0.0):
    """Support that lost stiffness k along one direction d alone: force +k d (d . r), across d none.

    With z = x + j y it is k (z + e^{2j alpha} conj(z)) / 2, where alpha is the angle of d from x.
    """
    here = outer(structure.unit(node)) / 2
    usual = 0.03 * structure.scales.stiffness(node)
    entries = (Entry(here), Entry(np.exp(2j * direction_rad) * here, on="conj"))
    return [Parameter("support_stiffness_loss", "N/m", entries, typical=usual)]
