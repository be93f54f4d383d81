from rotorstudy.plugins import Estimator, hookimpl, output_error_fit


def maximum_likelihood(problem):
    """Fit of the predicted to the measured harmonics, weighted by their covariance (output error)."""
    return output_error_fit(problem)


@hookimpl
def rotorstudy_estimator():
    return Estimator(
        "maximum_likelihood",
        maximum_likelihood,
        source="Ljung, System Identification, 1999, ch. 7",
        checked="scipy.optimize.least_squares; Cramer-Rao bound",
        uses_covariance=True,
        fits_output=True,
    )
