from dataclasses import replace

from rotorstudy.plugins import Estimator, output_error_fit

CLIP = 1.345  # standard deviations; 95 % efficiency under normal noise
STEPS = 60  # twenty are typical; a record that needs hundreds is too far from the model for a valid estimate
SPREAD = 0.9597 / 0.95  # mean weight under normal noise over the efficiency: correction of the weighted covariance


@Estimator(
    source="Huber and Ronchetti, Robust Statistics, 2009, ch. 7",
    checked="efficiency 95 % against the Cramer-Rao bound (Huber 1964)",
    uses_covariance=True,
    fits_output=True,
    tolerates_outliers=True,
)
def huber(problem):
    """Output-error fit with Huber's loss: linear instead of quadratic beyond 1.345 standard deviations.

    In the output error an outlier affects one row only. In the equation error it would also enter the columns, where
    no weighting of rows bounds its influence.
    """
    found = output_error_fit(problem, iterations=STEPS, clip=CLIP)
    return replace(found, covariance=SPREAD * found.covariance)
