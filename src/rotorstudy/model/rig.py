"""Build a model from a rig file (YAML); all keys are checked here."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

from rotorstudy.errors import CannotAct, PluginError, RotorstudyError, unknown_name
from rotorstudy.model.cracks import SERIES_ORDER, crack_parameters
from rotorstudy.model.depth import keys_from_depth
from rotorstudy.model.key_units import aliases_of, in_si
from rotorstudy.model.model import Model
from rotorstudy.model.options import Whole, check_options, number_hint, option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Origin, Reading, Structure
from rotorstudy.model.terms import Entry, Parameter, Term
from rotorstudy.model.uncertainty import with_uncertainty
from rotorstudy.yaml_file import read_yaml

SECTIONS = {"rotor": "rotor", "cracks": "crack", "bearings": "bearing", "effects": "effect"}
# `measurement` is read by rotorstudy.measurement, `diagnosis` by rotorstudy.diagnosis
SPEEDS_TRIED = 12  # halved each time, to find one at which a bearing is defined
OTHER = ("sensors", "static_deflection_m", "prior", "measurement", "diagnosis")


@dataclass(frozen=True)
class RigFile:
    """A rig file that is read once.

    path  : where it was read from
    given : its content
    """

    path: Path
    given: dict

    @cached_property
    def model(self):
        """The Model that it describes."""
        return build_model(self.given, str(self.path))

    @property
    def plugins(self):
        """The plugins that it names, a list of Plugin."""
        return named_plugins(self.given)

    def measured_at(self, sensors, reading=None):
        """The Model with the nodes `sensors` as its sensors, and the Reading of its records."""
        return build_model({**self.given, "sensors": list(sensors)}, str(self.path), reading)


def read_rig(rig: "str | Path | RigFile") -> "RigFile":
    """The RigFile at a path; a RigFile is returned unchanged.

    Parameters
    ----------
    rig : path or RigFile
        Path of a rig file, or a RigFile.

    Returns
    -------
    RigFile

    Raises
    ------
    RotorstudyError
        If the file cannot be read.
    """
    return rig if isinstance(rig, RigFile) else RigFile(Path(rig), read_yaml(rig))


def load_rig(path: str | Path) -> Model:
    """The Model described by a rig file.

    Parameters
    ----------
    path : path
        YAML file, with the unit of each number in its key.

    Returns
    -------
    Model

    Raises
    ------
    RotorstudyError
        If the file cannot be read, and as `build_model`.
    """
    return read_rig(path).model


def build_model(rig: dict, where: str = "the rig", reading: Reading | None = None) -> Model:
    """The Model described by a rig dict.

    Parameters
    ----------
    rig : dict
        {"rotor": {"kind": ..., options}, "cracks": [...], "bearings": [...], "effects": [...], "sensors": [nodes],
        "static_deflection_m": {node: prescribed value, real}, "prior": see `uncertainty`}
    where : str, optional
        Its name in error messages.
    reading : Reading, optional
        Of its records; effects of probes act along them.

    Returns
    -------
    Model

    Raises
    ------
    RotorstudyError
        For an unknown or missing key, or a value that is not allowed.
    PluginError
        If a plugin gives something of a wrong type or shape.
    """
    if not isinstance(rig, dict):
        raise RotorstudyError(f"{where}: expected sections {', '.join(SECTIONS)}, found {type(rig).__name__}")
    for key in rig:
        if key not in {*SECTIONS, *OTHER}:
            raise unknown_name("section", key, [*SECTIONS, *OTHER], where)
    if "rotor" not in rig:
        raise RotorstudyError(f"section 'rotor' is missing in {where}")
    place = f"{where}, rotor"
    plugin = registry().get("rotor", _kind(rig["rotor"], place), place)
    options = check_options(plugin.function, _rest(rig["rotor"]), place)
    structure = plugin.function(**options)
    _check_structure(structure, plugin, place)
    origin = Origin(plugin.function, options, plugin.uncertain)
    structure = replace(
        structure,
        bearing_nodes=tuple(item["node"] for item in _at_nodes(rig.get("bearings"))),
        labels=_labels(rig),
        origin=origin,
        reading=reading or Reading(),
    )
    sensors = _sensors(rig.get("sensors"), structure, where)
    terms = []
    for section in ("cracks", "bearings", "effects"):
        if not isinstance(rig.get(section) or [], list):
            raise RotorstudyError(
                f"section '{section}' in {where} must be a list of items, each starting with '- kind:'"
            )
        for i, item in enumerate(rig.get(section) or []):
            terms.append(make_term(SECTIONS[section], item, structure, sensors, f"{where}, {section}[{i}]"))
        if section == "bearings" and rig.get(section):
            structure = replace(structure, support=_support(structure, terms))
    _check_together(structure, terms, where)
    held = _held_deflection(rig.get("static_deflection_m"), structure, where)
    model = Model(structure, tuple(terms), sensors, held)
    if rig.get("prior") is None:
        return model
    return with_uncertainty(model, rig["prior"], f"{where}, prior")


def _check_together(structure, terms, where):
    """Raise if two effects of a kind cannot be on the rotor together."""
    for one, other in combinations(terms, 2):
        plugin = registry().plugins["effect"].get(one.kind)
        if one.kind == other.kind and plugin and plugin.together:
            try:
                plugin.together(structure, one.options, other.options)
            except CannotAct as error:
                raise RotorstudyError(f"{where}, two effects {one.kind}: {error}") from None


def _support(structure, terms):
    """Static stiffness (dof, dof) of the bearings, N/m, those without a value with their typical one.

    It gives the usual sizes of effects alone, so that a film may be taken at any speed at which it exists.
    """
    import numpy as np

    found, speeds = np.zeros_like(structure.stiffness), structure.scales.frequency * 0.5 ** np.arange(SPEEDS_TRIED)
    for term in (term for term in terms if term.carries):
        for unknown, value in zip(term.unknowns, term.theta, strict=True):
            size = unknown.typical if np.isnan(value) else value
            for entry in unknown.entries:
                if entry.on == "z" and entry.order == 0 and entry.shift == 0:
                    found -= size * _gain_somewhere(entry, speeds) * np.real(entry.matrix)
    return (found + found.T) / 2


def _gain_somewhere(entry, speeds):
    """Gain (real) of an entry at 0X at the first of some speeds where it exists; 0 if at none."""
    for speed in speeds:
        try:
            return entry.gain_at(speed, 0).real
        except RotorstudyError:  # outside its table, or without a film
            continue
    return 0.0


def _at_nodes(items):
    """Items of a section that have a node; mistakes are found when their terms are made."""
    items = items if isinstance(items, list) else []
    return [item for item in items if isinstance(item, dict) and isinstance(item.get("node"), int)]


def _labels(rig):
    """{node: label} of the labelled discs and bearings, those of the bearings with that word."""
    found = {disc["node"]: str(disc["label"]) for disc in _at_nodes(rig["rotor"].get("discs")) if disc.get("label")}
    for bearing in _at_nodes(rig.get("bearings")):
        if bearing.get("label"):
            name = str(bearing["label"])
            found[bearing["node"]] = name if "bearing" in name.lower() else f"bearing {name}"
    return found


def _held_deflection(given, structure, where):
    """Prescribed static deflection (dof,), m, zero where it is not given; None if the weight determines it."""
    import numpy as np

    if given is None:
        return None
    if not isinstance(given, dict):
        raise RotorstudyError(f"static_deflection_m = {given!r} in {where}: must be a mapping of nodes to metres")
    held = np.zeros(len(structure.dofs))
    for node, value in given.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise RotorstudyError(f"static_deflection_m of node {node} = {value!r} in {where}: must be a finite number")
        held[structure.index(node)] = value
    return held


def _sensors(given, structure, where):
    if given is None:
        return structure.nodes
    if not isinstance(given, list) or not given or len(set(map(str, given))) < len(given):
        raise RotorstudyError(f"sensors = {given!r} in {where}: must be a list of nodes, each once")
    for node in given:
        if node not in structure.nodes or isinstance(node, bool):
            raise RotorstudyError(f"sensors: node {node!r} in {where} does not exist (nodes: {list(structure.nodes)})")
    return tuple(given)


def named_plugins(rig):
    """The plugins that a rig dict names, a list of Plugin."""
    found = []
    for section, kind in SECTIONS.items():
        items = rig.get(section) or []
        found += [
            registry().get(kind, item["kind"], section) for item in ([items] if isinstance(items, dict) else items)
        ]
    depths = [item["depth"] for item in rig.get("cracks") or [] if "depth" in item]
    return found + [registry().get("depth", depth["kind"], "depth") for depth in depths]


def make_term(
    section: str, item: dict, structure: Structure, sensors: tuple[int, ...], where: str = "the term"
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
    plugin = registry().get(section, _kind(item, where), where)
    given = _rest(item)
    label = given.pop("label", "")
    if not isinstance(label, (str, int)):
        raise RotorstudyError(f"label = {label!r} in {where}: must be a text")
    function, fixed, acts_on = plugin.function, {}, getattr(plugin, "acts_on", "rotor")
    if section == "crack":
        function, fixed = crack_parameters, {"crack": plugin, "structure": structure}
        if "depth" in given:
            depth = given.pop("depth")
            given = {**keys_from_depth(depth, plugin, structure, given, where), **given}
        names = {n for one in (_every_crack, plugin.function) for n in option_names(one, ("angle",))}
        given = in_si(given, names, where)
        options = _crack_options(plugin, given, where)
    else:
        fixed = {"sensors": sensors} if acts_on == "output" else {}
        if acts_on != "output" or "structure" in option_names(function):
            fixed["structure"] = structure
        names = option_names(function, fixed)
        given = in_si(given, names, where)
        options = check_options(function, {k: v for k, v in given.items() if k in names}, where, fixed)
    parameters = _parameters(function(**fixed, **options), plugin, where)
    _check_shapes(parameters, len(sensors) if acts_on == "output" else len(structure.dofs), plugin, where)
    keys = [key for p in parameters for key in ((p.key, p.phase_key) if p.is_complex else (p.key,))]
    given = in_si(given, [*keys, *options], where, aliases_of(parameters))
    values = {key: value for key, value in given.items() if key not in options}
    values = _read_values(parameters, values, options, where)
    if section == "crack":
        _check_losses(
            values, structure.stiffness_loss_at(options.get("node"), options.get("element")), structure, where
        )
    return Term(plugin.name, parameters, values, acts_on, label, carries=section == "bearing", options=options)


def _check_structure(structure, plugin, where):
    """Raise PluginError unless a rotor plugin returned a Structure whose matrices fit its coordinates."""
    import numpy as np

    who = f"rotor '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(structure, Structure):
        raise PluginError(f"{who} gives {type(structure).__name__}; it must give a Structure, see rotorstudy.plugins")
    size = len(structure.dofs)
    for name in ("mass", "stiffness", "gyroscopic", "static_load"):
        matrix, needed = getattr(structure, name), (size,) if name == "static_load" else (size, size)
        if np.shape(matrix) != needed:
            raise PluginError(
                f"{who} gives {name} of shape {np.shape(matrix)}; it must be {needed} for its {size} coordinates"
            )
        if not np.isfinite(matrix).all():
            raise PluginError(f"{who} gives {name} with NaN or infinite values")


def _parameters(found, plugin, where):
    """The parameters returned by a plugin as a tuple, or PluginError unless each is a Parameter with entries."""
    found = [found] if isinstance(found, Parameter) else found
    who = f"plugin '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(found, (list, tuple)) or not all(isinstance(one, Parameter) for one in found):
        inside = f" of {type(found[0]).__name__}" if isinstance(found, (list, tuple)) and found else ""
        raise PluginError(f"{who} gives {type(found).__name__}{inside}; it must give a list of Parameter")
    for parameter in found:
        if not parameter.unit:
            raise PluginError(f"{who}: '{parameter.name}' has no unit; write it as 'N s/m', or '1' for a pure number")
        if not isinstance(parameter.entries, (list, tuple)) or not all(isinstance(e, Entry) for e in parameter.entries):
            raise PluginError(
                f"{who}: the entries of '{parameter.name}' are {type(parameter.entries).__name__}; they must be a "
                "tuple of Entry, a single one written with a comma: (Entry(...),)"
            )
    return tuple(found)


def _check_shapes(parameters, size, plugin, where):
    """Raise PluginError unless the matrices of a plugin fit the rotor and are finite."""
    import numpy as np

    for parameter in parameters:
        local = parameter.force
        if local and (
            parameter.is_complex
            or parameter.entries
            or getattr(plugin, "acts_on", "rotor") != "rotor"
            or np.shape(local.matrix)[1:] != (size,)
        ):
            raise PluginError(
                f"plugin '{plugin.name}' ({plugin.file}) in {where}: '{parameter.name}' multiplies a force in time: "
                f"it must be real, act on the rotor, and have no entries and a matrix (coordinate, {size}) here"
            )
        for i, entry in enumerate(parameter.entries):
            needed = (size,) if entry.is_constant else (size, size)
            if np.shape(entry.matrix) != needed:
                raise PluginError(
                    f"plugin '{plugin.name}' ({plugin.file}) in {where}: entry {i} of '{parameter.name}' has a matrix "
                    f"of shape {np.shape(entry.matrix)}; on '{entry.on}' it must be {needed} here"
                )
            if not np.isfinite(entry.matrix).all():
                raise PluginError(
                    f"plugin '{plugin.name}' ({plugin.file}) in {where}: entry {i} of '{parameter.name}' is not finite"
                )


def _every_crack(
    weight_dominance: bool = True,
    order: Whole = SERIES_ORDER,
    node: int | None = None,
    element: int | None = None,
    angle_rad: float = 0.0,
):
    """Options of every crack."""


def _crack_options(plugin, given, where):
    options = {}
    for function in (_every_crack, plugin.function):
        names = option_names(function, ("angle",))
        for name in {*options, "depth", "label"} & {*names}:
            raise PluginError(
                f"plugin '{plugin.name}' ({plugin.file}): option '{name}' is reserved for all cracks; rename it"
            )
        options |= check_options(function, {k: v for k, v in given.items() if k in names}, where, ("angle",))
    return options


def _read_values(parameters, given, options, where):
    import numpy as np

    allowed = {p.key for p in parameters} | {p.phase_key for p in parameters if p.is_complex}
    for key, value in given.items():
        if key not in allowed:
            raise unknown_name("key", key, [*allowed, *options, "label"], where)
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
    import numpy as np

    for name, value in values.items():
        pattern, unit, _ = losses[name]
        share = value if unit == "1" else np.max(value * np.diag(pattern) / np.diag(structure.stiffness))
        if value < 0 or share >= 1:
            raise RotorstudyError(
                f"{name} = {value:g} in {where}: a crack loses from nothing up to, but not including, all of the "
                "stiffness of the shaft there" + ("" if unit == "1" else f" ({value / share:.3g} {unit})")
            )


def _kind(item, where):
    if not isinstance(item, dict) or "kind" not in item:
        raise RotorstudyError(f"key 'kind' is missing in {where}")
    if not isinstance(item["kind"], str):
        raise RotorstudyError(f"kind = {item['kind']!r} in {where}: must be the name of a plugin")
    return item["kind"]


def _rest(item):
    return {key: value for key, value in item.items() if key != "kind"}
