"""One random effect of each family on a machine: `FAMILIES[name](draw)` adds it and returns what it is, with units in
the keys.

Sizes are relative to the machine at hand: its stiffness, weight, and motion without the effect. Node and element
numbers in what is returned count from 1, as in the files.
"""

from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.machines import contacts, effects
from rotorstudy.blind.machines.cracks import add_form, arc_form
from rotorstudy.blind.machines.draw import between
from rotorstudy.blind.machines.machine import Machine, add_internal_damping
from rotorstudy.blind.machines.stepping import Steady


@dataclass
class Draw:
    """What a family draws from: machine, unbalance (node to kg m), motion without the effect; severity : of `forms`."""

    rng: np.random.Generator
    machine: Machine
    unbalance: dict
    healthy: Steady
    frequency: float
    severity: float = 1.0

    @property
    def rotor(self):
        return self.machine.rotor

    @property
    def stiffness(self):
        """Mass times the square of the first natural frequency, N/m: a measure of the whole."""
        return self.rotor.mass * self.frequency**2

    def angle(self):
        return float(self.rng.uniform(0, 2 * np.pi))

    def disc(self):
        return self.rotor.discs[self.rng.integers(len(self.rotor.discs))]

    def node(self):
        """Any node away from the bearings."""
        held = {bearing.node for bearing in self.rotor.bearings}
        return int(self.rng.choice([node for node in range(self.rotor.nodes) if node not in held]))

    def support(self):
        """Node of a bearing, or of the disc of a rotor that has only this node, and a stiffness there, N/m."""
        if not self.rotor.bearings:
            return 0, self.stiffness
        bearing = self.bearing()
        return bearing.node, float(np.mean(np.diag(bearing.stiffness)))

    def bearing(self):
        return self.rotor.bearings[self.rng.integers(len(self.rotor.bearings))]

    def element(self):
        """Any element that carries a moment."""
        return int(self.rng.integers(self.rotor.bearings[0].node, len(self.rotor.elements)))

    def stretch(self):
        """Some neighbouring elements, five at most."""
        count = len(self.rotor.elements)
        width = int(self.rng.integers(1, min(count, 5) + 1))
        first = int(self.rng.integers(0, count - width + 1))
        return list(range(first, first + width))

    def swing(self, node):
        """Largest dynamic radius of the healthy motion at a node, m."""
        u = self.healthy.displacement[:, :, 4 * node : 4 * node + 2]
        return float(np.max(np.linalg.norm(u - u.mean(axis=1, keepdims=True), axis=2)))

    def rest(self, node):
        """Mean position without the effect, x and y, m."""
        return self.healthy.displacement[:, :, 4 * node : 4 * node + 2].mean(axis=(0, 1))

    def stator(self, node, angle, reach, most):
        """Offset (m, `most` vibrations at most) and centre of a stator that comes nearer until the orbit meets it."""
        side, rest, swing = np.array([np.cos(angle), np.sin(angle)]), self.rest(node), self.swing(node)
        orbit = self.healthy.displacement[:, :, 4 * node : 4 * node + 2] - rest
        for offset in np.linspace(0.0, most, 100 * most + 1) * swing:
            if np.max(np.linalg.norm(orbit + offset * side, axis=2)) >= reach:
                break
        return offset, rest - offset * side


def healthy(draw):
    return {}


def unbalance(draw):
    node = draw.disc().node
    value = abs(draw.unbalance[node]) * between(draw.rng, 0.5, 4.0) * np.exp(1j * draw.angle())
    effects.add_unbalance(draw.machine, node, abs(value), np.angle(value))
    return {"node": node + 1, "moment_kg_m": abs(value), "phase_rad": float(np.angle(value))}


def couple_unbalance(draw):
    disc, angle = draw.disc(), draw.angle()
    lever = draw.rotor.positions[-1] * between(draw.rng, 0.1, 0.5)
    tilt = abs(draw.unbalance[disc.node]) * lever / abs(disc.polar_moment - disc.diametral_moment)
    effects.add_couple_unbalance(draw.machine, disc.node, disc.polar_moment, disc.diametral_moment, tilt, angle)
    return {"node": disc.node + 1, "tilt_rad": tilt, "phase_rad": angle}


def add_crack(machine, element, position, depth, angle=0.0, kind="gradual"):
    """A crack with a straight front, as in the library: place in the element from 0 to 1, depth over radius."""
    part = machine.rotor.elements[element]
    place = float(machine.rotor.positions[element]) + position * part.length
    add_form(machine, place, arc_form(part, depth / 2, 0.0, kind), angle)


def crack(draw, kinds=("gradual", "switching")):
    element, share = draw.element(), float(draw.rng.uniform(0.1, 0.9))
    depth, angle, kind = float(draw.rng.uniform(0.4, 1.0)), draw.angle(), str(draw.rng.choice(kinds))
    add_crack(draw.machine, element, share, depth, angle, kind)
    nodes = draw.rotor.positions.tolist()
    place = {"element": element + 1, "position_m": (1 - share) * nodes[element] + share * nodes[element + 1]}
    return {**place, "nodes_m": nodes, "depth_ratio": depth / 2, "phase_rad": angle, "breathing": kind}


def open_crack(draw):
    return crack(draw, ["open"])


def misalignment(draw):
    """A coupling of the nominal machine at the first node, whose driver is off: lateral and bending stiffness stay."""
    rng, node, kind = draw.rng, 0, str(draw.rng.choice(["parallel", "angular"]))
    share, turning = float(rng.uniform(0.03, 0.25)), float(rng.uniform(0.0, 0.1))
    sag = np.max(np.abs(draw.healthy.displacement[:, :, 0::4].mean(axis=1)))
    stiffness = 0.2 * draw.rotor.bearings[0].stiffness[0, 0]
    size = sag * between(rng, 0.3, 3.0)
    if kind == "parallel":  # the mean lateral stiffness is part of the nominal support
        draw.machine.at_node(node, -stiffness * np.eye(2))
    else:
        size = size / draw.rotor.positions[-1] * 4
        stiffness = 0.1 * draw.rotor.elements[0].bending_stiffness / draw.rotor.elements[0].length
    offset = size * np.exp(1j * draw.angle())
    run_out = turning * size * np.exp(1j * draw.angle())
    contacts.add_misalignment(draw.machine, node, stiffness, offset, run_out, share, kind == "angular")
    unit = ("m", "N_per_m") if kind == "parallel" else ("rad", "N_m_per_rad")
    what = {"node": node + 1, "kind": kind, f"offset_{unit[0]}": abs(offset), "angle_rad": float(np.angle(offset))}
    return {**what, f"stiffness_{unit[1]}": stiffness, "turning_share": turning, "anisotropic_share": share}


def rub(draw, widest=1.5, deepest=0.3, most=3, severity=1.0, slow=0.02, other_contacts=()):
    """A rub, with one of some other contacts and with friction that falls with the slip.

    widest, deepest : clearance and depth over the vibration;  most : as of `Draw.stator`
    slow            : slip over the speed of the first frequency below which friction is smooth
    """
    rng, node = draw.rng, draw.disc().node
    swing, angle = draw.swing(node), draw.angle()
    contact = {"contact": str(rng.choice(other_contacts))} if other_contacts else {}
    clearance, depth = swing * rng.uniform(0.7, widest), swing * rng.uniform(0.05, deepest)
    offset, centre = draw.stator(node, angle, clearance + depth, most)
    stiffness, friction = severity * draw.stiffness * between(rng, 0.03, 0.5), float(rng.uniform(0.02, 0.2))
    radius, law = draw.rotor.diameter / 2, {}
    fast = draw.frequency * radius
    if contact:
        falling = friction * (rng.uniform(1.0, 2.0) - 1), fast * between(rng, 0.1, 1.0)
        law = contact | {"scale": depth, "falling": falling}
    contacts.add_rub(draw.machine, node, stiffness, clearance, friction, radius, centre, slow * fast, **law)
    what = {"node": node + 1, "side_rad": angle, "stiffness_N_per_m": stiffness, "clearance_m": clearance}
    return {**what, "offset_m": float(offset), "friction": friction, **contact}


def along_of(bearing, angle):
    """Unit vector along an angle, and the stiffness of a bearing there, N/m."""
    n = np.array([np.cos(angle), np.sin(angle)])
    return n, float(n @ bearing.stiffness @ n)


def looseness(draw):
    bearing, angle = draw.bearing(), draw.angle()
    loss = along_of(bearing, angle)[1] * draw.rng.uniform(0.3, 0.8)
    gap = draw.swing(bearing.node) * between(draw.rng, 0.3, 10.0)
    contacts.add_one_sided_loss(draw.machine, bearing.node, loss, angle, gap)
    return {"node": bearing.node + 1, "angle_rad": angle, "loss_N_per_m": loss, "gap_m": gap}


def support_loss(draw):
    bearing, angle, both = draw.bearing(), draw.angle(), bool(draw.rng.random() < 0.5)
    n, stiffness = along_of(bearing, angle)
    loss = stiffness * draw.rng.uniform(0.1, 0.5)
    if both:
        draw.machine.at_node(bearing.node, -loss * np.outer(n, n))
    else:
        contacts.add_one_sided_loss(draw.machine, bearing.node, loss, angle)
    return {"node": bearing.node + 1, "angle_rad": angle, "loss_N_per_m": loss, "one_sided": not both}


def pedestal(draw):
    bearing = draw.bearing()
    mass = draw.rotor.mass * between(draw.rng, 0.1, 1.0)
    stiffness = np.diag(np.diag(bearing.stiffness)) * between(draw.rng, 1.0, 5.0)
    damping = 2 * 0.03 * np.sqrt(stiffness * mass)
    effects.add_pedestal(draw.machine, bearing, mass, stiffness, damping)
    return {"node": bearing.node + 1, "mass_kg": mass, "stiffness_N_per_m": np.diag(stiffness).tolist()}


def seal(draw):
    """A seal whose fluid turns with the shaft, or one of the same swirl at every speed."""
    node, direct = draw.node(), draw.stiffness * between(draw.rng, 0.02, 0.3)
    damping = 2 * draw.rng.uniform(0.01, 0.1) * draw.stiffness / draw.frequency
    share, turning = float(draw.rng.uniform(0.1, 0.4)), bool(draw.rng.random() < 0.5)
    cross, swirl = (0.0, share) if turning else (damping * draw.frequency * share, 0.0)
    mass, cross_damping = draw.rotor.mass * draw.rng.uniform(0, 0.02), 0.05 * damping
    effects.add_seal(draw.machine, node, direct, cross, damping, cross_damping, mass, swirl)
    what = {"node": node + 1, "direct_N_per_m": direct, "cross_N_per_m": cross, "damping_N_s_per_m": damping}
    return {**what, "cross_damping_N_s_per_m": cross_damping, "mass_kg": mass, "swirl_ratio": swirl}


def added_mass(draw):
    node, mass, angle = draw.node(), draw.rotor.mass * between(draw.rng, 0.01, 0.1), draw.angle()
    radius = draw.rotor.elements[0].outer_diameter
    eccentricity = max(map(abs, draw.unbalance.values())) / mass * draw.rng.uniform(0, 2)
    effects.add_added_mass(draw.machine, node, mass, radius, radius / 2, eccentricity, angle)
    return {"node": node + 1, "mass_kg": mass, "eccentricity_m": eccentricity, "phase_rad": angle}


def bow(draw):
    element = int(draw.rng.integers(0, len(draw.rotor.elements) - 1))
    span, size = draw.rotor.positions[-1], max(draw.swing(node) for node in draw.unbalance)
    kink = 4 * size / span * between(draw.rng, 0.3, 3.0) * np.exp(1j * draw.angle())
    effects.add_bow(draw.machine, effects.bow_by_kink(draw.rotor, element, kink))
    return {"node": element + 2, "kink_rad": abs(kink), "phase_rad": float(np.angle(kink))}


def thermal_bow(draw):
    elements, angle = draw.stretch(), draw.angle()
    length = sum(draw.rotor.elements[number].length for number in elements)
    size = max(draw.swing(node) for node in draw.unbalance) * between(draw.rng, 0.3, 3.0)
    diameter = draw.rotor.elements[elements[0]].outer_diameter
    difference = 4 * size / (draw.rotor.positions[-1] * length) * diameter / effects.EXPANSION
    effects.add_thermal_bow(draw.machine, elements, difference, angle)
    return {"elements": [number + 1 for number in elements], "difference_K": difference, "hot_side_rad": angle}


def preload(draw):
    node, angle = draw.node(), draw.angle()
    force = draw.rotor.mass * 9.80665 * between(draw.rng, 0.1, 2.0)
    effects.add_preload(draw.machine, node, force, angle)
    return {"node": node + 1, "force_N": force, "angle_rad": angle}


def cubic_bearing(draw):
    bearing = draw.bearing()
    u = draw.healthy.displacement[:, :, 4 * bearing.node : 4 * bearing.node + 2]
    cubic = bearing.stiffness[0, 0] * between(draw.rng, 0.05, 0.5) / np.max(np.sum(u**2, axis=2))
    contacts.add_stiffening(draw.machine, bearing.node, 0.0, cubic)
    return {"node": bearing.node + 1, "cubic_N_per_m3": cubic}


def internal_damping(draw):
    elements = draw.stretch()
    change = draw.rotor.elements[0].internal_damping * between(draw.rng, 1.0, 6.0)
    add_internal_damping(draw.machine, [change * (n in elements) for n in range(len(draw.rotor.elements))])
    return {"elements": [number + 1 for number in elements], "change_s": change}


def external_damping(draw):
    node = draw.node()
    change = 2 * between(draw.rng, 0.01, 0.1) * draw.rotor.mass * draw.frequency
    draw.machine.at_node(node, change * np.eye(2), "damping")
    return {"node": node + 1, "change_N_s_per_m": change}


def asymmetry(draw):
    elements, share, angle = draw.stretch()[:3], between(draw.rng, 0.005, 0.05), draw.angle()
    contacts.add_asymmetry(draw.machine, elements, share, angle)
    return {"elements": [number + 1 for number in elements], "share": share, "phase_rad": angle}


FAMILIES = {
    family.__name__: family
    for family in (
        healthy, unbalance, couple_unbalance, crack, open_crack, misalignment, rub, looseness, support_loss, pedestal,
        seal, added_mass, bow, thermal_bow, preload, cubic_bearing, internal_damping, external_damping, asymmetry,
    )
}  # fmt: skip
