"""Noise of a spectrum in the equations and in the estimate: several speeds, two sensors, hidden coordinates."""

from dataclasses import replace

import numpy as np
import pytest
from random_rotor import four_coordinates
from test_noise_statistics import check_scatter

from rotorstudy import Problem, Spectrum, cramer_rao_bound, measured_response, registry
from rotorstudy.inference.equation_error import regression, residual_sensitivity
from rotorstudy.inference.output_error import output_error_fit

SPEEDS, EVERY = np.array([90.0, 130.0]), np.arange(-7, 8)
ORDER = 7
NAMES = ("swirl", "uneven", "turning", "push_real", "push_imag")
TRIALS = 300


def correlated(shown, size, generator):
    """A covariance for each speed and sensor, with every component correlated with every other."""
    speeds, harmonics, sensors = shown.shape
    root = generator.standard_normal((speeds, sensors, 2 * harmonics, 4 * harmonics))
    return size**2 * root @ np.swapaxes(root, -1, -2) / (4 * harmonics)


def draws(covariance, count, generator):
    """(trial, speed, harmonic, sensor) complex noise with that covariance."""
    root = np.linalg.cholesky(covariance)
    numbers = np.einsum("smij,tsmj->tsim", root, generator.standard_normal((count, *covariance.shape[:3])))
    real, imaginary = np.split(numbers, 2, axis=2)
    return real + 1j * imaginary


MODEL = four_coordinates(1)


@pytest.fixture(scope="module")
def clean():
    shown = measured_response(MODEL, SPEEDS, EVERY, order=ORDER)
    # a ten-thousandth of the largest harmonic: the square of the noise does not show
    covariance = correlated(shown, 1e-5 * np.abs(shown).max(), np.random.default_rng(21))
    return Spectrum(shown, SPEEDS, EVERY, MODEL.sensors, covariance)


@pytest.fixture(scope="module")
def problem(clean):
    noise = draws(clean.covariance, TRIALS, np.random.default_rng(22))
    return Problem(MODEL, clean.with_amplitude(clean.amplitude + noise), NAMES, ORDER)


@pytest.fixture(scope="module")
def true():
    return MODEL.theta[MODEL.position(NAMES)]


def residual(spectrum, theta):
    a, b = regression(MODEL, spectrum, NAMES, order=ORDER).real_system()
    return a @ theta - b


def moved_by(clean, theta):
    """Residual that a noise of one sigma makes, and what `residual_sensitivity` says it makes."""
    noise = draws(clean.covariance, 1, np.random.default_rng(3))[0]
    found = residual(clean.with_amplitude(clean.amplitude + noise), theta) - residual(clean, theta)
    slope = residual_sensitivity(MODEL, clean, NAMES, theta, order=ORDER)
    components = np.concatenate([noise.real, noise.imag], axis=1).reshape(len(SPEEDS), -1)
    return found, np.einsum("src,sc->sr", slope, components).ravel()


def test_the_residual_moves_with_the_spectrum_as_stated(clean, true):
    found, stated = moved_by(clean, true)
    # the residual is affine in the spectrum, so there is no error but the cancellation of forces a thousand times it
    assert np.abs(found - stated).max() < 1e-9 * np.abs(found).max()
    _, elsewhere = moved_by(clean, 1.1 * true)
    assert np.abs(found - elsewhere).max() > 1e-4 * np.abs(found).max()  # negative control: it depends on theta


def test_least_squares_scatters_as_stated_with_hidden_coordinates_and_correlated_noise(problem, true):
    found = registry().get("estimator", "least_squares").function(problem)
    check_scatter(found.theta - true, found.covariance, slack=0.02)  # first order, at the mean of the trials
    for factor in (2.0, 0.5):  # negative control, either way
        with pytest.raises(AssertionError):
            check_scatter(found.theta - true, factor * found.covariance, slack=0.02)


def test_maximum_likelihood_fills_the_cramer_rao_ellipsoid_with_correlated_noise(problem, clean, true):
    fitted = replace(problem, spectrum=problem.spectrum.with_amplitude(problem.spectrum.amplitude[:150]))
    found = output_error_fit(fitted)
    bound = cramer_rao_bound(replace(problem, spectrum=clean), true)
    check_scatter(found.theta - true, bound, slack=0.01)
    # degrees of freedom: two speeds, two sensors, real and imaginary parts, less the unknowns
    freedom = 2 * 2 * 2 * len(EVERY) - len(NAMES)
    # mean of 150 chi-square numbers: standard deviation sqrt(2 f / 150), here within five of these
    assert found.misfit.mean() == pytest.approx(freedom, abs=5 * np.sqrt(2 * freedom / 150))


def test_neither_estimate_nor_interval_depends_on_the_order_of_harmonics(problem, clean):
    mixed = np.random.default_rng(4).permutation(len(EVERY))
    both = np.concatenate([mixed, mixed + len(EVERY)])
    one = replace(problem, spectrum=clean.with_amplitude(problem.spectrum.amplitude[0]))
    here = one.spectrum
    other = Spectrum(
        here.amplitude[:, mixed], SPEEDS, EVERY[mixed], here.sensors, here.covariance[:, :, both][..., both]
    )
    estimators = registry().plugins["estimator"].values()
    assert len(estimators) >= 5
    for plugin in estimators:
        expected, found = plugin.function(one), plugin.function(replace(one, spectrum=other))
        # a fit stops within 1e-4 of a standard deviation; the linear estimate is the same to round-off
        assert (np.abs(found.theta - expected.theta) < 1e-3 * expected.std).all()
        assert found.covariance == pytest.approx(expected.covariance, rel=1e-5, abs=1e-8 * expected.std.min() ** 2)
