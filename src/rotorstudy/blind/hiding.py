"""What a blind test hides: which effect, where, with which parameters, and how large."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.machine import STEPS, steady_motion
from rotorstudy.blind.physics_in_time import OPENINGS
from rotorstudy.blind.simulated_effects import SIMULATED_EFFECTS, ForeignEffect, Scale
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term

SIZINGS = 6
CLOSE_ENOUGH = 1.2  # accepted ratio of the change obtained to the change wanted
RELATIVE_UNITS = ("1", "rad")
MOST_RELATIVE, MOST_ABSOLUTE = 6.0, 300.0  # largest effect in units of its typical size, by its unit


@dataclass(frozen=True)
class Hidden:
    """An effect at a place; its size is a factor to be chosen.

    where  : place;  options : further description;  values : parameter name -> value at size 1;  most : largest size
    places : number of places where it could act
    fixed  : the effect is present or absent, with these values; its size is that of its options, if it has any
    """

    name: str
    where: dict
    options: dict
    values: dict
    units: dict
    most: float
    places: int
    fixed: bool = False

    def at(self, size):
        """Values, and place with options, at a size (factor on `values`)."""
        scaled = {name: value * size for name, value in (self.options if self.fixed else self.values).items()}
        if self.fixed:
            return self.values, {**self.where, **scaled}
        return scaled, {**self.where, **self.options}


def rotor_families(setting):
    """Library effects on the rotor that can be hidden in this machine: name -> places."""
    return _families(setting, lambda effect: effect.on == "rotor")


def chain_families(setting):
    """Library errors of the measuring chain: name -> places."""
    return _families(setting, lambda effect: effect.on != "rotor")


def _families(setting, chosen):
    zoo, found = registry().plugins["effect"], {}
    for name in sorted(name for name, effect in SIMULATED_EFFECTS.items() if name in zoo and chosen(effect)):
        places = list(zoo[name].places(setting.nominal.structure, setting.nominal.sensors))
        taken = [_node_of(where, setting) for base, _, where in setting.effects if base == name]
        places = [p for p in places if not taken or _node_of(p, setting) not in taken]
        if zoo[name].candidate and places:
            found[name] = places
    return found


def _node_of(where, setting):
    return where.get("node", setting.nominal.structure.nodes[0])


def what_to_hide(kind, setting, generator):
    """List of Hidden, the name of foreign physics or None, and the effects to leave out of the library."""
    if kind == "clean":
        return [], None, []
    families = chain_families(setting) if kind == "chain" else rotor_families(setting)
    if kind == "foreign" and generator.random() < 0.5:
        every = [name for name, effect in SIMULATED_EFFECTS.items() if isinstance(effect, ForeignEffect)]
        foreign = str(generator.choice(every))
        return [hide_foreign(foreign, setting, generator)], foreign, []
    names = [str(n) for n in generator.choice(list(families), 2 if kind == "two" else 1, replace=False)]
    hidden = [hide(name, families[name], setting, generator) for name in names]
    return hidden, None, names if kind == "foreign" else []


def hide(name, places, setting, generator):
    """An effect of the library at a place, its parameters near their typical size."""
    plugin, effect = registry().get("effect", name), SIMULATED_EFFECTS[name]
    where = dict(places[generator.integers(len(places))])
    options = _options(plugin, where, setting, generator)
    item = {"kind": name, **plugin.example, **options, **where}
    term = make_term("effect", item, setting.nominal.structure, setting.nominal.sensors)
    values, units, most = {}, {}, np.inf
    for p in term.parameters:
        share, phase, sign = generator.uniform(0.5, 1), generator.uniform(-np.pi, np.pi), generator.choice([-1.0, 1.0])
        direction = np.exp(1j * phase) if p.is_complex else sign if effect.signed else 1.0
        values[p.name] = p.typical if plugin.fixed else p.typical * share * direction
        units[p.name] = p.unit
        most = min(most, effect.most or (MOST_RELATIVE if p.unit in RELATIVE_UNITS else MOST_ABSOLUTE))
    return Hidden(name, where, options, values, units, most, len(places), plugin.fixed)


def _options(plugin, where, setting, generator):
    """Shape parameters of an effect, where not at their defaults. Clearances lie within the motion: contact occurs."""
    if plugin.fixed or not plugin.shape:
        return dict.fromkeys(plugin.shape, 1.0)
    plant = setting.plant()
    motion = steady_motion(plant, [0, 1, -1])[..., plant.index(_node_of(where, setting))]
    radius = float(np.median(np.abs(motion[:, 1]) + np.abs(motion[:, 2])))
    options = {
        "clearance_m": radius * generator.uniform(0.3, 0.9),
        "lift_m": radius * generator.uniform(0, 0.5),
        "friction_ratio": generator.uniform(0.05, 0.3),
        "offset_ratio": generator.uniform(0, 0.9),
        "contact_angle_rad": generator.uniform(-np.pi, np.pi),
        "direction_rad": generator.uniform(*plugin.shape.get("direction_rad", (0, 1))),
        "swirl_ratio": generator.uniform(0.2, 0.6),
        "natural_frequency_rad_per_s": np.median(setting.speeds) * generator.uniform(0.5, 2),
        "play_m": radius * generator.uniform(0.3, 3),
        "bearing_time_s": generator.uniform(0, 0.3) / np.median(setting.speeds),
        "damping_ratio": generator.uniform(0.02, 0.2),
        "crack_angle_rad": 2 * np.pi / STEPS * generator.integers(-STEPS // 2, STEPS // 2),  # opens between two steps
    }
    if "frequency_ratio" in plugin.shape:
        options["frequency_ratio"] = generator.uniform(0.7, 1.4)
    chosen = {"crack": str(generator.choice(list(OPENINGS)))} if "crack" in plugin.alternatives else {}
    return {key: float(options[key]) for key in plugin.shape} | chosen


def hide_foreign(name, setting, generator):
    """Physics that the library lacks, at any node or in all probes; size 1 is 1 % of the characteristic size."""
    effect, structure = SIMULATED_EFFECTS[name], setting.nominal.structure
    node = int(generator.choice(structure.nodes))
    plant = setting.plant()
    motion = np.abs(steady_motion(plant, [1])[:, 0, plant.index(node)])
    radius, velocity = float(np.median(motion)), float(np.median(motion * setting.speeds))
    i = structure.index(node)
    typical, options = effect.draw(Scale(radius, velocity, float(structure.stiffness[i, i]) * radius), generator)
    where = {"node": node} if effect.on == "rotor" else {}
    return Hidden(name, where, options, {effect.size: 0.01 * typical}, {effect.size: effect.unit}, MOST_ABSOLUTE, 1)


def sized(hidden, wanted, change):
    """Size of an effect whose change over noise is as close as possible to the one wanted, and that change."""
    if hidden.fixed and not hidden.options:
        return 1.0, change([(hidden.name, *hidden.at(1.0))])
    size, best = 1e-2 * min(hidden.most, 100.0), None
    low, high = 0.0, hidden.most
    for _ in range(SIZINGS):
        try:
            reached = change([(hidden.name, *hidden.at(size))])
        except RotorstudyError:  # unstable, or without a periodic motion
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
        raise RotorstudyError(f"{hidden.name} does not change the harmonics here")
    return best
