"""The table of plugins/bearings/plain_journal.py, films of finite length: python benchmarks/journal_films.py

Reynolds' equation for the half length of a laminar, isoviscous film, by finite differences; where the film would be in
tension it ruptures, p = 0 and grad p = 0 at the boundary (Reynolds' condition), solved as a linear complementarity
problem by its active set. Stiffness is the exact derivative of the discrete equations, damping a difference of forces:
squeezing moves the rupture boundary past nodes, which a derivative of the discrete equations leaves out. Coordinates: x
along the load, y a right angle ahead in the sense of rotation; lengths over the clearance, time times the speed,
pressure over 6 viscosity speed (R / c)^2.

The table holds Chebyshev coefficients over the eccentricity ratio and the logarithm of length over diameter; both
grids are Chebyshev nodes. Each value is extrapolated from both meshes but for damping, of which the first is within
0.5 % of the second.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import diags, eye, kron
from scipy.sparse.linalg import splu

ANGLES, NEAR = (0.0, 1.6), 0.02  # rad, between which the attitude lies, and how far those of two meshes differ
TIES = 2  # nodes at the rupture boundary, of thousands, that may go on changing between film and rupture
GROOVE = np.radians(10)  # half the width of an axial groove
ECCENTRICITIES, LENGTHS = (0.0, 0.97), (0.1, 2.0)
NODES = (16, 8)
MESHES = ((180, 8), (360, 16))  # around, and along half the length
SWIFT = 0.015  # velocity of a difference, over the eccentricity


class Film:
    """Films of one shape: around (angle), along (half length), and their matrix at a position."""

    def __init__(self, length_over_diameter, grooves, around, along):
        self.step, self.along = 2 * np.pi / around, along
        self.angle = self.step * np.arange(around)
        away = [np.abs((self.angle - at + np.pi) % (2 * np.pi) - np.pi) for at in (np.pi / 2, 3 * np.pi / 2)]
        fixed = np.any(np.array(away) <= GROOVE + 1e-9, axis=0) if grooves else np.zeros(around, bool)
        self.free = np.repeat(~fixed, along)
        self.slope = (eye(around, format="csr")[np.roll(np.arange(around), -1)] - eye(around)) / self.step
        axial = diags([-1.0, 2.0, -1.0], [-1, 0, 1], (along, along), "lil")
        axial[0, 1] = -2.0  # symmetric about the middle
        self.axial = axial * (along / length_over_diameter) ** 2
        self.weights = np.full(along, 1.0)
        self.weights[0] = 0.5  # middle of the bearing; at the end p = 0
        self.weights *= self.step / along

    def thickness(self, at, angle):
        return 1 - at[0] * np.cos(angle) - at[1] * np.sin(angle)

    def operator(self, ahead, here):
        """-d/dtheta (a dp/dtheta) - (D/L)^2 d/dz (b dp/dz), a (around,) midway ahead and b (around,) at the nodes."""
        around = self.slope.T @ diags(ahead) @ self.slope
        return (kron(around, eye(self.along)) + kron(diags(here), self.axial)).tocsr()

    def pressed(self, at, velocity=(0.0, 0.0)):
        """Pressure, the solver at its film, and the matrix and thickness of the film at a position and velocity."""
        middle = self.angle + self.step / 2
        h, ahead = self.thickness(at, self.angle), self.thickness(at, middle)
        matrix = self.operator(ahead**3, h**3)
        slope = (ahead - np.roll(ahead, 1)) / self.step  # of h, conservative
        squeezed = velocity[0] * np.cos(self.angle) + velocity[1] * np.sin(self.angle)
        source = np.repeat(2 * squeezed - slope, self.along)
        active, p = self.free & (source > 0), np.zeros(len(source))
        for _ in range(100):
            inverse = splu(matrix[active][:, active].tocsc())
            p[:] = 0
            p[active] = inverse.solve(source[active])
            left = matrix @ p - source
            new = self.free & np.where(active, p > 0, left < 0)
            if np.sum(new != active) <= TIES:
                return p, active, inverse, h, ahead
            active = new
        raise RuntimeError("the rupture boundary was not found")

    def solved(self, at):
        """Force on the journal (2,) and its derivative by position (2, 2), over mu w (R/c)^2 R L."""
        p, active, inverse, h, ahead = self.pressed(at)
        middle, found = self.angle + self.step / 2, np.zeros((2, 2))
        for column, own in enumerate((np.cos, np.sin)):
            dh, dahead = -own(self.angle), -own(middle)
            turned = self.operator(3 * ahead**2 * dahead, 3 * h**2 * dh) @ p
            right = -np.repeat((dahead - np.roll(dahead, 1)) / self.step, self.along) - turned
            change = np.zeros(len(p))
            change[active] = inverse.solve(right[active])
            found[:, column] = self.force(change)
        return self.force(p), found

    def damping(self, at):
        """Derivative of the force by the velocity (2, 2), likewise."""
        step = SWIFT * np.hypot(*at)
        ends = [[self.force(self.pressed(at, way * step * one)[0]) for way in (1, -1)] for one in np.eye(2)]
        return np.transpose([(after - before) / (2 * step) for after, before in ends])

    def force(self, p):
        along = p.reshape(-1, self.along) @ self.weights
        return -6 * np.array([along @ np.cos(self.angle), along @ np.sin(self.angle)])


def running(film, eccentricity, attitude=None):
    """Sommerfeld number, attitude angle, K c / W and C c w / W where the load on the film is along x.

    attitude : between which two it lies; None for a film without grooves, which is alike in all directions
    """
    number, attitude, stiffness, (at, to, load) = settled(film, eccentricity, attitude)
    return number, attitude, stiffness, -to @ film.damping(at) @ to.T / load


def settled(film, eccentricity, attitude=None):
    """The same but for the damping, and its position, axes and load."""
    if attitude is None:
        at = np.array([eccentricity, 0.0])
        force, stiffness = film.solved(at)
        turn = np.arctan2(-force[1], -force[0])  # of the load, from the line of centres
        c, s = np.cos(turn), np.sin(turn)
        to, attitude, load = np.array([[c, s], [-s, c]]), -turn, np.hypot(*force)
    else:

        def across(angle):
            at = eccentricity * np.array([np.cos(angle), np.sin(angle)])
            return film.force(film.pressed(at)[0])[1]

        attitude = brentq(across, *attitude, xtol=1e-7)
        at, to = eccentricity * np.array([np.cos(attitude), np.sin(attitude)]), np.eye(2)
        force, stiffness = film.solved(at)
        load = -force[0]
    return 1 / (np.pi * load), attitude, -to @ stiffness @ to.T / load, (at, to, load)


def scaled(eccentricity, length_over_diameter, found):
    """Numbers (9,) that vary little: S over that of a short bearing (its logarithm), attitude, and coefficients."""
    number, attitude, stiffness, damping = found
    e = eccentricity
    short = (1 - e**2) ** 2 / (np.pi * e * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2)) * length_over_diameter**2)
    size = e * (1 - e**2)
    b = (damping + damping.T) / 2
    return np.array([np.log(number / short), attitude, *size * stiffness.ravel(), *size * b[[0, 0, 1], [0, 1, 1]]])


def nodes(count, low, high):
    return (low + high) / 2 + (high - low) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def extrapolated(eccentricity, length_over_diameter, grooves):
    """The numbers of `scaled` at mesh size zero, by one and the square of the mesh size; damping on the first mesh."""
    films = [Film(length_over_diameter, grooves, *mesh) for mesh in MESHES]
    first = running(films[0], eccentricity, ANGLES if grooves else None)
    attitude = (first[1] - NEAR, first[1] + NEAR) if grooves else None
    second = *settled(films[1], eccentricity, attitude)[:3], first[3]
    found = [scaled(eccentricity, length_over_diameter, one) for one in (first, second)]
    size = 1 / np.array(MESHES)[:, 0] ** 2.0
    return np.linalg.lstsq(np.column_stack([np.ones(len(size)), size]), np.array(found), rcond=None)[0][0]


def table(grooves):
    from numpy.polynomial.chebyshev import chebvander

    e, lengths = nodes(NODES[0], *ECCENTRICITIES), np.exp(nodes(NODES[1], *np.log(LENGTHS)))
    values = np.array([[extrapolated(x, length, grooves) for length in lengths] for x in e])
    inverse = [np.linalg.inv(chebvander(np.cos(np.pi * (np.arange(n) + 0.5) / n), n - 1)) for n in NODES]
    return np.einsum("ai,bj,ijk->kab", *inverse, values)


if __name__ == "__main__":
    path = Path(__file__).parents[1] / "plugins/bearings/plain_journal.npz"
    np.savez_compressed(path, **{name: np.float32(table(name == "two_axial")) for name in ("none", "two_axial")})
    print(path, path.stat().st_size, file=sys.stderr)
