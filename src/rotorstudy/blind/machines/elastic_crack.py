"""A transverse crack whose front is an arc of a circle, by three-dimensional elasticity with unilateral contact.

`elastic_crack.csv` is computed by finite elements (benchmarks/elasticity/crack_compliance.py --fronts arc): compliances
for Young's modulus and radius 1, and the share of the energy of the open crack by the direction of the moment. The law
of the kink is the gradient of that energy. Axes as in `crack`.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from rotorstudy.blind.machines.form_cracks import Form

CURVATURES = (0.0, 0.8)


@lru_cache(maxsize=1)
def _table():
    """Splines over the depth and, of their values, over the curvature: logarithms of 6 compliances, then shares."""
    rows = np.loadtxt(Path(__file__).with_suffix(".csv"), delimiter=",", skiprows=4)
    depth, curvature = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))].reshape(len(depth), len(curvature), -1)
    values = np.concatenate([np.log(rows[..., 2:8]), rows[..., 8:]], axis=-1)
    return make_interp_spline(np.log(depth), values), curvature


def arc_crack(depth_ratio, curvature, poissons_ratio=0.3):
    """Compliances (opening, sideways) for Young's modulus and radius 1, and the shares of energy over 0 to pi.

    depth_ratio : over the diameter, 0.05 to 0.5;  curvature : depth over the radius of the arc, 0 (straight) to 0.8
    """
    over_depth, known = _table()
    row = make_interp_spline(known, over_depth(np.log(depth_ratio)), k=2)(curvature)
    low, high = row[2:4] / -0.05, row[4:6] / 0.03
    slope = low if poissons_ratio < 0.3 else high
    return np.exp(row[:2] + slope * (poissons_ratio - 0.3)), row[6:]


def arc_form(part, depth_ratio, curvature, kind="gradual", closing=0.0):
    """The crack in an element as a `form_cracks.Form`; `closing` is the moment that just opens it, N m.

    kind : `open`: a slot. `switching`: it yields across alone, while the moment pulls on it (R. Gasch, J. Sound Vib.
           160 (1993) 313-332). `gradual`: in parts, by the contact of its faces.
    """
    (opening, sideways), shares = arc_crack(depth_ratio, curvature, part.poissons_ratio)
    compliance = np.diag([opening, sideways]) / (part.youngs_modulus * (part.outer_diameter / 2) ** 3)
    if kind == "open":
        return Form(compliance, "open", None)
    if kind == "switching":
        return Form(compliance * [1, 0], "energy", lambda angle: np.cos(angle) > 0, closing)
    share = make_interp_spline(np.linspace(0, np.pi, len(shares)), shares, bc_type="clamped")
    ratio = np.sqrt(sideways / opening)

    def opened(angle):
        return share(np.abs(np.arctan2(ratio * np.sin(angle), np.cos(angle))))

    return Form(compliance, "energy", opened, closing)
