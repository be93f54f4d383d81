"""Cases of a blind test: a machine with a hidden effect, its measurement, and the truth.

A case depends on the configuration, the seed and its number alone.
"""

from dataclasses import dataclass

import numpy as np

from rotorstudy.blind.base import left_by_base
from rotorstudy.blind.hiding import sized, what_to_hide
from rotorstudy.blind.observation import CARRIED, colouring, harmonics_of, measure, observe
from rotorstudy.blind.setting import draw_setting
from rotorstudy.blind.simulated_effects import SIMULATED_EFFECTS, ForeignEffect
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.registry import registry

STREAM = 6  # separates the random numbers of blind tests from those of studies
MOST_DRAWS = 30


@dataclass(frozen=True)
class Case:
    """A measurement and the truth behind it.

    rig      : dict, nominal;  spectrum : Spectrum;  records : list of Record
    stated   : settings that the diagnosis is given
    truth    : dict of plain numbers and strings
    """

    rig: dict
    spectrum: Spectrum
    records: list
    stated: dict
    truth: dict


def draw_case(config, seed, index):
    """The Case of a number (`index`); config : BlindConfig. Raises RotorstudyError if no drawn machine is steady."""
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
    setting = draw_setting(config, rig, generator)
    levels = config.two_noise_percent if kind == "two" else config.noise_percent
    noise_percent = float(generator.choice(levels))
    hidden, foreign, left_out = what_to_hide(kind, setting, generator)
    low, high = config.two_size if kind == "two" else config.size
    wanted = np.exp(generator.uniform(np.log(low), np.log(high), len(hidden)))
    colour = float(generator.uniform(0, config.most_colour))

    clean = observe(setting, [])
    moving = CARRIED != 0
    rms = np.sqrt(np.sum(np.abs(harmonics_of(clean, CARRIED, config)[..., moving]) ** 2, axis=-1).mean(axis=1))
    level = noise_percent / 100 * np.median(rms)
    harmonics = np.array(config.harmonics)
    std = level * colouring(colour, harmonics, config.samples_per_revolution)
    base = harmonics_of(clean, harmonics, config)

    def change(effects):
        seen = harmonics_of(observe(setting, effects), harmonics, config)
        return float(np.sqrt(np.mean((np.abs(seen - base) / std) ** 2)))

    sizes, alone = [], []
    for one, s in zip(hidden, wanted, strict=True):
        size, reached = sized(one, s, change)
        sizes.append(size)
        alone.append(reached)
    acting = [(one.name, *one.at(size)) for one, size in zip(hidden, sizes, strict=True)]
    signals = observe(setting, acting) if acting else clean
    exact = harmonics_of(signals, harmonics, config)
    together = change(acting) if len(acting) > 1 else (alone[0] if alone else 0.0)
    records, spectrum = measure(config, setting, signals, level, colour, generator)
    stated = {
        "uncertainty": {"default": config.base_share, "rotor": config.rotor_share},
        "nuisance": {"phase_reference": config.phase_mark_std_rad, "probe_gain": config.gain_std},
        "model_error": config.model_error,
        "leave_out": left_out,
    }
    beyond = []  # of each effect alone
    for one in acting:
        seen = signals if len(acting) == 1 else observe(setting, [one])
        beyond.append(left_by_base(harmonics_of(seen, harmonics, config) - base, spectrum, setting.nominal, stated))
    hidden_ones = zip(hidden, acting, alone, beyond, strict=True)
    truth |= {
        "rig": name,
        "sensors": list(setting.nominal.sensors),
        "speed_rad_per_s": setting.speeds.tolist(),
        "noise_percent": noise_percent,
        "noise_colour": colour,
        "change_over_noise": together,
        "left_out": left_out,
        "foreign": foreign,
        "effects": [_recorded(one, values, place, size, left) for one, (_, values, place), size, left in hidden_ones],
        "base": {effect: _parts(values) for effect, values, _ in setting.effects},
        "phase_mark_rad": float(setting.mark),
        "without_noise": [exact.real.tolist(), exact.imag.tolist()],
    }
    return Case(rig, spectrum, records, stated, truth)


def _recorded(hidden, values, place, change, left):
    """A hidden effect as the truth records it, with its declared confounders.

    change, left : over noise, of the effect alone, and of that what the base model cannot absorb
    """
    effect = SIMULATED_EFFECTS[hidden.name]
    if isinstance(effect, ForeignEffect):
        confounders = list(effect.confounders)
    else:
        confounders = [name for name, _ in registry().get("effect", hidden.name).confounders]
    return {
        "effect": hidden.name,
        "where": hidden.where,
        "options": {key: value for key, value in place.items() if key not in hidden.where},
        "parameters": _parts(values),
        "units": hidden.units,
        "change_over_noise": change,
        "places": hidden.places,
        "confounders": confounders,
        "change_beyond_base": left,
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
