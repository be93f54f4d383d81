"""Transverse cracks: a kink of the shaft in an element, by any two flexibilities and any law of closing.

Axes of a crack: `across` points from the centre to the middle of the cracked side, `along` is 90 degrees on in the
sense of the spin (parallel to the crack front). A moment of slopes m = M_across + j M_along (work-conjugate to a kink
of the slopes dx/dz + j dy/dz) opens the crack if M_across is negative: the convex side, where tension is, is opposite
to the curvature's centre.

Straight fronts by fracture mechanics: A. D. Dimarogonas and S. A. Paipetis, Analytical Methods in Rotor Dynamics
(1983), chapter 5; C. A. Papadopoulos and A. D. Dimarogonas, J. Sound Vib. 117 (1987) 81-93; stress-intensity factors of
an edge-cracked strip: H. Tada, P. C. Paris, G. R. Irwin, The Stress Analysis of Cracks Handbook (1973).

Fronts that are arcs of a circle by three-dimensional elasticity with contact: `elastic_crack.csv` is computed by finite
elements (benchmarks/elasticity/crack_compliance.py --fronts arc), compliances for Young's modulus and radius 1, and the
share of the energy of the open crack by the direction of the moment; the kink is the gradient of that energy.

Other laws of closing. A real crack has a curved front, faces that touch unevenly, and softens a length of the shaft.
Whole opening by the curvature or by (1 + cos) / 2: I. W. Mayes, W. G. R. Davies, J. Vib. Acoust. 106 (1984) 139-145;
sign of the deflection in rotating axes: R. Gasch, J. Sound Vib. 160 (1993) 313-332; smooth contact of rough faces: A.
S. Bouboulas, N. K. Anifantis, Arch. Appl. Mech. 83 (2013) 207-223; residual stress that shifts the closing: N.
Bachschmid, P. Pennacchi, E. Tanzi, Cracked Rotors (2010).
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from rotorstudy.blind.machines.beam import both_planes, by_plane, plane_matrices
from rotorstudy.blind.machines.machine import LocalForce, linear_law
from rotorstudy.blind.machines.stepping import NoSteadyState


def strip_factors(ratio):
    """F of K = F stress sqrt(pi depth), of an edge crack in a strip in bending, and in tension; depth/width (Tada)."""
    angle = np.pi * ratio / 2
    front, left = np.sqrt(np.tan(angle) / angle), 1 - np.sin(angle)
    return front * [0.923 + 0.199 * left**4, 0.752 + 2.02 * ratio + 0.37 * left**3] / np.cos(angle)


def crack_face(depth_ratio):
    """Quadrature over the crack's face in radii: weights, and K of each moment; 32 int K_i K_j dA is the compliance."""
    half = np.sqrt(1 - (1 - depth_ratio) ** 2)
    points, weights = np.polynomial.legendre.leggauss(120)
    turn = np.pi / 2 * points
    x, dx = half * np.sin(turn), half * np.cos(turn) * np.pi / 2 * weights
    arch = np.sqrt(1 - x**2)
    deepest = depth_ratio - 1 + arch
    depth = deepest[:, None] * (points + 1) / 2
    area = dx[:, None] * deepest[:, None] * weights / 2
    ratio = np.maximum(depth / (2 * arch[:, None]), 1e-12)
    bending, tension = strip_factors(ratio)
    return area, arch[:, None] * np.sqrt(depth) * bending, x[:, None] * np.sqrt(depth) * tension


def dimensionless_compliance(depth_ratio):
    """Open crack: pi E R³/(1 - nu²) times the compliance for the moment that opens it and the one across.

    The energy released over the face is int (1 - nu²)/E K² dA with K = 4 M/(pi R⁴) arch F sqrt(pi depth), so that the
    compliance d²U/dM² is 32 (1 - nu²)/(pi E R³) int arch² depth F² dA in radii.
    """
    area, opening, sideways = crack_face(depth_ratio)
    return 32 * np.sum(area * opening**2), 32 * np.sum(area * sideways**2)


def to_crack(angle):
    """Moments in x and y to (opening, sideways) of a crack at an angle; opening is against `across`."""
    cos, sin = np.cos(angle), np.sin(angle)
    return -np.array([[cos, sin], [-sin, cos]])


BY_MOMENT = ("energy", "whole")
BY_ANGLE = ("flexibility_by_angle", "stiffness_by_angle")


@dataclass(frozen=True)
class Form:
    """How a crack yields and closes.

    compliance : (2, 2) open, across and along the front, rad/(N m); symmetric
    law        : `energy`: the open share of its energy follows the direction of the instantaneous moment. `whole`: the
                 share of its kink does (not conservative). `flexibility_by_angle`, `stiffness_by_angle`: the share of
                 its flexibility, or of the stiffness that it takes away, follows the angle to the side that the weight
                 stretches. `open`.
    share      : open share (0 to 1) by the angle (rad) between the front's middle and the direction that opens it most
    closing    : moment that just opens it, N m; of laws by moment
    """

    compliance: np.ndarray
    law: str
    share: object
    closing: float = 0.0


def smooth_contact(width, lag=0.0):
    """Open share (1 + tanh(cos(angle - lag) / width)) / 2: a jump for width 0."""
    return lambda angle: 0.5 * (1 + np.tanh(np.cos(angle - lag) / width))


def cosine(power=1.0, lag=0.0):
    """Open share ((1 + cos(angle - lag)) / 2)^power."""
    return lambda angle: (0.5 * (1 + np.cos(angle - lag))) ** power


def trapezoid(half_open, ramp, lag=0.0):
    """Open share 1 within `half_open` rad, then falling linearly over `ramp` rad to 0."""
    return lambda angle: np.clip((half_open + ramp - np.abs(np.angle(np.exp(1j * (angle - lag))))) / ramp, 0.0, 1.0)


def tabulated(form, angle, stiffness):
    """Law of a form that depends on the moment.

    The moment is m = y - k kink, k the element's own `stiffness` against a kink and y what it were without one; the
    kink is the crack's compliance of m. Laws of degree one in m are solved beforehand: the direction of y alone
    decides, and a table by that direction holds the solution. A residual stress that closes the crack shifts both m
    and y by its moment.
    """
    count = 1440  # directions
    turn = 2 * np.pi * np.arange(count) / count
    moments = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    share = np.ones(count) if form.law == "open" else form.share(turn)
    kinks = share[:, None] * (moments @ form.compliance)
    if form.law == "energy":  # e = share m.C m / 2 of degree two in m: its gradient is 2 e along m and e' across
        energy = np.sum(moments * kinks, axis=1) / 2
        lines = np.fft.rfft(energy)
        slope = np.fft.irfft(1j * np.arange(len(lines)) * lines, count)
        around = np.stack([-moments[:, 1], moments[:, 0]], axis=1)
        kinks = 2 * energy[:, None] * moments + slope[:, None] * around
    solved = moments + stiffness * kinks
    direction = np.unwrap(np.arctan2(solved[:, 1], solved[:, 0]))
    if np.any(np.diff(direction) <= 0):
        raise NoSteadyState("the crack's law has no unique solution")
    ratio = kinks / np.hypot(solved[:, 0], solved[:, 1])[:, None]
    grid = 2 * np.pi * np.arange(count + 1) / count
    table = np.stack([np.interp(grid, direction, ratio[:, i], period=2 * np.pi) for i in (0, 1)], axis=1)
    slopes, closing = np.diff(table, axis=0) * count / (2 * np.pi), np.array([form.closing, 0.0])

    def law(turn, y, v, speed):
        axes = to_crack(turn + angle)
        y = y @ axes.T - closing
        size = np.maximum(np.hypot(y[:, 0], y[:, 1]), 1e-300)
        unit = y / size[:, None]
        direction = np.mod(np.arctan2(y[:, 1], y[:, 0]), 2 * np.pi)
        number = np.minimum((direction / grid[1]).astype(int), len(slopes) - 1)
        slope = slopes[number]
        value = table[number] + slope * (direction - grid[number])[:, None]
        around = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
        by_y = value[:, :, None] * unit[:, None] + slope[:, :, None] * around[:, None]
        return size[:, None] * value @ axes, axes.T @ by_y @ axes, np.zeros_like(by_y)

    return law


def by_angle(form, angle, stiffness, stretched):
    """Law of a form that depends on the shaft's angle alone; `stretched`: angle of the side in tension at rest."""
    softer, one = stiffness * form.compliance, np.eye(2)

    def yielded(turn):
        share = form.share(turn + angle - stretched)
        if form.law == "flexibility_by_angle":
            kink = np.linalg.solve(one + share * softer, share * form.compliance)
        else:
            kink = share * np.linalg.solve(one + softer, form.compliance)
        axes = to_crack(turn + angle)
        return axes.T @ kink @ axes

    return linear_law(yielded)


def pieces(machine, position, length):
    """[(selection, kink stiffness, share, own)] of a crack at a position (m); over a length (m) it bends uniformly.

    selection : (coordinates, 2) of the moments in x and y at the kink
    own       : (2,) what the weight between the nodes adds to these, N m
    """
    rotor = machine.rotor
    if not rotor.elements:
        selection, stiffness = rotor.hinge(position)
        return [(selection, stiffness, 1.0, np.zeros(2))]
    found, start = [], 0.0
    for number, part in enumerate(rotor.elements):
        low, high = np.clip(np.array([position - length / 2, position + length / 2]) - start, 0.0, part.length)
        is_there = 0 <= position - start < part.length if length == 0 else high > low
        if is_there:
            kink = np.array([0.0, 0.0, part.length - (low + high) / 2, 1.0])  # by what it moves the ends of its element
            (bending, _, _, load), selection = plane_matrices(part), np.zeros((machine.size, 2))
            selection[4 * number : 4 * number + 8] = both_planes(bending) @ by_plane(kink[:, None])
            share = 1.0 if length == 0 else (high - low) / length
            # deflection by a unit kink while the nodes are held, integrated over the element: the work of its weight
            behind = (part.length - low) ** 2 / 2 - (part.length - low) * (high - low) / 2 + (high - low) ** 2 / 6
            weight = part.density * part.area * machine.gravity
            own = np.array([weight * (behind - load @ kink), 0.0])
            found.append((selection, kink @ bending @ kink, share, own))
        start += part.length
    return found


def add_form(machine, position, form, angle, length=0.0):
    """Add a Form at a position (m), `angle` (rad) of the middle of its front, over a length (m) or in one section."""
    sag = machine.sag() if form.law in BY_ANGLE else None
    found = pieces(machine, position, length)
    whole = sum(share for _, _, share, _ in found)  # less than 1 where the length ends beyond the shaft
    for selection, stiffness, share, own in found:
        part = Form(form.compliance * share / whole, form.law, form.share, form.closing)
        if form.law in BY_ANGLE:
            static = -(selection.T @ sag + own)
            law = by_angle(part, angle, stiffness, np.arctan2(static[1], static[0]))
        else:
            law = tabulated(part, angle, stiffness)
        machine.local.append(LocalForce(selection, _beside(own, law), "crack"))


def _beside(own, law):
    """The law with a constant moment beside that by the nodes."""
    return lambda turn, y, v, speed: law(turn, y + own, v, speed)


def static_moment(machine, position):
    """Bending moment (N m) at a position (m) at rest."""
    selection, *_, own = pieces(machine, position, 0.0)[0]
    return float(np.linalg.norm(selection.T @ machine.sag() + own))


CURVATURES = (0.0, 0.8)


@lru_cache(maxsize=1)
def _table():
    """Splines over the depth and, of their values, over the curvature: logarithms of 6 compliances, then shares."""
    rows = np.loadtxt(Path(__file__).with_name("elastic_crack.csv"), delimiter=",", skiprows=4)
    depth, curvature = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))].reshape(len(depth), len(curvature), -1)
    values = np.concatenate([np.log(rows[..., 2:8]), rows[..., 8:]], axis=-1)
    return make_interp_spline(np.log(depth), values), curvature


def arc_crack(depth_ratio, curvature, poissons_ratio=0.3):
    """Compliances (opening, sideways) for modulus and radius 1, and shares of energy over 0 to pi.

    depth_ratio : over the diameter, 0.05 to 0.5;  curvature : depth over the radius of the arc, 0 (straight) to 0.8
    """
    over_depth, known = _table()
    row = make_interp_spline(known, over_depth(np.log(depth_ratio)), k=2)(curvature)
    low, high = row[2:4] / -0.05, row[4:6] / 0.03
    slope = low if poissons_ratio < 0.3 else high
    return np.exp(row[:2] + slope * (poissons_ratio - 0.3)), row[6:]


def arc_form(part, depth_ratio, curvature, kind="gradual", closing=0.0):
    """The crack in an element as a Form; `closing` is the moment that just opens it, N m.

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
