import numpy as np

from rotorstudy.plugins import Crack, Whole


def series(order, terms=None):
    """sigma = 1/2 + (2/pi) (cos - cos3 / 3 + cos5 / 5 - ...)"""
    coefficients = {0: 0.5}
    for k in range(1, min(order, 2 * terms - 1 if terms else order) + 1, 2):
        coefficients[k] = coefficients[-k] = (-1) ** ((k - 1) // 2) / (np.pi * k)
    return coefficients


@Crack(
    source="Gasch 1993, 2008; thesis Eq. (2.4)",
    series=series,
    symmetric=True,
    checked="the nine participation factors the thesis prints (with reversed sign), to their five decimals",
)
def switching(angle, terms: Whole | None = None):
    """Crack that opens and closes suddenly (hinge model): sigma = 1 while cos(angle) > 0, else 0.

    terms: number of terms of the cosine series to keep; a truncated series overshoots by 9 to 14 % of the loss.
    """
    if terms:
        return sum(np.real(s * np.exp(1j * k * angle)) for k, s in series(2 * terms - 1).items())
    return np.where(np.abs(np.cos(angle)) < 1e-12, 0.5, np.cos(angle) > 0)
