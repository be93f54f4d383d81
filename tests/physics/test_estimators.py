"""Estimators against scipy, against the Cramer-Rao bound, and their intervals against the truth."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import HARMONICS, jeffcott
from scipy import optimize, stats

from rotorstudy import Problem, Spectrum, cramer_rao_bound, magnitude_and_phase, measured_response, registry
from rotorstudy.inference.identification import output_error_fit, predicted_derivatives
from rotorstudy.measurement.noise import noise_std, noisy, standard_normal
from rotorstudy.measurement.spectrum import independent_covariance

TRIALS = 400


@pytest.fixture(scope="module")
def problem():
    """One speed, 1 % noise per harmonic, many trials."""
    model = jeffcott()
    clean = measured_response(model, [88.0], HARMONICS)
    spectrum = Spectrum(
        clean, np.array([88.0]), np.array(HARMONICS), (1,), independent_covariance(np.zeros(clean.shape))
    )
    std = noise_std(spectrum, 0.01, "per harmonic", 65536)
    numbers = standard_normal(11, 0, TRIALS, (2, *clean.shape))
    trials = noisy(clean, std, numbers, "per harmonic")
    return Problem(model, replace(spectrum, amplitude=trials, covariance=independent_covariance(std**2)), model.names)


@pytest.fixture(scope="module")
def estimates(problem):
    return {name: plugin.function(problem) for name, plugin in registry().plugins["estimator"].items()}


def test_the_fit_is_scipys(problem):
    one = replace(problem, spectrum=problem.spectrum.with_amplitude(problem.spectrum.amplitude[0]))
    measured = one.spectrum.whitened(one.spectrum.amplitude)
    scale = np.abs(one.model.theta)

    def residual(x):
        return predicted_derivatives(one, x * scale)[0] - measured

    reference = optimize.least_squares(residual, np.ones(5), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = output_error_fit(one)
    assert found.theta / scale == pytest.approx(reference.x, rel=1e-5)  # both stop within 1e-4 of a sigma, here 0.1
    assert found.misfit == pytest.approx(2 * reference.cost, rel=1e-9)


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_the_fit_finds_back_from_starts_30_percent_off(problem, factor):
    clean = measured_response(problem.model, [88.0], HARMONICS)
    one = replace(problem, spectrum=problem.spectrum.with_amplitude(clean))
    found = output_error_fit(one, start=factor * problem.model.theta)
    assert found.theta == pytest.approx(problem.model.theta, rel=1e-9)


def test_trials_at_once_equal_single_fits(problem, estimates):
    for t in (0, TRIALS - 1):
        one = replace(problem, spectrum=problem.spectrum.with_amplitude(problem.spectrum.amplitude[t]))
        # a fit stops when the misfit falls by less than 1e-9 of itself: within 1e-4 of a standard deviation
        difference = np.abs(output_error_fit(one).theta - estimates["maximum_likelihood"].theta[t])
        assert (difference < 1e-4 * estimates["maximum_likelihood"].std[t]).all()


def ratio_bounds(probability=1e-5):
    """Where the ratio of a sample variance of TRIALS to the true one lies, except with this probability."""
    return stats.chi2.ppf([probability / 2, 1 - probability / 2], TRIALS - 1) / (TRIALS - 1)


def test_maximum_likelihood_scatters_by_the_cramer_rao_bound(problem, estimates):
    clean = measured_response(problem.model, [88.0], HARMONICS)
    bound = cramer_rao_bound(replace(problem, spectrum=problem.spectrum.with_amplitude(clean)), problem.model.theta)
    ratio = estimates["maximum_likelihood"].theta.var(axis=0, ddof=1) / np.diag(bound)
    low, high = ratio_bounds()
    assert (ratio > low).all() and (ratio < high).all()


def test_least_squares_scatters_by_more_and_says_so(problem, estimates):
    least, best = estimates["least_squares"], estimates["maximum_likelihood"]
    ratio = least.theta.var(axis=0, ddof=1) / np.diag(least.covariance)
    low, high = ratio_bounds()
    assert (ratio > low).all() and (ratio < high).all()
    external = problem.names.index("external_damping")
    assert least.theta[:, external].std() > 2 * best.theta[:, external].std()


def covered(estimate, true, widen=1.0):
    """Whether the share of 95 % intervals that hold the truth is one a right interval has, but for once in 10^5."""
    std = np.broadcast_to(estimate.std, estimate.theta.shape) * widen
    holds = (np.abs(estimate.theta - true) <= 1.959964 * std).sum(axis=0)
    low, high = stats.binom.ppf([5e-6, 1 - 5e-6], TRIALS, 0.95)
    return (holds >= low).all() and (holds <= high).all()


@pytest.mark.parametrize("name", ["least_squares", "maximum_likelihood"])
def test_stated_intervals_cover(problem, estimates, name):
    assert covered(estimates[name], problem.model.theta)
    assert not covered(estimates[name], problem.model.theta, widen=0.7)  # negative control: too narrow is noticed


def test_magnitude_and_phase_carry_the_covariance(problem):
    theta = np.array([3.0, 4.0])
    covariance = np.array([[0.02, 0.01], [0.01, 0.03]]) ** 2 * [[1, 0.5], [0.5, 1]]
    names, polar, turned = magnitude_and_phase(["x_real", "x_imag"], theta, covariance)
    assert names == ("x", "x_phase")
    assert polar == pytest.approx([5.0, np.arctan2(4, 3)])
    draws = np.random.default_rng(5).multivariate_normal(theta, covariance, 200_000)
    z = draws[:, 0] + 1j * draws[:, 1]
    sampled = np.cov(np.abs(z), np.angle(z))
    assert turned == pytest.approx(sampled, rel=0.02)  # 200 000 draws: 0.5 % of a variance, more for the covariance


def test_exact_data_are_fitted_exactly(problem):
    clean = measured_response(problem.model, [88.0], HARMONICS)
    one = replace(problem, spectrum=problem.spectrum.with_amplitude(clean))
    estimators = registry().plugins["estimator"].values()
    assert len(estimators) >= 5
    for plugin in estimators:
        assert plugin.function(one).theta == pytest.approx(problem.model.theta, rel=1e-10)
