"""Estimators against scipy and exact posteriors; how they scatter: `test_noise_statistics`, `test_equation_noise`."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, jeffcott, spectrum_of
from scipy import optimize

from rotorstudy import Problem, magnitude_and_phase
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.levenberg_marquardt import levenberg_marquardt
from rotorstudy.inference.linear import invert
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.inference.prediction import predicted_derivatives
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.noise import standard_normal, with_noise

TRIALS = 400


@pytest.fixture(scope="module")
def problem():
    """One speed, 1 % noise per harmonic, many trials."""
    model = jeffcott()
    spectrum = spectrum_of(model, [88.0], HARMONICS)
    numbers = standard_normal(11, 0, TRIALS, (2, *spectrum.amplitude.shape))
    return Problem(model, with_noise(spectrum, 0.01, "per harmonic", 65536, numbers), model.names)


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


def parabola(theta):
    """A model of two data, without a steady state beyond 3."""
    if (theta > 3).any():
        raise NoSteadyState("beyond 3")
    return np.concatenate([theta**2, theta], axis=-1), np.stack([2 * theta, np.ones_like(theta)], axis=-2)


def test_a_step_to_where_there_is_no_steady_state_is_refused_and_other_trials_go_on():
    start, measured = np.array([[0.1], [2.0]]), np.array([[4.0, 2.0], [4.0, 2.0]])  # the first step from 0.1 goes to 4
    found = levenberg_marquardt(parabola, measured, start, ("a",))
    assert found.converged.all() and found.theta == pytest.approx(2.0)
    alone = levenberg_marquardt(parabola, measured[1:], start[1:], ("a",))
    assert (alone.theta == found.theta[1:]).all()
    with pytest.raises(NoSteadyState):  # negative control: it is not hidden where no fit can start
        levenberg_marquardt(parabola, measured, start + 3, ("a",))


@pytest.mark.parametrize(("needed", "end"), [(np.inf, 2.0), (10.0, 2.0), (1.0, 0.11)])
def test_a_fit_ends_where_its_steps_would_not_reach_the_cost_that_matters(needed, end):
    """The first of 200 steps of 0.01 from 0.1 gains 0.054 of a cost of 19.5: as much by each would leave 8.8."""
    start, measured = np.array([[0.1]]), np.array([[4.0, 2.0]])
    found = levenberg_marquardt(parabola, measured, start, ("a",), longest=0.01, needed=needed)
    assert found.theta == pytest.approx(end) and found.converged == (end == 2.0)


def test_each_step_after_a_rejected_one_is_half_as_long_at_most(monkeypatch):
    """Gauss-Newton steps diverge from 3. Negative control: steps as long as the rejected one are tried again."""

    def tried():
        def predict(theta):
            seen.append(float(theta[0, 0]))
            return np.arctan(theta), 1 / (1 + theta[..., None] ** 2)

        seen = []
        found = levenberg_marquardt(predict, np.zeros((1, 1)), np.array([[3.0]]), ("a",))
        return found, *np.abs(np.subtract(seen[1:3], seen[0]))  # and lengths of the first two steps

    found, first, second = tried()
    assert found.theta == pytest.approx(0.0, abs=1e-6) and first > 9 and second <= 0.5 * first
    monkeypatch.setattr("rotorstudy.inference.levenberg_marquardt.SHORTER", 1.0)
    found, first, second = tried()
    assert second > 0.5 * first and found.theta == pytest.approx(3.0)


def test_a_prior_joins_the_data_with_its_whole_covariance():
    """Linear in theta: the posterior is known."""
    columns = np.array([[1.0, 0.5], [0.2, 1.0], [0.3, -0.4]])
    prior = Prior(("a", "b"), np.array([1.0, -2.0]), np.array([[0.5, 0.3], [0.3, 0.4]]))
    measured = np.array([[1.0, 2.0, 3.0]])
    precision = np.linalg.inv(prior.covariance)
    exact = np.linalg.solve(columns.T @ columns + precision, columns.T @ measured[0] + precision @ prior.mean)

    def fitted(prior):
        def predict(theta):
            return theta @ columns.T, np.broadcast_to(columns, (len(theta), 3, 2))

        found = levenberg_marquardt(predict, measured, np.zeros((1, 2)), prior.names, prior=prior)
        return found.theta[0], invert(found.normal[0])

    theta, covariance = fitted(prior)
    assert theta == pytest.approx(exact, rel=1e-9)
    assert covariance == pytest.approx(np.linalg.inv(columns.T @ columns + precision), rel=1e-9)
    lost, _ = fitted(Prior(prior.names, prior.mean, np.diag(np.diag(prior.covariance))))  # negative control
    assert np.abs(lost - exact).max() > 0.05


def test_trials_at_once_equal_single_fits(problem):
    together = output_error_fit(problem)
    for t in (0, TRIALS - 1):
        one = replace(problem, spectrum=problem.spectrum.with_amplitude(problem.spectrum.amplitude[t]))
        # a fit stops when the misfit falls by less than 1e-9 of itself: within 1e-4 of a standard deviation
        difference = np.abs(output_error_fit(one).theta - together.theta[t])
        assert (difference < 1e-4 * together.std[t]).all()


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
