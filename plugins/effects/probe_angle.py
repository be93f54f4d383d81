import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, probe_axis, sensor_unit


@Effect(
    source="API 670 (probes 90 degrees apart within 5)",
    acts_on="output",
    checked="exactly rotated and skewed axes at 0.1 and 0.2 rad, in time, to 1e-12",
    confounders={
        "support_anisotropy": "a skewed probe mirrors the same share of every harmonic, anisotropy does not",
        "probe_gain": "a gain scales, an angle rotates; mirrored parts of mismatch and skew are 90 degrees apart",
        "probe_error": "a rotated bracket rotates both probes; exchange the probes, and the error stays",
        "swapped_probes": "swapped probes mirror the entire signal, a skew a few per cent of it",
    },
)
def probe_angle(sensors, structure, node: int | None = None):
    """Probes rotated by rho, y by sigma more: x is measured as Re(z e^{-j rho}), y as Im(z e^{-j (rho + sigma)}).

    x and y are along the probes, at an angle a to those of the rotor: there conj(z) is e^{2ja} conj(z).
    """
    here = np.diag(sensor_unit(sensors, node))
    mirrored = probe_axis(structure, sensors, node) ** 2 * here

    def rotated(rho):
        return (Entry(np.expm1(-1j * rho) * here),)

    def skewed(sigma):
        return Entry(np.expm1(-1j * sigma) / 2 * here), Entry(-np.expm1(1j * sigma) / 2 * mirrored, on="conj")

    skew = Entry(-0.5j * here), Entry(-0.5j * mirrored, on="conj")
    return [
        Parameter("probe_rotation", "rad", (Entry(-1j * here),), typical=0.03, exact=rotated),
        Parameter("probe_skew", "rad", skew, typical=0.03, exact=skewed),
    ]
