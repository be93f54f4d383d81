from rotorstudy.plugins import Estimator, in_chunks, linear_estimate, solve_weighted


@Estimator(
    source="Sanathanan and Koerner 1963, IEEE Trans. Autom. Control 8, 56-58 (weights taken at the last estimate)",
    checked="Cramer-Rao bound",
    uses_covariance=True,
)
def weighted_least_squares(problem):
    """Least squares of the equations of motion, weighted by the inverse covariance of the equation error.

    Equivalent to maximum likelihood for small noise; the noise in the columns causes a bias of second order.
    """
    theta = in_chunks(problem, solve_weighted)
    weights = problem.equation_weights(problem.mean(theta)[1])
    return linear_estimate(problem, theta, problem.equation_error_covariance(theta, weights))
