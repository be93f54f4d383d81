import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl, sensor_unit


def delay(sensors, node: int | None = None):
    """Signal that comes late by tau, all sensors or that of a node: z shows z - tau dz/dt.

    Linear in tau: (n w tau)^2 / 2 of harmonic n is lost.
    """
    late = np.eye(len(sensors)) if node is None else np.diag(sensor_unit(sensors, node))
    return [Parameter("delay", "s", (Entry(-late, order=1),), typical=1e-4)]


def all_or_one(structure, sensors):
    """All sensors together, or each alone."""
    return [{}] + ([{"node": node} for node in sensors] if len(sensors) > 1 else [])


@hookimpl
def rotorstudy_effect():
    return Effect(
        "delay",
        delay,
        source="Taylor; filters and multiplexers state their group delay",
        acts_on="output",
        places=all_or_one,
        positive=True,
        checked="z(t - tau) at w tau = 1e-4, in time, to 1e-7",
        confounders=(
            ("external_damping", "a delay turns the harmonics far from resonance too, where damping does little"),
            (
                "phase_reference",
                "the angle of a wrong mark is the same at all speeds, that of a delay grows with the speed",
            ),
            ("ac_coupling", "a high pass leads most at low speeds and loses 0X, a delay lags most at high speeds"),
        ),
    )
