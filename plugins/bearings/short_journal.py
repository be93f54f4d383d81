from functools import lru_cache
from math import log, sqrt

import numpy as np

from rotorstudy.plugins import Bearing, Parameter, Positive, RotorstudyError, film_entries, weight_carried

LONGEST = 0.5  # length over diameter: beyond, the neglect of the circumferential flow exceeds 10 % of the stiffness
ECCENTRICITY = (1e-6, 1 - 1e-6)  # search range; outside, there is no film or it carries no load


def running(speed, diameter_m, length_m, radial_clearance_m, viscosity_Pa_s, load_N, load_angle_rad):
    """Eccentricity ratio and attitude angle, rad, at which the journal runs at a speed, rad/s."""
    e = eccentricity_ratio(diameter_m * length_m**3 * viscosity_Pa_s * speed / (8 * load_N * radial_clearance_m**2))
    return e, np.arctan2(np.pi * np.sqrt(1 - e * e), 4 * e) + load_angle_rad


@lru_cache(maxsize=4096)  # both states of a machine have the same films, and so do steps of a fit
def eccentricity_ratio(ocvirk, where="the journal"):
    """Eccentricity over clearance at an Ocvirk number D speed viscosity L^3 / (8 load c^2).

    It solves (1 - e^2)^2 / (e sqrt(16 e^2 + pi^2 (1 - e^2))) = ocvirk, falling from infinity to 0.
    """
    from scipy.optimize import brentq

    wanted = log(ocvirk) if ocvirk > 0 else np.nan  # of a load that turned round in a fit there is none

    def excess(e):
        return 2 * log(1 - e * e) - log(e) - 0.5 * log(16 * e * e + np.pi**2 * (1 - e * e)) - wanted

    low, high = ECCENTRICITY
    if not excess(low) > 0 > excess(high):
        side = "below" if excess(low) <= 0 else "above"
        raise RotorstudyError(
            f"{where} has an eccentricity ratio {side} {low if side == 'below' else high:.6f} (Ocvirk number "
            f"{ocvirk:.3g}); it must lie between 0 and 1: check load_N, viscosity_Pa_s and the dimensions, or leave "
            "that speed out"
        )
    return brentq(excess, low, high, xtol=1e-15, rtol=1e-14)


def coefficients(e):
    """Dimensionless K c / load and C c w / load at eccentricity ratio e, each (2, 2), x along the load.

    As in the book, u = y is across the load and v = -x against it.
    """
    pi2, e2 = np.pi**2, e * e
    rest = 1 - e2
    root = sqrt(rest)
    a_uu = 4 * (pi2 * (2 - e2) + 16 * e2)
    a_uv = np.pi * (pi2 * rest**2 - 16 * e2 * e2) / (e * root)
    a_vu = -np.pi * (pi2 * rest * (1 + 2 * e2) + 32 * e2 * (1 + e2)) / (e * root)
    a_vv = 4 * (pi2 * (1 + 2 * e2) + 32 * e2 * (1 + e2) / rest)
    b_uu = 2 * np.pi * root * (pi2 * (1 + 2 * e2) - 16 * e2) / e
    b_uv = -8 * (pi2 * (1 + 2 * e2) - 16 * e2)
    b_vv = 2 * np.pi * (pi2 * rest**2 + 48 * e2) / (e * root)
    h0 = (pi2 * rest + 16 * e2) ** -1.5
    return h0 * np.array([[a_vv, -a_vu], [-a_uv, a_uu]]), h0 * np.array([[b_vv, -b_uv], [-b_uv, b_uu]])


@Bearing(
    source="Ocvirk 1952, NACA TN 2808; Friswell, Penny, Garvey and Lees 2010, Dynamics of Rotating Machines, 5.5.1",
    example={
        "load_N": 525.0,
        "diameter_m": 0.1,
        "length_m": 0.03,
        "radial_clearance_m": 1e-4,
        "viscosity_Pa_s": 0.1,
    },
    checked="Friswell et al. 2010, Example 5.5.1; numerical Reynolds film; Lund's threshold",
    defaults={"load_N": weight_carried},
    changeable=("radial_clearance_m", "viscosity_Pa_s"),
    load=("load_N", "load_angle_rad"),
    running=running,
    positive_damping=True,
)
def short_journal(
    structure,
    diameter_m: Positive,
    length_m: Positive,
    radial_clearance_m: Positive,
    viscosity_Pa_s: Positive,
    load_N: Positive | None = None,
    load_angle_rad: float = 0.0,
    node: int | None = None,
):
    """Oil film of a short plain journal bearing (Ocvirk, half film) about its running position, times bearing_scale.

    load_N is the static load on this bearing, at load_angle_rad from gravity; by default what it carries of the weight
    if all bearings are rigid, which is exact for two. Effects that are constant forces change its size and direction.
    Displacements are measured from the equilibrium position of the journal at each speed. This offset, of 0 to 1 radial
    clearances, is part neither of the displacements nor of the static deflection, which follows from the stiffness; the
    bending of the shaft is correct if the bearings share the load as stated.
    """
    if length_m > 1.001 * LONGEST * diameter_m:  # a derivative by the length steps over the limit
        raise RotorstudyError(
            f"short_journal: length_m / diameter_m = {length_m / diameter_m:g}; the short-bearing theory is limited to "
            f"{LONGEST:g}, where its stiffness is up to 1.1 times too large, and 1.3 times at 1; plain_journal takes "
            "the same keys for lengths of up to two diameters"
        )
    node = structure.default_node() if node is None else node
    film = diameter_m * length_m**3 * viscosity_Pa_s / (8 * load_N * radial_clearance_m**2)  # Ocvirk number / speed

    def at(speed):
        eccentricity = eccentricity_ratio(film * speed, f"at {speed:g} rad/s the journal at node {node}")
        stiffness, damping = coefficients(eccentricity)
        return load_N / radial_clearance_m * stiffness, load_N / (radial_clearance_m * speed) * damping

    entries = film_entries(structure.unit(node), at, load_angle_rad)
    return [Parameter("bearing_scale", "1", entries, typical=1.0, default=1.0)]
