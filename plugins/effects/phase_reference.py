import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="thesis Eq. (2.30)",
    acts_on="output",
    nuisance=5e-3,
    checked="harmonics of a record without phase reference that starts at 0.6 rad, to 1e-6",
    confounders={
        "unbalance": "a wrong mark shifts the phase of harmonic n by n times its angle: compare 1X with 2X",
        "probe_angle": "rotated probes shift all phases by one angle, a wrong mark harmonic n by n times it",
    },
)
def phase_reference(sensors):
    """Phase mark off by an angle alpha: harmonic n is measured as e^{j n alpha} z_n.

    For a small alpha, and in time, z is measured as z + alpha / w dz/dt.
    """
    every = np.eye(len(sensors))

    def exact(alpha):
        def gain(speed, harmonic):
            return np.expm1(1j * harmonic * alpha)

        return (Entry(every, gain=gain, frequency_only=True),)

    entry = Entry(every, order=1, gain=lambda speed: 1 / speed)
    return [Parameter("phase_reference", "rad", (entry,), typical=0.02, exact=exact)]
