"""Rotors that lose stiffness along a direction that turns with them, by the independent simulator.

The crack's edge is at `angle` from the phase mark. A crack opens where bending stretches the shaft.
"""

import numpy as np
from machines import point_machine, stepped

from rotorstudy.blind.machines.beam import Element, by_plane, plane_matrices
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.machine import Bearing, Disc, LocalForce, Rotor, build

OPENINGS = {
    "switching": lambda phase: 1.0 * (np.cos(phase) > 0),
    "breathing": lambda phase: (1 + np.cos(phase)) / 2,
    "open": lambda phase: np.ones_like(phase),
    "none": lambda phase: np.zeros_like(phase),
    "power_cosine": lambda phase: np.cos(phase / 2) ** 4,
}
PART = Element(0.15, 0.02, 2.1e11, 7850.0, internal_damping=1e-4)


def softer(selection, planes, lost, angle, opening, bend=None, held=None, across=0.0):
    """The force of a crack: stiffness `lost` along the direction of its edge, a share of it across, while it is open.

    planes : (2, coordinate, part) of x and y;  opening : of OPENINGS, or None: by the bending `bend` of the motion;
    held : motion (coordinate,) in place of the one that the rotor has
    """

    def law(turn, y, v, speed):
        along = np.tensordot([np.cos(turn + angle), np.sin(turn + angle)], planes, 1)
        if opening is None:  # the convex side is opposite to the centre of curvature
            share = 1.0 * (y @ along @ bend < 0)
        else:  # before and after, so that a jump at a step counts half
            share = np.full(len(y), sum(OPENINGS[opening](turn + angle + side) for side in (-1e-9, 1e-9)) / 2)
        every = planes @ lost @ np.swapaxes(planes, 1, 2)
        slope = share[:, None, None] * ((1 - across) * along @ lost @ along.T + across * every.sum(axis=0))
        if held is not None:
            return slope @ held, 0 * slope, 0 * slope
        return (slope @ y[..., None])[..., 0], slope, 0 * slope

    return LocalForce(selection, law, "crack")


def cracked_jeffcott(speeds, orders, mass, stiffness, damping, unbalance, loss, angle, opening, weight_only=False,
                     across=0.0, internal=0.0, steps=256):  # fmt: skip
    """Harmonics (speed, order) of the disc; weight_only : the crack yields to the deflection by the weight alone."""
    machine, rest = point_machine(mass, stiffness, damping, unbalance, internal)
    planes, held = np.eye(2)[..., None], rest[:2] if weight_only else None
    machine.local.append(softer(np.eye(4)[:, :2], planes, np.array([[loss]]), angle, opening, held=held, across=across))
    return stepped(machine, speeds, orders, steps, rest)[..., 0]


def cracked_shaft(speeds, orders, discs, bearings, unbalances, element, loss, angle, opening):
    """Harmonics (speed, order, node) of all nodes, which count from 1; opening : None: by the bending of the motion.

    discs : {node: (mass, polar, diametral)};  bearings : {node: (kx, ky, c)};  unbalances : {node: kg m, complex}
    """
    ends = tuple(Bearing(n - 1, np.diag([kx, ky]), c * np.eye(2)) for n, (kx, ky, c) in bearings.items())
    machine = build(Rotor((PART,) * 4, tuple(Disc(n - 1, *sizes) for n, sizes in discs.items()), ends), gravity=9.81)
    rest = machine.sag()
    for node, size in unbalances.items():
        add_unbalance(machine, node - 1, abs(size), np.angle(size))
    planes, bend = np.array(np.hsplit(by_plane(np.eye(4)), 2)), np.array([0.0, -1.0, 0.0, 1.0])
    selection = np.eye(20)[:, 4 * element - 4 : 4 * element + 4]
    machine.local.append(softer(selection, planes, loss * plane_matrices(PART)[0], angle, opening, bend))
    return stepped(machine, speeds, orders, 256, rest)
