"""The oil film of a short plain journal bearing: its force by integration of the pressure, and its linear coefficients.

The pressure summed over the length is -L^3/(12 h^3) (6 mu W dh/dphi + 12 mu dh/dt), what is negative cut off. Source:
F. W. Ocvirk, NACA TN 2808 (1952); D. Childs, Turbomachinery Rotordynamics (1993), section 3.2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from foreign.machine import Bearing

ANGLES, WEIGHTS = np.polynomial.legendre.leggauss(200)
STEP = 1e-4  # of the clearance (times the speed for a velocity), of central differences of fourth order


@dataclass(frozen=True)
class Film:
    """A journal in its bearing: dimensions (m), viscosity (Pa s) and the static load it carries along x (N)."""

    node: int
    diameter: float
    length: float
    clearance: float
    viscosity: float
    load: float


def force(film, speed, position, velocity):
    """Force (x, y) on the journal at a position (m) from the middle of the bearing and a velocity (m/s)."""
    (x, y), (vx, vy), mu = position, velocity, film.viscosity
    push = np.array([6 * mu * speed * y + 12 * mu * vx, -6 * mu * speed * x + 12 * mu * vy])  # of cos and sin
    angle = np.arctan2(push[1], push[0]) + np.pi / 2 * ANGLES  # where the pressure is positive
    direction = np.array([np.cos(angle), np.sin(angle)])
    gap = film.clearance - np.array([x, y]) @ direction
    pressure = film.length**3 / (12 * gap**3) * (push @ direction)
    return -np.pi / 4 * film.diameter * direction @ (WEIGHTS * pressure)


def running_position(film, speed):
    """Where the journal runs under its load, m."""
    for share in (0.3, 0.6, 0.8, 0.9):
        start = share * np.array([0.6, 0.8])
        found = root(lambda at: force(film, speed, film.clearance * at, (0, 0)) / film.load + [1, 0], start, tol=1e-13)
        if found.success and np.hypot(*found.x) < 1:
            return film.clearance * found.x
    raise ValueError(f"no running position at {speed} rad/s")


def bearing(film, speed):
    """The linear Bearing that the film is for small motion about its running position."""
    at, step = running_position(film, speed), STEP * film.clearance

    def slopes(function, step):
        columns = [
            (8 * (function(d) - function(-d)) - (function(2 * d) - function(-2 * d))) / (12 * step)
            for d in step * np.eye(2)
        ]
        return -np.transpose(columns)

    stiffness = slopes(lambda moved: force(film, speed, at + moved, (0, 0)), step)
    damping = slopes(lambda moving: force(film, speed, at, moving), step * speed)
    return Bearing(film.node, stiffness, damping)
