"""Output-error estimates from the data alone, and the smallest covariance that any unbiased estimate can have."""

from dataclasses import replace
from functools import partial

import numpy as np

from rotorstudy.errors import NoConvergenceError, RotorstudyError
from rotorstudy.inference.estimate import Estimate
from rotorstudy.inference.levenberg_marquardt import ESTIMATE, levenberg_marquardt
from rotorstudy.inference.linear import check_identifiable, invert, solve_equations, whitened
from rotorstudy.inference.prediction import predicted_derivatives
from rotorstudy.inference.problem import Problem

FITTED_TOGETHER = 700_000  # derivatives: more do not fit the cache of a processor and take up to six times as long


def start_values(problem: Problem) -> np.ndarray:
    """(..., parameter) start of a fit: equation-error least squares weighted once, else given or typical values.

    Trials start together, from their mean: a step more for each costs less than linear equations of its own.
    """
    model = problem.model
    nominal = model.nominal[model.position(problem.names)]
    linear = {u.name for u in model.rotor_unknowns}.issuperset(problem.names)
    mean, _ = problem.mean(nominal)
    try:
        if linear:
            theta = solve_equations(mean, settled=False)
            nominal = solve_equations(mean, whitened(mean.equation_weights(theta)), theta, settled=False)
    except RotorstudyError:
        pass  # the linear equations do not determine the unknowns
    return np.broadcast_to(nominal, (*problem.spectrum.amplitude.shape[:-3], len(nominal)))


def output_error_fit(
    problem: Problem, start: np.ndarray | None = None, iterations: int = ESTIMATE.steps, clip: float = np.inf
) -> Estimate:
    """Output-error estimate from the data alone: predicted harmonics fitted to measured ones, weighted by covariance.

    Parameters
    ----------
    problem : Problem
        Its spectrum may have many trials.
    start : ndarray (..., parameter), optional
        See `start_values`.
    iterations : int
        Largest number of steps.
    clip : float
        See `levenberg_marquardt`.

    Returns
    -------
    Estimate
        Trials that do not converge are NaN.

    Raises
    ------
    UnidentifiableError
        If the unknowns trade off at the start.
    NoConvergenceError
        If no trial converges.
    """
    measured = problem.spectrum.whitened(problem.spectrum.amplitude)
    start = np.array(start_values(problem) if start is None else start, float)
    shape, count = measured.shape[:-1], start.shape[-1]
    measured = measured.reshape(-1, measured.shape[-1])
    start = np.broadcast_to(start.reshape(-1, count), (len(measured), count))
    together = max(1, FITTED_TOGETHER // (measured.shape[-1] * count))
    parts = [slice(first, first + together) for first in range(0, len(measured), together)]
    predict, given = partial(predicted_derivatives, problem), {"convergence": replace(ESTIMATE, steps=iterations)}
    found = [
        levenberg_marquardt(predict, measured[part], start[part], problem.names, clip=clip, **given) for part in parts
    ]
    names = ("theta", "cost", "normal", "converged")
    theta, cost, normal, converged = (np.concatenate([getattr(one, name) for one in found]) for name in names)
    if not converged.any():
        raise NoConvergenceError(
            f"the output-error fit did not converge in {iterations} steps; start closer, or fix a weak parameter"
        )
    covariance = np.full_like(normal, np.nan)
    theta[~converged] = np.nan
    covariance[converged] = invert(normal[converged])
    theta, covariance = theta.reshape(*shape, count), covariance.reshape(*shape, count, count)
    return Estimate(problem.names, theta, covariance, cost.reshape(shape))


def cramer_rao_bound(problem: Problem, theta: np.ndarray) -> np.ndarray:
    """The Cramer-Rao bound of the unknowns of a problem, from the data alone.

    Parameters
    ----------
    problem : Problem
        Model, spectrum and unknowns.
    theta : array (parameter,)
        The true amplitudes in the units of the parameters.

    Returns
    -------
    array (parameter, parameter)
        Covariance in the units of the parameters.

    Raises
    ------
    UnidentifiableError
        If the data cannot tell the unknowns apart.

    References
    ----------
    Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, ch. 3.
    """
    _, jacobian = predicted_derivatives(problem, np.asarray(theta, float))
    check_identifiable(jacobian, problem.names)
    return invert(jacobian.T @ jacobian)
