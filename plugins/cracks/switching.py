import numpy as np

from rotorstudy.plugins import Crack, hookimpl


def switching(angle):
    """Hinge that opens and shuts at once: sigma = 1 while cos(angle) > 0, else 0."""
    return np.where(np.abs(np.cos(angle)) < 1e-12, 0.5, np.cos(angle) > 0)


def series(order):
    """sigma = 1/2 + (2/pi) (cos - cos3 / 3 + cos5 / 5 - ...)"""
    coefficients = {0: 0.5}
    for k in range(1, order + 1, 2):
        coefficients[k] = coefficients[-k] = (-1) ** ((k - 1) // 2) / (np.pi * k)
    return coefficients


@hookimpl
def rotorstudy_crack():
    return Crack("switching", switching, source="Gasch 1993, 2008; thesis Eq. (2.4)", series=series)
