import numpy as np

from rotorstudy.plugins import Crack, DepthRatio

GAUSS = np.polynomial.legendre.leggauss(10)  # integrates sines and cosines up to order 5 over 90 degrees to round-off


@Crack(
    source="after Al-Shudeifat and Butcher 2011; neutral axis through the centroid at each angle",
    symmetric=True,
    checked="closed forms: area moments of the open crack, angles where closing begins and ends; square sections",
)
def section_geometry(angle, depth_ratio: DepthRatio = 0.25):
    """Straight-edged crack, open where bending by the weight causes tension: loss of area moments of a round section.

    The crack is open below the neutral axis, which is horizontal and passes through the centroid of the section without
    the open part of the crack. Shares are losses of central area moments over the loss of the open crack in xi; the
    radius is 1, the crack depth 2 * depth_ratio.
    """
    angle = np.asarray(angle, float)
    turned = np.asarray(np.abs(np.angle(np.exp(1j * angle))))  # 0 crack down, pi up; the other half mirrors eta
    half = np.arccos(1 - 2 * depth_ratio)  # the crack extends over the angles -half to half about xi
    neutral, left = np.zeros_like(turned), np.ones(turned.shape, bool)
    for _ in range(30):  # Newton: zero first moment of the uncracked area about the neutral axis
        area, first, _ = _open_part(turned[left], neutral[left], half)
        down = first[0] * np.cos(turned[left]) - first[1] * np.sin(turned[left])
        step = (np.pi * neutral[left] + down - area * neutral[left]) / (np.pi - area)
        neutral[left] -= step
        left[left] = np.abs(step) >= 1e-13
        if not left.any():
            break
    loss = _loss(*_open_part(turned, neutral, half))
    loss[2] *= np.where(np.sin(angle) < 0, -1, 1)
    return loss / _loss(*_open_part(np.zeros(()), np.array(-1.0), half))[0]


def _open_part(turned, neutral, half):
    """Area, first moments (xi, eta) and second moments (xi xi, eta eta, xi eta) of the crack below the neutral axis.

    A point of the crack lies at xi cos(turned) - eta sin(turned) below the axis of the shaft. Strips across
    xi = cos(phi) are integrated in closed form, over phi between the angles where the neutral axis meets the circle.
    """
    meets = np.arccos(np.clip(neutral, -1, 1))
    ends = [np.arccos(np.cos(meets + sign * turned)).clip(0, half) for sign in (-1, 1)]
    cuts = np.sort(np.stack([0 * turned, *ends, 0 * turned + half]), axis=0)
    width = np.diff(cuts, axis=0)[..., None] / 2
    phi = (cuts[:-1, ..., None] + width) + width * GAUSS[0]
    xi, w = np.cos(phi), np.sin(phi)
    along, across = xi * np.cos(turned)[..., None] - neutral[..., None], np.sin(turned)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        right = np.where(across < 1e-12, np.where(along > 0, w, -w), np.clip(along / across, -w, w))

    def over(strips):
        return np.sum(strips * w * width * GAUSS[1], axis=(0, -1))

    first, second, third = right + w, right**2 - w**2, right * right**2 + w * w**2  # no powers, which take far longer
    moments = [xi * first, second / 2], [xi**2 * first, third / 3, xi * second / 2]
    return over(first), *(np.array([over(moment) for moment in order]) for order in moments)


def _loss(area, first, second):
    """Loss of the central area moments xi xi, eta eta and xi eta of the section."""
    carrying = np.pi - area
    return second + np.array([first[0] ** 2, first[1] ** 2, first[0] * first[1]]) / carrying
