import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl, sensor_unit


def probe_angle(sensors, node: int | None = None):
    """Probes turned by rho, y by sigma more: z shows z - j rho z - j sigma (z + conj z) / 2.

    Linear in both angles: 1 % of them is lost at 8 degrees.
    """
    here = np.diag(sensor_unit(sensors, node))
    return [
        Parameter("probe_rotation", "rad", (Entry(-1j * here),), typical=0.03),
        Parameter("probe_skew", "rad", (Entry(-0.5j * here), Entry(-0.5j * here, on="conj")), typical=0.03),
    ]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "probe_angle",
        probe_angle,
        source="API 670 (probes 90 degrees apart within 5)",
        acts_on="output",
        checked="exactly turned and skewed axes at 1e-4 rad, in time, to 1e-7",
        confounders=(
            (
                "support_anisotropy",
                "a skewed probe mirrors the same share of everything; anisotropy resonates at backward whirl",
            ),
            ("gravity_direction", "turned probes turn every harmonic, a turned weight 0X and what it drives"),
            (
                "probe_gain",
                "a gain scales, an angle turns; mismatch and skew mirror a quarter turn apart",
            ),
            (
                "phase_reference",
                "turned probes turn all harmonics alike, a wrong mark turns harmonic n by n times the angle",
            ),
            ("swapped_probes", "swapped probes mirror the whole signal, a skew a few per cent"),
        ),
    )
