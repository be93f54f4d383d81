import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, sensor_unit


@Effect(
    source="shift theorem of Fourier; filters and multiplexers state their group delay",
    acts_on="output",
    places=lambda structure, sensors: [{}] + [{"node": node} for node in sensors if len(sensors) > 1],
    positive=True,
    checked="z(t - tau) in time at w tau = 0.7 to 1e-12; its derivatives",
    confounders={
        "external_damping": "a delay also shifts the phase far from resonance, where damping has little influence",
        "phase_reference": "the phase error of a wrong mark is the same at all speeds, that of a delay grows",
    },
)
def delay(sensors, structure, node: int | None = None):
    """Signal delayed by tau, of all sensors or of one node: harmonic n is measured as e^{-j n w tau} z_n.

    For a small tau, and in time, z is measured as z - tau dz/dt.
    """
    late = np.eye(len(sensors)) if node is None else np.diag(sensor_unit(sensors, node))

    def exact(tau):
        def gain(speed, harmonic):
            return np.expm1(-1j * harmonic * speed * tau)

        return (Entry(late, gain=gain, frequency_only=True),)

    usual = 0.06 / structure.scales.frequency
    return [Parameter("delay", "s", (Entry(-late, order=1),), typical=usual, exact=exact)]
