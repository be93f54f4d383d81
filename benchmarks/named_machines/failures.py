"""Named machines and faults on which a diagnosis of an earlier version failed: `FAILURES[name]` draws a case.

Rotors of a bench, a fan and a turbine by drawings; what is drawn at random is their bearings, damping, unbalance,
speeds and probes. Each fault is one of `ADDED`, which return the family as which they count.
"""

from functools import partial

import numpy as np

from rotorstudy.blind.machines import contacts, effects, faults, forms
from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.cases import draw_case
from rotorstudy.blind.machines.cracks import cosine, dimensionless_compliance, smooth_contact
from rotorstudy.blind.machines.draw import MACHINES, carried
from rotorstudy.blind.machines.machine import Disc

STEEL = {"youngs_modulus": 2.1e11, "density": 7850.0}


def _rotor(length, count, diameter, discs, bearings, stiffness):
    """Drawing of a uniform shaft; discs: node (from 0) to mass (kg) and radius (m)."""
    shaft = (Element(length / count, diameter, **STEEL),) * count
    parts = tuple(Disc(n, m, m * r**2 / 2, m * r**2 / 4 * 1.05) for n, (m, r) in discs.items())
    return lambda rng: carried(rng, shaft, parts, bearings, stiffness)


ROTORS = {
    "bench": _rotor(0.6, 10, 0.014, {4: (0.8, 0.06), 7: (0.7, 0.05)}, (0, 10), 1.5e6),
    "two_discs": _rotor(0.6, 4, 0.02, {1: (2.0, 0.07), 3: (1.5, 0.06)}, (0, 4), 1e6),
    "fan": _rotor(0.9, 9, 0.04, {9: (12.0, 0.2), 3: (3.0, 0.09)}, (0, 6), 3e7),
    "turbine": _rotor(3.0, 12, 0.3, {3: (700.0, 0.55), 6: (900.0, 0.6), 9: (700.0, 0.55)}, (0, 12), 6e8),
}


def _compliance(draw, depth_ratio, ratio=None):
    """Of a straight front of a depth over the diameter; `ratio`: along over across, if not that of the front."""
    rotor = draw.rotor
    scale = (1 - 0.3**2) / (np.pi * rotor.youngs_modulus * (rotor.diameter / 2) ** 3)
    across, along = dimensionless_compliance(2 * depth_ratio)
    return scale * np.diag([across, along if ratio is None else ratio * across])


def _hinge(depth_ratio, position, law, share, ratio=None):
    def add(draw):
        compliance = _compliance(draw, depth_ratio, ratio)
        what = forms.add_crack(draw, position, 0.0, compliance, law, share, draw.angle())
        return what | {"family": "crack_form"}

    return add


def _element(along, across, law, share, number):
    """A whole element (from 0) that loses shares of E I for bending along and across the edge of the crack."""

    def add(draw):
        part = draw.rotor.elements[number]
        compliance = part.length / part.bending_stiffness * np.diag([s / (1 - s) for s in (across, along)])
        position = float(draw.rotor.positions[number] + part.length / 2)
        what = forms.add_crack(draw, position, part.length, compliance, law, share, draw.angle())
        return what | {"family": "open_crack_form" if law == "open" else "crack_form"}

    return add


def _small_bow(draw):
    """A bow of a tenth of the vibration."""
    size = 0.1 * max(draw.swing(node) for node in draw.unbalance)
    kink = 4 * size / draw.rotor.length * np.exp(1j * draw.angle())
    effects.add_bow(draw.machine, effects.bow_by_kink(draw.rotor, 4, kink))
    return {"family": "bow", "node": 6, "kink_rad": abs(kink), "phase_rad": float(np.angle(kink))}


def _whirl(draw):
    """A rotor of one disc: 15 % of the stiffness while it is deflected to the cracked side, a fifth of that across."""
    position, stiffness = draw.rotor.first, draw.rotor.plane_stiffness[0, 0]
    across = 0.15 / 0.85 / stiffness * 16 / draw.rotor.length**2
    compliance = np.diag([across, 0.2 * across])
    what = forms.add_crack(draw, position, 0.0, compliance, "whole", smooth_contact(0.02), draw.angle())
    return what | {"family": "crack_form"}


def _rub(node, stiffness, friction, clearance, offset, angle):
    """A ring; clearance and offset over the vibration, stiffness in N/m."""

    def add(draw):
        swing, rest = draw.swing(node), draw.rest(node)
        gap, centre = clearance * swing, rest - offset * swing * np.array([np.cos(angle), np.sin(angle)])
        radius = draw.rotor.diameter / 2
        slip = 0.02 * draw.frequency * radius
        contacts.add_rub(draw.machine, node, stiffness(draw), gap, friction, radius, centre, slip)
        return {"family": "rub", "node": node + 1, "side_rad": angle, "stiffness_N_per_m": stiffness(draw),
                "clearance_m": gap, "offset_m": offset * swing, "friction": friction}  # fmt: skip

    return add


def _bearing(draw):
    return draw.rotor.bearings[0].stiffness[0, 0]


def _dry_friction(draw):
    size = 0.1 * _bearing(draw) * draw.swing(0)
    contacts.add_dry_friction(draw.machine, 0, size, 0.1 * draw.swing(0) * draw.frequency)
    return {"family": "dry_friction_form", "node": 1, "force_N": size}


def _cubic(draw):
    u = draw.healthy.displacement[:, :, :2]
    cubic = 0.3 * _bearing(draw) / np.max(np.sum(u**2, axis=2))
    contacts.add_cubic_bearing(draw.machine, 0, cubic)
    return {"family": "cubic_bearing", "node": 1, "cubic_N_per_m3": cubic}


def _loose(draw):
    """The foot at the fan's bearing lifts within the vibration."""
    node, angle = draw.rotor.bearings[1].node, np.pi
    loss, swing = 0.5 * draw.rotor.bearings[1].stiffness[0, 0], draw.swing(node)
    start = float(draw.rest(node) @ [np.cos(angle), np.sin(angle)]) + 0.3 * swing
    contacts.add_soft_foot(draw.machine, node, loss, 5 * swing, 1e-3 * swing, angle, start)
    return {"family": "looseness_form", "node": node + 1, "angle_rad": angle, "loss_N_per_m": loss,
            "gap_m": 5 * swing, "start_m": start, "width_m": 1e-3 * swing}  # fmt: skip


def _softer(draw):
    loss = 0.28 * _bearing(draw)
    draw.machine.at_node(0, -loss * np.eye(2))
    return {"family": "softer_support", "node": 1, "loss_N_per_m": loss}


ADDED = {
    "turbine_cosine": _hinge(0.115, 1.4547, "flexibility_by_angle", cosine()),
    "turbine_cosine_shallow": _hinge(0.086, 1.4547, "flexibility_by_angle", cosine()),
    "turbine_by_moment": _hinge(0.15, 1.1, "whole", smooth_contact(0.02)),
    "fan_cosine": _hinge(0.0834, 0.261, "flexibility_by_angle", cosine()),
    "bench_cosine": _hinge(0.19, 0.22, "flexibility_by_angle", cosine()),
    "bench_by_moment": _hinge(0.2, 0.33, "whole", smooth_contact(0.02)),
    "element_by_curvature": _element(0.11, 0.23, "whole", smooth_contact(0.02), 1),
    "element_open": _element(0.11, 0.23, "open", None, 2),
    "small_bow": _small_bow,
    "by_whirl": _whirl,
    "stiff_rub": _rub(4, lambda draw: 2.0 * _bearing(draw), 0.15, 1.0, 0.6, -2.5),
    "hard_rub": _rub(4, lambda draw: 2.8 * _bearing(draw), 0.18, 1.0, 0.72, 0.6),
    "dry_friction": _dry_friction,
    "cubic": _cubic,
    "loose_foot": _loose,
    "misaligned": lambda draw: faults.misalignment(draw) | {"family": "misalignment"},
    "softer_support": _softer,
}
FAULTS_OF = {  # name -> machine, faults
    # found, then given up beside a second cause that is not there
    "turbine_cosine": ("turbine", "turbine_cosine"),
    "turbine_cosine_shallow": ("turbine", "turbine_cosine_shallow"),
    "fan_cosine": ("fan", "fan_cosine"),
    # explained, then called implausible
    "element_by_curvature": ("two_discs", "element_by_curvature"),
    "turbine_by_moment": ("turbine", "turbine_by_moment"),
    "bench_by_moment": ("bench", "bench_by_moment"),
    # not found
    "bench_cosine": ("bench", "bench_cosine"),
    "element_open": ("two_discs", "element_open"),
    "bench_crack_with_bow": ("bench", "bench_cosine+small_bow"),
    "jeffcott_by_whirl": ("jeffcott", "by_whirl"),
    # ended without a verdict
    "bench_stiff_rub": ("bench", "stiff_rub"),
    "bench_dry_friction": ("bench", "dry_friction"),
    # others
    "bench_cubic": ("bench", "cubic"),
    "bench_hard_rub": ("bench", "hard_rub"),
    "fan_loose_foot": ("fan", "loose_foot"),
    "bench_misaligned_on_a_softer_support": ("bench", "misaligned+softer_support"),
}


def drawn(name, seed, **options):
    """The case of a name; options : of `draw_case`."""
    machine, family = FAULTS_OF[name]
    return draw_case(seed, family, machine=machine, known=ADDED, machines=MACHINES | ROTORS, **options)


FAILURES = {name: partial(drawn, name) for name in FAULTS_OF}
