from rotorstudy.plugins import Estimator, output_error_fit, start_values


@Estimator(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
    uses_covariance=True,  # a claim; `rotorstudy check` checks each claim both ways
    fits_output=True,
)
def my_model(problem):
    """Fit of the predicted to the measured harmonics from a start 10 % above that of least squares."""
    # problem.equations() gives A (..., row, parameter) and b (..., row); problem.spectrum the measured harmonics with
    # their covariance; "..." is empty for one spectrum, `trial` for many. The result is an
    # Estimate(problem.names, theta (..., parameter), covariance (..., parameter, parameter), misfit (...)), see
    # docs/adding_a_model.md.
    return output_error_fit(problem, start=1.1 * start_values(problem))
