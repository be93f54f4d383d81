"""Keys of a rig file in the units of balancing, read as keys in SI: angles in degrees, unbalance in g mm or kg m."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.options import number_hint
from rotorstudy.model.terms import unit_suffix

SUFFIXES = {"_deg": ("_rad", np.pi / 180), "_g_mm": ("_kg_m", 1e-6)}


def in_si(given, known, where, aliases=None):
    """Options or values, keys that stand for known ones in SI replaced by these; a quantity given twice is an error.

    aliases : other key in SI -> (known key, factor);  keys that stand for nothing known stay as they are
    """
    known, aliases, found, source = set(known), aliases or {}, {}, {}
    for key, value in given.items():
        target, factor = _standing_for(key, known, aliases)
        if target in source:
            raise RotorstudyError(f"{source[target]} and {key} in {where} are the same quantity; give one of them")
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if isinstance(value, str) and factor != 1:
            raise RotorstudyError(f"{key} = {value!r} in {where}: must be a finite number{number_hint(value)}")
        found[target] = value * factor if factor != 1 and is_number else value
        source[target] = key
    return found


def aliases_of(parameters):
    """{other key: (key, factor)} of the values of some parameters."""
    found = {}
    for parameter in parameters:
        for name, (unit, factor) in parameter.also.items():
            found[f"{name}_{unit_suffix(unit)}"] = (parameter.key, factor)
            found[f"{name}_phase_rad"] = (parameter.phase_key, 1.0)
    return found


def spellings(keys):
    """Some keys in SI, and those in other units that stand for them."""
    others = [key.removesuffix(si) + own for key in keys for own, (si, _) in SUFFIXES.items() if key.endswith(si)]
    return [*keys, *others]


def without_aliases(item, keys, aliases):
    """An item of a rig without its keys that stand for some keys in SI."""
    return {key: value for key, value in item.items() if _standing_for(key, set(keys), aliases)[0] not in keys}


def _standing_for(key, known, aliases):
    """The key in SI that a key stands for, and the factor to it; the key itself if it stands for none."""
    if key in known:
        return key, 1.0
    factor = 1.0
    for suffix, (si, to_si) in SUFFIXES.items():
        if key.endswith(suffix) and (key.removesuffix(suffix) + si) in known | set(aliases):
            key, factor = key.removesuffix(suffix) + si, to_si
    if key in aliases and aliases[key][0] in known:
        target, more = aliases[key]
        return target, factor * more
    return key, factor
