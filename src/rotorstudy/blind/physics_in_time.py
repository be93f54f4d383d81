"""Effects whose force follows from the shaft angle and the motion at each instant: cracks, contacts, friction.

Each is a function(plant, values, where) as in `physics`; `coulomb_friction` and `quadratic_damping` are foreign to the
plugin library (see `simulated_effects`).
"""

import numpy as np

from rotorstudy.blind.physics import node_of, stiffness_of


def shaft_asymmetry(plant, values, where):
    """Shaft, or stretch of it, that is stiffer along one rotating axis and softer across it."""
    share, axis = np.abs(values["shaft_asymmetry"]), np.angle(values["shaft_asymmetry"]) / 2
    size, stiffness = plant.dof, stiffness_of(plant, where) if "element" in where else plant.structure.stiffness

    def force(angle, middle, position, velocity):
        c, s = np.cos(2 * (angle + axis)), np.sin(2 * (angle + axis))
        x, y = position[:, :size] @ stiffness, position[:, size:] @ stiffness
        return -share * np.concatenate([c * x + s * y, s * x - c * y], axis=1)

    plant.moving.append(force)


def _lost_stiffness(plant, values, where):
    """(dof, dof) stiffness lost while the crack is open; a nominal element is several elements of this mesh."""
    element = where.get("element")
    places = [{}] if element is None else [{"element": e} for e in plant.place(element, element=True)]
    return sum(
        values[name] * pattern
        for p in places
        for name, (pattern, _, _) in plant.structure.stiffness_loss_at(**p).items()
    )


OPENINGS = {
    "switching": lambda angle: np.cos(angle) > 0,
    "breathing": lambda angle: np.cos(angle / 2) ** 2,
    "open": lambda angle: 1.0,
}  # of a crack whose edge is at an angle from the side that the weight stretches


def _stretched_above(plant, where):
    """Half a revolution if the weight bends the element of a crack so that its upper side is stretched, else 0."""
    element = where.get("element")
    if element is None:
        return 0.0
    ends = [plant.place(element), plant.place(element + 1)]
    tilts = [plant.rest[plant.structure.index(n, "tilt")] if (n, "tilt") in plant.structure.dofs else 0 for n in ends]
    return np.pi if tilts[1] > tilts[0] else 0.0


def breathing_crack(plant, values, where):
    """Crack that opens and closes with the shaft angle, acting on the full motion."""
    lost, size, turned = _lost_stiffness(plant, values, where), plant.dof, where["crack_angle_rad"]
    opening, above = OPENINGS[where["crack"]], _stretched_above(plant, where)

    def force(angle, middle, position, velocity):
        c, s = np.cos(angle + turned), np.sin(angle + turned)
        along = opening(middle + turned - above) * (c * position[:, :size] + s * position[:, size:]) @ lost
        return np.concatenate([c * along, s * along], axis=1)

    plant.moving.append(force)


def _local(plant, where, force):
    """Add a force that depends on the motion of one node: force(x, y, x', y'), each (speed,) -> its x and y."""
    i, j = plant.index(node_of(where, plant)), plant.index(node_of(where, plant)) + plant.dof

    def moving(angle, middle, position, velocity):
        found = np.zeros_like(position)
        found[:, i], found[:, j] = force(position[:, i], position[:, j], velocity[:, i], velocity[:, j])
        return found

    plant.moving.append(moving)
    return plant.rest[i], plant.rest[j]


def rub(plant, values, where):
    """Contact with a ring, with friction; stiffness in N/m beyond the gap.

    The shaft at rest is nearest to the ring on the side of the contact angle; the ring's centre is away from there.
    """
    friction, k, angle = where["friction_ratio"], values["rub_stiffness"], where["contact_angle_rad"]
    radius = where["clearance_m"] / (1 - where["offset_ratio"])
    away = radius - where["clearance_m"]

    def force(x, y, vx, vy):
        x, y = x - rest[0] + away * np.cos(angle), y - rest[1] + away * np.sin(angle)
        distance = np.hypot(x, y)
        press = k * np.maximum(distance - radius, 0) / np.maximum(distance, 1e-30)
        return -press * (x - friction * y), -press * (y + friction * x)

    rest = _local(plant, where, force)


def looseness(plant, values, where):
    """Support that loses stiffness, N/m, once the journal lifts off, until its bolts hold it after a play.

    It lifts off against the direction that presses it down.
    """
    k, c, s = values["stiffness_lost_in_lift"], np.cos(where["direction_rad"]), np.sin(where["direction_rad"])

    def force(x, y, vx, vy):
        lost = k * np.clip((rest[0] - x) * c + (rest[1] - y) * s - where["lift_m"], 0, where["play_m"])
        return -lost * c, -lost * s

    rest = _local(plant, where, force)


def cubic_stiffness(plant, values, where):
    """Isotropic cubic spring to ground, N/m^3."""
    k = values["cubic_stiffness"]
    _local(plant, where, lambda x, y, vx, vy: (-k * (x**2 + y**2) * x, -k * (x**2 + y**2) * y))


def coulomb_friction(plant, values, where):
    """Dry friction: a force of constant size against the velocity."""
    slow = where["smooth_m_per_s"]

    def force(x, y, vx, vy):
        along = -values["friction_N"] / np.sqrt(vx**2 + vy**2 + slow**2)
        return along * vx, along * vy

    _local(plant, where, force)


def quadratic_damping(plant, values, where):
    """Drag against the velocity, proportional to its square, N s^2/m^2."""
    c = values["drag_N_s2_per_m2"]

    def force(x, y, vx, vy):
        return -c * np.hypot(vx, vy) * vx, -c * np.hypot(vx, vy) * vy

    _local(plant, where, force)
