import numpy as np

from rotorstudy.plugins import Estimator, in_chunks, linear_estimate, solve_equations, solve_truncated, undetermined


@Estimator(
    source="Golub and Van Loan, Matrix Computations, 2013, section 5.5 (rank deficiency by SVD)",
    checked="least_squares at full rank, whose checks hold for it",
    handles_rank_deficiency=True,
)
def column_scaled_least_squares(problem):
    """Least squares by SVD that estimates the determined parameters; the others are NaN with infinite variance.

    Columns are scaled to unit length and zero singular values are omitted. With full rank it equals `least_squares`,
    which raises an error if two unknowns are not separable.
    """
    theta = in_chunks(problem, lambda part: solve_equations(part, solve_truncated))
    covariance = problem.equation_error_covariance(theta)
    mean, _ = problem.mean(theta)
    lost = np.isin(problem.names, undetermined(mean.equations()[0], problem.names))
    covariance[lost], covariance[:, lost] = 0, 0
    covariance[lost, lost] = np.inf
    return linear_estimate(problem, np.where(lost, np.nan, theta), covariance)
