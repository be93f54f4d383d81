import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def phase_reference(sensors):
    """Phase mark off by an angle alpha: harmonic n turns by n alpha, so z shows z + alpha / w dz/dt.

    Linear in alpha: (n alpha)^2 / 2 of harmonic n is lost, 0.4 % of 5X at 1 degree.
    """
    entry = Entry(np.eye(len(sensors)), order=1, gain=lambda speed: 1 / speed)
    return [Parameter("phase_reference", "rad", (entry,), typical=0.02)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "phase_reference",
        phase_reference,
        source="thesis Eq. (2.30), linear",
        acts_on="output",
        nuisance=5e-3,
        checked="harmonics of a record that starts at 1e-4 rad, without reference, to 1e-6",
        confounders=(
            (
                "unbalance",
                "a wrong mark turns harmonic n by n times its angle: 1X alone cannot tell, 2X can",
            ),
            ("external_damping", "a wrong mark turns the harmonics far from resonance too, where damping does little"),
            (
                "probe_angle",
                "turned probes turn all harmonics alike, a wrong mark turns harmonic n by n times the angle",
            ),
            ("delay", "the angle of a wrong mark is the same at all speeds, that of a delay grows with the speed"),
            (
                "internal_damping",
                "a wrong mark turns the harmonics far from resonance too, where damping does little",
            ),
        ),
    )
