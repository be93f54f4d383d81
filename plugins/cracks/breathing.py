import numpy as np

from rotorstudy.plugins import Crack, Share


@Crack(
    source="Mayes and Davies 1984",
    symmetric=True,
    example={"eta_share": 0.2},
    checked="participation factors of harmonics -1 to 3 in closed form, 1/8, 1/4, 1/4, 1/4, 1/8",
)
def breathing(angle, eta_share: Share = 0.0):
    """Crack that opens and closes gradually: sigma = (1 + cos(angle)) / 2.

    eta_share: ratio of the loss along eta to that along xi.
    """
    breathing = (1 + np.cos(angle)) / 2
    return np.stack([breathing, eta_share * breathing, 0 * breathing])
