"""Laws of breathing: what share of an imposed rotation the kink of a crack is, as the shaft turns or by the moment.

See `hinge.py` for the equations and the symbols.
"""

from functools import lru_cache

import numpy as np

from rotorstudy.model.cracks import compliance
from rotorstudy.model.registry import registry

DIRECTIONS = 128  # of the moment, over 360 degrees; interpolation between them is wrong by 2e-4 of the kink
PULL = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)  # directions in which the moment pulls, rad from xi
ACROSS = 0.5  # of the flexibility across, in the formulas by the angle: they count only the half in tension
ROUND_OFF = 1e-9  # of a cosine, and of the coefficients of shares, relative to the largest
KEPT = 2048  # depths: a search tries the same one at many angles, and every search on a shaft begins with the same ones
KEPT_PARTS = 256  # of which those of further laws are kept
LEAST_OF_PARTS = 1e-3  # coefficient of these, relative to the largest; those above ORDER are as small
ORDER = 15  # highest k of h_k, which decrease with the cube of k; those left out are less than 1e-3 of the kink
SHIFTS = np.arange(-ORDER, ORDER + 3)  # of entries: the conjugate turns by two more


def none(softer, side, sudden):
    """It never closes, such as a notch."""
    return _diagonal(*np.broadcast_to((softer / (1 + softer))[:, None], (2, DIRECTIONS)))


def turning(softer, side, sudden):
    """The flexibility opens as (1 + cos) / 2 by the angle to the side that the weight stretches."""
    softer = np.multiply.outer(softer, (1 + side * np.cos(PULL)) / 2)
    return _diagonal(*softer / (1 + softer))


def cosine(softer, side, sudden):
    """The formula of Mayes: (1 + cos) / 2 of what the open crack takes from the stiffness of the element is missing.

    Unlike the others, it depends on the length of the element.
    """
    return _by_formula(softer, (1 + side * np.cos(PULL)) / 2)


def switching(softer, side, sudden):
    """The formula of Gasch: all of it is missing while the cosine of that angle is positive."""
    towards = side * np.cos(PULL)
    return _by_formula(softer, np.where(np.abs(towards) > ROUND_OFF, towards > 0, 0.5))


def weight(softer, side, sudden, *section):
    """The static moment opens the crack; it stretches the lower or the upper side of the shaft.

    The derivative of |mu| c(psi) is c along mu and dc/dpsi across it.
    """
    *depth, stiffness = section
    kink = softer[0] * np.maximum(np.cos(PULL), 0) if sudden else stiffness * _partly_open(*depth)
    orders = np.fft.fftfreq(DIRECTIONS, 1 / DIRECTIONS)
    both = kink, np.fft.ifft(1j * orders * np.fft.fft(kink))
    along, sideways = (np.array([one.real, one.imag]) for one in both)
    turn = np.array([[np.cos(PULL), np.sin(PULL)], [-np.sin(PULL), np.cos(PULL)]])  # to mu and across it
    matrix = np.moveaxis(along[:, None] * turn[0] + sideways[:, None] * turn[1], -1, 0)
    found = np.moveaxis(np.linalg.solve(np.eye(2) + matrix, matrix), 0, -1)
    return found[..., (-np.arange(DIRECTIONS) + (DIRECTIONS // 2) * (side < 0)) % DIRECTIONS]  # it turns backwards


def _by_formula(softer, share):
    softer = softer * [1, ACROSS]
    return _diagonal(*np.multiply.outer(softer / (1 + softer), share))


def _diagonal(xi, eta):
    return np.array([[xi, 0 * xi], [0 * eta, eta]])


# Laws by which a crack opens as the shaft turns: functions of what the open one yields along xi and eta, in kinks by
# the moment of a unit kink, of the side that the weight stretches, and of whether it opens at once
LAWS = {law.__name__: law for law in (none, turning, cosine, switching, weight)}


@lru_cache(maxsize=KEPT)
def _opened(breathing, softer, side, sudden, section):
    """Kink (2, 2, direction) along xi and eta by a unit of imposed rotation along each, by the turn of the shaft."""
    return LAWS[breathing](np.array(softer), side, sudden, *section)


@lru_cache(maxsize=KEPT)
def shares_of(law):
    """Shares of one of `LAWS` for `Hinge._entries`."""
    return _as_shares(_on_both(_opened(*law)))


@lru_cache(maxsize=KEPT_PARTS)
def shares_of_parts(law, parts):
    """Shares (part, 2, shift) of parts (motion, order) of a law of breathing beside one of `LAWS`.

    If the law changes the kink by d at the same moment, the moment changes with it where the nodes are held: with T of
    the law, a part 1 - T of d is left, and the moment strains the shaft by the part 1 - T of the imposed rotation.
    """
    _, (across, _), side, *_ = law
    left = np.eye(2)[..., None] - _opened(*law)
    yields = {"across": np.diag([across, 0]), "along": np.diag([0, across]), "coupled": across * (1 - np.eye(2))}
    yields = {motion: _on_both(np.einsum("ijd,jk,kld->ild", left, one, left)) for motion, one in yields.items()}
    yields |= {"lagging": yields["across"], "skewed": yields["coupled"]}
    kinks = [yields[motion] * _opening(motion, order, side) for motion, order in parts]
    return _as_shares(np.reshape(kinks, (-1, 2, DIRECTIONS)), LEAST_OF_PARTS)


@lru_cache
def _opening(motion, order, side):
    """What part (direction,) of it is open."""
    angle = side**order * np.exp(-1j * order * PULL)  # the moment turns backwards
    return angle.imag / 2 if motion in ("coupled", "lagging") else (1 - angle.real) / 2 if order else angle.real


def _on_both(kinks):
    """Kinks (2, direction) by the imposed rotation and by its conjugate, of kinks (2, 2, direction) as of `_opened`."""
    (xx, xy), (yx, yy) = kinks
    return np.stack([xx + yy + 1j * (yx - xy), xx - yy + 1j * (xy + yx)]) / 2


def _as_shares(kinks, least=ROUND_OFF):
    """Shares (..., 2, shift) for `Hinge._entries` of kinks (..., 2, direction) as of `_on_both`.

    least : share of the largest below which they are left out
    """
    series = np.fft.fft(kinks)[..., np.arange(-ORDER, ORDER + 1)] / DIRECTIONS
    largest = np.abs(series).max(axis=(-2, -1), keepdims=True)
    series = np.where(np.abs(series.imag) > ROUND_OFF * largest, series, series.real)
    series = np.where(np.abs(series) > least * largest, series, 0.0)
    found = np.zeros((*kinks.shape[:-1], len(SHIFTS)), complex)
    found[..., 0, :-2], found[..., 1, 2:] = series[..., 0, :], series[..., 1, :]  # the conjugate turns by 2 more
    return found


@lru_cache(maxsize=KEPT)
def open_compliance(name, depth_ratio, shaft):
    """Compliance (2,) of the open crack along xi and eta, rad/(N m); not to be changed."""
    depth = registry().get("depth", name, "the transverse crack")
    return compliance(depth, depth_ratio, "the transverse crack", **dict(shaft))


@lru_cache(maxsize=KEPT)
def _partly_open(name, depth_ratio, shaft):
    """Kink c (direction,) by a unit moment in all directions, rad/(N m)."""
    half = PULL[: DIRECTIONS // 2]
    found = registry().get("depth", name, "the transverse crack").partly_open(depth_ratio, half, **dict(shaft))
    return np.concatenate([found, [0], found[:0:-1].conj()])  # closed in pure compression, and symmetric


@lru_cache(maxsize=KEPT)
def series_of(name, depth_ratio, shaft, stiffness):
    """Chebyshev coefficients (k, 2) in cos x of Re h(x) and of Im h(x) / sin x, of a crack at any angle."""
    kink = stiffness * _partly_open(name, depth_ratio, shaft)
    turned = 1 + kink * np.exp(-1j * PULL)  # the imposed rotation in the direction of the moment
    h = np.interp(PULL, PULL + np.angle(turned), kink / np.abs(turned), period=2 * np.pi)
    h = (np.fft.fft(h).real / DIRECTIONS)[np.arange(-ORDER, ORDER + 1)]  # real, as the crack is symmetric
    along, odd = h[ORDER:] + h[ORDER::-1], h[ORDER + 1 :] - h[ORDER - 1 :: -1]
    across = np.array([2 * odd[k::2].sum() for k in range(ORDER + 1)])  # sin kx / sin x = 2 cos (k-1)x + ...
    return np.stack([along, across], axis=-1) / np.where(np.arange(ORDER + 1) > 0, 1, 2)[:, None]
