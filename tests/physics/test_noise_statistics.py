"""Stated covariances against the scatter of many draws, with all correlations, from the record to the estimate."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, jeffcott, spectrum_of
from scipy.stats import chi2, norm

from rotorstudy import full_spectrum, measured_response, registry, simulate_records
from rotorstudy.measurement.full_spectra import harmonics_by
from rotorstudy.measurement.noise import noise_std, standard_normal
from rotorstudy.measurement.spectrum import components, independent_covariance
from rotorstudy.response.series import synthesize

FALSE_ALARM = 1e-6  # share of seeds with which a right program fails one of these checks
METHODS = list(registry().plugins["spectrum"].values())
# others take harmonics nobody asked for, which drop out of whole turns in a linear fit, for speed or outliers
LINEAR = [m for m in METHODS if m.uses_marks or not (m.tolerates_wrong_speed or m.tolerates_outliers)]
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


def test_a_trial_has_the_same_noise_in_whatever_chunk_it_is_drawn():
    together = standard_normal(7, 2, 6, (2, 3))
    assert np.array_equal(together[4:], standard_normal(7, 2, 2, (2, 3), first=4))
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
