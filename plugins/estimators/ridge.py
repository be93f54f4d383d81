import numpy as np

from rotorstudy.plugins import (
    Estimator,
    by_speed,
    in_chunks,
    invert,
    linear_estimate,
    solve_full_rank,
    solve_truncated,
    solve_weighted,
)

PRIOR_WIDTH = 10.0  # standard deviation of the prior, in typical sizes of the unknown


@Estimator(
    source="Hoerl and Kennard 1970, Technometrics 12, 55-67; as a prior, Gelman et al., Bayesian Data Analysis",
    checked="Cramer-Rao bound where the prior is weak",
    uses_covariance=True,
    handles_rank_deficiency=True,
)
def ridge(problem):
    """Weighted least squares with a weak normal prior: posterior mode and covariance.

    Prior: the unknowns are independent; the mean is the value in the model, else zero, and the standard deviation is
    ten times the typical size. Parameters that the data do not determine keep their prior.
    """
    mean, std = _prior(problem)
    rows = np.diag(1 / std)

    def solve(columns, right_side, names):
        leading = columns.shape[:-2]
        columns = np.concatenate([columns, np.broadcast_to(rows, (*leading, *rows.shape))], axis=-2)
        right_side = np.concatenate([right_side, np.broadcast_to(mean / std, (*leading, len(std)))], axis=-1)
        return solve_full_rank(columns, right_side)

    theta = in_chunks(problem, lambda part: solve_weighted(part, solve, solve_truncated))
    at, middle = problem.mean(theta)
    at = at.holding(middle) or at
    columns = np.concatenate([by_speed(problem.equation_weights(middle), at.equations()[0]), rows])
    return linear_estimate(problem, theta, invert(columns.T @ columns))


def _prior(problem):
    model = problem.model
    place = model.position(problem.names)
    return np.nan_to_num(model.stated)[place], PRIOR_WIDTH * model.typical[place]
