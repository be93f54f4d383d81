from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from rotorstudy.plugins import Bearing, Parameter, Positive, RotorstudyError, film_entries, weight_carried

# of the table, over which it holds Chebyshev coefficients; benchmarks/journal_films.py computes it
ECCENTRICITIES, LENGTHS = (0.0, 0.97), (0.1, 2.0)
LEAST = 1e-6  # eccentricity ratio


def sommerfeld_number(speed, diameter_m, length_m, radial_clearance_m, viscosity_Pa_s, load_N):
    """At a speed, rad/s."""
    squeezed = viscosity_Pa_s * speed / (2 * np.pi) * length_m * diameter_m / load_N
    return squeezed * (diameter_m / 2 / radial_clearance_m) ** 2


def position(speed, *, diameter_m, length_m, grooves, load_angle_rad, **film):
    """Eccentricity ratio and attitude angle, rad, at which the journal runs at a speed, rad/s."""
    ratio = length_m / diameter_m
    rows = coefficients_over_eccentricity(ratio, grooves)
    e = eccentricity_ratio(sommerfeld_number(speed, diameter_m, length_m, **film), ratio, rows)
    return e, running(e, ratio, rows)[1] + load_angle_rad


@lru_cache
def table(grooves):
    """Chebyshev coefficients (number, eccentricity ratio, logarithm of length over diameter)."""
    with np.load(Path(__file__).with_suffix(".npz")) as data:
        return data[grooves].astype(float)


def coefficients_over_eccentricity(length_over_diameter, grooves):
    """Chebyshev coefficients (eccentricity ratio, number) at a length.

    Numbers are the Sommerfeld number over that of a short bearing (its logarithm), attitude angle, and, times
    e (1 - e^2), the coefficients xx, xy, yx, yy of K c / load and xx, xy, yy of C c w / load, x along the load.
    """
    low, high = np.log(LENGTHS)
    along = (2 * np.log(length_over_diameter) - low - high) / (high - low)
    return np.polynomial.chebyshev.chebval(along, np.moveaxis(table(grooves), -1, 0)).T


def running(e, length_over_diameter, rows):
    """Sommerfeld number mu N L D (R / c)^2 / load, attitude angle (rad), K c / load and C c w / load (2, 2) each."""
    low, high = ECCENTRICITIES
    number, attitude, *found = np.polynomial.chebyshev.chebval((2 * e - low - high) / (high - low), rows)
    k, b = np.reshape(found[:4], (2, 2)), np.reshape([found[i] for i in (4, 5, 5, 6)], (2, 2))
    short = (1 - e * e) ** 2 / (np.pi * e * np.sqrt(16 * e * e + np.pi**2 * (1 - e * e)) * length_over_diameter**2)
    return short * np.exp(number), attitude, k / (e * (1 - e * e)), b / (e * (1 - e * e))


def eccentricity_ratio(sommerfeld, length_over_diameter, rows, where="the journal"):
    """Eccentricity over clearance at a Sommerfeld number, which falls with it from infinity."""
    from scipy.optimize import brentq

    def excess(e):
        return np.log(running(e, length_over_diameter, rows)[0] / sommerfeld)

    low, high = LEAST, ECCENTRICITIES[1]
    if not excess(low) > 0 > excess(high):
        side = f"below {low:g}" if excess(low) <= 0 else f"above {high:g}"
        raise RotorstudyError(
            f"{where} has an eccentricity ratio {side} (Sommerfeld number {sommerfeld:.3g}), for which no film was "
            "computed: check load_N, viscosity_Pa_s and the dimensions, or leave that speed out"
        )
    return brentq(excess, low, high, xtol=1e-15, rtol=1e-14)


@Bearing(
    source="Reynolds 1886; Lund and Thomsen 1978, A calculation method and data for the dynamic coefficients of "
    "oil-lubricated journal bearings; table by benchmarks/journal_films.py",
    example={
        "load_N": 2000.0,
        "diameter_m": 0.1,
        "length_m": 0.08,
        "radial_clearance_m": 1e-4,
        "viscosity_Pa_s": 0.03,
    },
    checked="Raimondi and Boyd 1958; Lund and Thomsen 1978; short_journal at small lengths; a Reynolds film",
    defaults={"load_N": weight_carried},
    changeable=("radial_clearance_m", "viscosity_Pa_s"),
    load=("load_N", "load_angle_rad"),
    running=position,
    positive_damping=True,
)
def plain_journal(
    structure,
    diameter_m: Positive,
    length_m: Positive,
    radial_clearance_m: Positive,
    viscosity_Pa_s: Positive,
    load_N: Positive | None = None,
    load_angle_rad: float = 0.0,
    grooves: Literal["none", "two_axial"] = "none",
    node: int | None = None,
):
    """Oil film of a plain journal bearing of a length of 0.1 to 2 diameters about its running position.

    Finite-length Reynolds equation, ruptured film (Reynolds' condition), times bearing_scale. grooves: none, oil fills
    the film wherever it converges; two_axial, the pressure is zero in two grooves of 20 degrees at right angles to the
    load. To 1 % of the largest coefficient, but stiffness with grooves beyond an eccentricity ratio of 0.9 to 4 %.
    load_N and load_angle_rad as for short_journal; displacements are measured from the equilibrium position as there.
    """
    ratio = length_m / diameter_m
    if not 0.999 * LENGTHS[0] <= ratio <= 1.001 * LENGTHS[1]:  # a derivative by the length steps over the limits
        raise RotorstudyError(
            f"plain_journal: length_m / diameter_m = {ratio:g} is outside {LENGTHS[0]:g} to {LENGTHS[1]:g}, for which "
            "the film was computed; tabulate the coefficients over speed (speed_tabulated)"
        )
    node = structure.default_node() if node is None else node
    film = sommerfeld_number(1.0, diameter_m, length_m, radial_clearance_m, viscosity_Pa_s, load_N)
    rows = coefficients_over_eccentricity(ratio, grooves)

    def at(speed):
        where = f"at {speed:g} rad/s the journal at node {node}"
        _, _, stiffness, damping = running(eccentricity_ratio(film * speed, ratio, rows, where), ratio, rows)
        return load_N / radial_clearance_m * stiffness, load_N / (radial_clearance_m * speed) * damping

    entries = film_entries(structure.unit(node), at, load_angle_rad)
    return [Parameter("bearing_scale", "1", entries, typical=1.0, default=1.0)]
