"""Full spectra of records: harmonics by a spectrum method, and their phases by a reference signal or a keyphasor."""

from collections.abc import Iterable, Sequence

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError, check_known
from rotorstudy.measurement.harmonics import shared_error_covariance
from rotorstudy.measurement.keyphasor import mark_times, phase_at_start, phase_from_keyphasor
from rotorstudy.measurement.records import Record, check_record, cut_to_whole_revolutions
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.kinds import SpectrumMethod
from rotorstudy.response.coupling import check_harmonics

# what phases refer to: nothing but the first sample, a multi-harmonic reference signal, or a keyphasor
PHASES = ("none", "reference", "keyphasor")


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
    std = np.sqrt(power / 2) / size
    mirrored = (n[:, None] == n).astype(float) - (n[:, None] == -n)
    return np.angle(amplitude), std[:, None] * std * mirrored


def compensate(amplitude, covariance, phase, phase_covariance):
    """R_n e^{-j psi_n} (sensor, harmonic), m, with its covariance, phase noise included (thesis Eq. 2.30)."""
    turned, cosine, sine = amplitude * np.exp(-1j * phase), np.diag(np.cos(phase)), np.diag(np.sin(phase))
    rotation = np.block([[cosine, sine], [-sine, cosine]])
    change = -1j * turned[..., None] * np.eye(len(phase))
    return turned, rotation @ covariance @ rotation.T + shared_error_covariance(change, phase_covariance)


def harmonics_by(method, signal, time, speed, harmonics, marks=None):
    """Amplitude (..., harmonic) and covariance of a signal (..., time) by a SpectrumMethod, or PluginError."""
    found = method.function(signal, time, speed, harmonics, *([marks] if method.uses_marks else []))
    size, lead, who = len(harmonics), np.shape(signal)[:-1], f"spectrum '{method.name}' ({method.file})"
    needed = {"amplitude": (*lead, size), "covariance": (*lead, 2 * size, 2 * size)}
    if not isinstance(found, (tuple, list)) or len(found) != 2:
        raise PluginError(
            f"{who} gives one {type(found).__name__}; it must give two arrays, amplitude and covariance, of shapes "
            f"{' and '.join(map(str, needed.values()))}"
        )
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
    check_known("phase", phases, PHASES)
    harmonics, seen = check_harmonics(harmonics), []
    if not records:
        raise RotorstudyError("no records; give at least one")
    for record in records:
        check_record(record, harmonics)
        seen.append(_harmonics_of(record, harmonics, method, phases, whole_revolutions))
    speed, sensors, spectra = np.array([record.speed for record in records]), tuple(records[0].sensors), {}
    for phase in phases:
        amplitude, covariance = map(np.array, zip(*(one[phase] for one in seen), strict=True))
        spectra[phase] = Spectrum(np.swapaxes(amplitude, 1, 2), speed, harmonics, sensors, covariance)
    return spectra


def _harmonics_of(record, harmonics, method, phases, whole_revolutions):
    """Phase -> amplitude (sensor, harmonic) and covariance (sensor, component, component) of one record."""
    whole = record  # with the pulses of the last incomplete revolution
    record = cut_to_whole_revolutions(record) if whole_revolutions else record
    marks = mark_times(whole, drifting=True) if method.uses_marks else None
    with_reference, found = "reference" in phases, {}
    if with_reference and record.reference is None:
        step, highest = np.rad2deg(record.speed * (record.time[1] - record.time[0])), max(map(abs, harmonics))
        raise RotorstudyError(
            f"{record.where}: no reference signal; record one, or use the keyphasor. Without either (phase 'none') the "
            "angle of the first sample is unknown, and its error rotates harmonic n n times as far: each missing "
            f"sample is {step:.2g} degrees at 1X and {highest * step:.2g} at {highest}X, which a fit takes for damping"
        )
    signals = np.array([*record.displacement, *([record.reference] if with_reference else [])])
    every = harmonics_by(method, signals, record.time, record.speed, harmonics, marks)  # of each signal by itself
    own = tuple(part[: len(record.displacement)] for part in every)
    if with_reference:
        psi = phase_from_reference(record.where, harmonics, *(part[-1] for part in every))
        found["reference"] = compensate(*own, *psi)
    found["none"] = found["keyphasor"] = own
    if method.uses_marks and "none" in phases:  # its time zero is a mark
        psi, psi_covariance = phase_at_start(marks, record.time[0], harmonics)
        found["none"] = compensate(*own, -psi, psi_covariance)
    elif "keyphasor" in phases and not method.uses_marks:
        found["keyphasor"] = compensate(*own, *phase_by_marks(whole, harmonics, method))
    return found


def phase_by_marks(record, harmonics, method):
    """Phases psi_n (harmonic,) rad of a keyphasor at the first sample, for a spectrum method, and their covariance."""
    if method.tolerates_wrong_speed:
        return phase_at_start(mark_times(record, drifting=True), record.time[0], harmonics)
    return phase_from_keyphasor(record, harmonics)
