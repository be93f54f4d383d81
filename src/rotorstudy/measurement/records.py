"""Records in time: simulated, checked, written to disk, and converted to full spectra with a phase reference."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import PluginError, RotorstudyError, unknown_name
from rotorstudy.measurement import quality
from rotorstudy.measurement.keyphasor import mark_times, phase_at_start, phase_from_keyphasor
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.kinds import SpectrumMethod
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import check_harmonics, forced_harmonics
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.response.stability import check_stable
from rotorstudy.store import dataset

log = logging.getLogger(__name__)

# what phases refer to: nothing but the first sample, a multi-harmonic reference signal, or a keyphasor
PHASES = ("none", "reference", "keyphasor")


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


def keyphasor_signal(speed, time, width_rad=0.1):
    """(time,) V, one smooth pulse a revolution, centred where the phase mark is at angle zero; time in s."""
    angle = np.angle(np.exp(1j * speed * time))
    return np.exp(-0.5 * (angle / width_rad) ** 2)


def records_dataset(records):
    """Records of one time base as a Dataset, as `simulate` writes it and `read_measurement` reads it.

    Returns
    -------
    Dataset
        displacement (speed, node, direction, time) m, reference (speed, time), keyphasor (speed, time) V
    """
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
                f"{where}: {name} has NaN or infinite samples, the first at {time[bad]:g} s; cut or repair"
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


def phase_from_reference(where, harmonics, amplitude, covariance):
    """Phases psi_n (harmonic,) rad of a reference signal with this amplitude and covariance, and their covariance."""
    size = np.abs(amplitude)
    silent = size <= 1e-9 * size.max()
    if silent.any():
        lost = [int(n) for n in np.asarray(harmonics)[silent]]
        raise RotorstudyError(f"{where}: the reference signal has no harmonic {lost}; use the keyphasor")
    # the signal is real: its noise rotates n and -n by opposite angles and does not rotate the mean
    count, n = len(size), np.asarray(harmonics)
    power = np.diag(covariance)[:count] + np.diag(covariance)[count:]
    std = np.where(n == 0, 0, np.sqrt(power / 2) / size)
    mirrored = (n[:, None] == n).astype(float) - (n[:, None] == -n)
    return np.angle(amplitude), std[:, None] * std * mirrored


def compensate(amplitude, covariance, phase, phase_covariance):
    """R_n e^{-j psi_n} with its covariance, phase noise included (thesis Eq. 2.30).

    amplitude : (sensor, harmonic) m; covariance (sensor, component, component) m^2; phase (harmonic,) rad
    """
    turned = amplitude * np.exp(-1j * phase)
    count = len(phase)
    rotation = np.zeros((2 * count, 2 * count))
    index = np.arange(count)
    rotation[index, index] = rotation[count + index, count + index] = np.cos(phase)
    rotation[index, count + index], rotation[count + index, index] = np.sin(phase), -np.sin(phase)
    slope = np.zeros((*amplitude.shape[:-1], 2 * count, count))
    slope[..., index, index], slope[..., count + index, index] = turned.imag, -turned.real
    moved = rotation @ covariance @ rotation.T
    return turned, moved + slope @ phase_covariance @ np.swapaxes(slope, -1, -2)


def cut_to_whole_revolutions(record):
    """The record without its last incomplete revolution, so that other harmonics do not leak into those fitted."""
    step = (record.time[-1] - record.time[0]) / (len(record.time) - 1)
    revolutions = np.floor(record.speed * step * len(record.time) / (2 * np.pi) + 1e-6)
    samples = round(revolutions * 2 * np.pi / (record.speed * step))
    signals = {
        name: None if getattr(record, name) is None else getattr(record, name)[:samples]
        for name in ("reference", "keyphasor")
    }
    return replace(record, time=record.time[:samples], displacement=record.displacement[..., :samples], **signals)


def _no_reference(record, harmonics):
    """What to do without a reference signal, and which error to expect without any phase reference."""
    step = np.rad2deg(record.speed * (record.time[1] - record.time[0]))
    highest = max(abs(int(n)) for n in harmonics)
    return (
        f"{record.where}: no reference signal; record one, or use the keyphasor. Without either (phase 'none') the "
        "angle of the first sample is unknown, and its error rotates harmonic n n times as far: each missing sample is "
        f"{step:.2g} degrees at 1X and {highest * step:.2g} at {highest}X. A fit takes that for damping: in the rotor "
        "of thesis Table 4.10, 100 missing samples of 65536 change 27 N s/m to 7, and 200 to -22"
    )


def harmonics_by(method, signal, time, speed, harmonics, marks=None):
    """Amplitude (..., harmonic) and covariance (..., component, component) by a SpectrumMethod, or PluginError.

    signal : (..., time);  time : (time,) s;  speed : rad/s;  marks : (revolution,) s, for methods that use them
    """
    found = method.function(signal, time, speed, harmonics, *([marks] if method.uses_marks else []))
    size, lead, who = len(harmonics), np.shape(signal)[:-1], f"spectrum '{method.name}' ({method.file})"
    if not isinstance(found, (tuple, list)) or len(found) != 2:
        raise PluginError(
            f"{who} gives one {type(found).__name__}; it must give two arrays, amplitude and covariance, of shapes "
            f"{(*lead, size)} and {(*lead, 2 * size, 2 * size)}"
        )
    needed = {"amplitude": (*lead, size), "covariance": (*lead, 2 * size, 2 * size)}
    for part, (name, shape) in zip(found, needed.items(), strict=True):
        if np.shape(part) != shape:
            raise PluginError(
                f"{who} gives {name} of shape {np.shape(part)}; it must be {shape} for a signal of shape "
                f"{np.shape(signal)} and {size} harmonics"
            )
        if not np.isfinite(part).all():
            raise PluginError(f"{who} gives {name} with NaN or infinite values for a finite signal at {speed:g} rad/s")
    return found


def full_spectrum(
    records: Sequence[Record],
    harmonics: Iterable[int],
    method: SpectrumMethod,
    phase: str = "reference",
    *,
    whole_revolutions: bool = True,
) -> Spectrum:
    """The full spectrum of records.

    Parameters
    ----------
    records : list of Record
        One for each speed, of the same sensors.
    harmonics : ints (harmonic,)
        Harmonics of the spectrum.
    method : SpectrumMethod
        The plugin.
    phase : str, optional
        One of `PHASES`.
    whole_revolutions : bool, optional
        Leave the last incomplete revolution out; False uses the whole record, with its leakage.

    Returns
    -------
    Spectrum
        Amplitude (speed, harmonic, sensor) in m, with covariance.

    Raises
    ------
    RotorstudyError
        For an unknown phase, no records, or a record that does not determine these harmonics.
    """
    return full_spectra(records, harmonics, method, [phase], whole_revolutions=whole_revolutions)[phase]


def full_spectra(records, harmonics, method, phases=PHASES, *, whole_revolutions=True):
    """Phase -> Spectrum for several phases, see `full_spectrum`: less work than one after the other."""
    for phase in phases:
        if phase not in PHASES:
            raise unknown_name("phase", phase, PHASES)
    harmonics = check_harmonics(harmonics)
    if not records:
        raise RotorstudyError("no records; give at least one")
    found = {phase: [] for phase in phases}
    for record in records:
        check_record(record, harmonics)
        for phase, seen in _harmonics_of(record, harmonics, method, phases, whole_revolutions).items():
            found[phase].append(seen)
    speed, sensors = np.array([record.speed for record in records]), tuple(records[0].sensors)
    spectra = {}
    for phase, seen in found.items():
        amplitudes, covariances = zip(*seen, strict=True)
        amplitudes = np.array([amplitude.T for amplitude in amplitudes])
        spectra[phase] = Spectrum(amplitudes, speed, np.asarray(harmonics), sensors, np.array(covariances))
    return spectra


def _harmonics_of(record, harmonics, method, phases, whole_revolutions):
    """Phase -> amplitude (sensor, harmonic) and covariance (sensor, component, component) of one record."""
    whole = record  # with the pulses of the last incomplete revolution
    record = cut_to_whole_revolutions(record) if whole_revolutions else record
    marks = mark_times(whole, drifting=True) if method.uses_marks else None

    def measured(signals):
        return harmonics_by(method, signals, record.time, record.speed, harmonics, marks)

    signals, found = np.asarray(record.displacement), {}
    if "reference" in phases:
        if record.reference is None:
            raise RotorstudyError(_no_reference(record, harmonics))
        amplitude, covariance = measured(np.concatenate([signals, [record.reference]]))
        psi = phase_from_reference(record.where, harmonics, amplitude[-1], covariance[-1])
        found["reference"] = compensate(amplitude[:-1], covariance[:-1], *psi)
    if {"keyphasor", "none"} & set(phases):
        keyphasor = none = measured(signals)
        if method.uses_marks:  # its time zero is a mark
            if "none" in phases:
                psi, psi_covariance = phase_at_start(marks, record.time[0], harmonics)
                none = compensate(*none, -psi, psi_covariance)
        elif "keyphasor" in phases:
            if method.tolerates_wrong_speed:
                psi = phase_at_start(mark_times(whole, drifting=True), record.time[0], harmonics)
            else:
                psi = phase_from_keyphasor(whole, harmonics)
            keyphasor = compensate(*keyphasor, *psi)
        found |= {"keyphasor": keyphasor, "none": none}
    return {phase: found[phase] for phase in phases}


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
    """The records of `simulate_records`, one after another, so that only one need be in memory."""
    if theta is None:
        log.info("stability and response at %d speeds", len(speeds))
        check_stable(model, speeds)
    vibrating = forced_harmonics(model)
    shown = measured_response(model, speeds, vibrating, theta)
    every = np.union1d(vibrating, harmonics)
    amplitude = np.zeros((len(speeds), len(model.sensors) + 1, len(every)), complex)
    amplitude[:, :-1, np.isin(every, vibrating)] = np.swapaxes(shown, 1, 2)
    amplitude[:, -1, np.isin(every, harmonics)] = 1
    for w, both, angle in zip(speeds, amplitude, np.broadcast_to(start_angle_rad, np.shape(speeds)), strict=True):
        turned = time + angle / w
        signals = synthesize(both, w, every, turned)
        keyphasor = keyphasor_signal(w, turned) if keyphasor_wanted else None
        yield Record(
            time, signals[:-1], float(w), model.sensors, signals[-1].real, keyphasor, f"simulated record at {w:g} rad/s"
        )
