"""Stated covariances against the scatter of many draws, with all correlations, from the record to the estimate."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from machines import HARMONICS, LINEAR, METHODS, jeffcott, spectrum_of
from scipy.stats import chi2, norm

from rotorstudy import Record, full_spectrum, measured_response, registry, simulate_records
from rotorstudy.measurement.full_spectra import harmonics_by
from rotorstudy.measurement.noise import noise_std, standard_normal
from rotorstudy.measurement.records import check_record, reference_signal
from rotorstudy.measurement.spectrum import components, independent_covariance
from rotorstudy.response.series import synthesize

FALSE_ALARM = 1e-6  # share of seeds with which a right program fails one of these checks
SPEED = 88.0


def check_scatter(errors, covariance, slack=0.0):
    """Raise AssertionError unless errors (trial, component) with mean zero scatter as the covariance says.

    Whitened errors are independent and standard normal: sums of their squares follow chi-square, and the mean product
    of two of them is close to normal with variance 1 / trials.
    slack : share by which the derivation of the covariance allows it to be off
    """
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), np.transpose(errors)).T
    trials, count = whitened.shape
    tail = FALSE_ALARM / (count + 1) / 2
    for name, squares in (("all", whitened**2), *((f"component {i}", w**2) for i, w in enumerate(whitened.T))):
        low, high = chi2.ppf([tail, 1 - tail], squares.size) / squares.size
        ratio = squares.mean()
        assert low * (1 - slack) < ratio < high * (1 + slack), f"{name}: {ratio:.3f} times the stated variance"
    correlation = (whitened.T @ whitened / trials)[np.triu_indices(count, 1)]
    limit = norm.isf(FALSE_ALARM / max(1, correlation.size) / 2) / np.sqrt(trials) + slack
    assert np.abs(correlation).max(initial=0) < limit, f"correlation {np.abs(correlation).max():.3f} not stated"


COVARIANCE = np.array([[2.0, 1.2, 0.3], [1.2, 1.0, 0.1], [0.3, 0.1, 0.5]])


def test_the_check_passes_what_is_right_and_finds_what_is_wrong():
    errors = np.random.default_rng(1).multivariate_normal(np.zeros(3), COVARIANCE, 400)
    check_scatter(errors, COVARIANCE)
    for wrong in (1.5 * COVARIANCE, COVARIANCE / 1.5, np.diag(np.diag(COVARIANCE))):
        with pytest.raises(AssertionError):
            check_scatter(errors, wrong)


def test_a_trial_has_the_same_noise_however_many_are_drawn():
    together = standard_normal(7, 2, 6, (2, 3))
    assert np.array_equal(together[:2], standard_normal(7, 2, 2, (2, 3)))
    assert not np.isclose(together, standard_normal(7, 3, 6, (2, 3))).any()  # another study
    assert not np.isclose(together, standard_normal(8, 2, 6, (2, 3))).any()  # another seed


TRIALS, LEVEL = 400, 0.01
TIME = np.arange(1200) * (6 * 2 * np.pi / SPEED / 1200)  # six whole turns
MARKS = np.arange(6) * 2 * np.pi / SPEED


def noisy_records():
    """Records of one rotor with white noise on each sample, as a share of the signal's rms."""
    (clean,) = simulate_records(jeffcott(), [SPEED], HARMONICS, TIME, start_angle_rad=0.4)
    moving = clean.displacement - clean.displacement.mean(axis=-1, keepdims=True)
    sigma = LEVEL * np.sqrt(np.mean(np.abs(moving) ** 2) / 2)
    x, y = np.random.default_rng(5).standard_normal((2, TRIALS, *clean.displacement.shape))
    return [replace(clean, displacement=clean.displacement + sigma * noise) for noise in x + 1j * y]


@pytest.mark.parametrize("method", LINEAR, ids=lambda m: m.name)
def test_white_noise_in_time_is_the_noise_drawn_on_harmonics(method):
    """With all correlations, by the level a study states and by what the method itself reads off the record."""
    records = noisy_records()
    shown = measured_response(jeffcott(), [SPEED], HARMONICS)
    spectrum = full_spectrum(records, HARMONICS, method, "none")
    late = np.exp(0.4j * np.array(HARMONICS))[:, None]
    errors, stated = components(spectrum.amplitude - shown * late)[..., 0], spectrum.covariance[:, 0].mean(axis=0)
    std = noise_std(spectrum_of(jeffcott(), [SPEED], HARMONICS), LEVEL, "white in time", len(TIME))
    # the records also hold harmonics above 7, left out of the rms of the nine: under 1 % of it
    if method.name != "windowed_fft":  # which scatters by more
        check_scatter(errors, independent_covariance(std**2)[0, 0], slack=0.02)
    # the median of 1200 lines, of which the rotor's own are up to 33: 3 % up or down
    check_scatter(errors, stated, slack=0.04)
    with pytest.raises(AssertionError):
        check_scatter(errors, 1.5 * stated, slack=0.04)  # negative control


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_a_method_takes_real_and_complex_signals_of_any_shape_from_any_first_instant(method):
    generator = np.random.default_rng(2)
    amplitude = generator.standard_normal((2, 3, len(HARMONICS))) + 1j * generator.standard_normal((2, 3, 9))
    signal = synthesize(amplitude, SPEED, HARMONICS, TIME)
    for start in (0.0, 123.4):  # phases count from the first sample, wherever the clock stands
        found, covariance = harmonics_by(method, signal, TIME + start, SPEED, HARMONICS, MARKS + start)
        assert found == pytest.approx(amplitude, rel=1e-8, abs=1e-9)  # round-off of a clock at 123.4 s
        assert covariance.shape == (2, 3, 18, 18)
    found, _ = harmonics_by(method, signal.real, TIME, SPEED, [1, -1], MARKS)
    if method not in LINEAR:
        return
    assert found[..., 0] == pytest.approx((amplitude[..., 1] + amplitude[..., 6].conj()) / 2, abs=1e-2)
    assert found[..., 1] == pytest.approx(found[..., 0].conj(), abs=1e-12)


@pytest.mark.parametrize("method", [m for m in LINEAR if not m.uses_marks], ids=lambda m: m.name)
@pytest.mark.parametrize("reference_noise", [0.0, 0.3])
def test_a_noisy_phase_reference_is_in_the_stated_covariance(method, reference_noise):
    """Whatever the noise, the phase of a real reference is opposite at -nX, and that of its mean is none."""
    harmonics, random = [0, 1, 2, 3, -1, -3], np.random.default_rng(5)
    true = 0.5 + random.random(len(harmonics)) + 1j * random.random(len(harmonics))
    clean, reference = (f(SPEED, harmonics, TIME + 0.7 / SPEED) for f in (partial(synthesize, true), reference_signal))
    records = [
        Record(TIME, (clean + 0.05 * (x + 1j * y))[None], SPEED, (1,), reference + reference_noise * r)
        for x, y, r in random.standard_normal((TRIALS, 3, len(TIME)))
    ]
    found = full_spectrum(records, harmonics, method, "reference")
    errors, stated = components(found.amplitude - true[:, None])[..., 0], found.covariance[:, 0].mean(axis=0)
    check_scatter(errors, stated, slack=0.04)
    with pytest.raises(AssertionError):
        check_scatter(errors, 0.4 * stated, slack=0.04)  # negative control


def short_record(method, samples):
    """Errors (trial, component) of harmonics of a revolution with noise of one, and their stated covariances.

    The noise floor is the median over all lines of the periodogram. Of N lines the p harmonics asked for are not noise:
    the fit of `regression` empties them, and the signal stands in them for `fft`; so they are left out. With them the
    median would be the quantile (N/2 - p) / (N - p), or (N/2) / (N - p), of the noise: at p = 9, 9 % at 150 samples.
    """
    time = np.arange(samples) * 2 * np.pi / SPEED / samples
    x, y = np.random.default_rng(samples).standard_normal((2, 2000, samples))
    true = 100 * np.exp(1j * np.arange(len(HARMONICS)))
    signal = synthesize(true, SPEED, HARMONICS, time) + x + 1j * y
    check_record(Record(time, signal[:1], SPEED, (1,)), HARMONICS)  # accepted
    amplitude, covariance = registry().get("spectrum", method).function(signal, time, SPEED, HARMONICS)
    return components((amplitude - true)[..., None])[..., 0], covariance


@pytest.mark.parametrize("samples", [30, 150])
@pytest.mark.parametrize("method", ["fft", "regression"])
def test_the_stated_covariance_of_a_short_record_is_that_of_its_errors(method, samples):
    errors, stated = short_record(method, samples)
    check_scatter(errors, stated.mean(axis=0), slack=0.04)  # a median of 21 lines is 3.4 % high by itself


def test_intervals_of_the_shortest_record_let_in_cover():
    errors, stated = short_record("regression", 2 * len(HARMONICS) + 1)
    std = np.sqrt(np.diagonal(stated, axis1=-2, axis2=-1))
    # ten lines are left for the noise: the median of these has a spread of a third, and intervals cover some 90 %
    assert np.mean(np.abs(errors) <= 1.959964 * std) > 0.85
