"""A transverse crack with a straight front: compliance from fracture mechanics, and the kink of a cracked element.

Sources: A. D. Dimarogonas and S. A. Paipetis, Analytical Methods in Rotor Dynamics (1983), chapter 5; C. A.
Papadopoulos and A. D. Dimarogonas, "Coupled longitudinal and bending vibrations of a rotating shaft with an open
crack", J. Sound Vib. 117 (1987) 81-93; stress-intensity factors of an edge-cracked strip: H. Tada, P. C. Paris, G. R.
Irwin, The Stress Analysis of Cracks Handbook (1973).

Crack axes: `across` points from the centre to the middle of the cracked side, `along` is 90 degrees on in the sense of
the spin (parallel to the crack front). A moment of slopes m = M_across + j M_along (work-conjugate to a kink of the
slopes dx/dz + j dy/dz) opens the crack if M_across is negative: the convex side, where tension is, is opposite to the
curvature's centre.
"""

import numpy as np

from rotorstudy.blind.machines.beam import both_planes, plane_matrices


def strip_tension(ratio):
    """F of K = F stress sqrt(pi depth) for an edge crack in a strip in tension; ratio = depth/width (Tada)."""
    angle = np.pi * ratio / 2
    front = np.sqrt(np.tan(angle) / angle)
    return front * (0.752 + 2.02 * ratio + 0.37 * (1 - np.sin(angle)) ** 3) / np.cos(angle)


def strip_bending(ratio):
    """F of K = F stress sqrt(pi depth) for an edge crack in a strip in bending (Tada)."""
    angle = np.pi * ratio / 2
    front = np.sqrt(np.tan(angle) / angle)
    return front * (0.923 + 0.199 * (1 - np.sin(angle)) ** 4) / np.cos(angle)


def crack_face(depth_ratio, count=120):
    """Quadrature over the crack's face in radii: weights, and K of each moment; 32 int K_i K_j dA is the compliance."""
    half = np.sqrt(1 - (1 - depth_ratio) ** 2)
    points, weights = np.polynomial.legendre.leggauss(count)
    turn = np.pi / 2 * points
    x, dx = half * np.sin(turn), half * np.cos(turn) * np.pi / 2 * weights
    arch = np.sqrt(1 - x**2)
    deepest = depth_ratio - 1 + arch
    depth = deepest[:, None] * (points + 1) / 2
    area = dx[:, None] * deepest[:, None] * weights / 2
    ratio = np.maximum(depth / (2 * arch[:, None]), 1e-12)
    opening = arch[:, None] * np.sqrt(depth) * strip_bending(ratio)
    sideways = x[:, None] * np.sqrt(depth) * strip_tension(ratio)
    return area, opening, sideways


def dimensionless_compliance(depth_ratio):
    """Open crack: pi E R³/(1 - nu²) times the compliance for the moment that opens it and the one across.

    The energy released over the face is int (1 - nu²)/E K² dA with K = 4 M/(pi R⁴) arch F sqrt(pi depth), so that the
    compliance d²U/dM² is 32 (1 - nu²)/(pi E R³) int arch² depth F² dA in radii.
    """
    area, opening, sideways = crack_face(depth_ratio)
    return 32 * np.sum(area * opening**2), 32 * np.sum(area * sideways**2)


class TabulatedHinge:
    """Law of the kink in an element: moment if there were no kink, to kink.

    The moment is m = y - k kink, k the element's own stiffness against a kink; the kink is the crack's compliance of m.
    Laws of degree one in m are solved beforehand: the direction of y alone decides, and a table by that direction holds
    the solution. A residual stress that closes the crack shifts both m and y by its moment.

    moments, kinks : (count, 2) unit moments (opening, sideways) around the circle, in N m, and their kinks, in rad
    angle          : of the middle of the cracked side from the shaft's reference line, rad
    kink_stiffness : k, N m/rad;  closing : moment that just opens the crack, N m
    """

    def __init__(self, moments, kinks, angle, kink_stiffness, closing=0.0, count=1440):
        self.angle, self.closing = angle, np.array([closing, 0.0])
        y = moments + kink_stiffness * kinks
        direction = np.unwrap(np.arctan2(y[:, 1], y[:, 0]))
        if np.any(np.diff(direction) <= 0):
            raise ValueError("the crack's law has no unique solution")
        ratio = kinks / np.hypot(y[:, 0], y[:, 1])[:, None]
        self.grid = 2 * np.pi * np.arange(count + 1) / count
        self.table = np.stack([np.interp(self.grid, direction, ratio[:, i], period=2 * np.pi) for i in (0, 1)], axis=1)
        self.slope = np.diff(self.table, axis=0) * count / (2 * np.pi)

    def kink(self, y):
        """Kink (opening, sideways) for y (speeds, 2) in the same axes, and its derivative (speeds, 2, 2)."""
        size = np.maximum(np.hypot(y[:, 0], y[:, 1]), 1e-300)
        unit = y / size[:, None]
        direction = np.mod(np.arctan2(y[:, 1], y[:, 0]), 2 * np.pi)
        number = np.minimum((direction / self.grid[1]).astype(int), len(self.slope) - 1)
        slope = self.slope[number]
        value = self.table[number] + slope * (direction - self.grid[number])[:, None]
        around = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
        return size[:, None] * value, value[:, :, None] * unit[:, None] + slope[:, :, None] * around[:, None]

    def __call__(self, angle, y, v, speed):
        """Local law: y are the moments of the slopes in x and y (N m), the result is the kink of the slopes (rad)."""
        cos, sin = np.cos(angle + self.angle), np.sin(angle + self.angle)
        to_crack = -np.array([[cos, sin], [-sin, cos]])  # opening is against `across`
        kink, slope = self.kink(y @ to_crack.T - self.closing)
        return kink @ to_crack, to_crack.T @ slope @ to_crack, np.zeros_like(slope)


def hinge_selection(size, part, element, kink):
    """Selection (size, 2) of the moments in x and y at a kink, by what it moves the ends of its element (4,)."""
    shape = np.zeros((8, 2))
    shape[[0, 3, 4, 7], 0] = kink
    shape[[1, 2, 5, 6], 1] = kink * [1, -1, 1, -1]
    selection = np.zeros((size, 2))
    selection[4 * element : 4 * element + 8] = both_planes(plane_matrices(part)[0]) @ shape
    return selection
