"""Records in time: made from harmonics, checked at the door, turned into full spectra with a phase reference."""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError, unknown_name
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.harmonic import check_harmonics, forced_harmonics, measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.response.stability import check_stable

MARK_TOLERANCE = 0.05  # turns a keyphasor pulse may be off the others: jitter is far less, spurious ones mostly more
LABEL_TOLERANCE = 0.1  # of the speed a record states, against its pulses, for methods that do not rely on the label
PIECE_TURNS = 10  # of the spline through the phase marks: it follows slower drift, and averages the jitter of so many


@dataclass(frozen=True)
class Record:
    """Displacement at one speed with what is needed to give it a phase.

    time         : (time,) s, evenly spaced
    displacement : (sensor, time) complex x + j y, m
    speed        : rad/s
    sensors      : (sensor,) nodes
    reference    : (time,) multi-harmonic reference signal, or None
    keyphasor    : (time,) voltage with a pulse each time the phase mark passes, or None
    where        : a name for error messages
    """

    time: np.ndarray
    displacement: np.ndarray
    speed: float
    sensors: tuple
    reference: np.ndarray | None = None
    keyphasor: np.ndarray | None = None
    where: str = "the record"


def reference_signal(speed, harmonics, time):
    """(time,) the thesis's phase reference (Fig. 2.5): the real part of a unit cosine at every harmonic."""
    return synthesize(np.ones(len(harmonics)), speed, harmonics, time).real


def keyphasor_signal(speed, time, width_rad=0.1):
    """(time,) V, one smooth pulse a revolution, centred where the phase mark is at angle zero."""
    angle = np.angle(np.exp(1j * speed * time))
    return np.exp(-0.5 * (angle / width_rad) ** 2)


def spectral_lines(time, speed, harmonics):
    """(harmonic,) line of the discrete Fourier transform nearest to each harmonic."""
    revolutions = speed * (time[1] - time[0]) * len(time) / (2 * np.pi)
    return np.rint(np.asarray(harmonics) * revolutions).astype(int) % len(time)


def fit_basis(signal, basis, window=1.0):
    """Least squares of a signal (..., time) on a basis (..., harmonic, time), samples weighted by a window (time,).

    returns : amplitude (..., harmonic), inverse (..., harmonic, harmonic) of the normal matrix
    """
    weighted = basis.conj() * window
    inverse = np.linalg.inv(weighted @ np.swapaxes(basis, -1, -2))
    if basis.ndim == 2:
        return signal @ weighted.T @ inverse.T, inverse
    return (inverse @ (weighted @ signal[..., None]))[..., 0], inverse


def noise_power(residual, lines, window=1.0):
    """(...) m^2 variance of white noise in a record, from the noise floor of what a fit leaves.

    The floor is the median of the residual's periodogram, so that lines nobody asked for (other harmonics, hum) do not
    count as noise.

    residual : (..., time) complex or real, m
    lines    : (harmonic,) lines of the harmonics asked for, which are signal or emptied by the fit, not noise
    window   : (time,) weights that the samples were fitted with
    """
    samples = residual.shape[-1]
    rest = np.delete(np.fft.fft(residual * window, axis=-1), lines, axis=-1)
    return np.median(np.abs(rest) ** 2, axis=-1) / (np.log(2) * np.sum(np.broadcast_to(window, samples) ** 2))


def circular_covariance(hermitian):
    """(..., component, component) of real parts, then imaginary parts, of circular noise (..., harmonic, harmonic)."""
    real, imag = hermitian.real, hermitian.imag
    return np.concatenate([np.concatenate([real, -imag], -1), np.concatenate([imag, real], -1)], -2) / 2


def white_noise_covariance(residual, inverse_normal, lines, window=1.0):
    """Covariance of harmonics fitted to a record, with noise taken as white and circular; see `noise_power`.

    inverse_normal : (harmonic, harmonic) inverse of basis^H basis
    returns        : (..., component, component) m^2, real parts then imaginary parts
    """
    return noise_power(residual, lines, window)[..., None, None] * circular_covariance(inverse_normal)


def shared_error_covariance(change, covariance):
    """Covariance of harmonics through quantities that were estimated with them: speed, or the shaft angle.

    change     : (..., harmonic, quantity) complex derivative;  covariance (..., quantity, quantity)
    returns    : (..., component, component)
    """
    slope = np.concatenate([change.real, change.imag], axis=-2)
    return slope @ covariance @ np.swapaxes(slope, -1, -2)


def check_record(record, harmonics):
    """The door: raise for a record from which these harmonics cannot be had."""
    where, time = record.where, np.asarray(record.time)
    if np.ndim(record.displacement) != 2 or len(record.displacement) != len(record.sensors):
        raise RotorstudyError(
            f"{where}: displacement has shape {np.shape(record.displacement)}; needed is (sensor, time) for "
            f"the sensors {tuple(record.sensors)}"
        )
    if not (np.isfinite(record.speed) and record.speed > 0):
        raise RotorstudyError(f"{where}: speed {record.speed:g} rad/s; harmonics need a rotor that turns, so speed > 0")
    if len(time) < 2 * len(harmonics) + 1:
        raise RotorstudyError(
            f"{where}: {len(time)} samples are too few for {len(harmonics)} harmonics; "
            f"at least {2 * len(harmonics) + 1} are needed"
        )
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
    if not (step > 0).all() or np.ptp(step) > 1e-6 * step.mean():
        raise RotorstudyError(f"{where}: time is not evenly spaced and increasing; resample the record first")
    step = step.mean()
    revolutions = record.speed * step * len(time) / (2 * np.pi)
    if revolutions < 1 - 1e-9:
        raise RotorstudyError(f"{where}: {revolutions:.2f} revolutions; at least one is needed, take a longer record")
    highest = max(abs(int(n)) for n in harmonics)
    if highest * record.speed * step >= np.pi:
        allowed = int(np.ceil(np.pi / (record.speed * step))) - 1
        raise RotorstudyError(
            f"{where}: harmonic {highest} lies above the Nyquist frequency; with {1 / step:g} samples/s at "
            f"{record.speed:g} rad/s harmonics up to {allowed} can be had"
        )


def phase_from_reference(record, harmonics, amplitude, covariance):
    """Phase psi_n (harmonic,) of the harmonics of the reference signal, and its covariance."""
    size = np.abs(amplitude)
    silent = size <= 1e-9 * size.max()
    if silent.any():
        lost = [int(n) for n in np.asarray(harmonics)[silent]]
        raise RotorstudyError(
            f"{record.where}: the reference signal has no harmonic {lost}; use the keyphasor for these"
        )
    # the signal is real: its noise turns n and -n by opposite angles, and its mean not at all
    count, n = len(size), np.asarray(harmonics)
    power = np.diag(covariance)[:count] + np.diag(covariance)[count:]
    std = np.where(n == 0, 0, np.sqrt(power / 2) / size)
    mirrored = (n[:, None] == n).astype(float) - (n[:, None] == -n)
    return np.angle(amplitude), std[:, None] * std * mirrored


def mark_times(record, drifting=False):
    """(revolution,) s when the phase mark passed: centres of the keyphasor pulses at half height.

    drifting : take the speed from the pulses, so that it may drift and its label may be wrong
    raises   : RotorstudyError if there is no keyphasor, or if its pulses are not about one a revolution
    """
    if record.keyphasor is None:
        raise RotorstudyError(f"{record.where}: no keyphasor; record one, or use a reference signal")
    signal, time = np.asarray(record.keyphasor, float), np.asarray(record.time)
    level = (signal.max() + signal.min()) / 2
    above = signal > level
    up, down = np.flatnonzero(~above[:-1] & above[1:]), np.flatnonzero(above[:-1] & ~above[1:])
    if len(up) and len(down):
        down = down[down > up[0]]

    def crossing(i):
        return time[i] + (level - signal[i]) / (signal[i + 1] - signal[i]) * (time[i + 1] - time[i])

    pairs = min(len(up), len(down))
    found = (crossing(up[:pairs]) + crossing(down[:pairs])) / 2
    if drifting:
        _check_drifting(record, found)
    else:
        _check_steady(record, found)
    return found


def _check_steady(record, found):
    """Raise unless the pulses come once a revolution of the stated speed."""
    expected = record.speed * (record.time[-1] - record.time[0]) / (2 * np.pi)
    if len(found) == 0 or abs(len(found) - expected) > 1.5:
        raise RotorstudyError(
            f"{record.where}: {len(found)} keyphasor pulses in {expected:.1f} revolutions at {record.speed:g} rad/s; "
            "there must be one a revolution"
        )
    angle = np.exp(1j * record.speed * found)
    usual = np.median(angle.real) + 1j * np.median(angle.imag)
    off = np.abs(np.angle(angle * np.conj(usual))) / (2 * np.pi)
    if off.max() > MARK_TOLERANCE:
        raise RotorstudyError(
            f"{record.where}: the keyphasor pulse at {found[off.argmax()]:g} s comes {off.max():.2f} turns off the "
            f"others at {record.speed:g} rad/s; remove spurious pulses, or correct the speed"
        )


def _check_drifting(record, found):
    """Raise unless each pulse comes half way between its neighbours, at about the stated speed."""
    if len(found) < 2:
        raise RotorstudyError(
            f"{record.where}: {len(found)} whole keyphasor pulses; the shaft angle needs at least two, so take a "
            "record of three revolutions or more, or use a method that relies on the stated speed"
        )
    turn = np.median(np.diff(found))
    uneven = np.abs(np.diff(found, 2)) / turn
    if len(uneven) and uneven.max() > 2 * MARK_TOLERANCE:
        worst = int(uneven.argmax())
        raise RotorstudyError(
            f"{record.where}: the keyphasor pulse at {found[worst + 1]:g} s comes {uneven[worst] / 2:.2f} turns off "
            f"the middle of its neighbours, allowed is {MARK_TOLERANCE:g}; remove spurious pulses, restore missing ones"
        )
    measured = 2 * np.pi / turn
    if abs(measured / record.speed - 1) > LABEL_TOLERANCE:
        raise RotorstudyError(
            f"{record.where}: the keyphasor turns at {measured:g} rad/s, the record states {record.speed:g} rad/s; "
            "correct the speed, there must be one pulse a revolution"
        )
    for place, gap in (("start", found[0] - record.time[0]), ("end", record.time[-1] - found[-1])):
        if gap > (1 + 2 * MARK_TOLERANCE) * turn:
            raise RotorstudyError(
                f"{record.where}: no keyphasor pulse in the {gap / turn:.2f} turns at the {place} of the record; cut it"
            )


def shaft_angle(marks, time):
    """Angle of the shaft through its phase marks: a cubic spline of pieces of ten turns, by least squares.

    Least squares rather than interpolation: what the marks scatter about a slow drift is jitter, and it is stated.

    marks   : (revolution,) s;  time : (time,) s
    returns : angle (time,) rad, slope (time, coefficient) by the spline's coefficients, their covariance
    source  : Fyfe and Munck 1997 (computed order tracking), with a fit for their interpolation
    """
    from scipy.interpolate import BSpline

    count = len(marks)
    degree = min(max((count - 1) // 2, 1), 3)
    middle = marks.mean()
    ends = np.linspace(marks[0], marks[-1], max(1, (count - 1) // PIECE_TURNS) + 1) - middle
    knots = np.concatenate([[ends[0]] * degree, ends, [ends[-1]] * degree])

    def spline(instants):
        return BSpline(knots, np.eye(len(knots) - degree - 1), degree, extrapolate=True)(instants - middle)

    at_marks, turned = spline(marks), 2 * np.pi * np.arange(count)
    coefficients = np.linalg.lstsq(at_marks, turned, rcond=None)[0]
    freedom = count - len(coefficients)
    variance = np.sum((turned - at_marks @ coefficients) ** 2) / freedom if freedom else 0.0
    slope = spline(time)
    return slope @ coefficients, slope, variance * np.linalg.inv(at_marks.T @ at_marks)


def phase_at_start(marks, start, harmonics):
    """Phase psi_n = n * angle of the shaft at the first sample (harmonic,), and its covariance, whatever the label."""
    angle, slope, covariance = shaft_angle(marks, np.array([start]))
    n = np.asarray(harmonics)
    return np.angle(np.exp(1j * n * angle[0])), (slope @ covariance @ slope.T)[0, 0] * np.outer(n, n)


def phase_from_keyphasor(record, harmonics):
    """Phase psi_n = -n w t_mark (harmonic,) that the mark passing at t_mark gives each harmonic, and its covariance."""
    marks = mark_times(record) - record.time[0]
    turns = np.rint((marks - marks[0]) * record.speed / (2 * np.pi))
    offsets = marks - turns * 2 * np.pi / record.speed
    variance = offsets.var(ddof=1) / len(offsets) if len(offsets) > 1 else 0.0
    rate = -np.asarray(harmonics) * record.speed
    return np.angle(np.exp(1j * rate * offsets.mean())), variance * np.outer(rate, rate)


def compensate(amplitude, covariance, phase, phase_covariance):
    """R_n e^{-j psi_n} with the covariance that rotation and phase noise leave (thesis Eq. 2.30).

    amplitude : (sensor, harmonic); covariance (sensor, component, component); phase (harmonic,) rad
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


def cut_to_whole_turns(record):
    """The record without its last incomplete revolution: then harmonics nobody asked for do not leak into others."""
    step = (record.time[-1] - record.time[0]) / (len(record.time) - 1)
    turns = np.floor(record.speed * step * len(record.time) / (2 * np.pi) + 1e-6)
    samples = round(turns * 2 * np.pi / (record.speed * step))
    signals = {
        name: None if getattr(record, name) is None else getattr(record, name)[:samples]
        for name in ("reference", "keyphasor")
    }
    return replace(record, time=record.time[:samples], displacement=record.displacement[..., :samples], **signals)


def _no_reference(record, harmonics):
    """What to do without a reference signal, and what error to expect from going on without any phase mark."""
    step = np.rad2deg(record.speed * (record.time[1] - record.time[0]))
    highest = max(abs(int(n)) for n in harmonics)
    return (
        f"{record.where}: no reference signal; record one, or use the keyphasor. Without either (phase 'none') the "
        "angle of the first sample is unknown, and harmonic n turns by n times its error: each missing sample is "
        f"{step:.2g} degrees at 1X and {highest * step:.2g} at {highest}X. A fit takes that for damping: in the rotor "
        "of thesis Table 4.10, 100 missing samples of 65536 give 7 for 27 N s/m, and 200 give -22"
    )


def harmonics_by(method, signal, time, speed, harmonics, marks=None):
    """Amplitude (..., harmonic) and covariance (..., component, component) that a SpectrumMethod gives, or PluginError.

    marks : (revolution,) s, handed to methods that use them
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


def full_spectrum(records, harmonics, method, phase="reference", *, whole_revolutions=True):
    """The full spectrum of records, one a speed.

    records   : list of Record, of the same sensors
    harmonics : (harmonic,) int
    method    : SpectrumMethod plugin
    phase     : "reference" (multi-harmonic reference signal), "keyphasor", or "none": counted from the first sample
    whole_revolutions : leave the last incomplete revolution out; False takes the record as it is, with its leakage
    returns   : Spectrum with amplitude (speed, harmonic, sensor)
    """
    if phase not in ("reference", "keyphasor", "none"):
        raise unknown_name("phase", phase, ("reference", "keyphasor", "none"))
    harmonics = check_harmonics(harmonics)
    if not records:
        raise RotorstudyError("no records; give at least one")
    amplitudes, covariances = [], []
    for record in records:
        check_record(record, harmonics)
        whole = record  # pulses of the last incomplete revolution count too
        record = cut_to_whole_turns(record) if whole_revolutions else record
        signals = np.asarray(record.displacement)
        if phase == "reference":
            if record.reference is None:
                raise RotorstudyError(_no_reference(record, harmonics))
            signals = np.concatenate([signals, [record.reference]])
        marks = mark_times(whole, drifting=True) if method.uses_marks else None
        amplitude, covariance = harmonics_by(method, signals, record.time, record.speed, harmonics, marks)
        if phase == "reference":
            psi = phase_from_reference(record, harmonics, amplitude[-1], covariance[-1])
            amplitude, covariance = compensate(amplitude[:-1], covariance[:-1], *psi)
        elif method.uses_marks and phase == "none":
            psi, psi_covariance = phase_at_start(marks, record.time[0], harmonics)
            amplitude, covariance = compensate(amplitude, covariance, -psi, psi_covariance)
        elif method.tolerates_wrong_speed and not method.uses_marks and phase == "keyphasor":
            marks = mark_times(whole, drifting=True)
            psi = phase_at_start(marks, record.time[0], harmonics)
            amplitude, covariance = compensate(amplitude, covariance, *psi)
        elif phase == "keyphasor" and not method.uses_marks:
            amplitude, covariance = compensate(amplitude, covariance, *phase_from_keyphasor(whole, harmonics))
        amplitudes.append(amplitude.T)
        covariances.append(covariance)
    speed = np.array([record.speed for record in records])
    return Spectrum(
        np.array(amplitudes), speed, np.asarray(harmonics), tuple(records[0].sensors), np.array(covariances)
    )


def simulate_records(model, speeds, harmonics, time, *, theta=None, start_angle_rad=0.0, keyphasor_wanted=True):
    """Records of the steady state of a model, one a speed, with reference signal and keyphasor.

    speeds          : (speed,) rad/s;  time : (time,) s
    harmonics       : (harmonic,) of the reference signal; the displacement has all that the model vibrates at
    start_angle_rad : angle of the phase mark at the first sample; a record that starts late has it above zero
    returns         : list of Record
    """
    if theta is None:
        check_stable(model, speeds)
    vibrating = forced_harmonics(model)
    shown = measured_response(model, speeds, vibrating, theta)
    every = np.union1d(vibrating, harmonics)
    amplitude = np.zeros((len(speeds), len(model.sensors) + 1, len(every)), complex)
    amplitude[:, :-1, np.isin(every, vibrating)] = np.swapaxes(shown, 1, 2)
    amplitude[:, -1, np.isin(every, harmonics)] = 1
    records = []
    for w, both, angle in zip(speeds, amplitude, np.broadcast_to(start_angle_rad, np.shape(speeds)), strict=True):
        turned = time + angle / w
        signals = synthesize(both, w, every, turned)
        where = f"simulated record at {w:g} rad/s"
        keyphasor = keyphasor_signal(w, turned) if keyphasor_wanted else None
        records.append(Record(time, signals[:-1], float(w), model.sensors, signals[-1].real, keyphasor, where))
    return records
