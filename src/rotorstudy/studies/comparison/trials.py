"""Records with noise and faults, and their spectra by a spectrum method."""

from itertools import product
from time import perf_counter
from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.full_spectra import compensate, full_spectrum, phase_by_marks
from rotorstudy.measurement.noise import standard_normal
from rotorstudy.measurement.records import Record, keyphasor_signal, simulate_records
from rotorstudy.studies.common import results


class Trials(NamedTuple):
    """Records of one speed: time, s; label, rad/s; signal (level, trial, sensor, time), m; keyphasor (trial, time)."""

    time: np.ndarray
    label: float
    signal: np.ndarray
    keyphasor: np.ndarray


def make_trials(config, rotor_index, rotor, fault_name, place, levels, count):
    """Trials of one speed with noise of some levels (%) and a fault; all levels share their random numbers."""
    fault, speed = config.faults[fault_name], float(rotor.speeds[place])
    stream = (rotor_index * len(config.faults) + list(config.faults).index(fault_name)) * 1000 + place
    time = np.arange(config.samples) * fault.revolutions * 2 * np.pi / speed / config.samples
    clean = simulate_records(rotor.model, [speed], rotor.measured, time)[0].displacement
    moving = clean - clean.mean(axis=-1, keepdims=True)
    rms = np.sqrt(np.mean(np.abs(moving) ** 2, axis=-1, keepdims=True) / 2)
    x, y = np.moveaxis(standard_normal(config.seed, stream, count, (2, *clean.shape)), 1, 0)
    signal = clean + np.array(levels)[:, None, None, None] / 100 * rms * (x + 1j * y)
    seeds = (np.random.SeedSequence(config.seed, spawn_key=(stream, 1, t)) for t in range(count))
    others = list(map(np.random.default_rng, seeds))
    if fault.outlier_share:
        drawn = np.array([rng.uniform(size=(2, *clean.shape)) for rng in others])
        hit, angle = drawn[:, 0] < fault.outlier_share, 2 * np.pi * drawn[:, 1]
        signal = signal + hit * fault.outlier_size * rms * np.exp(1j * angle)
    keyphasor = keyphasor_signal(speed, time)[None]
    if fault.keyphasor_jitter_rad:
        revolution = np.rint(speed * time / (2 * np.pi)).astype(int)  # each pulse is shifted as a whole
        late = [fault.keyphasor_jitter_rad * rng.normal(size=revolution.max() + 1)[revolution] for rng in others]
        keyphasor = np.array([keyphasor_signal(speed, time - shift / speed) for shift in late])
    return Trials(time, speed * (1 + fault.speed_error), signal, keyphasor)


def trial_spectra(method, trials, harmonics):
    """Harmonics (level, trial, harmonic, sensor), and the mean over the trials of their stated covariance."""

    def record(signal, keyphasor):
        flat = signal.reshape(-1, len(trials.time))
        return Record(trials.time, flat, trials.label, tuple(range(len(flat))), keyphasor=keyphasor)

    def spectrum(signal, keyphasor, phase):
        """Of signals (..., time): (..., harmonic), (..., component, component)."""
        found = full_spectrum([record(signal, keyphasor)], harmonics, method, phase)
        amplitude, covariance = found.amplitude[0].T, found.covariance[0]
        return [part.reshape(*signal.shape[:-1], *part.shape[1:]) for part in (amplitude, covariance)]

    def by_mark(part):
        """Of all trials of one keyphasor, or of each of its own."""
        return np.split(part, len(trials.keyphasor), axis=1)

    pairs = list(zip(by_mark(trials.signal), trials.keyphasor, strict=True))
    if method.uses_marks:
        each = [spectrum(*pair, "keyphasor") for pair in pairs]
    else:
        parts = map(by_mark, spectrum(trials.signal, trials.keyphasor[0], "none"))
        phases = (phase_by_marks(record(*pair), harmonics, method) for pair in pairs)
        each = [compensate(*own, *phase) for *own, phase in zip(*parts, phases, strict=True)]
    amplitude, covariance = (np.concatenate(part, axis=1) for part in zip(*each, strict=True))
    return np.swapaxes(amplitude, 2, 3), covariance.mean(axis=1)


def spectra(config, name, rotor, method, faults=None):
    """A Dataset of the spectra of a rotor's records by a spectrum method; faults : names of some, by default of all."""
    faults, levels = list(faults or config.faults), config.levels_percent
    model, harmonics = rotor.model, rotor.measured
    shape = (len(faults), len(levels), config.trials, len(rotor.speeds), len(harmonics), len(model.sensors))
    amplitude = np.full(shape, np.nan, complex)
    size = 2 * len(harmonics)
    covariance = np.full((len(faults), len(levels), len(rotor.speeds), len(model.sensors), size, size), np.nan)
    error, seconds = np.full(shape[:2], np.nan), np.full(shape[:2], np.nan)
    true = rotor.without_noise.amplitude
    vibration = np.sqrt(np.sum(np.abs(true[:, np.array(harmonics) != 0]) ** 2, axis=1, keepdims=True))
    for (f, fault), s in product(enumerate(faults), range(len(rotor.speeds))):
        for noisy in (False, True):
            wanted = [n for n, level in enumerate(levels) if (level > 0) == noisy and level in config.levels(fault)]
            if not wanted:
                continue
            count = config.trials if noisy else min(config.trials, config.trials_without_noise)
            place = list(config.rotors).index(name)
            trials = make_trials(config, place, rotor, fault, s, [levels[n] for n in wanted], count)
            start = perf_counter()
            amplitude[f, wanted, :count, s], covariance[f, wanted, s] = trial_spectra(method, trials, harmonics)
            spent = (perf_counter() - start) / count / len(wanted) / len(rotor.speeds)
            seconds[f, wanted] = np.nan_to_num(seconds[f, wanted]) + spent
    off = np.abs((amplitude - true) / vibration) ** 2
    cells = np.isfinite(seconds)
    error[cells] = np.sqrt(np.nanmean(off[cells], axis=(1, 2, 3, 4)))
    coordinates = {"fault": faults, "noise": np.array(levels, float), "speed": rotor.speeds, "harmonic": harmonics}
    found = {"amplitude": amplitude, "covariance": covariance, "harmonic_error": error, "seconds": seconds}
    title, nodes = f"{config.title}: {name}, {method.name}", list(model.sensors)
    return results("fault_spectra", title, **coordinates, node=nodes, **found)
