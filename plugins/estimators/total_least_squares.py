import numpy as np

from rotorstudy.plugins import (
    Estimator,
    NoConvergenceError,
    in_chunks,
    invert,
    linear_estimate,
    noise_in_equations,
    solve_equations,
    solve_linear,
    solve_weighted,
    whitened,
)

STEPS = 50


@Estimator(
    source="Van Huffel and Vandewalle, The Total Least Squares Problem, 1991, ch. 8 (generalized)",
    checked="Cramer-Rao bound",
    uses_covariance=True,
)
def total_least_squares(problem):
    """Least squares that accounts for noise in the columns: minimises |A theta - b|^2 over its variance at theta.

    With v = (theta, -1), whitened rows, and N the covariance of (A, b) summed over rows, |(A, b) v|^2 / (v' N v) is
    minimised, so that noise in the columns causes no bias. Columns without noise are zero in N.
    """
    theta = in_chunks(problem, _solve)
    weights = problem.equation_weights(problem.mean(theta)[1])
    return linear_estimate(problem, theta, problem.equation_error_covariance(theta, weights))


def _solve(problem):
    theta = solve_weighted(problem)
    weights = problem.equation_weights(theta)
    noise = noise_in_equations(problem, weights)
    return solve_equations(problem, whitened(weights, lambda *equations: _compensated(*equations, noise)), theta)


def _compensated(columns, right_side, names, noise):
    """(A'A - ratio * N_AA) theta = A'b - ratio * N_Ab, the ratio being the objective at the last theta."""
    theta = plain = solve_linear(columns, right_side, names)
    inverse = invert(np.swapaxes(columns, -1, -2) @ columns)
    for _ in range(STEPS):
        v = np.concatenate([theta, -np.ones((*theta.shape[:-1], 1))], axis=-1)
        misfit = np.sum(((columns @ theta[..., None])[..., 0] - right_side) ** 2, axis=-1)
        ratio = misfit / np.einsum("...p,...pq,...q->...", v, noise, v)
        # a correction of least squares of the order of the squared noise
        slope = np.eye(theta.shape[-1]) - ratio[..., None, None] * (inverse @ noise[..., :-1, :-1])
        cross = ratio[..., None, None] * (inverse @ noise[..., :-1, -1:])
        before, theta = theta, np.linalg.solve(slope, plain[..., None] - cross)[..., 0]
        if np.all(np.abs(theta - before) <= 1e-9 * np.abs(theta)):
            return theta
    raise NoConvergenceError(f"total least squares did not converge in {STEPS} steps; the noise is too large")
