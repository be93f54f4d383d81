from rotorstudy.plugins import Estimator, hookimpl, in_chunks, linear_estimate, solve_equations


def least_squares(problem):
    """Unweighted least squares of the equations of motion, A theta = b."""
    theta = in_chunks(problem, solve_equations)
    return linear_estimate(problem, theta, problem.equation_error_covariance(theta))


@hookimpl
def rotorstudy_estimator():
    return Estimator(
        "least_squares",
        least_squares,
        source="thesis Eqs. (2.33) to (2.35)",
        checked="thesis Tables 2.5, 3.9, 4.10, 5.5, 6.8, 6.9 (scoreboard)",
    )
