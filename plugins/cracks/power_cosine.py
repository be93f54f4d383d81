import numpy as np

from rotorstudy.plugins import Crack, Even, Share


@Crack(
    source="Al-Shudeifat and Butcher 2011 (the first of their breathing functions)",
    symmetric=True,
    example={"eta_share": 0.2},
    checked="exponent 2 is the cosine of Mayes and Davies; its mean is binomial(m, m/2) / 2^m",
)
def power_cosine(angle, exponent: Even = 4, eta_share: Share = 0.0):
    """Crack open for a smaller part of the revolution, the higher the exponent: sigma = cos(angle / 2)^exponent.

    exponent: even; 2 is the cosine of Mayes and Davies.  eta_share: ratio of the loss along eta to that along xi.
    """
    breathing = np.cos(angle / 2) ** exponent
    return np.stack([breathing, eta_share * breathing, 0 * breathing])
