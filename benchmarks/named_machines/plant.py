"""A machine in a plant: an overhung compressor on oil films, on a foundation that moves and carries the probes.

The foundation is a rigid block on springs at its feet, with coordinates of its own (x, y and the rotations a, b as of a
node). The films act between journal and block, and the probes see the shaft move against the block. Source: J. M.
Vance, F. Zeidan, B. Murphy, Machinery Vibration and Rotordynamics (2010), chapter 4.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.film import FEWER, Film, bearing, force, running_position
from rotorstudy.blind.machines.form_contacts import by_differences
from rotorstudy.blind.machines.machine import Disc, LocalForce, Rotor, build


@dataclass(frozen=True)
class Foundation:
    """A rigid block: mass (kg), radius of gyration (m) about its centre (m along the shaft), and its feet.

    feet : places along the shaft, m;  stiffness, damping : of each foot along x and y, N/m and N s/m
    """

    mass: float
    radius_of_gyration: float
    centre: float
    feet: tuple[float, float]
    stiffness: tuple[float, float]
    damping: tuple[float, float]

    def motion_at(self, position):
        """Motion (2, 4) along x and y at a place, m, by its x, y, a, b, of slopes dx/dz = b, dy/dz = -a."""
        arm = position - self.centre
        return np.array([[1.0, 0.0, 0.0, arm], [0.0, 1.0, -arm, 0.0]])

    def matrices(self):
        """Mass, stiffness and damping (4, 4)."""
        mass = np.diag([self.mass] * 2 + [self.mass * self.radius_of_gyration**2] * 2)
        seen = [self.motion_at(foot) for foot in self.feet]
        return mass, *(sum(m.T @ np.diag(values) @ m for m in seen) for values in (self.stiffness, self.damping))

    def frequencies(self):
        """Natural frequencies of the block alone, Hz."""
        mass, stiffness, _ = self.matrices()
        return np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)


def build_on_foundation(rotor, foundation, speeds, unbalance):
    """The Machine of a rotor whose films stand on a foundation, about the running positions; coordinates of the block
    last.

    rotor : Rotor without bearings, with `films`;  unbalance : node -> complex moment, kg m
    """
    machine = build(rotor)
    first = machine.add_dofs(4)
    block = slice(first, first + 4)
    mass, stiffness, damping = foundation.matrices()
    machine.mass[block, block] += mass
    machine.stiffness[block, block] += stiffness
    machine.damping[block, block] += damping
    for film in rotor.films:
        selection = against_block(machine, foundation, film.node)
        linear = bearing(film, float(np.mean(speeds)))
        machine.stiffness += selection @ linear.stiffness @ selection.T
        machine.damping += selection @ linear.damping @ selection.T
        law = by_differences(film_law(film, linear, speeds), film.clearance, film.clearance * float(np.mean(speeds)))
        machine.local.append(LocalForce(selection, law, "film"))
        # the block counts from where it rests under the rotor
        machine.harmonic[0, 0][block] -= foundation.motion_at(rotor.positions[film.node]).T @ [film.load, 0.0]
    for node, value in unbalance.items():
        add_unbalance(machine, node, abs(value), np.angle(value))
    return machine


def against_block(machine, foundation, node):
    """Selection (coordinates, 2) of the motion along x and y of a node against the block, which is last."""
    selection = np.zeros((machine.size, 2))
    selection[[4 * node, 4 * node + 1], [0, 1]] = 1.0
    selection[-4:] = -foundation.motion_at(machine.rotor.positions[node]).T
    return selection


def film_law(film, linear, speeds):
    """The force of a film about where it runs at each of the speeds, less what the linear bearing does."""
    running = {speed: running_position(film, speed) for speed in np.atleast_1d(speeds)}

    def law(angle, y, v, speed):
        moved = np.array([running[one] for one in np.atleast_1d(speed)]) + y
        far = np.linalg.norm(moved, axis=1, keepdims=True) / film.clearance
        moved = moved * np.minimum(1.0, 0.97 / far)  # within an iteration only
        return force(film, speed, moved, v, FEWER) + y @ linear.stiffness.T + v @ linear.damping.T

    return law


def shown_by(steady, machine, foundation, nodes):
    """Steady motion as probes on the block see it: that of the nodes against the block."""
    motion = steady.displacement.copy()
    for node in nodes:
        motion[:, :, 4 * node : 4 * node + 2] = steady.displacement @ against_block(machine, foundation, node)
    return replace(steady, displacement=motion)


STEEL = {"youngs_modulus": 2.1e11, "density": 7850.0}


def compressor(clearance_of_drive_end=1.0):
    """An overhung compressor of 163 kg with three impellers on plain films, and its foundation.

    The shaft has 14 nodes; films at nodes 3 (drive end) and 9, the coupling at node 0, impellers at 11, 12, 13.
    clearance_of_drive_end : times its clearance
    """
    lengths = [0.08, 0.08, 0.05] + [0.1] * 6 + [0.07, 0.05, 0.08, 0.08]
    diameters = [0.07, 0.07, 0.08] + [0.11] * 6 + [0.1, 0.09, 0.085, 0.085]
    shaft = tuple(
        Element(length, diameter, internal_damping=1e-6, **STEEL)
        for length, diameter in zip(lengths, diameters, strict=True)
    )
    discs = (Disc(0, 16.0, 0.13, 0.08), Disc(11, 26.0, 0.5, 0.27), Disc(12, 26.0, 0.5, 0.27), Disc(13, 29.0, 0.6, 0.33))
    rotor = Rotor(shaft, discs, ())
    loads = bearing_loads(rotor, (3, 9))
    films = (
        Film(3, 0.08, 0.03, 7e-5 * clearance_of_drive_end, 0.018, loads[0]),
        Film(9, 0.1, 0.045, 1e-4, 0.018, loads[1]),
    )
    positions = rotor.positions
    foundation = Foundation(
        900.0, 0.38, float(positions[3] + positions[9]) / 2, (float(positions[2]), float(positions[10])),
        (4.5e7, 9.5e7), (1.6e4, 2.0e4),
    )  # fmt: skip
    return replace(rotor, films=films), foundation


def bearing_loads(rotor, nodes):
    """What bearings at two nodes carry of the weight, N, by equilibrium."""
    weight, positions = build(rotor).harmonic[0, 0].real, rotor.positions
    total = weight[0::4].sum()
    moment = weight[0::4] @ positions + weight[3::4].sum()  # loads on the slopes dx/dz
    a, b = positions[list(nodes)]
    second = (moment - a * total) / (b - a)
    return float(total - second), float(second)
