"""Shaft elements: a Timoshenko beam with gyroscopic effects, from its static shape functions.

Source: H. D. Nelson, "A finite rotating shaft element using Timoshenko beam theory", J. Mech. Des. 102 (1980) 793-803;
shape functions of the static beam as in J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968). All matrices
are integrated numerically from the shape functions (Gauss, exact for these polynomials), none is copied.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np


@dataclass(frozen=True)
class Element:
    """A uniform piece of round shaft: lengths in m, modulus in Pa, density in kg/m³."""

    length: float
    outer_diameter: float
    youngs_modulus: float
    density: float
    poissons_ratio: float = 0.3
    theory: str = "timoshenko"  # `timoshenko` (with shear) or `euler_bernoulli`
    internal_damping: float = 0.0  # proportional to stiffness, rotating, s

    @property
    def area(self):
        """Cross-section, m²."""
        return np.pi / 4 * self.outer_diameter**2

    @property
    def second_moment(self):
        """Second moment of area about a diameter, m⁴."""
        return np.pi / 64 * self.outer_diameter**4

    @property
    def bending_stiffness(self):
        """E I, N m²."""
        return self.youngs_modulus * self.second_moment

    @property
    def mass(self):
        """In kg."""
        return self.density * self.area * self.length

    @property
    def shear_parameter(self):
        """12 E I / (kappa G A L²), zero without shear; kappa of a round section after Cowper (1966)."""
        if self.theory == "euler_bernoulli":
            return 0.0
        nu = self.poissons_ratio
        kappa = 6 * (1 + nu) / (7 + 6 * nu)
        shear_modulus = self.youngs_modulus / (2 * (1 + nu))
        return 12 * self.bending_stiffness / (kappa * shear_modulus * self.area * self.length**2)


def shapes(element, s):
    """Deflection w, its slope w', rotation of the section p and p' at s = 0...1, each (len(s), 4) of w1, p1, w2, p2."""
    s, length, phi = np.atleast_1d(s), element.length, element.shear_parameter
    w = [
        [1 + phi, -phi, -3, 2],  # polynomials in s, lowest power first
        [0, length * (1 + phi / 2), -length * (2 + phi / 2), length],
        [0, phi, 3, -2],
        [0, -length * phi / 2, length * (phi / 2 - 1), length],
    ]
    p = [[0, -6 / length, 6 / length], [1 + phi, -4 - phi, 3], [0, 6 / length, -6 / length], [0, -2 + phi, 3]]

    def values(rows, derivative):
        rows = [np.polynomial.Polynomial(row) for row in rows]
        rows = [row.deriv() / length if derivative else row for row in rows]
        return np.stack([row(s) for row in rows], axis=-1) / (1 + phi)

    return values(w, False), values(w, True), values(p, False), values(p, True)


@lru_cache(maxsize=1024)
def plane_matrices(element):
    """Stiffness, mass of translation, mass of rotation (4x4) and load by a unit of line force (4) in one plane."""
    points, weights = np.polynomial.legendre.leggauss(6)
    weights = weights * element.length / 2
    w, w_slope, p, p_slope = shapes(element, (points + 1) / 2)

    def integral(a, b):
        return np.einsum("s,si,sj->ij", weights, a, b)

    stiffness = element.bending_stiffness * integral(p_slope, p_slope)
    if element.shear_parameter:
        shear_stiffness = 12 * element.bending_stiffness / (element.shear_parameter * element.length**2)
        stiffness = stiffness + shear_stiffness * integral(w_slope - p, w_slope - p)
    translation = element.density * element.area * integral(w, w)
    rotation = element.density * element.second_moment * integral(p, p)
    matrices = stiffness, translation, rotation, weights @ w
    for matrix in matrices:
        matrix.setflags(write=False)
    return matrices


def both_planes(plane):
    """Matrix of x1, y1, a1, b1, x2, ... of the same matrix of deflection and slope (w1, p1, w2, ...) in both planes."""
    along_x, along_y = np.hsplit(by_plane(np.eye(len(plane))), 2)
    return along_x @ plane @ along_x.T + along_y @ plane @ along_y.T


def by_plane(columns):
    """Columns (n, k) of deflections and slopes (w1, p1, w2, ...) in x1, y1, a1, b1, x2, ...: along x, then along y."""
    columns = np.asarray(columns)
    count = columns.shape[1]
    pairs, full = columns.reshape(-1, 2, count), np.zeros((len(columns) // 2, 4, 2 * count), columns.dtype)
    full[:, [0, 3], :count], full[:, [1, 2], count:] = pairs, pairs * [[1.0], [-1.0]]  # dx/dz = b, dy/dz = -a
    return full.reshape(2 * len(columns), 2 * count)


def gyroscopic_planes(plane):
    """Gyroscopic matrix 8x8 for spin 1 rad/s: +G on the x rows by y velocities, -G on the y rows by x velocities."""
    along_x, along_y = np.hsplit(by_plane(np.eye(len(plane))), 2)
    return along_x @ plane @ along_y.T - along_y @ plane @ along_x.T
