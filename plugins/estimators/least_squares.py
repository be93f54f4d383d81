from rotorstudy.plugins import Estimator, in_chunks, linear_estimate, solve_equations


@Estimator(source="thesis Eqs. (2.33) to (2.35)", checked="thesis Tables 2.5, 3.9, 4.10, 5.5, 6.8, 6.9 (scoreboard)")
def least_squares(problem):
    """Unweighted least squares of the equations of motion, A theta = b."""
    theta = in_chunks(problem, solve_equations)
    return linear_estimate(problem, theta, problem.equation_error_covariance(theta))
