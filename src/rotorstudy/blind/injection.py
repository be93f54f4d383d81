"""Cases of a blind test: a machine with something hidden in it, what its probes show, and the truth.

A case is drawn from a seed and its number alone. The rig file that goes to the diagnosis holds the nominal values; the
machine has others, a finer mesh, a measuring chain that is a little off, and what is hidden. See `machine` and
`physics` for how it moves and `chain` for what is measured of it.
"""

import itertools
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.base import left_by_base
from rotorstudy.blind.chain import CHAIN, CHAIN_SIGNED, FOREIGN_CHAIN, LABEL, UNSIZED, phase_reference, probe_gain
from rotorstudy.blind.machine import build_plant, critical_speeds, growth, settle, steady_motion
from rotorstudy.blind.physics import FOREIGN, HIDDEN, SIGNED, bearing
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.harmonics import estimate
from rotorstudy.measurement.records import Record
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model, make_term

STREAM = 6  # keeps the random numbers of blind tests apart from those of studies
CARRIED = np.arange(-12, 13)  # harmonics of the motion that a record holds
MOST_DRAWS = 30
SIZINGS = 6
CLOSE_ENOUGH = 1.2  # factor between the change wanted and had
RELATIVE_UNITS = ("1", "rad")
MOST_TYPICAL = {"relative": 6.0, "loss": 1.5, "absolute": 300.0}  # largest effect, in its typical size
RANGE_OF_SPEEDS = (0.35, 1.7)  # of the first critical speed
KEEP_OFF = 0.04  # relative distance of any speed from a resonance of 1X, 2X or 3X
NEAR = (0.05, 0.14)  # relative distance from the first critical speed of the one speed that is near


@dataclass(frozen=True)
class Case:
    """What is measured, and the truth.

    rig      : dict, nominal;  spectrum : Spectrum;  records : list of Record
    stated   : what else the diagnosis is told, keys of its settings
    truth    : dict of plain numbers and words
    """

    rig: dict
    spectrum: Spectrum
    records: list
    stated: dict
    truth: dict


@dataclass(frozen=True)
class Setting:
    """The machine and its measurement without what is hidden.

    nominal  : Model of the rig file;  structure, place : of the mesh of the machine
    bearings, effects : [(name, values, place)] of the base
    speeds   : (speed,) rad/s;  gains : (sensor, 2) common and differing error;  mark : rad
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


@dataclass(frozen=True)
class Hidden:
    """An effect at a place, of a size still to be multiplied.

    where   : place;  options : what else describes it;  values : parameter name -> value at size 1;  most : size
    """

    name: str
    where: dict
    options: dict
    values: dict
    units: dict
    most: float
    places: int

    def at(self, size):
        if self.name in UNSIZED:
            return self.values, {**self.where, **self.options}
        if "corner_rad_per_s" in self.options:
            corner = self.options["corner_rad_per_s"] * size
            return self.values, {**self.where, **self.options, "corner_rad_per_s": corner}
        return {name: value * size for name, value in self.values.items()}, {**self.where, **self.options}


def draw_case(config, seed, index):
    """The Case of a number, whoever asks for it and whenever."""
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, index)))
    kind = str(generator.choice(list(config.shares), p=list(config.shares.values())))
    problems = []
    for _ in range(MOST_DRAWS):
        try:
            return _draw(config, kind, generator, {"case": index, "seed": seed, "kind": kind})
        except RotorstudyError as error:  # unstable, or no steady motion: no such record can be taken
            problems.append(str(error))
    raise RotorstudyError(f"blind case {index} of seed {seed}: {MOST_DRAWS} draws failed, the last: {problems[-1]}")


def _draw(config, kind, generator, truth):
    name = str(generator.choice(list(config.rigs)))
    sets = config.rigs[name].sensor_sets
    rig = {**config.nominal(name), "sensors": sets[generator.integers(len(sets))]}
    setting = _setting(config, rig, generator)
    levels = config.two_noise_percent if kind == "two" else config.noise_percent
    noise_percent = float(generator.choice(levels))
    hidden, foreign, left_out = _what(kind, setting, generator)
    low, high = config.two_size if kind == "two" else config.size
    wanted = np.exp(generator.uniform(np.log(low), np.log(high), len(hidden)))
    colour = float(generator.uniform(0, config.most_colour))

    clean = _observe(setting, [])
    moving = CARRIED != 0
    rms = np.sqrt(np.sum(np.abs(_harmonics(clean, CARRIED, config)[..., moving]) ** 2, axis=-1).mean(axis=1))
    level = noise_percent / 100 * np.median(rms)
    harmonics = np.array(config.harmonics)
    std = level * _colouring(colour, harmonics, config.samples_per_revolution)
    base = _harmonics(clean, harmonics, config)

    def change(effects):
        seen = _harmonics(_observe(setting, effects), harmonics, config)
        return float(np.sqrt(np.mean((np.abs(seen - base) / std) ** 2)))

    sizes, alone = [], []
    for one, s in zip(hidden, wanted, strict=True):
        size, reached = _size(one, s, change)
        sizes.append(size)
        alone.append(reached)
    acting = [(one.name, *one.at(size)) for one, size in zip(hidden, sizes, strict=True)]
    signals = _observe(setting, acting) if acting else clean
    together = change(acting) if len(acting) > 1 else (alone[0] if alone else 0.0)
    records, spectrum = _measure(config, setting, signals, level, colour, generator)
    stated = {
        "uncertainty": {"default": config.base_share},
        "nuisance": {"phase_reference": config.phase_mark_std_rad, "probe_gain": config.gain_std},
        "model_error": config.model_error,
        "leave_out": left_out,
    }
    beyond = []  # of each effect alone
    for one in acting:
        seen = signals if len(acting) == 1 else _observe(setting, [one])
        beyond.append(left_by_base(_harmonics(seen, harmonics, config) - base, spectrum, setting.nominal, stated))
    truth |= {
        "rig": name,
        "sensors": list(setting.nominal.sensors),
        "speed_rad_per_s": setting.speeds.tolist(),
        "noise_percent": noise_percent,
        "noise_colour": colour,
        "change_over_noise": together,
        "left_out": left_out,
        "foreign": foreign,
        "effects": [
            _told(one, values, place, s) | {"change_beyond_base": left}
            for one, (_, values, place), s, left in zip(hidden, acting, alone, beyond, strict=True)
        ],
        "base": {effect: _parts(values) for effect, values, _ in setting.effects},
        "phase_mark_rad": float(setting.mark),
        "without_noise": [
            _harmonics(signals, harmonics, config).real.tolist(),
            _harmonics(signals, harmonics, config).imag.tolist(),
        ],
    }
    return Case(rig, spectrum, records, stated, truth)


def _setting(config, rig, generator):
    """The machine behind a rig: base parameters around the nominal ones, speeds, errors of the chain."""
    nominal = build_model(rig)
    structure, place = _machine(rig, config.mesh_factor)
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


def _machine(rig, factor):
    """Structure of the machine, and the node or elements of its mesh that one of the rig file stands for."""
    rotor = deepcopy(rig["rotor"])
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
    """A base value off its nominal one, as much as is stated; never so far that it changes its sign."""
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
        HIDDEN[name](plant, values, where)
    return plant


def _observe(setting, acting):
    """(speed, sensor, time) complex signals without noise; acting : [(name, values, place and options)]."""
    sensors, speeds = setting.nominal.sensors, setting.speeds
    for name, values, _ in acting:
        if name == LABEL:
            speeds = speeds * (1 + values[LABEL])
    plant = _plant(setting.nominal, setting.structure, setting.place, setting.bearings, setting.effects, speeds)
    for name, values, where in acting:
        act = HIDDEN.get(name) or FOREIGN.get(name, (None,))[0]
        if act:
            act(plant, values, where)
    motion = steady_motion(plant, CARRIED)[..., [plant.index(node) for node in sensors]]
    turning = np.exp(1j * np.multiply.outer(CARRIED, setting.angle))
    signals = np.einsum("shn,ht->snt", motion, turning)
    for s, speed in enumerate(speeds):
        for name, values, where in acting:
            distort = CHAIN.get(name) or FOREIGN_CHAIN.get(name, (None,))[0]
            if distort:
                signals[s] = distort(signals[s].copy(), setting.angle, speed, values, where, sensors)
        for node, (g, m) in zip(sensors, setting.gains, strict=True):
            error = {"gain_error": g, "gain_mismatch": m}
            signals[s] = probe_gain(signals[s], setting.angle, speed, error, {"node": node}, sensors)
        error = {"phase_reference": setting.mark}
        signals[s] = phase_reference(signals[s], setting.angle, speed, error, {}, sensors)
    return signals


def _harmonics(signals, harmonics, config):
    """(speed, sensor, harmonic) of signals that hold whole turns."""
    lines = np.fft.fft(signals, axis=-1) / signals.shape[-1]
    return lines[..., np.asarray(harmonics) * config.revolutions]


def _colouring(colour, harmonics, samples):
    """(harmonic,) size of noise whose samples are correlated by `colour`, over that of white noise."""
    angle = 2 * np.pi * harmonics / samples
    return np.sqrt(1 - colour**2) / np.abs(1 - colour * np.exp(-1j * angle))


def _measure(config, setting, signals, level, colour, generator):
    """Records with noise, and the spectrum estimated from them as from any measured record."""
    from scipy.signal import lfilter

    samples = signals.shape[-1]
    draws = generator.standard_normal((*signals.shape, 2))
    draws[..., 0, :] /= np.sqrt(1 - colour**2)  # stationary from the first sample
    noise = lfilter([1.0], [1.0, -colour], draws, axis=-2) * np.sqrt(1 - colour**2)
    noise = (noise[..., 0] + 1j * noise[..., 1]) * level * np.sqrt(samples / 2)
    records, amplitude, covariance = [], [], []
    for s, speed in enumerate(setting.speeds):
        shown = signals[s] + noise[s]
        where = f"blind record at {speed:.6g} rad/s"
        records.append(Record(setting.angle / speed, shown, float(speed), setting.nominal.sensors, where=where))
        found = [estimate(z, setting.angle, config.revolutions, config.harmonics) for z in shown]
        amplitude.append(np.transpose([one.amplitude for one in found]))
        covariance.append([one.covariance for one in found])
    spectrum = Spectrum(
        np.array(amplitude),
        setting.speeds,
        np.array(config.harmonics),
        tuple(setting.nominal.sensors),
        np.array(covariance),
    )
    return records, spectrum


def rotor_families(setting):
    """name -> places of the zoo's effects on the rotor that can be hidden in this machine."""
    return _families(setting, list(HIDDEN))


def chain_families(setting):
    """name -> places of the zoo's errors of the measuring chain."""
    return _families(setting, [*CHAIN, LABEL])


def _families(setting, names):
    zoo, found = registry().plugins["effect"], {}
    for name in sorted(set(names) & set(zoo)):
        places = list(zoo[name].places(setting.nominal.structure, setting.nominal.sensors))
        taken = [_node_of(where, setting) for base, _, where in setting.effects if base == name]
        places = [p for p in places if not taken or _node_of(p, setting) not in taken]
        if zoo[name].candidate and places:
            found[name] = places
    return found


def _node_of(where, setting):
    return where.get("node", setting.nominal.structure.nodes[0])


def _what(kind, setting, generator):
    """What is hidden: list of Hidden, the name of foreign physics or None, families to leave out of the library."""
    if kind == "clean":
        return [], None, []
    rotor, foreign, left_out = rotor_families(setting), None, []
    if kind == "chain":
        rotor = chain_families(setting)
    if kind == "foreign" and generator.random() < 0.5:
        foreign = str(generator.choice([*FOREIGN, *FOREIGN_CHAIN]))
        return [_foreign(foreign, setting, generator)], foreign, []
    names = [str(n) for n in generator.choice(list(rotor), 2 if kind == "two" else 1, replace=False)]
    hidden = [_family(name, rotor[name], setting, generator) for name in names]
    if kind == "foreign":
        left_out = names
    return hidden, foreign, left_out


def _family(name, places, setting, generator):
    """An effect of the zoo at a place, its parameters near their typical size."""
    plugin = registry().get("effect", name)
    where = dict(places[generator.integers(len(places))])
    options = _options(name, where, setting, generator)
    item = {"kind": name, **plugin.example, **options, **where}
    term = make_term("effect", item, setting.nominal.structure, setting.nominal.sensors)
    values, units, most = {}, {}, np.inf
    signed = name in SIGNED or name in CHAIN_SIGNED
    for p in term.parameters:
        share, phase, sign = generator.uniform(0.5, 1), generator.uniform(-np.pi, np.pi), generator.choice([-1.0, 1.0])
        values[p.name] = p.typical * share * (np.exp(1j * phase) if p.is_complex else sign if signed else 1.0)
        if name in UNSIZED or "corner_rad_per_s" in options:
            values[p.name] = 1.0
        units[p.name] = p.unit
        scale = "loss" if p.name.startswith("stiffness_loss") else "absolute"
        most = min(most, MOST_TYPICAL["relative" if p.unit in RELATIVE_UNITS and scale != "loss" else scale])
    return Hidden(name, where, options, values, units, most, len(places))


def _options(name, where, setting, generator):
    """Shape of an effect: what is searched, not fitted. Contacts are placed within the motion, so that they happen."""
    shape = registry().get("effect", name).shape
    if "corner_rad_per_s" in shape:
        return {"corner_rad_per_s": 1.0}
    if not shape:
        return {}
    plant = _plant(setting.nominal, setting.structure, setting.place, setting.bearings, setting.effects, setting.speeds)
    motion = steady_motion(plant, [0, 1, -1])[..., plant.index(_node_of(where, setting))]
    radius = float(np.median(np.abs(motion[:, 1]) + np.abs(motion[:, 2])))
    options = {
        "clearance_m": radius * generator.uniform(0.3, 0.9),
        "lift_m": radius * generator.uniform(0, 0.5),
        "friction_ratio": generator.uniform(0.05, 0.3),
    }
    return {key: float(options[key]) for key in shape}


def _foreign(name, setting, generator):
    """Physics that the zoo does not have, at any node or in all probes; at size 1 of the order of the motion itself."""
    structure = setting.nominal.structure
    node = int(generator.choice(structure.nodes))
    plant = _plant(setting.nominal, setting.structure, setting.place, setting.bearings, setting.effects, setting.speeds)
    motion = np.abs(steady_motion(plant, [1])[:, 0, plant.index(node)])
    radius, velocity = float(np.median(motion)), float(np.median(motion * setting.speeds))
    i = structure.index(node)
    force = float(structure.stiffness[i, i]) * radius
    options, typical, where = {}, 0.0, {"node": node}
    if name == "coulomb_friction":
        options, typical, unit = {"smooth_m_per_s": 0.1 * velocity}, force, "N"
    elif name == "quadratic_damping":
        typical, unit = force / velocity**2, "N s2/m2"
    elif name == "gear_mesh":
        options = {"direction_rad": generator.uniform(0, np.pi), "phase_rad": generator.uniform(-np.pi, np.pi)}
        typical, unit = force, "N"
    else:
        where, typical, unit = {}, *((1 / radius, "1/m") if name == "probe_saturation" else (1.0, "1"))
    key = FOREIGN.get(name, FOREIGN_CHAIN.get(name))[1]
    return Hidden(name, where, options, {key: 0.01 * typical}, {key: unit}, MOST_TYPICAL["absolute"], 1)


def _size(hidden, wanted, change):
    """Size of an effect whose change over noise is the one wanted, or as near as it can be; and that change."""
    if hidden.name in UNSIZED:
        return 1.0, change([(hidden.name, *hidden.at(1.0))])
    size, best = 1e-2 * min(hidden.most, 100.0), None
    low, high = 0.0, hidden.most
    for _ in range(SIZINGS):
        try:
            reached = change([(hidden.name, *hidden.at(size))])
        except RotorstudyError:  # unstable, or so strong that nothing repeats
            high = size
            size = (low or size / 10) ** 0.5 * size**0.5
            continue
        if best is None or abs(np.log(max(reached, 1e-12) / wanted)) < abs(np.log(max(best[1], 1e-12) / wanted)):
            best = size, reached
        if 1 / CLOSE_ENOUGH < reached / wanted < CLOSE_ENOUGH or (size >= hidden.most and reached < wanted):
            break
        if reached < wanted:
            low = max(low, size)
        size = min(size * np.clip(wanted / max(reached, 1e-12), 1e-3, 1e3), high)
        if size == high < hidden.most:
            size = (low or high / 10) ** 0.5 * high**0.5
    if best is None or best[1] < 1e-3:
        raise RotorstudyError(f"{hidden.name} leaves no trace here")
    return best


def _told(hidden, values, place, s):
    """A hidden effect as the truth states it, with the names that an answer may use."""
    plugin = registry().plugins["effect"].get(hidden.name)
    if plugin:
        confounders = [name for name, _ in plugin.confounders]
    else:
        confounders = list(FOREIGN.get(hidden.name, FOREIGN_CHAIN.get(hidden.name))[2])
    return {
        "effect": hidden.name,
        "where": hidden.where,
        "options": {key: value for key, value in place.items() if key not in hidden.where},
        "parameters": _parts(values),
        "units": hidden.units,
        "change_over_noise": s,
        "places": hidden.places,
        "confounders": confounders,
    }


def _parts(values):
    """Amplitudes as plain numbers: a complex one by its parts, and by magnitude and phase."""
    found = {}
    for name, value in values.items():
        if isinstance(value, complex):
            found |= {f"{name}_real": value.real, f"{name}_imag": value.imag}
            found |= {name: abs(value), f"{name}_phase": float(np.angle(value))}
        else:
            found[name] = float(value)
    return {name: float(value) for name, value in found.items()}
