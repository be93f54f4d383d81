"""The oil film of a short plain journal bearing: its force by integration of the pressure, and its linear coefficients.

The pressure summed over the length is -L^3/(12 h^3) (6 mu W dh/dphi + 12 mu dh/dt), what is negative cut off. Source:
F. W. Ocvirk, NACA TN 2808 (1952); D. Childs, Turbomachinery Rotordynamics (1993), section 3.2.
"""

from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.machines.contacts import by_differences
from rotorstudy.blind.machines.machine import Bearing, LocalForce
from rotorstudy.blind.machines.stepping import NoSteadyState

GAUSS = np.polynomial.legendre.leggauss(200)
FEWER = np.polynomial.legendre.leggauss(24)  # while integrating in time: 1e-4 of the force up to 0.85 of the clearance
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


def force(film, speed, position, velocity, gauss=GAUSS):
    """Force (..., 2) on the journal at positions (..., 2), m from the middle of the bearing, and velocities (m/s)."""
    (x, y), (vx, vy), mu = np.moveaxis(position, -1, 0), np.moveaxis(velocity, -1, 0), film.viscosity
    push = np.stack([6 * mu * speed * y + 12 * mu * vx, -6 * mu * speed * x + 12 * mu * vy], axis=-1)  # of cos and sin
    angle = np.arctan2(push[..., 1], push[..., 0])[..., None] + np.pi / 2 * gauss[0]  # where the pressure is positive
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    gap = film.clearance - np.sum(direction * np.asarray(position)[..., None, :], axis=-1)
    pressure = film.length**3 / (12 * gap**3) * np.sum(direction * push[..., None, :], axis=-1)
    return -np.pi / 4 * film.diameter * np.sum(direction * (gauss[1] * pressure)[..., None], axis=-2)


def running_position(film, speed):
    """Where the journal runs under its load, m."""
    from scipy.optimize import root  # which takes long

    for share in (0.3, 0.6, 0.8, 0.9):
        start = share * np.array([0.6, 0.8])
        found = root(lambda at: force(film, speed, film.clearance * at, (0, 0)) / film.load + [1, 0], start, tol=1e-13)
        if found.success and np.hypot(*found.x) < 1:
            return film.clearance * found.x
    raise NoSteadyState(f"no running position at {speed} rad/s")


def bearing(film, speed):
    """The linear Bearing that the film is for small motion about its running position."""
    at, step = running_position(film, speed), STEP * film.clearance

    def slopes(f, step):
        ways = step * np.eye(2)
        return -np.transpose([(8 * (f(d) - f(-d)) - (f(2 * d) - f(-2 * d))) / (12 * step) for d in ways])

    stiffness = slopes(lambda moved: force(film, speed, at + moved, (0, 0)), step)
    damping = slopes(lambda moving: force(film, speed, at, moving), step * speed)
    return Bearing(film.node, stiffness, damping)


def about_running(film, linear, speeds):
    """Law of a film about where it runs at each of the speeds, less what the Bearing `linear` and the load do."""
    running = {speed: running_position(film, speed) for speed in np.atleast_1d(speeds)}

    def law(angle, y, v, speed):
        moved = np.array([running[one] for one in np.atleast_1d(speed)]) + y
        far = np.linalg.norm(moved, axis=1, keepdims=True) / film.clearance
        moved = moved * np.minimum(1.0, 0.97 / far)  # within an iteration only; NoSteadyState if it stays there
        return force(film, speed, moved, v, FEWER) + y @ linear.stiffness.T + v @ linear.damping.T

    return by_differences(law, film.clearance, film.clearance * float(np.mean(speeds)))


def add_film(machine, film, linear, speeds):
    """The force of a film less weight and that of its bearing `linear`; displacements count from where it runs."""
    machine.local.append(LocalForce(machine.plane(film.node), about_running(film, linear, speeds), "film"))
