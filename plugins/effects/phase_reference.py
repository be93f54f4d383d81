import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def phase_reference(sensors):
    """Phase mark off by an angle alpha: harmonic n shifts by n alpha in phase, z is measured as z + alpha / w dz/dt.

    Linear in alpha: the relative error of harmonic n is (n alpha)^2 / 2, 0.4 % of 5X at 1 degree.
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
        checked="harmonics of a record without phase reference that starts at 1e-4 rad, to 1e-6",
        confounders={
            "unbalance": "a wrong mark shifts the phase of harmonic n by n times its angle: compare 1X with 2X",
            "probe_angle": "rotated probes shift all phases by one angle, a wrong mark harmonic n by n times it",
        },
    )
