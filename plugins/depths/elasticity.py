from functools import lru_cache
from pathlib import Path

import numpy as np

from rotorstudy.plugins import CrackDepth, PoissonsRatio, Positive, Share

TABLE = Path(__file__).with_suffix(".csv")
SHALLOWEST = 1e-9  # depth ratio; what is shallower counts as this


def partly_open(depth_ratio, direction, diameter_m, youngs_modulus_Pa, poissons_ratio, front_aspect_ratio=0.0):
    """Rotation of the same crack by a unit moment whose faces do not overlap: unilateral contact.

    Of m = (sqrt(c_xi) cos, sqrt(c_eta) sin) of the direction, |m|^2 / 2 is the energy of the open crack, and e(arg m)
    the share of it that the crack has; the rotation is the gradient of |m|^2 e / 2.
    """
    from scipy.interpolate import PPoly

    (xi, eta), shares = _crack(depth_ratio, front_aspect_ratio, poissons_ratio)
    share = PPoly(_table()[-1] @ shares, np.linspace(0, np.pi, len(shares)))
    root = np.sqrt([xi, eta]) / np.sqrt(youngs_modulus_Pa * (diameter_m / 2) ** 3)
    across = np.abs(np.angle(np.exp(1j * np.asarray(direction, float))))
    m = root[0] * np.cos(across) + 1j * root[1] * np.sin(across)
    angle = np.angle(m)
    slope = m * (share(angle) + 0.5j * share(angle, 1))
    return root[0] * slope.real + 1j * root[1] * slope.imag * np.where(np.sin(direction) < 0, -1, 1)


@lru_cache(maxsize=512)
def _crack(depth_ratio, front_aspect_ratio, poissons_ratio):
    """Compliances (xi and eta) for E = R = 1, and shares e of the energy at equal steps of the angle of m, 0 to pi."""
    by_depth, first = _over_depth(front_aspect_ratio)
    log = np.log(max(depth_ratio, SHALLOWEST))
    row = by_depth(max(log, first))
    beyond = min(log - first, 0) * by_depth(first, 1)[:2]
    off = poissons_ratio - 0.3
    curve = (row[4:6] / 0.03 + row[2:4] / 0.05) / 0.08  # of the parabola through 0.25, 0.3 and 0.33
    return np.exp(row[:2] + beyond + off * (row[4:6] / 0.03 + curve * (off - 0.03))), row[6:]


@lru_cache(maxsize=512)
def _over_depth(front_aspect_ratio):
    """Spline of the rows of the table over the logarithm of the depth, and where it begins."""
    from scipy.interpolate import PPoly

    depth, over_aspect, over_depth, _ = _table()
    rows = [fronts(_slimness(d, front_aspect_ratio)) for d, fronts in zip(depth, over_aspect, strict=True)]
    return PPoly(over_depth @ np.array(rows), np.log(depth)), np.log(depth[0])


@lru_cache(maxsize=1)
def _table():
    """Depths, and for each a spline over `_slimness`: logarithms of compliances, then shares of energy.

    And coefficients of splines through unit values over the depth, and over the angle: times values those through them.
    Columns: depth, aspect, xi, eta, both at Poisson's ratios of 0.25 and 0.33 over those at 0.3, shares over the angle.
    """
    from scipy.interpolate import CubicSpline

    table = np.loadtxt(TABLE, delimiter=",", skiprows=4)
    values = np.concatenate([np.log(table[:, 2:8]), table[:, 8:]], axis=1)
    depth, found = np.unique(table[:, 0]), []
    for one in depth:
        here = np.flatnonzero(table[:, 0] == one)
        here = here[np.argsort(table[here, 1])]
        found.append(CubicSpline(_slimness(one, table[here, 1]), values[here]))
    ends = (np.log(depth), "not-a-knot"), (np.linspace(0, np.pi, values.shape[1] - 6), "clamped")
    return depth, found, *(CubicSpline(x, np.eye(len(x)), bc_type=kind).c for x, kind in ends)


def _slimness(depth_ratio, front_aspect_ratio):
    """How much narrower than with a straight front a crack is: nearly the logarithm of the ratio of the widths."""
    return np.log1p(front_aspect_ratio * np.sqrt(1 / depth_ratio - 1))


@CrackDepth(
    source="computed by benchmarks/elasticity/crack_compliance.py with gmsh and scikit-fem",
    valid=(0.0, 0.6),
    partly_open=partly_open,
    example={"diameter_m": 0.02},
    checked="plane strain at small depth; strips within 10 % in xi; refinement of the mesh; depths left out",
)
def elasticity(
    depth_ratio,
    diameter_m: Positive,
    youngs_modulus_Pa: Positive = 2.1e11,
    poissons_ratio: PoissonsRatio = 0.3,
    front_aspect_ratio: Share = 0.0,
):
    """Crack in a round shaft by three-dimensional elasticity: a table of finite elements, accurate to 1 %.

    front_aspect_ratio: depth over half the width of the ellipse about a point of the surface that the front is a part
    of; 1 is a circle, 0 a straight front.  The table has depths of 2 to 60 % and Poisson's ratios of 0.25 to 0.33;
    beyond, the powers of the depth at 2 % and the parabola of the logarithm are continued.
    """
    (xi, eta), _ = _crack(depth_ratio, front_aspect_ratio, poissons_ratio)
    if not depth_ratio:
        return 0.0, 0.0
    scale = youngs_modulus_Pa * (diameter_m / 2) ** 3
    return xi / scale, eta / scale
