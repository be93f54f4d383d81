"""Cracks of other forms: any two flexibilities with coupling, at a section or over a length, and any law of closing.

A real crack has a curved front, faces that touch unevenly, and softens a length of the shaft, so that neither its
flexibilities nor the way it closes are those of a straight front (`crack`). Here both are free. Axes as in `crack`: the
opening moment is across the front, the sideways one along it.

Sources of the laws: whole opening by the curvature or by (1 + cos) / 2: I. W. Mayes, W. G. R. Davies, "Analysis of the
response of a multi-rotor-bearing system containing a transverse crack in a rotor", J. Vib. Acoust. 106 (1984) 139-145;
sign of the deflection in rotating axes: R. Gasch, J. Sound Vib. 160 (1993) 313-332; smooth contact of rough faces: A.
S. Bouboulas, N. K. Anifantis, "Three-dimensional finite element modeling of a vibrating beam with a breathing crack",
Arch. Appl. Mech. 83 (2013) 207-223; residual stress that shifts the closing: N. Bachschmid, P. Pennacchi, E. Tanzi,
Cracked Rotors (2010).
"""

from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.machines.beam import plane_matrices
from rotorstudy.blind.machines.crack import TabulatedHinge, hinge_selection
from rotorstudy.blind.machines.machine import LocalForce

BY_MOMENT = ("energy", "whole")
BY_ANGLE = ("flexibility_by_angle", "stiffness_by_angle")
LAWS = (*BY_MOMENT, *BY_ANGLE, "open")


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


def tabulated(form, angle, stiffness, count=1440):
    """Law of a form that depends on the moment."""
    turn = 2 * np.pi * np.arange(count) / count
    moments = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    share = np.ones(count) if form.law == "open" else form.share(turn)
    yielded = share[:, None] * (moments @ form.compliance)
    if form.law == "energy":  # e = share m.C m / 2 of degree two in m: its gradient is 2 e along m and e' across
        energy = np.sum(moments * yielded, axis=1) / 2
        lines = np.fft.rfft(energy)
        slope = np.fft.irfft(1j * np.arange(len(lines)) * lines, count)
        around = np.stack([-moments[:, 1], moments[:, 0]], axis=1)
        yielded = 2 * energy[:, None] * moments + slope[:, None] * around
    return TabulatedHinge(moments, yielded, angle, stiffness, form.closing)


def by_angle(form, angle, stiffness, stretched):
    """Law of a form that depends on the shaft's angle alone; `stretched`: angle of the side in tension at rest."""
    softer, one = stiffness * form.compliance, np.eye(2)

    def law(turn, y, v, speed):
        cos, sin = np.cos(turn + angle), np.sin(turn + angle)
        to_crack = -np.array([[cos, sin], [-sin, cos]])
        share = form.share(turn + angle - stretched)
        if form.law == "flexibility_by_angle":
            kink = np.linalg.solve(one + share * softer, share * form.compliance)
        else:
            kink = share * np.linalg.solve(one + softer, form.compliance)
        matrix = to_crack.T @ kink @ to_crack
        by_y = np.broadcast_to(matrix, (len(y), 2, 2))
        return y @ matrix.T, by_y, np.zeros_like(by_y)

    return law


def pieces(machine, position, length):
    """[(selection, kink stiffness, share of the flexibility)] of a crack at a position (m) that softens a length (m).

    Over a length the additional curvature is uniform within each element; a length of zero is one section.
    """
    rotor = machine.rotor
    if not rotor.elements:
        selection, stiffness = rotor.hinge(position)
        return [(selection, stiffness, 1.0)]
    found, start = [], 0.0
    for number, part in enumerate(rotor.elements):
        low, high = np.clip(np.array([position - length / 2, position + length / 2]) - start, 0.0, part.length)
        is_there = 0 <= position - start < part.length if length == 0 else high > low
        if is_there:
            kink = np.array([0.0, 0.0, part.length - (low + high) / 2, 1.0])
            stiffness = kink @ plane_matrices(part)[0] @ kink
            share = 1.0 if length == 0 else (high - low) / length
            found.append((hinge_selection(machine.size, part, number, kink), stiffness, share))
        start += part.length
    return found


def add_form(machine, position, form, angle, length=0.0):
    """Add a crack of any form at a position (m along the shaft), `angle` (rad) of the middle of its front.

    `length` (m) of softened shaft, 0 for a section; every element of it opens by its own moment.
    """
    sag = machine.sag() if form.law in BY_ANGLE else None
    found = pieces(machine, position, length)
    whole = sum(share for _, _, share in found)  # less than 1 where the length ends beyond the shaft
    for selection, stiffness, share in found:
        part = Form(form.compliance * share / whole, form.law, form.share, form.closing)
        if form.law in BY_ANGLE:
            static = -(selection.T @ sag)
            law = by_angle(part, angle, stiffness, np.arctan2(static[1], static[0]))
        else:
            law = tabulated(part, angle, stiffness)
        machine.local.append(LocalForce(selection, law, "crack"))


def static_moment(machine, position):
    """Bending moment (N m) at a position (m) at rest."""
    return float(np.linalg.norm(pieces(machine, position, 0.0)[0][0].T @ machine.sag()))
