"""A rig file (YAML) read into a model. Every key is checked here, once."""

from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge

from rotorstudy.cracks import SERIES_ORDER, crack_parameters
from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model import Model
from rotorstudy.options import check_options, option_names, validation_message
from rotorstudy.plugins import registry
from rotorstudy.terms import Term

SECTIONS = {"rotor": "rotor", "cracks": "crack", "bearings": "bearing", "effects": "effect"}


def load_rig(path):
    """The Model a rig file describes."""
    return build_model(read_yaml(path), where=str(path))


def read_yaml(path):
    """A YAML file as a dict; what is wrong with it is said in one line."""
    import yaml

    path = Path(path)
    if not path.is_file():
        raise RotorstudyError(f"file '{path}' does not exist")
    try:
        found = yaml.safe_load(path.read_text())
    except yaml.YAMLError as error:
        place = getattr(error, "problem_mark", None)
        at = f" line {place.line + 1}" if place else ""
        raise RotorstudyError(f"{path}{at}: not valid YAML: {getattr(error, 'problem', error)}") from None
    if not isinstance(found, dict):
        raise RotorstudyError(f"{path}: expected keys and values, found {type(found).__name__}")
    return found


def check_config(config_class, given, where):
    """A pydantic configuration from a dict; unknown, missing and impossible values are one-line errors."""
    from pydantic import ValidationError

    for key in given:
        if key not in config_class.model_fields:
            raise unknown_name("key", key, config_class.model_fields, where)
    try:
        return config_class(**given)
    except ValidationError as error:
        raise RotorstudyError(validation_message(error, where)) from None


def build_model(rig, where="the rig"):
    """The Model a rig dict describes.

    rig : {"rotor": {"kind": ..., options}, "cracks": [...], "bearings": [...], "effects": [...], "sensors": [nodes]}
    """
    for key in rig:
        if key not in {*SECTIONS, "sensors"}:
            raise unknown_name("section", key, [*SECTIONS, "sensors"], where)
    if "rotor" not in rig:
        raise RotorstudyError(f"section 'rotor' is missing in {where}")
    place = f"{where}, rotor"
    plugin = registry().get("rotor", _kind(rig["rotor"], place), place)
    structure = plugin.function(**check_options(plugin.function, _rest(rig["rotor"]), place))
    sensors = tuple(rig.get("sensors") or structure.nodes)
    terms = []
    for section in ("cracks", "bearings", "effects"):
        if not isinstance(rig.get(section) or [], list):
            raise RotorstudyError(
                f"section '{section}' in {where} must be a list of items, each starting with '- kind:'"
            )
        for i, item in enumerate(rig.get(section) or []):
            terms.append(make_term(SECTIONS[section], item, structure, sensors, f"{where}, {section}[{i}]"))
    return Model(structure, tuple(terms), sensors)


def named_plugins(rig):
    """The Plugin objects a rig dict names."""
    found = []
    for section, kind in SECTIONS.items():
        items = rig.get(section) or []
        found += [
            registry().get(kind, item["kind"], section) for item in ([items] if isinstance(items, dict) else items)
        ]
    return found


def make_term(section, item, structure, sensors, where="the term"):
    """A Term from a plugin kind and its configuration: kind, label, options, and values of its parameters.

    section : "crack", "bearing" or "effect"
    item    : {"kind": name, options..., parameter_unit: value, ...}; a complex parameter also has parameter_phase_rad
    """
    plugin = registry().get(section, _kind(item, where), where)
    given = _rest(item)
    label = given.pop("label", "")
    function, fixed, acts_on = plugin.function, {}, getattr(plugin, "acts_on", "rotor")
    if section == "crack":
        function, fixed = crack_parameters, {"crack": plugin, "structure": structure}
        options = _typed_crack_options(given, where)
    else:
        fixed = {"sensors": sensors} if acts_on == "output" else {"structure": structure}
        names = option_names(function, fixed)
        options = check_options(function, {k: v for k, v in given.items() if k in names}, where, fixed)
    parameters = tuple(function(**fixed, **options))
    values = {key: value for key, value in given.items() if key not in options}
    return Term(plugin.name, parameters, _read_values(parameters, values, options, where), acts_on, label)


def _typed_crack_options(given, where):
    def crack_options(weight_dominance: bool = True, order: Annotated[int, Ge(1)] = SERIES_ORDER):
        return {"weight_dominance": weight_dominance, "order": order}

    return check_options(crack_options, {k: v for k, v in given.items() if k in ("weight_dominance", "order")}, where)


def _read_values(parameters, given, options, where):
    import numpy as np

    allowed = {p.key for p in parameters} | {p.phase_key for p in parameters if p.is_complex}
    for key, value in given.items():
        if key not in allowed:
            raise unknown_name("key", key, [*allowed, *options, "label"], where)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise RotorstudyError(f"{key} = {value!r} in {where}: must be a finite number{_yaml_hint(value)}")
    values = {}
    for parameter in parameters:
        if parameter.key in given:
            phase = given.get(parameter.phase_key, 0.0)
            values[parameter.name] = given[parameter.key] * (np.exp(1j * phase) if parameter.is_complex else 1)
        elif parameter.is_complex and parameter.phase_key in given:
            raise RotorstudyError(f"{parameter.phase_key} in {where} has no magnitude; give {parameter.key} too")
    return values


def _yaml_hint(value: Any):
    """YAML reads 2.5e5 as text; say so where that is what happened."""
    try:
        float(value)
    except (TypeError, ValueError):
        return ""
    return " (YAML wants a sign in the exponent: 2.5e+5)" if isinstance(value, str) else ""


def _kind(item, where):
    if not isinstance(item, dict) or "kind" not in item:
        raise RotorstudyError(f"key 'kind' is missing in {where}")
    return item["kind"]


def _rest(item):
    return {key: value for key, value in item.items() if key != "kind"}
