import numpy as np

from rotorstudy.plugins import Crack


def series(order):
    """Fourier coefficients {k: s_k} of sigma, |k| <= order."""
    coefficients = {0: 3 / 8, 1: 1 / 4, -1: 1 / 4, 2: 1 / 16, -2: 1 / 16}
    return {k: s for k, s in coefficients.items() if abs(k) <= order}


@Crack(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
    series=series,
    symmetric=True,  # a claim: it opens as it closes; `rotorstudy check` checks each claim both ways
)
def my_model(angle):
    """Opens gradually and stays open for less than half a revolution: sigma = ((1 + cos(angle)) / 2)^2."""
    # angle (...) in rad is 0 where the crack points down: the weight keeps it open there and closed at pi.
    # Return the share of the stiffness loss: 0 closed, 1 open.
    return ((1 + np.cos(angle)) / 2) ** 2
