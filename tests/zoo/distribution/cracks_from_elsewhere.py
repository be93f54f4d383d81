import numpy as np

from rotorstudy.plugins import Crack


def series(order):
    """cos^4(a/2) = 3/8 + cos(a) / 2 + cos(2a) / 8"""
    coefficients = {0: 3 / 8, 1: 1 / 4, -1: 1 / 4, 2: 1 / 16, -2: 1 / 16}
    return {k: s for k, s in coefficients.items() if abs(k) <= order}


@Crack(source="a test", checked="its closed-form series, three coefficients", series=series, symmetric=True)
def from_a_distribution(angle):
    """Opens like the fourth power of a cosine: sigma = cos(angle / 2)^4."""
    return np.cos(angle / 2) ** 4
