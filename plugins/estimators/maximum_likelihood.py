from rotorstudy.plugins import Estimator, output_error_fit


@Estimator(
    source="Ljung, System Identification, 1999, ch. 7",
    checked="scipy.optimize.least_squares; Cramer-Rao bound",
    uses_covariance=True,
    fits_output=True,
)
def maximum_likelihood(problem):
    """Fit of the predicted to the measured harmonics, weighted by their covariance (output error)."""
    return output_error_fit(problem)
