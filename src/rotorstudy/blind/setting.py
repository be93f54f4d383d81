"""The machine of a blind test before anything is hidden in it, drawn around the nominal rig.

The diagnosis is given the nominal rig; the machine has other parameter values, other numbers of its rotor (modulus,
density, masses), a finer mesh and a measuring chain with small errors.
"""

import itertools
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.machine import build_plant, critical_speeds, growth, settle
from rotorstudy.blind.physics import bearing
from rotorstudy.blind.simulated_effects import SIMULATED_EFFECTS
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import rig_with_changes, uncertain_numbers

RANGE_OF_SPEEDS = (0.35, 1.7)  # of the first critical speed
KEEP_OFF = 0.04  # smallest relative distance of any speed from a resonance of 1X, 2X or 3X
NEAR = (0.05, 0.14)  # relative distance of the one near-critical speed from the first critical speed


@dataclass(frozen=True)
class Setting:
    """The machine and its measurement without the hidden effects.

    nominal  : Model of the rig file;  structure, place : of the mesh of the machine
    bearings, effects : [(name, values, place)] of the base
    speeds   : (speed,) rad/s;  gains : (sensor, 2) error and mismatch of the probe gains
    mark     : rad, error of the phase mark;  angle : (time,) rad, of the shaft at each sample
    """

    nominal: Model
    structure: object
    place: object
    bearings: list
    effects: list
    speeds: np.ndarray
    gains: np.ndarray
    mark: float
    angle: np.ndarray

    def plant(self, speeds=None):
        """The machine at some speeds (rad/s), its own if not given."""
        speeds = self.speeds if speeds is None else speeds
        return _plant(self.nominal, self.structure, self.place, self.bearings, self.effects, speeds)


def draw_setting(config, rig, generator):
    """Draw the Setting of a rig dict: base parameters around the nominal ones, speeds, measuring-chain errors."""
    nominal = build_model(rig)
    rotor = _other_rotor(rig["rotor"], nominal.structure, config.rotor_share, generator)
    structure, place = _machine(rotor, config.mesh_factor)
    bearings, effects = [], []
    for section, found in (("bearings", bearings), ("effects", effects)):
        for item in rig.get(section) or []:
            term = make_term("bearing" if section == "bearings" else "effect", item, nominal.structure, nominal.sensors)
            values = {p.name: _around(term.values[p.name], config.base_share, generator) for p in term.parameters}
            found.append((term.kind, values, {k: item[k] for k in ("node", "mass_kg") if k in item}))
    still = _plant(nominal, structure, place, bearings, effects, [1.0])
    count = generator.integers(config.fewest_speeds, config.most_speeds + 1)
    speeds = _speeds(critical_speeds(still), count, generator)
    plant = _plant(nominal, structure, place, bearings, effects, speeds)
    speeds = speeds[growth(plant) < 0]
    if len(speeds) < config.fewest_speeds:
        raise RotorstudyError("too few speeds at which the machine is stable")
    samples = config.revolutions * config.samples_per_revolution
    gains = generator.normal(0, config.gain_std, (len(nominal.sensors), 2)) if config.gain_std else 0
    mark = generator.normal(0, config.phase_mark_std_rad) if config.phase_mark_std_rad else 0.0
    angle = 2 * np.pi * np.arange(samples) / config.samples_per_revolution
    gains = np.broadcast_to(gains, (len(nominal.sensors), 2))
    return Setting(nominal, structure, place, bearings, effects, speeds, gains, float(mark), angle)


def _other_rotor(rotor, structure, share, generator):
    """The rotor with its uncertain numbers drawn around the nominal ones, with a relative standard deviation."""
    (own,) = generator.spawn(1)
    model = Model(structure)
    changes = {name: share * np.clip(own.normal(), -2.5, 2.5) for name in uncertain_numbers(model, "rotor")}
    return rig_with_changes({"rotor": rotor}, model, changes)["rotor"]


def _machine(rotor, factor):
    """Structure of the machine, and the map from a nominal node or element to its mesh."""
    rotor = deepcopy(rotor)
    if "elements" not in rotor:
        return build_model({"rotor": rotor}).structure, lambda n, element=False: [n] if element else n

    def place(n, element=False):
        return list(range(factor * (n - 1) + 1, factor * n + 1)) if element else factor * (n - 1) + 1

    for stretch in rotor["elements"]:
        stretch["count"] = factor * stretch.get("count", 1)
    for body in [*rotor.get("discs", []), *rotor.get("point_masses", [])]:
        body["node"] = place(body["node"])
    for held in ("pinned_nodes", "clamped_nodes"):
        rotor[held] = [place(n) for n in rotor.get(held, [])]
    return build_model({"rotor": rotor}).structure, place


def _around(value, share, generator):
    """A base value drawn around its nominal value, with the stated standard deviation; it keeps its sign."""
    off = np.clip(generator.normal(size=2), -2.5, 2.5) * share * abs(value)
    return value + off[0] + (1j * off[1] if isinstance(value, complex) else 0)


def _speeds(critical, count, generator):
    """Sorted speeds: one near the first critical speed, the others spread over the range; none on a resonance."""
    first = critical[0]
    resonances = [mode / n for mode in critical[:3] for n in (1, 2, 3)]
    found = [first * (1 + generator.choice([-1, 1]) * generator.uniform(*NEAR))]
    edges = np.linspace(*RANGE_OF_SPEEDS, count) * first
    for low, high in itertools.pairwise(edges):
        tries = generator.uniform(low, high, 50)
        off = np.min(np.abs(tries[:, None] / np.array(resonances) - 1), axis=1)
        apart = np.min(np.abs(tries[:, None] / np.array(found) - 1), axis=1) > 0.02
        good = np.flatnonzero((off > KEEP_OFF) & apart)
        found += [tries[good[0]]] if len(good) else []
    return np.sort(found)


def _plant(nominal, structure, place, bearings, effects, speeds):
    plant = build_plant(structure, nominal.structure, place, speeds)
    for _, values, where in bearings:
        bearing(plant, values, where)
    settle(plant)
    for name, values, where in effects:
        SIMULATED_EFFECTS[name].function(plant, values, where)
    return plant
