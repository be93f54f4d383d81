import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, Positive


@Effect(
    source="first-order high pass",
    acts_on="output",
    fixed=True,
    shape={"corner_rad_per_s": (1e-4, 0.1, "frequency")},
    checked="0X gone to 1e-12, -3 dB and 45 degrees of lead at the corner",
    confounders={
        "sensor_gap": "AC coupling removes the entire mean of every sensor",
        "delay": "a high-pass filter leads most at low speeds and removes 0X; a delay lags most at high speeds",
    },
)
def ac_coupling(sensors, corner_rad_per_s: Positive = 3.0):
    """First-order high-pass filter in all channels, which removes the mean: gain j n w / (j n w + w_c) of harmonic n.

    The amplitude is 1 if the channels are AC coupled, else 0; the corner frequency is a shape parameter.
    """

    def lost(speed, harmonic):
        return -corner_rad_per_s / (1j * harmonic * speed + corner_rad_per_s)

    entry = Entry(np.eye(len(sensors)), gain=lost, frequency_only=True)
    return [Parameter("ac_coupling", "1", (entry,), typical=1.0)]
