"""Invariants of a spectrum method: exact harmonics, a correct covariance, and the faults it tolerates."""

import inspect

import numpy as np

from rotorstudy.authoring.invariants.base import HARMONICS, claimed, require
from rotorstudy.measurement.full_spectra import harmonics_by
from rotorstudy.response.series import synthesize

SPECTRUM_TRIALS = 300
SPEED = 100.0  # rad/s


def _bench_record(revolutions=6.0, samples=100):
    """A record of nine harmonics with `samples` per revolution: time, amplitude (harmonic,), signal."""
    generator = np.random.default_rng(3)
    time = np.arange(int(samples * revolutions)) * (2 * np.pi / SPEED / samples)
    amplitude = generator.normal(size=len(HARMONICS)) + 1j * generator.normal(size=len(HARMONICS))
    return time, amplitude, synthesize(amplitude, SPEED, HARMONICS, time)


def _harmonics_by(plugin, signal, time, speed=SPEED):
    """Harmonics with exact marks, the first at the first sample, so that both phase references agree."""
    marks = np.arange(0, time[-1], 2 * np.pi / SPEED)
    return harmonics_by(plugin, signal, time, speed, HARMONICS, marks)


def _require_exact(amplitude, true, tolerance=1e-9):
    off = np.abs(amplitude - true)
    worst = int(off.argmax())
    require(off.max() < tolerance, f"harmonic {HARMONICS[worst]} is off by {off[worst]:.3g} of 1")


def spectrum_is_exact(plugin):
    """gives the exact harmonics of a record of whole revolutions, with the phase at the first sample"""
    time, true, signal = _bench_record()
    _require_exact(_harmonics_by(plugin, signal[None], time)[0][0], true)


def spectrum_covariance_is_honest(plugin):
    """states the covariance of its harmonics under white noise"""
    time, _, signal = _bench_record()
    x, y = 0.1 * np.random.default_rng(4).normal(size=(2, SPECTRUM_TRIALS, len(time)))
    amplitude, stated = _harmonics_by(plugin, signal + x + 1j * y, time)
    # the mean variance of 18 components over 300 trials is known to 2 %, the stated noise floor to 5 % a record
    _require_honest(np.concatenate([amplitude.real, amplitude.imag], axis=-1), stated, 0.1)


def _require_honest(found, stated, tolerance):
    scatter, stated = np.cov(np.transpose(found)), np.mean(stated, axis=0)
    ratio = np.trace(stated) / np.trace(scatter)
    require(abs(ratio - 1) < tolerance, f"stated variance is {ratio:.3g} times the scatter of {len(found)} trials")
    off = np.abs(stated - scatter).max() / np.diag(scatter).mean()
    require(
        off < 0.45 * max(1, np.diag(scatter).max() / np.diag(scatter).mean()),
        f"an element of the stated covariance is off by {off:.2g} of the mean variance",
    )


@claimed("any_length")
def spectrum_is_exact_at_any_length(plugin):
    """gives the exact harmonics of a record of incomplete revolutions"""
    time, true, signal = _bench_record(revolutions=5.7)
    _require_exact(_harmonics_by(plugin, signal, time)[0], true)


@claimed("tolerates_wrong_speed")
def spectrum_tolerates_wrong_speed(plugin):
    """gives the exact harmonics of a long record whose stated speed is wrong by 0.1 %"""
    time, true, signal = _bench_record(revolutions=600, samples=20)  # so long that the error exceeds half a line
    for wrong in (0.999, 1.001):
        _require_exact(_harmonics_by(plugin, signal, time, wrong * SPEED)[0], true)


@claimed("tolerates_outliers")
def spectrum_tolerates_outliers(plugin):
    """is not biased by spikes of one sign in 2 % of the samples"""
    time, true, signal = _bench_record(revolutions=20)
    generator, std = np.random.default_rng(5), 0.01
    x, y = std * generator.normal(size=(2, len(time)))
    spikes = 100 * std * (generator.random(len(time)) < 0.02)
    amplitude, _ = _harmonics_by(plugin, signal + x + 1j * y + spikes, time)
    _require_exact(amplitude, true, 6 * std / np.sqrt(len(time)))  # six standard deviations without any spikes


def spectrum_follows_the_marks(plugin):
    """follows the keyphasor marks of a drifting speed, and includes the jitter of the marks in its covariance"""
    takes_marks = "marks" in inspect.signature(plugin.function).parameters
    if not plugin.uses_marks:  # only the arguments show whether it could follow
        require(not takes_marks, "its function has an argument 'marks', but it does not claim it: set uses_marks=True")
        return
    require(takes_marks, "it claims uses_marks, but its function has no argument 'marks'")
    time, true, _ = _bench_record(revolutions=21)
    drift = 0.05 / time[-1]  # the speed rises by a tenth
    signal = synthesize(true, SPEED, HARMONICS, time * (1 + drift * time))
    turned = np.arange(20) * 2 * np.pi / SPEED
    marks = 2 * turned / (1 + np.sqrt(1 + 4 * drift * turned))  # where time * (1 + drift * time) = turned
    found = harmonics_by(plugin, signal, time, SPEED, HARMONICS, marks)[0]
    # a cubic spline over pieces of ten revolutions; without it every harmonic is lost
    _require_exact(found, true, 1e-3)
    jitter = 1e-3 / SPEED * np.random.default_rng(6).normal(size=(SPECTRUM_TRIALS, len(marks)))
    trials = [harmonics_by(plugin, signal, time, SPEED, HARMONICS, marks + late) for late in jitter]
    amplitude, stated = (np.array(part) for part in zip(*trials, strict=True))
    # one error a mark: fewer than ten independent ones in 300 trials, so a variance is known to 8 %, here three times
    _require_honest(np.concatenate([amplitude.real, amplitude.imag], axis=-1), stated, 0.25)


spectrum_follows_the_marks.flag = "uses_marks"
