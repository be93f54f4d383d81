import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl, sensor_unit


def probe_gain(sensors, node: int | None = None):
    """Probes that show too much: x by g + m and y by g - m, so z shows (1 + g) z + m conj(z).

    The static deflection, from which displacements count, is not multiplied.
    """
    here = np.diag(sensor_unit(sensors, node))
    return [
        Parameter("gain_error", "1", (Entry(here),), typical=0.05),
        Parameter("gain_mismatch", "1", (Entry(here, on="conj"),), typical=0.05),
    ]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "probe_gain",
        probe_gain,
        source="API 670 (incremental scale factor within 5 %)",
        acts_on="output",
        nuisance=5e-3,
        checked="x (1 + g + m) and y (1 + g - m) in time to 1e-12",
        confounders=(
            ("unbalance", "a wrong gain scales every harmonic, an unbalance 1X alone"),
            (
                "support_anisotropy",
                "a mismatch mirrors the same share of everything; anisotropy resonates at backward whirl",
            ),
            (
                "probe_angle",
                "a gain scales, an angle turns; mismatch and skew mirror a quarter turn apart",
            ),
            ("reversed_probe", "a reversed probe mirrors the whole signal, a mismatch a few per cent"),
        ),
    )
