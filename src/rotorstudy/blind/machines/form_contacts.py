"""Contacts, supports and couplings of other forms: each adds a local force with its law, or forces that turn."""

import numpy as np

from rotorstudy.blind.machines.contacts import at
from rotorstudy.blind.machines.machine import LocalForce


def pushed(depth, stiffness, kind, scale):
    """Contact force over the depth (m) of any sign; of depth `scale` in the steady slope `stiffness`.

    `hertz`: depth^1.5; `quadratic`: depth²; `smooth`: rough faces that touch one after another, softplus of depth.
    """
    deep = np.maximum(depth, 0.0)
    if kind == "hertz":
        return stiffness * deep**1.5 / scale**0.5
    if kind == "quadratic":
        return stiffness * deep**2 / scale
    if kind == "smooth":
        width = 0.2 * scale
        return stiffness * width * np.logaddexp(0.0, depth / width)
    raise ValueError(f"no contact: {kind}")


def by_differences(force, size_of_y, size_of_v):
    """A law with its derivatives by central differences, from force(angle, y, v, speed) of shape (speeds, p)."""

    def law(angle, y, v, speed):
        value = force(angle, y, v, speed)
        count = y.shape[1]
        by_y, by_v = np.empty((2, len(y), count, count))
        for i in range(count):
            step_y, step_v = 1e-5 * size_of_y * np.eye(count)[i], 1e-5 * size_of_v * np.eye(count)[i]
            ahead, behind = force(angle, y + step_y, v, speed), force(angle, y - step_y, v, speed)
            by_y[:, :, i] = (ahead - behind) / (2e-5 * size_of_y)
            ahead, behind = force(angle, y, v + step_v, speed), force(angle, y, v - step_v, speed)
            by_v[:, :, i] = (ahead - behind) / (2e-5 * size_of_v)
        return value, by_y, by_v

    return law


def add_contact_ring(machine, node, stiffness, kind, clearance, scale, centre, friction, radius, speed_of):
    """Ring with another contact law and friction that falls with the slip (Stribeck).

    `friction`: static, sliding and the slip speed (m/s) between them; smooth over 1 % of `speed_of` (m/s). Source of
    the friction: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083-1138; of the contact:
    K. L. Johnson, Contact Mechanics (1985), chapter 4.
    """
    static, sliding, stribeck = friction
    centre = np.asarray(centre)

    def force(angle, y, v, speed):
        away = y - centre
        r = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-300)
        normal = away / r[:, None]
        tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        push = pushed(r - clearance, stiffness, kind, scale)
        slip = np.sum(tangent * v, axis=1) + speed * radius
        grip = sliding + (static - sliding) * np.exp(-((slip / stribeck) ** 2))
        return -push[:, None] * (normal + (grip * np.tanh(slip / (0.01 * speed_of)))[:, None] * tangent)

    machine.local.append(LocalForce(at(machine, 4 * node), by_differences(force, scale, 0.01 * speed_of), "rub"))


def add_soft_foot(machine, node, loss, gap, width, angle, start):
    """Foot that lifts: `loss` N/m less towards `angle` beyond `start` m until `gap` m more, over `width` m."""
    normal = np.array([np.cos(angle), np.sin(angle)])

    def law(turn, y, v, speed):
        w = (y @ normal - start) / width
        force = loss * width * (np.logaddexp(0.0, w) - np.logaddexp(0.0, w - gap / width))
        slope = loss * (1 / (1 + np.exp(-w)) - 1 / (1 + np.exp(gap / width - w)))
        by_y = slope[:, None, None] * np.outer(normal, normal)
        return force[:, None] * normal, by_y, np.zeros_like(by_y)

    machine.local.append(LocalForce(at(machine, 4 * node), law, "soft foot"))


def add_clearance(machine, node, stiffness, clearance, width, centre=(0.0, 0.0)):
    """Support with clearance: within a circle about `centre` it has lost `stiffness` N/m; smooth over `width` m.

    Source: F. F. Ehrich, J. Vib. Acoust. 110 (1988) 9-16, made smooth.
    """
    centre = np.asarray(centre)

    def force(angle, y, v, speed):
        away = y - centre
        r = np.sqrt(np.sum(away**2, axis=1) + (1e-3 * clearance) ** 2)
        inside = r - width * np.logaddexp(0.0, (r - clearance) / width)
        return stiffness * (inside / r)[:, None] * away

    machine.local.append(LocalForce(at(machine, 4 * node), by_differences(force, clearance, clearance), "clearance"))


def add_stiffening(machine, node, quadratic, cubic, ratio):
    """Support that stiffens: force -(quadratic r + cubic r²) (x, ratio y), N/m² and N/m³."""

    def law(angle, y, v, speed):
        r = np.sqrt(np.sum(y**2, axis=1) + 1e-30)[:, None]
        axes = np.array([1.0, ratio])
        stiffness, slope = quadratic * r + cubic * r**2, quadratic / r + 2 * cubic
        by_y = -(stiffness[:, :, None] * np.diag(axes) + slope[:, :, None] * (axes * y)[:, :, None] * y[:, None])
        return -stiffness * axes * y, by_y, np.zeros_like(by_y)

    machine.local.append(LocalForce(at(machine, 4 * node), law, "stiffening"))


def add_dry_friction(machine, node, size, slow):
    """Dry friction against the vibration of a node: force `size` N against its velocity, smooth below `slow` m/s."""

    def law(angle, y, v, speed):
        fast = np.sqrt(np.sum(v**2, axis=1) + slow**2)[:, None]
        by_v = -size * (np.eye(2) / fast[:, :, None] - v[:, :, None] * v[:, None] / fast[:, :, None] ** 3)
        return -size * v / fast, np.zeros_like(by_v), by_v

    machine.local.append(LocalForce(at(machine, 4 * node), law, "dry friction"))


def add_elliptic_forces(machine, node, forces, rotations=False):
    """Forces of a coupling at multiples of the speed, each an ellipse: {(k, power): (forward, backward)} complex, N.

    Force x + j y: forward e^{jk angle} + backward e^{-jk angle}, times speed^power; with `rotations` moments on the
    slopes, N m. Source: M. Xu, R. D. Marangoni, J. Sound Vib. 176 (1994) 663-679.
    """
    for (k, power), (forward, backward) in forces.items():
        vector = np.zeros(machine.size, complex)
        x, y = forward + np.conj(backward), -1j * (forward - np.conj(backward))
        if rotations:
            vector[4 * node + 3], vector[4 * node + 2] = x, -y
        else:
            vector[4 * node], vector[4 * node + 1] = x, y
        machine.add_harmonic(k, power, vector)
