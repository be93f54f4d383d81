import numpy as np

from rotorstudy.plugins import Crack, Share


@Crack(
    name="open",
    source="Smith 1933; Tondl 1965; the asymmetric shaft of textbooks",
    symmetric=True,
    example={"eta_share": 0.2},
    checked="closed form of the 2X response to gravity of an asymmetric shaft and of its two natural frequencies",
)
def always_open(angle, eta_share: Share = 0.0):
    """Crack that never closes, such as a notch: sigma = 1.

    eta_share: ratio of the loss along eta to that along xi.
    """
    return np.stack([np.full(np.shape(angle), share) for share in (1.0, eta_share, 0.0)])
