from dataclasses import replace

from rotorstudy.plugins import Estimator, hookimpl, output_error_fit

CLIP = 1.345  # standard deviations; 95 % efficiency under normal noise
STEPS = 60  # twenty are usual; a record that takes hundreds is too far from the model for a valid estimate
SPREAD = (
    0.9597 / 0.95
)  # mean weight under normal noise over the efficiency: corrects the covariance, which uses the weights


def huber(problem):
    """Fit in which a residual beyond 1.345 standard deviations counts by its size, not its square (Huber).

    The residual is the equation error carried back to the harmonics, which is the output error: there an outlier
    affects one row alone. In the equation error it stands in the columns too, where no weight on rows would bound its
    influence.
    """
    found = output_error_fit(problem, iterations=STEPS, clip=CLIP)
    return replace(found, covariance=SPREAD * found.covariance)


@hookimpl
def rotorstudy_estimator():
    return Estimator(
        "huber",
        huber,
        source="Huber and Ronchetti, Robust Statistics, 2009, ch. 7",
        checked="efficiency 95 % against the Cramer-Rao bound (Huber 1964)",
        uses_covariance=True,
        fits_output=True,
        tolerates_outliers=True,
    )
