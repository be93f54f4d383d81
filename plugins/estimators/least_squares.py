from rotorstudy.identification import Estimate, solve_equations
from rotorstudy.plugins import Estimator, hookimpl


def least_squares(problem):
    """Unweighted least squares of the equations of motion, A theta = b."""
    import numpy as np

    theta = np.concatenate([np.atleast_2d(solve_equations(part)) for part in problem.chunks()])
    theta = theta.reshape(*problem.spectrum.amplitude.shape[:-3], -1)
    misfit = np.full(theta.shape[:-1], np.nan)
    return Estimate(problem.names, theta, problem.equation_error_covariance(theta), misfit)


@hookimpl
def rotorstudy_estimator():
    return Estimator("least_squares", least_squares, source="thesis Eqs. (2.33) to (2.35)")
