"""Records of the steady state of a model."""

import logging
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.measurement.records import Record, keyphasor_signal
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import forced_harmonics
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.response.stability import check_stable

log = logging.getLogger(__name__)
SPEEDS_AT_ONCE = 100  # whose responses are in memory together


def simulate_records(
    model: Model,
    speeds: ArrayLike,
    harmonics: Iterable[int],
    time: ArrayLike,
    *,
    theta: ArrayLike | None = None,
    start_angle_rad: ArrayLike = 0.0,
    keyphasor_wanted: bool = True,
) -> list[Record]:
    """Records of the steady state of a model with reference signal and keyphasor.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speeds : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Of the reference signal; the displacement has all harmonics of the model.
    time : array (time,)
        In s.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.
    start_angle_rad : array (speed,) or float, optional
        Angle of the phase mark at the first sample, rad; above zero for a record that starts late.
    keyphasor_wanted : bool, optional
        Whether the records have a keyphasor signal.

    Returns
    -------
    list of Record
        One a speed.

    Raises
    ------
    NoSteadyState
        If a whirl mode grows at a speed.
    """
    return list(
        each_record(
            model,
            speeds,
            harmonics,
            time,
            theta=theta,
            start_angle_rad=start_angle_rad,
            keyphasor_wanted=keyphasor_wanted,
        )
    )


def each_record(model, speeds, harmonics, time, *, theta=None, start_angle_rad=0.0, keyphasor_wanted=True):
    """The records of `simulate_records`, one after another, so that only some need be in memory."""
    if theta is None:
        log.info("stability and response at %d speeds", len(speeds))
        check_stable(model, speeds)
    vibrating = forced_harmonics(model)
    every = np.union1d(vibrating, harmonics)
    angles = np.broadcast_to(start_angle_rad, np.shape(speeds))
    for first in range(0, len(speeds), SPEEDS_AT_ONCE):
        here = slice(first, first + SPEEDS_AT_ONCE)
        shown = measured_response(model, speeds[here], vibrating, theta)
        amplitude = np.zeros((len(shown), len(model.sensors) + 1, len(every)), complex)
        amplitude[:, :-1, np.isin(every, vibrating)] = np.swapaxes(shown, 1, 2)
        amplitude[:, -1, np.isin(every, harmonics)] = 1
        for w, both, angle in zip(speeds[here], amplitude, angles[here], strict=True):
            turned = time + angle / w
            signals = synthesize(both, w, every, turned)
            keyphasor = keyphasor_signal(w, turned) if keyphasor_wanted else None
            where = f"simulated record at {w:g} rad/s"
            yield Record(time, signals[:-1], float(w), model.sensors, signals[-1].real, keyphasor, where)
