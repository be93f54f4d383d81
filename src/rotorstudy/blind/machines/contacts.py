"""Contacts, supports and couplings: each adds a local force with its law, or forces that turn.

A law takes the angle, local displacements y and velocities v (speeds, p) and the speeds; it returns the force (speeds,
p) and its derivatives by y and v. Fixed angles count from x in the sense of the spin, rotating ones from the shaft's
reference line; rad.
"""

import numpy as np

from rotorstudy.blind.machines.beam import by_plane, plane_matrices
from rotorstudy.blind.machines.machine import LocalForce, linear_law


def at_stator(y, v, speed, centre, radius):
    """Unit normal and tangent, distance from the centre (m), and speed of the shaft's surface (`radius`) there, m/s."""
    away = y - centre
    r = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-300)
    normal = away / r[:, None]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    return normal, tangent, r, np.sum(tangent * v, axis=1) + speed * radius


# Normal force of a contact over stiffness and scale, of x = depth over scale: function(x) -> it, and its slope. Faces
# that are smooth (K. L. Johnson, Contact Mechanics (1985), chapter 4) or rough, which touch one place after another
CONTACTS = {
    "linear": lambda x: (np.maximum(x, 0.0), np.where(x > 0, 1.0, 0.0)),
    "hertz": lambda x: (np.maximum(x, 0.0) ** 1.5, 1.5 * np.maximum(x, 0.0) ** 0.5),
    "quadratic": lambda x: (np.maximum(x, 0.0) ** 2, 2 * np.maximum(x, 0.0)),
    "smooth": lambda x: (0.2 * np.logaddexp(0.0, x / 0.2), 0.5 + 0.5 * np.tanh(x / 0.4)),
}


def rub_law(
    stiffness, clearance, friction, radius, centre, slip_speed, contact="linear", scale=1.0, falling=(0.0, 1.0)
):
    """Law of a circular stator: F_n by one of `CONTACTS` of the depth r - clearance, friction mu F_n against the slip.

    Friction is Coulomb's, made smooth over a slip speed (tanh). Source: A. Muszynska, Rotordynamics (2005), chapter 5;
    F. Chu, Z. Zhang, "Bifurcation and chaos in a rub-impact Jeffcott rotor system", J. Sound Vib. 210 (1998) 1-18.

    scale   : depth (m) at which another contact than the linear one has the force of that, or about that
    falling : by how much mu is larger at rest, and the slip speed (m/s) over which it falls (Stribeck): B.
              Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083-1138
    """
    centre, (more, stribeck) = np.asarray(centre), falling

    def law(angle, y, v, speed):
        normal, tangent, r, slip = at_stator(y, v, speed, centre, radius)
        push, slope = CONTACTS[contact]((r - clearance) / scale)
        push, slope = stiffness * scale * push, (stiffness * slope)[:, None, None]
        smooth, extra = np.tanh(slip / slip_speed), more * np.exp(-((slip / stribeck) ** 2))
        share = (friction + extra) * smooth
        steep = (friction + extra) * (1 - smooth**2) / slip_speed - 2 * slip / stribeck**2 * extra * smooth
        force = -push[:, None] * (normal + share[:, None] * tangent)
        outer_nn = normal[:, :, None] * normal[:, None]
        outer_tn = tangent[:, :, None] * normal[:, None]
        outer_tt = tangent[:, :, None] * tangent[:, None]
        outer_nt = normal[:, :, None] * tangent[:, None]
        turn = (push / r)[:, None, None]
        share, grip = share[:, None, None], (push * steep)[:, None, None]
        radial = (np.sum(normal * v, axis=1) / r)[:, None, None]
        by_y = -slope * (outer_nn + share * outer_tn) - turn * (outer_tt - share * outer_nt) + grip * radial * outer_tt
        return force, by_y, -grip * outer_tt

    return law


def add_rub(machine, node, stiffness, clearance, friction, radius, centre=(0.0, 0.0), slip_speed=None, **other):
    """Rub: a circular stator of `clearance` m about `centre` (m); stiffness N/m, shaft radius m; see `rub_law`."""
    law = rub_law(stiffness, clearance, friction, radius, centre, slip_speed or 1e-2 * radius, **other)
    machine.local.append(LocalForce(machine.plane(node), law, "rub"))


# Laws by which a contact opens gradually about x = 0, in its widths: function(x) -> rounded max(x, 0), and its slope.
# With logistic tails, for gaps spread evenly, or with a stiffness that grows as the square root of the depth (a ball)
OPENINGS = {
    "logistic": lambda x: (np.logaddexp(0.0, x), 0.5 + 0.5 * np.tanh(x / 2)),
    "even": lambda x: (np.clip(x + 3, 0, 6) ** 2 / 12 + np.maximum(x - 3, 0), np.clip(x + 3, 0, 6) / 6),
    "ball": lambda x: (np.clip(x, 0, 4) ** 1.5 / 3 + np.maximum(x - 4, 0), np.clip(x, 0, 4) ** 0.5 / 2),
}


def one_sided(loss, gap, angle, start=0.0, width=1.0, opening=None):
    """Law of a stiffness lost along a direction n from n y = start on until `gap` m more, at once or over `width` m."""
    normal = np.array([np.cos(angle), np.sin(angle)])
    opened = OPENINGS[opening] if opening else CONTACTS["linear"]

    def law(turn, y, v, speed):
        w = (y @ normal - start) / width
        (lifted, lifts), (held, holds) = opened(w), opened(w - gap / width)
        by_y = (loss * (lifts - holds))[:, None, None] * np.outer(normal, normal)
        return (loss * width * (lifted - held))[:, None] * normal, by_y, np.zeros_like(by_y)

    return law


def add_one_sided_loss(machine, node, loss, angle, gap=np.inf, **gradual):
    """Support with `loss` N/m less towards `angle`, if it is loose until the bolts hold after `gap` m; see `one_sided`.

    Sources: F. F. Ehrich, J. Vib. Acoust. 110 (1988) 9-16; P. Goldman, A. Muszynska, "Analytical and experimental
    simulation of loose pedestal dynamic effects on a rotating machine vibrational response", ASME DE 35 (1991) 11-17.
    """
    law = one_sided(loss, gap, angle, **gradual)
    machine.local.append(LocalForce(machine.plane(node), law, "one-sided loss"))


def turned(angle):
    """Matrix [[cos, sin], [sin, -cos]] of twice the angle: stiffness more along `angle`, less across."""
    return np.array([[np.cos(2 * angle), np.sin(2 * angle)], [np.sin(2 * angle), -np.cos(2 * angle)]])


def add_asymmetry(machine, elements, share, angle=0.0):
    """Shaft asymmetry: E I of some elements is larger by `share` along the rotating direction `angle`, smaller across.

    Source: F. M. Dimentberg, Flexural Vibrations of Rotating Shafts (1961).
    """
    for number in elements:
        part = machine.rotor.elements[number]
        # of the rotations of its ends against its chord, in x (first two) and in y
        stiffness = share * plane_matrices(part)[0][np.ix_([1, 3], [1, 3])]
        chord = np.array([[1 / part.length, 1.0, -1 / part.length, 0.0], [1 / part.length, 0.0, -1 / part.length, 1.0]])
        selection = np.zeros((machine.size, 4))
        selection[4 * number : 4 * number + 8] = by_plane(chord.T)
        law = linear_law(lambda turn, stiffness=stiffness: -np.kron(turned(turn + angle), stiffness))
        machine.local.append(LocalForce(selection, law, "asymmetry"))


def coupling(stiffness, share, offset, run_out):
    """Law of a coupling to an immovable driver: force K(angle) (offset - y), of displacement and of slopes alike.

    K(angle) = stiffness (1 + share turned(angle)); `offset` is fixed (misalignment), `run_out` turns with the shaft.
    """

    def driver(angle):
        off = offset + run_out * np.exp(1j * angle)
        return np.array([off.real, off.imag])

    return linear_law(lambda angle: -stiffness * (np.eye(2) + share * turned(angle)), driver)


def add_misalignment(machine, node, stiffness, offset, run_out=0.0, share=0.0, angular=False):
    """The driver's shaft end is off by `offset` (m, x + j y, fixed) and `run_out` (m, turning), or tilted by slopes.

    Coupling of lateral `stiffness` N/m, or of bending stiffness in N m/rad if angular. Sources: C. B. Gibbons,
    "Coupling misalignment forces", Proc. 5th Turbomachinery Symposium (1976) 111-116; A. S. Sekhar, B. S. Prabhu,
    "Effects of coupling misalignment on vibrations of rotating machinery", J. Sound Vib. 185 (1995) 655-671.
    """
    law = coupling(stiffness, share, offset, run_out)
    machine.local.append(LocalForce(machine.plane(node, angular), law, "misalignment"))


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


def add_clearance(machine, node, stiffness, clearance, width, centre, oval, opening):
    """Support without `stiffness` N/m in a circle, smooth over `width` m (Ehrich, J. Vib. Acoust. 110 (1988) 9-16).

    oval : share by which the clearance is wider along an angle, and narrower across, and that angle
    """
    (share, along), opened = oval, OPENINGS[opening]

    def force(angle, y, v, speed):
        away = y - centre
        r = np.sqrt(np.sum(away**2, axis=1) + (1e-3 * clearance) ** 2)
        free = clearance * (1 + share * np.cos(2 * (np.arctan2(away[:, 1], away[:, 0]) - along)))
        inside = r - width * opened((r - free) / width)[0]
        return stiffness * (inside / r)[:, None] * away

    machine.local.append(LocalForce(machine.plane(node), by_differences(force, clearance, clearance), "clearance"))


def add_stiffening(machine, node, quadratic, cubic, ratio=1.0):
    """Support that stiffens: force -(quadratic r + cubic r²) (x, ratio y), N/m² and N/m³ (Yamamoto, Ishida 2001, 6)."""

    def law(angle, y, v, speed):
        r = np.sqrt(np.sum(y**2, axis=1) + 1e-30)[:, None]
        axes = np.array([1.0, ratio])
        stiffness, slope = quadratic * r + cubic * r**2, quadratic / r + 2 * cubic
        by_y = -(stiffness[:, :, None] * np.diag(axes) + slope[:, :, None] * (axes * y)[:, :, None] * y[:, None])
        return -stiffness * axes * y, by_y, np.zeros_like(by_y)

    machine.local.append(LocalForce(machine.plane(node), law, "stiffening"))


def add_dry_friction(machine, node, size, slow):
    """Dry friction against the vibration of a node: force `size` N against its velocity, smooth below `slow` m/s."""

    def law(angle, y, v, speed):
        fast = np.sqrt(np.sum(v**2, axis=1) + slow**2)[:, None]
        by_v = -size * (np.eye(2) / fast[:, :, None] - v[:, :, None] * v[:, None] / fast[:, :, None] ** 3)
        return -size * v / fast, np.zeros_like(by_v), by_v

    machine.local.append(LocalForce(machine.plane(node), law, "dry friction"))


def add_elliptic_forces(machine, node, forces, slopes=False):
    """Forces of a coupling at multiples of the speed, each an ellipse: {(k, power): (forward, backward)} complex, N.

    Force x + j y: forward e^{jk angle} + backward e^{-jk angle}, times speed^power; with `slopes` moments on these,
    N m. Source: M. Xu, R. D. Marangoni, J. Sound Vib. 176 (1994) 663-679.
    """
    for (k, power), (forward, backward) in forces.items():
        x, y = forward + np.conj(backward), -1j * (forward - np.conj(backward))
        machine.add_harmonic(k, power, machine.plane(node, slopes) @ [x, y])
