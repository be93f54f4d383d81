"""Machines in a plant as data: rotors on oil films, on blocks that move and carry bearings and probes.

Each block is rigid, on springs at its feet, with coordinates of its own (x, y and the rotations a, b as of a node). The
films act between journal and block, and the probes see the shaft move against the block. Source: J. M. Vance, F.
Zeidan, B. Murphy, Machinery Vibration and Rotordynamics (2010), chapter 4. x is the direction of the load: gravity, or
the radial thrust of a vertical pump.
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.effects import add_preload, add_unbalance
from rotorstudy.blind.machines.film import Film, about_running, bearing
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


@dataclass(frozen=True)
class Plant:
    """A machine as data; nodes count from 0.

    rotor       : Rotor without bearings, on its films;  blocks : a Foundation each;  speeds : rad/s
    unbalance   : node -> complex moment, kg m;  thrust : node -> N along x, of a vertical machine, which has no weight
    hub         : node of the coupling;  other_hub : that of the other rotor, None where the driver does not move
    coupling    : its lateral (N/m) and bending stiffness (N m/rad)
    wheels      : nodes at which unbalance grows, and at which a rub may be
    bow         : elements across which the shaft is hotter on one side
    cracks      : (element, position in it from 0 to 1) beside a bearing and in the middle
    """

    rotor: Rotor
    blocks: tuple
    speeds: np.ndarray
    unbalance: dict
    hub: int
    coupling: tuple
    wheels: tuple
    bow: tuple
    cracks: tuple
    other_hub: int | None = None
    thrust: dict | None = None

    def block_at(self, node):
        """Number of the block on which what is at a node stands: the nearest one."""
        place = self.rotor.positions[node]
        return int(np.argmin([abs(block.centre - place) for block in self.blocks]))

    def block_slice(self, machine, number):
        """Coordinates of a block, of which all come last."""
        first = machine.size - 4 * (len(self.blocks) - number)
        return slice(first, first + 4)

    def against_block(self, machine, node):
        """Selection (coordinates, 2) of the motion along x and y of a node against its block."""
        number, selection = self.block_at(node), machine.plane(node)
        motion = self.blocks[number].motion_at(self.rotor.positions[node])
        selection[self.block_slice(machine, number)] = -motion.T
        return selection

    def build(self):
        """The Machine about the running positions, with its unbalance."""
        machine, speeds = loaded(self.rotor, self.thrust), self.speeds
        machine.add_dofs(4 * len(self.blocks))
        for number, block in enumerate(self.blocks):
            own = self.block_slice(machine, number)
            for total, part in zip((machine.mass, machine.stiffness, machine.damping), block.matrices(), strict=True):
                total[own, own] += part
        for film in self.rotor.films:
            selection, linear = self.against_block(machine, film.node), bearing(film, float(np.mean(speeds)))
            machine.stiffness += selection @ linear.stiffness @ selection.T
            machine.damping += selection @ linear.damping @ selection.T
            machine.local.append(LocalForce(selection, about_running(film, linear, speeds), "film"))
            # the blocks count from where they rest under the rotor
            machine.harmonic[0, 0][-4 * len(self.blocks) :] += film.load * selection[-4 * len(self.blocks) :, 0]
        for node, value in self.unbalance.items():
            add_unbalance(machine, node, abs(value), np.angle(value))
        return machine

    def shown_by(self, steady, machine):
        """Steady motion as probes on the blocks see it at the films: that of their nodes against the block."""
        motion = steady.displacement.copy()
        for film in self.rotor.films:
            seen = steady.displacement @ self.against_block(machine, film.node)
            motion[:, :, 4 * film.node : 4 * film.node + 2] = seen
        return replace(steady, displacement=motion)


def loaded(rotor, thrust=None):
    """The Machine of a rotor without its films, under its weight, or upright under thrusts (node -> N along x)."""
    machine = build(rotor, 0.0) if thrust else build(rotor)
    for node, value in (thrust or {}).items():
        add_preload(machine, node, value, 0.0)
    return machine


def on_films(rotor, sizes, viscosity, thrust=None):
    """The rotor on films of sizes node -> (diameter, length, clearance), m, with what they carry on rigid bearings."""
    machine, nodes = loaded(rotor, thrust), list(sizes)
    held = np.zeros((machine.size, 2 * len(nodes)))
    for k, node in enumerate(nodes):
        held[[4 * node, 4 * node + 1], [k, len(nodes) + k]] = 1.0
    whole = np.block([[machine.stiffness, held], [held.T, np.zeros((2 * len(nodes),) * 2)]])
    loads = np.linalg.solve(whole, np.concatenate([machine.harmonic[0, 0].real, np.zeros(2 * len(nodes))]))
    loads = loads[machine.size : machine.size + len(nodes)]
    films = [Film(node, *sizes[node], viscosity, float(load)) for node, load in zip(nodes, loads, strict=True)]
    return replace(rotor, films=tuple(films))


def shaft(lengths, diameters):
    """Steel elements."""
    steel = {"youngs_modulus": 2.1e11, "density": 7850.0, "internal_damping": 1e-6}
    return tuple(Element(*sizes, **steel) for sizes in zip(lengths, diameters, strict=True))


def at_rpm(*speeds):
    return np.array(speeds) * 2 * np.pi / 60


def compressor():
    """An overhung compressor of 163 kg with three wheels on plain films, on a frame."""
    lengths = [0.08, 0.08, 0.05] + [0.1] * 6 + [0.07, 0.05, 0.08, 0.08]
    diameters = [0.07, 0.07, 0.08] + [0.11] * 6 + [0.1, 0.09, 0.085, 0.085]
    discs = (Disc(0, 16.0, 0.13, 0.08), Disc(11, 26.0, 0.5, 0.27), Disc(12, 26.0, 0.5, 0.27), Disc(13, 29.0, 0.6, 0.33))
    rotor = Rotor(shaft(lengths, diameters), discs, ())
    films = {3: (0.08, 0.03, 7e-5), 9: (0.1, 0.045, 1e-4)}
    frame = Foundation(900.0, 0.38, 0.51, (0.16, 0.88), (4.5e7, 9.5e7), (1.6e4, 2.0e4))
    return Plant(
        on_films(rotor, films, 0.018), (frame,), at_rpm(1200, 1600, 2000, 2400, 2800, 3200, 3600, 4000),
        {0: 16 * 4e-5 * np.exp(1j), 11: 26 * 3e-5, 13: 29 * 3.5e-5 * np.exp(2j)},
        hub=0, coupling=(5e6, 5e4), wheels=(13, 11), bow=(5, 6), cracks=((9, 0.4), (6, 0.4)),
    )  # fmt: skip


def pump():
    """A vertical pump: two wheels between two guide bearings, in a column that swings below its motor stand.

    Its head, and with it the radial thrust of its volutes, is the same at all speeds.
    """
    rotor = Rotor(
        shaft([0.15, 0.2] + [0.3] * 6 + [0.2, 0.2], [0.1, 0.1] + [0.12] * 6 + [0.11, 0.11]),
        (Disc(0, 25.0, 0.2, 0.12), Disc(7, 55.0, 1.1, 0.65), Disc(8, 55.0, 1.1, 0.65)), (),
    )  # fmt: skip
    thrust = {7: 1600.0, 8: 1400.0, 0: 200.0}
    films = {1: (0.1, 0.05, 9e-5), 10: (0.11, 0.055, 1.1e-4)}
    stand = Foundation(1600.0, 0.9, 1.0, (0.15, 0.9), (9e7, 1.3e8), (6e4, 8e4))
    return Plant(
        on_films(rotor, films, 0.02, thrust), (stand,), at_rpm(600, 750, 900, 1050, 1200, 1350, 1500, 1650),
        {0: 25 * 1e-4 * np.exp(2j), 7: 55 * 1.2e-4, 8: 55 * 8e-5 * np.exp(1j)},
        hub=0, coupling=(5e6, 5e4), wheels=(7, 8), bow=(4, 5), cracks=((8, 0.5), (4, 0.5)), thrust=thrust,
    )  # fmt: skip


def train():
    """A turbine and a generator of 10 MW, joined by a quill shaft, on four films and two blocks."""
    turbine = [0.3, 0.35, 0.4, 0.4, 0.4, 0.35, 0.3], [0.2, 0.28, 0.36, 0.36, 0.36, 0.28, 0.2]
    quill = ([0.6], [0.11])
    generator = [0.3, 0.4, 0.5, 0.5, 0.5, 0.4, 0.3], [0.22, 0.3, 0.62, 0.62, 0.62, 0.3, 0.22]
    lengths, diameters = ([*a, *b, *c] for a, b, c in zip(turbine, quill, generator, strict=True))
    discs = (
        *(Disc(node, 380.0, 38.0, 20.0) for node in (2, 3, 4, 5)),
        Disc(7, 60.0, 1.0, 0.6), Disc(8, 60.0, 1.0, 0.6), Disc(15, 80.0, 1.5, 0.9),
    )  # fmt: skip
    films = {1: (0.2, 0.09, 1.6e-4), 6: (0.2, 0.09, 1.6e-4), 9: (0.22, 0.11, 1.8e-4), 14: (0.22, 0.11, 1.8e-4)}
    blocks = (
        Foundation(6000.0, 0.8, 1.25, (0.3, 2.2), (4e8, 7e8), (4e5, 5e5)),
        Foundation(9000.0, 1.0, 4.55, (3.4, 5.7), (5e8, 8e8), (5e5, 6e5)),
    )
    return Plant(
        on_films(Rotor(shaft(lengths, diameters), discs, ()), films, 0.022), blocks,
        at_rpm(1500, 1800, 2100, 2400, 2700, 3000, 3300, 3600),
        {3: 700 * 1e-5, 5: 700 * 8e-6 * np.exp(1j), 11: 1500 * 8e-6 * np.exp(2j), 12: 1500 * 1e-5 * np.exp(3j)},
        hub=7, other_hub=8, coupling=(8e7, 2e6), wheels=(5, 3), bow=(3,), cracks=((5, 0.6), (3, 0.5)),
    )  # fmt: skip


PLANTS = {"compressor": compressor, "pump": pump, "train": train}
