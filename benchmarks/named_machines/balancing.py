"""Machines to be balanced in two planes, with what a rig file does not know of them.

Beside the unbalances of the two planes there may be one of a third disc and a bow; both planes scatter from run to run
by what heat and fits move.
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.draw import first_frequency
from rotorstudy.blind.machines.effects import add_bow, add_unbalance
from rotorstudy.blind.machines.files import discs_section
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.blind.machines.rig_items import springs
from rotorstudy.blind.machines.stepping import steady_state

ELEMENTS, DISCS, PROBES = 12, (2, 6, 9), (1, 11)  # of the shaft, and nodes
PLANES = (2, 9)  # nodes of the correction planes
GAIN, PHASE = 5e-3, 5e-3  # errors of the probes and of the phase mark, 1 and rad


@dataclass(frozen=True)
class Balanced:
    """A machine and what is written of it: `rig` (numbers that are a little wrong), `speeds`, `noise` in m."""

    machine: object
    speeds: np.ndarray
    noise: float
    scatter: float
    gains: np.ndarray
    phase: float
    rig: dict

    def motion(self, added=(), own=(0.0, 0.0)):
        """Harmonics 1 and -1 (speed, harmonic, probe) of x + j y, m.

        added : (node, unbalance in kg m, complex) each;  own : unbalances of the planes in this run, kg m
        """
        machine = replace(self.machine, harmonic=dict(self.machine.harmonic))
        for node, value in (*added, *zip(PLANES, own, strict=True)):
            add_unbalance(machine, node, abs(value), np.angle(value))
        return steady_state(machine, self.speeds, steps=8).harmonics(PROBES, (1, -1))

    def scattered(self, rng):
        """Unbalances of the planes in one run, kg m."""
        return self.scatter * (rng.normal(size=2) + 1j * rng.normal(size=2))

    def reading(self, motion, rng):
        """What the probes show of a motion, with gains, an angle of the phase mark and noise."""
        x, y = motion[:, 0] + motion[:, 1].conj(), (motion[:, 0] - motion[:, 1].conj()) / 1j
        x, y = self.gains[0] * x, self.gains[1] * y  # of one each probe
        forward, backward = (x + 1j * y) / 2, np.conj(x - 1j * y) / 2
        turn = np.exp(1j * self.phase)
        shown = np.stack([forward * turn, backward / turn], axis=1)
        noise = rng.normal(0, self.noise, (2, *shown.shape))
        return shown + noise[0] + 1j * noise[1]


def draw(seed):
    """A machine of three discs on two bearings, its rig file with errors as large as stated there."""
    rng = np.random.default_rng([seed, 30])
    length, diameter = rng.uniform(0.7, 1.3), rng.uniform(0.025, 0.045)
    element = Element(length / ELEMENTS, diameter, 2.1e11 * (1 + 0.02 * rng.normal()), 7850.0)
    masses = rng.uniform(2.0, 8.0, 3)
    discs = tuple(Disc(node, m, m * 5e-3, m * 2.7e-3) for node, m in zip(DISCS, masses, strict=True))
    shaft = 48 * element.bending_stiffness / length**3
    stiffness = shaft * rng.uniform(1.5, 8.0, 2)[:, None] * rng.uniform(0.8, 1.0, (2, 2))
    damping = 0.04 * np.sqrt(shaft * masses.sum()) * rng.uniform(0.5, 2.5, 2)[:, None] * np.ones(2)
    ends = (0, ELEMENTS)
    bearings = tuple(Bearing(n, np.diag(k), np.diag(c)) for n, k, c in zip(ends, stiffness, damping, strict=True))
    machine = build(Rotor((element,) * ELEMENTS, discs, bearings))
    critical = first_frequency(machine.rotor)
    usual = 20e-6 * rng.lognormal(0, 0.5)  # eccentricity, m
    sizes = usual * masses * (rng.normal(size=3) + 1j * rng.normal(size=3)) / np.sqrt(2)
    sizes[1] *= rng.choice([0.0, 0.1, 0.4])  # that nobody states
    for node, value in zip(DISCS, sizes, strict=True):
        add_unbalance(machine, node, abs(value), np.angle(value))
    if rng.random() < 0.5:
        at = np.linspace(0, np.pi, ELEMENTS + 1)
        size = 0.3 * usual * (rng.normal() + 1j * rng.normal())
        add_bow(machine, size * np.column_stack([np.sin(at), np.pi / length * np.cos(at)]))
    speeds = critical * (0.5 + (np.arange(6) + 0.8 * rng.random(6)) / 6)
    scatter = rng.choice([0.0, 0.05]) * usual * masses.mean()
    found = Balanced(machine, speeds, 0.0, scatter, 1 + GAIN * rng.normal(size=(2, len(PROBES))),
                     PHASE * rng.normal(), {})  # fmt: skip
    noise = rng.choice([0.002, 0.01]) * float(np.abs(found.motion()).max())
    off = 1 + rng.normal(size=8) * [0.1, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.2]
    rig = {
        "rotor": {
            "kind": "finite_element",
            "elements": [{"length_m": length, "count": ELEMENTS}],
            "outer_diameter_m": diameter,
            "discs": discs_section(found.machine.rotor),
        },
        "bearings": [
            item
            for *values, n, label in zip(stiffness / off[:4].reshape(2, 2), damping / off[4:].reshape(2, 2), ends,
                                         ("left", "right"), strict=True)
            for item in springs({n + 1: label}, *map(tuple, values))
        ],
        "effects": [
            {"kind": "unbalance", "node": node + 1, "label": f"{name} {node + 1}", "mass_kg": 1e-3,
             "eccentricity_m": 0.0}
            for node in PLANES for name in ("residual", "scatter")
        ],
        "sensors": [node + 1 for node in PROBES],
        "measurement": {"harmonics": [1, -1], "table_noise_m": noise},
        "diagnosis": {
            "uncertainty": {
                "default": 0.1, "rotor": 0.0, "rotor.youngs_modulus_Pa": 0.02,
                **{f"bearing_damping_{axis}": 0.2 for axis in ("xx", "yy")},
            },
            "run_to_run": [f"eccentricity[scatter {node + 1}]" for node in PLANES],
        },
    }  # fmt: skip
    names = [f"eccentricity[{name} {node + 1}]_{part}" for name in ("residual", "scatter") for node in PLANES
             for part in ("real", "imag")]  # fmt: skip
    wide, narrow = 1e3 * 3 * usual * masses.max(), 1e3 * max(scatter, 1e-6 * usual)
    rig["prior"] = {"parameters": names, "standard_deviations": [float(wide)] * 4 + [float(narrow)] * 4}
    return replace(found, noise=noise, rig=rig)
