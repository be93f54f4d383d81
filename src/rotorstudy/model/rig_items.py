"""Terms of a rig: the items of its sections, with their options and values, and keys in the units of balancing."""

from contextlib import contextmanager
from dataclasses import replace
from math import isfinite
from typing import get_args

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError, unknown_name
from rotorstudy.model.bearings import at_housings
from rotorstudy.model.cracks import SERIES_ORDER, crack_parameters, keys_from_depth
from rotorstudy.model.entries import Entry, Multiples, compacted
from rotorstudy.model.kinds import Bearing
from rotorstudy.model.options import Whole, check_options, choices, number_hint, option_names, plain
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import loading_films
from rotorstudy.model.structure import Structure, at_supports
from rotorstudy.model.terms import Parameter, Term, unit_suffix


def make_term(
    section: str,
    item: dict,
    structure: Structure,
    sensors: tuple[int, ...],
    where: str = "the term",
    *,
    is_foundation: bool = False,
) -> Term:
    """The Term described by an item of a rig: kind, label, options, and values of its parameters.

    The stiffness loss of a crack can be given by its depth instead: {"depth": {"kind": ..., "depth_ratio": ..., ...}}.

    Parameters
    ----------
    section : str
        "crack", "bearing" or "effect".
    item : dict
        {"kind": name, options..., parameter_unit: value, ...}; a complex parameter also has parameter_phase_rad. Angles
        can be given in degrees (`_deg` for `_rad`), an unbalance as unbalance_g_mm or unbalance_kg_m.
    structure : Structure
        The rotor it acts on.
    sensors : ints (sensor,)
        Nodes with a sensor.
    where : str, optional
        Its name in error messages.
    is_foundation : bool, optional
        Whether a bearing acts between what the one at that node stands on and the ground.

    Returns
    -------
    Term

    Raises
    ------
    RotorstudyError
        For an unknown key or a value that is not allowed.
    PluginError
        If the plugin gives something of a wrong type or shape.
    """
    with named(where):
        item = plain(item)
    plugin, given = registry().get(section, kind_of(item, where), where), without_kind(item)
    label = given.pop("label", "")
    if not isinstance(label, (str, int)):
        raise RotorstudyError(f"label = {label!r} in {where}: must be a text")
    fixed, is_crack = _fixed(plugin, section, structure, sensors), section == "crack"
    functions = (_every_crack, plugin.function) if is_crack else (plugin.function,)
    by_engine = ("angle",) if is_crack else tuple(fixed)
    if is_crack and "depth" in given:
        given = keys_from_depth(given.pop("depth"), plugin, structure, given, where) | given
    names = {name for function in functions for name in option_names(function, by_engine)}
    given = in_si(given, spellings(names), where)
    for name in {*option_names(_every_crack), "depth", "label"} & {*option_names(plugin.function)} if is_crack else ():
        told = f"option '{name}' is reserved for all cracks; rename it"
        raise PluginError(f"plugin '{plugin.name}' ({plugin.file}): {told}")
    own, left = {k: v for k, v in given.items() if k in names}, [key for key in given if key not in names]
    options = check_options(functions, own, where, by_engine, left)
    if section == "bearing":  # stated, so that it is a number of the bearing like others
        missing = {name: value for name, value in plugin.defaults.items() if options[name] is None}
        with named(where):
            options |= {name: value(structure, options.get("node")) for name, value in missing.items()}
    function = crack_parameters if is_crack else plugin.function
    parameters = _parameters(plugin, function, fixed, options, where, is_foundation)
    for changed in _other_choices(plugin, options, given):
        if {*given} <= {*_keys(parameters), *options}:
            break
        others = _parameters(plugin, function, fixed, changed, where, is_foundation)
        if {*given} <= {*_keys(others), *changed}:
            parameters, options = others, changed
    known = spellings([*_keys(parameters), *options], parameters)
    given = in_si(given, known, where)
    values = {key: value for key, value in given.items() if key not in options}
    values = _read_values(parameters, values, known, where)
    if is_crack:
        _check_losses(values, structure.stiffness_loss_at(options["node"], options["element"]), structure, where)
    changes = getattr(plugin, "changes_bearing", False)
    is_number = changes or any(p.loads_films for p in parameters)
    kind = {"is_bearing_number": is_number, "is_foundation": is_foundation, "carries": section == "bearing" or changes}
    return Term(plugin.name, parameters, values, getattr(plugin, "acts_on", "rotor"), label, options=options, **kind)


ACTS_ON = get_args(Entry.__annotations__["on"])
SUFFIXES = {"_deg": ("_rad", np.pi / 180), "_g_mm": ("_kg_m", 1e-6)}


def with_options(term: Term, options: dict, structure: Structure, sensors: tuple[int, ...]) -> Term:
    """The Term of an effect with other options, SI, and without values; only what the plugin gives is checked."""
    plugin, options, where = registry().get("effect", term.kind), {**term.options, **options}, f"effect {term.kind}"
    parameters = _parameters(plugin, plugin.function, _fixed(plugin, "effect", structure, sensors), options, where)
    values = {p.name: p.default for p in parameters if p.default is not None}
    return replace(term, parameters=parameters, values=values, options=options)


def _keys(parameters):
    """Keys of the values of parameters."""
    return [key for p in parameters for key in ((p.key, p.phase_key) if p.is_complex else (p.key,))]


def _other_choices(plugin, options, given):
    """Options with another value of each that takes one of several and is not stated: the keys of values may tell."""
    for name, values in choices(plugin.function).items():
        if name not in given:
            yield from ({**options, name: value} for value in values if value != options[name])


def _fixed(plugin, section, structure, sensors):
    """Arguments of the function of a plugin that are no options."""
    if section == "crack":
        return {"crack": plugin, "structure": structure}
    on_output = getattr(plugin, "acts_on", "rotor") == "output"
    fixed = {"sensors": sensors} if on_output else {}
    if not on_output or "structure" in option_names(plugin.function):
        fixed["structure"] = structure
    return fixed


def _parameters(plugin, function, fixed, options, where, is_foundation=False):
    """The parameters that a plugin gives, checked, of supports where these are."""
    with named(where):
        found = function(**fixed, **options)
    size = len(fixed["sensors"]) if "sensors" in fixed else len(fixed["structure"].dofs)
    parameters = [
        replace(p, positive=True) if plugin.is_positive(p) and not p.is_complex else p
        for p in _checked_parameters(found, size, plugin, where)
    ]
    if getattr(plugin, "acts_on", None) == "rotor":
        parameters = loading_films(parameters, fixed["structure"].films)
    if isinstance(plugin, Bearing) or getattr(plugin, "places", None) is at_supports:
        return at_housings(fixed["structure"], parameters, from_ground=is_foundation)
    return tuple(
        p if isinstance(p.entries, Multiples) or not p.entries else replace(p, entries=tuple(map(compacted, p.entries)))
        for p in parameters
    )


@contextmanager
def named(where):
    """Context in which an error of the package is raised with the place it is about."""
    try:
        yield
    except RotorstudyError as error:
        raise type(error)(f"{where}: {error}") from None


def _every_crack(
    weight_dominance: bool = True,
    order: Whole = SERIES_ORDER,
    node: int | None = None,
    element: int | None = None,
    angle_rad: float = 0.0,
):
    """Options of every crack."""


def _read_values(parameters, given, known, where):
    for key, value in given.items():
        if key not in _keys(parameters):
            raise unknown_name("key", key, [*known, "label"], where)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise RotorstudyError(f"{key} = {value!r} in {where}: must be a finite number{number_hint(value)}")
    values = {}
    for parameter in parameters:
        if parameter.key in given:
            phase = given.get(parameter.phase_key, 0.0)
            values[parameter.name] = given[parameter.key] * (np.exp(1j * phase) if parameter.is_complex else 1)
        elif parameter.default is not None:
            values[parameter.name] = parameter.default
        elif parameter.is_complex and parameter.phase_key in given:
            raise RotorstudyError(f"{parameter.phase_key} in {where} has no magnitude; give {parameter.key} too")
    return values


def _check_losses(values, losses, structure, where):
    """Raise for a crack that adds stiffness, or takes away more than the shaft has."""
    for name, value in values.items():
        pattern, unit, _ = losses[name]
        share = value if unit == "1" else np.max(value * np.diag(pattern) / np.diag(structure.stiffness))
        if value < 0 or share >= 1:
            whole = "" if unit == "1" or share <= 0 else f" ({value / share:.3g} {unit})"
            raise RotorstudyError(
                f"{name} = {value:g} in {where}: a crack loses from nothing up to, but not including, all of the "
                f"stiffness of the shaft there{whole}"
            )


def kind_of(item, where):
    """The name of the plugin of an item."""
    if not isinstance(item, dict) or "kind" not in item:
        raise RotorstudyError(f"key 'kind' is missing in {where}")
    if wrong := [key for key in item if not isinstance(key, str)]:
        raise RotorstudyError(f"key {wrong[0]!r} in {where}: must be a name; write a text")
    if not isinstance(item["kind"], str):
        raise RotorstudyError(f"kind = {item['kind']!r} in {where}: must be the name of a plugin")
    return item["kind"]


def without_kind(item):
    """Options and values of an item."""
    return {key: value for key, value in item.items() if key != "kind"}


def check_structure(structure, plugin, where):
    """Raise PluginError unless a rotor plugin returned a Structure whose matrices fit its coordinates."""
    who = f"rotor '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(structure, Structure):
        raise PluginError(f"{who} gives {type(structure).__name__}; it must give a Structure, see rotorstudy.plugins")
    size = len(structure.dofs)
    for name in ("mass", "stiffness", "gyroscopic", "static_load"):
        matrix, needed = getattr(structure, name), (size,) if name == "static_load" else (size, size)
        if np.shape(matrix) != needed:
            told = f"{who} gives {name} of shape {np.shape(matrix)}; it must be {needed} for its {size} coordinates"
            raise PluginError(told)
        if not np.isfinite(matrix).all():
            raise PluginError(f"{who} gives {name} with NaN or infinite values")


def _checked_parameters(found, size, plugin, where):
    """The parameters returned by a plugin as a tuple; PluginError unless each has finite entries that fit the rotor."""
    found = [found] if isinstance(found, Parameter) else found
    who = f"plugin '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(found, (list, tuple)) or not all(isinstance(one, Parameter) for one in found):
        inside = f" of {type(found[0]).__name__}" if isinstance(found, (list, tuple)) and found else ""
        raise PluginError(f"{who} gives {type(found).__name__}{inside}; it must give a list of Parameter")
    for i, parameter in enumerate(found):
        name, entries, local = parameter.name, parameter.entries, parameter.force
        if name in [other.name for other in found[:i]]:
            raise PluginError(f"{who} gives two parameters called '{name}'; rename one")
        if not parameter.unit:
            raise PluginError(f"{who}: '{name}' has no unit; write it as 'N s/m', or '1' for a pure number")
        if not isfinite(parameter.typical) or not isfinite(parameter.default or 0.0):
            numbers = f"typical = {parameter.typical}, default = {parameter.default}"
            raise PluginError(f"{who}: '{name}' has {numbers}; they must be finite")
        is_table = isinstance(entries, Multiples)
        if not (is_table or (isinstance(entries, (list, tuple)) and all(isinstance(e, Entry) for e in entries))):
            raise PluginError(
                f"{who}: the entries of '{name}' are {type(entries).__name__}; they must be a tuple of Entry, a single "
                "one written with a comma: (Entry(...),)"
            )
        on_output = getattr(plugin, "acts_on", "rotor") != "rotor"
        if local and (parameter.is_complex or entries or on_output or np.shape(local.matrix)[1:] != (size,)):
            raise PluginError(
                f"{who}: '{name}' multiplies a force in time: it must be real, act on the rotor, and have no entries "
                f"and a matrix (coordinate, {size}) here"
            )
        if local and not local.takes_its_arguments:
            told = "displacement, velocity, deflection" + ", shaft_angle" * local.takes_angle
            raise PluginError(f"{who}: the function of the force of '{name}' must take {told}")
        if is_table and not np.isfinite(entries.factor).all():
            raise PluginError(f"{who}: an entry of '{name}' is not finite")
        for i, entry in enumerate(() if is_table else entries):
            _check_entry(entry, size, f"{who}: entry {i} of '{name}'")
    return tuple(found)


def _check_entry(entry, size, who):
    """Raise PluginError unless the matrix of an entry fits the rotor and is finite."""
    needed = (size,) if entry.is_constant else (size, size)
    if np.shape(entry.matrix) != needed:
        raise PluginError(
            f"{who} has a matrix of shape {np.shape(entry.matrix)}; on '{entry.on}' it must be {needed} here"
        )
    whole = all(isinstance(n, (int, np.integer)) for n in (entry.order, entry.shift)) and 0 <= entry.order <= 2
    is_gain = entry.gain is None or callable(entry.gain)
    if entry.on not in ACTS_ON or not (whole and is_gain) or entry.nonzero[-1].dtype.kind not in "biufc":
        raise PluginError(
            f"{who} has on = {entry.on!r}, order = {entry.order!r}, shift = {entry.shift!r}; `on` must be one of "
            f"{', '.join(ACTS_ON)}, `order` 0, 1 or 2, `shift` a whole number, `gain` a function of the "
            "speed, and the matrix of numbers"
        )
    if not np.isfinite(entry.nonzero[-1]).all():
        raise PluginError(f"{who} is not finite")


def in_si(given, known, where):
    """Options or values, keys that stand for known ones in SI (`spellings`) replaced by these; others stay as they are.

    A quantity given twice is an error.
    """
    found, source = {}, {}
    for key, value in given.items():
        target, factor = known.get(key, (key, 1.0))
        if target in source:
            raise RotorstudyError(f"{source[target]} and {key} in {where} are the same quantity; give one of them")
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if isinstance(value, str) and factor != 1:
            raise RotorstudyError(f"{key} = {value!r} in {where}: must be a finite number{number_hint(value)}")
        found[target] = value * factor if factor != 1 and is_number else value
        source[target] = key
    return found


def spellings(keys, parameters=()):
    """{key: (key in SI, factor to it)} of keys in SI, and of what stands for them in other units and by other names."""
    found = {key: (key, 1.0) for key in keys}
    for parameter in parameters:
        for name, (unit, factor) in parameter.also.items():
            found.setdefault(f"{name}_{unit_suffix(unit)}", (parameter.key, factor))
            found.setdefault(f"{name}_phase_rad", (parameter.phase_key, 1.0))
    for own, (si, factor) in SUFFIXES.items():
        for key, (target, more) in [one for one in found.items() if one[0].endswith(si)]:
            found.setdefault(key.removesuffix(si) + own, (target, factor * more))
    return {key: meant for key, meant in found.items() if meant[0] in keys}
