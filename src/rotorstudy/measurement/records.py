"""Records in time: checked, cut to whole revolutions, as a dataset, and simulated from a model."""

import logging
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement import quality
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import forced_harmonics
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.response.stability import check_stable
from rotorstudy.response.whirl import check_held
from rotorstudy.store import dataset

log = logging.getLogger(__name__)
SPEEDS_AT_ONCE = 100  # whose simulated responses are in memory together
PULSE_RAD = 0.1  # width of a pulse of the keyphasor


@dataclass(frozen=True)
class Record:
    """Displacement at one speed with its phase reference.

    time         : (time,) s, evenly spaced
    displacement : (sensor, time) complex x + j y, m
    speed        : rad/s
    sensors      : (sensor,) nodes
    reference    : (time,) multi-harmonic reference signal, or None
    keyphasor    : (time,) voltage with a pulse each time the phase mark passes, or None
    where        : a name for error messages
    marks        : (revolution,) s when the phase mark passed, if known without the keyphasor, or None
    """

    time: np.ndarray
    displacement: np.ndarray
    speed: float
    sensors: tuple
    reference: np.ndarray | None = None
    keyphasor: np.ndarray | None = None
    where: str = "the record"
    marks: np.ndarray | None = None


def reference_signal(speed, harmonics, time):
    """(time,) the thesis's phase reference (Fig. 2.5), 1: a sum of unit cosines, one at every harmonic; time in s."""
    return synthesize(np.ones(len(harmonics)), speed, harmonics, time).real


def keyphasor_signal(speed, time):
    """(time,) V, one smooth pulse a revolution, centred where the phase mark is at angle zero; time in s."""
    angle = np.angle(np.exp(1j * speed * time))
    return np.exp(-0.5 * (angle / PULSE_RAD) ** 2)


def records_dataset(records):
    """Records of one time base as a Dataset, as `simulate` writes it and `read_measurement` reads it."""
    z = np.array([record.displacement for record in records])
    displacement = np.stack([z.real, z.imag], axis=2)
    variables = {"displacement": (("speed", "node", "direction", "time"), displacement, "m", "shaft displacement")}
    for name, unit in (("reference", "1"), ("keyphasor", "V")):
        signals = [getattr(record, name) for record in records]
        if all(signal is not None for signal in signals):
            variables[name] = (("speed", "time"), np.array(signals), unit, f"{name} signal")
    coordinates = {
        "speed": (np.array([record.speed for record in records]), "rad/s", "spin speed"),
        "node": (np.array(records[0].sensors), "1", "node"),
        "direction": (["x", "y"], "1", "x vertically down, y from x in the sense of rotation"),
        "time": (records[0].time, "s", "time"),
    }
    return dataset(variables, coordinates, title="records")


def check_record(record, harmonics):
    """Raise RotorstudyError for a Record that does not determine these harmonics (harmonic,)."""
    where, time = record.where, np.asarray(record.time)
    if np.ndim(record.displacement) != 2 or len(record.displacement) != len(record.sensors):
        raise RotorstudyError(
            f"{where}: displacement has shape {np.shape(record.displacement)}; needed is (sensor, time) for "
            f"the sensors {tuple(record.sensors)}"
        )
    if not (np.isfinite(record.speed) and record.speed > 0):
        raise RotorstudyError(f"{where}: speed {record.speed:g} rad/s; harmonics need a rotating shaft, speed > 0")
    for name in ("displacement", "reference", "keyphasor"):
        signal = getattr(record, name)
        if signal is None:
            continue
        if np.shape(signal)[-1] != len(time):
            raise RotorstudyError(f"{where}: {np.shape(signal)[-1]} samples of {name} but {len(time)} of time")
        if not np.isfinite(signal).all():
            bad = int(np.flatnonzero(~np.isfinite(np.atleast_2d(signal)).all(axis=0))[0])
            raise RotorstudyError(
                f"{where}: {name} has NaN or infinite samples, first at {time[bad]:g} s; cut or repair"
            )
    step = np.diff(time)
    if len(step) == 0 or not (step > 0).all() or np.ptp(step) > 1e-6 * step.mean():
        raise RotorstudyError(f"{where}: time is not evenly spaced and increasing; resample the record first")
    check_length_of_record(record.speed, len(time), step.mean(), harmonics, where)


def check_length_of_record(speed, samples, step, harmonics, where):
    """Raise RotorstudyError for a record whose number of samples, `step` s apart, does not determine the harmonics."""
    revolutions = speed * step * samples / (2 * np.pi)
    for finding in quality.check_sampling(samples, revolutions + 1e-9, harmonics, where):
        raise RotorstudyError(f"{where}: {finding.text}")


def cut_to_whole_revolutions(record):
    """The record without its last incomplete revolution, so that other harmonics do not leak into those fitted."""
    step = (record.time[-1] - record.time[0]) / (len(record.time) - 1)
    revolutions = np.floor(record.speed * step * len(record.time) / (2 * np.pi) + 1e-6)
    samples = round(revolutions * 2 * np.pi / (record.speed * step))
    signals = {name: getattr(record, name) for name in ("time", "displacement", "reference", "keyphasor")}
    return replace(record, **{name: None if one is None else one[..., :samples] for name, one in signals.items()})


def simulate_records(
    model: Model,
    speeds: ArrayLike,
    harmonics: Iterable[int],
    time: ArrayLike,
    *,
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
    return list(each_record(model, speeds, harmonics, time, start_angle_rad, keyphasor_wanted))


def each_record(model, speeds, harmonics, time, start_angle_rad=0.0, keyphasor_wanted=True):
    """The records of `simulate_records`, one after another, so that only some need be in memory."""
    log.info("stability and response at %d speeds", len(speeds))
    check_held(model, max(speeds))
    check_stable(model, speeds)
    vibrating = forced_harmonics(model)
    every = np.union1d(vibrating, harmonics)
    angles = np.broadcast_to(start_angle_rad, np.shape(speeds))
    for first in range(0, len(speeds), SPEEDS_AT_ONCE):
        here = slice(first, first + SPEEDS_AT_ONCE)
        shown = measured_response(model, speeds[here], vibrating)
        amplitude = np.zeros((len(shown), len(model.sensors) + 1, len(every)), complex)
        amplitude[:, :-1, np.isin(every, vibrating)] = np.swapaxes(shown, 1, 2)
        amplitude[:, -1, np.isin(every, harmonics)] = 1
        for w, both, angle in zip(speeds[here], amplitude, angles[here], strict=True):
            turned = time + angle / w
            signals = synthesize(both, w, every, turned)
            keyphasor = keyphasor_signal(w, turned) if keyphasor_wanted else None
            where = f"simulated record at {w:g} rad/s"
            yield Record(time, signals[:-1], float(w), model.sensors, signals[-1].real, keyphasor, where)
