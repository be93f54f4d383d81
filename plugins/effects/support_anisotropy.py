import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def support_anisotropy(structure, node: int | None = None):
    """Support stiffer by k along the angle alpha and softer by k across: force -k e^{2j alpha} conj(z).

    The phase of the amplitude is twice the angle alpha of the stiff direction.
    """
    here = structure.unit(structure.default_node() if node is None else node)
    entry = Entry(-np.outer(here, here), on="conj")
    usual = 0.03 * structure.scales.stiffness(node)
    return [Parameter("support_anisotropy", "N/m", (entry,), typical=usual, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "support_anisotropy",
        support_anisotropy,
        source="Gasch, Nordmann, Pfuetzner, Rotordynamik, anisotropic bearings",
        fold=2,
        checked="with alpha = 0: x and y whirl apart with k_s + k and k_s - k, harmonics to 1e-12",
        confounders=(
            (
                "probe_error",
                "a wrong probe mirrors the same share of every harmonic; anisotropy excites backward whirl modes",
            ),
            ("bearing_coefficients", "two stiffnesses, without damping; change the film: speed, oil, load"),
            ("pedestal_resonance", "equal far below its resonance; tap the pedestal, or measure its motion"),
            ("support_loss", "a loss along one direction lowers the mean stiffness too; load it along both"),
            (
                "probe_gain",
                "a mismatch mirrors the same share of every harmonic; anisotropy excites backward whirl modes",
            ),
            (
                "probe_angle",
                "a skewed probe mirrors the same share of every harmonic; anisotropy excites backward whirl modes",
            ),
            ("shaft_asymmetry", "fixed anisotropy couples n with -n, rotating asymmetry n with 2 - n"),
        ),
    )
