"""Effects that are linear in the fixed frame or imposed: each adds its matrices or forces to a machine.

Angles of rotating things count from the shaft's reference line, of fixed things from x (down) in the sense of the spin;
in rad.
"""

import numpy as np

from rotorstudy.blind.machines.beam import by_plane
from rotorstudy.blind.machines.machine import Disc, add_disc, shaft_stiffness

EXPANSION = 1.2e-5  # of steel, 1/K


def add_unbalance(machine, node, moment, angle=0.0):
    """Unbalance: a mass times eccentricity `moment` (kg m) at a node, force moment W² with the shaft (ISO 21940-11)."""
    machine.add_rotating(node, moment * np.exp(1j * angle), power=2)


def add_couple_unbalance(machine, node, polar_moment, diametral_moment, tilt, angle=0.0):
    """A disc's axis tilted by `tilt` rad: moment (I_d - I_p) W² tilt on the slopes (Genta (2005), section 2.6)."""
    value = (diametral_moment - polar_moment) * tilt * np.exp(1j * angle)
    machine.add_rotating(node, value, power=2, slopes=True)


def add_added_mass(machine, node, mass, radius, length, eccentricity=0.0, angle=0.0):
    """A solid cylinder of `mass` kg, `radius` and `length` m, with weight and inertia, `eccentricity` m off."""
    polar, diametral = mass * radius**2 / 2, mass * (3 * radius**2 + length**2) / 12
    add_disc(machine, Disc(node, mass, polar, diametral))
    add_unbalance(machine, node, mass * eccentricity, angle)


def add_bow(machine, shape):
    """Shaft bow: the unloaded shaft is bent as `shape`; it pulls with its own stiffness, K_s shape, turning with it.

    shape : (nodes, 2) deflection x + j y (m) and slope dx/dz + j dy/dz (rad) at angle zero. Source: J. C. Nicholas, E.
            J. Gunter, P. E. Allaire, "Effect of residual shaft bow on unbalance response and balancing of a single mass
            flexible rotor", J. Eng. Power 98 (1976) 171-181.
    """
    vector = np.zeros(machine.size, complex)
    vector[: 4 * machine.rotor.nodes] = by_plane(shape.reshape(-1, 1)) @ [1, -1j]
    machine.add_harmonic(1, 0, shaft_stiffness(machine.rotor, size=machine.size) @ vector)


def add_thermal_bow(machine, elements, difference, angle=0.0):
    """Thermal bow: one side of the shaft hotter by `difference` K across its diameter, over some elements.

    The free shaft takes the curvature EXPANSION difference / diameter, convex on the hot side `angle` (B. A. Boley, J.
    H. Weiner, Theory of Thermal Stresses (1960), chapter 10). Its equivalent load is E I times that curvature, as end
    moments.
    """
    for number in elements:
        part = machine.rotor.elements[number]
        curvature = -EXPANSION * difference / part.outer_diameter * np.exp(1j * angle)
        moment = part.bending_stiffness * curvature
        machine.add_rotating(number, -moment, slopes=True)
        machine.add_rotating(number + 1, moment, slopes=True)


def add_preload(machine, node, force, angle):
    """Static preload: a constant force (N) along a fixed direction, as of a belt, a gear or misaligned bearings."""
    machine.add_harmonic(0, 0, machine.plane(node) @ [force * np.cos(angle), force * np.sin(angle)])


def add_seal(machine, node, direct, cross, damping, cross_damping, mass, swirl=0.0):
    """Annular seal: reaction -F = [K k; -k K] u + [C c; -c C] u' + M u'' (D. Childs, Turbomachinery Rotordynamics
    (1993), ch. 4).

    `direct`, `cross` in N/m, `damping`, `cross_damping` in N s/m, `mass` in kg; cross stiffness of positive sign drives
    forward whirl. `cross` is that of a swirl at the inlet, the same at all speeds (gas labyrinths); of the swirl that
    the turning shaft causes, `swirl` times its speed, k grows with the speed: swirl C W (Black 1969; liquid seals).
    """
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    machine.at_node(node, direct * np.eye(2) + cross * turn)
    machine.at_node(node, swirl * damping * turn, "circulatory")
    machine.at_node(node, damping * np.eye(2) + cross_damping * turn, "damping")
    machine.at_node(node, mass * np.eye(2), "mass")


def add_pedestal(machine, bearing, mass, stiffness, damping):
    """A mass (kg) between a bearing and the ground, on stiffness and damping 2x2 (N/m, N s/m).

    Source: E. Kramer, Dynamics of Rotors and Foundations (1993), chapter 12. Its weight only shifts it and is left out.
    """
    first = machine.add_dofs(2)
    shaft, ground = slice(4 * bearing.node, 4 * bearing.node + 2), slice(first, first + 2)
    for name, matrix, foot in (("stiffness", bearing.stiffness, stiffness), ("damping", bearing.damping, damping)):
        total = getattr(machine, name)
        total[shaft, ground] -= matrix
        total[ground, shaft] -= matrix
        total[ground, ground] += matrix + foot
    machine.mass[ground, ground] += mass * np.eye(2)


def bow_by_kink(rotor, element, kink):
    """Shape of a shaft with a kink (rad, complex) at the end of an element, zero at the first and last bearing."""
    z = rotor.positions
    deflection = np.where(z > z[element + 1], kink * (z - z[element + 1]), 0.0 * kink)
    slope = np.where(np.arange(rotor.nodes) > element + 1, kink, 0.0 * kink)
    first, last = rotor.bearings[0].node, rotor.bearings[-1].node
    tilt = (deflection[last] - deflection[first]) / (z[last] - z[first])
    return np.stack([deflection - deflection[first] - tilt * (z - z[first]), slope - tilt], axis=1)
