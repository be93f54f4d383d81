"""Build a model from a rig file (YAML); all keys are checked here."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from os.path import realpath
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.bearings import on_housings, springs_at_rest
from rotorstudy.model.model import Model
from rotorstudy.model.options import check_options, plain
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import check_structure, kind_of, make_term, named, without_kind
from rotorstudy.model.rig_numbers import Holder, films_of
from rotorstudy.model.structure import Reading
from rotorstudy.model.uncertainty import with_uncertainty
from rotorstudy.yaml_file import read_yaml

SECTIONS = {"rotor": "rotor", "cracks": "crack", "bearings": "bearing", "foundation": "bearing", "effects": "effect"}
# `measurement` is read by rotorstudy.measurement, `diagnosis` by rotorstudy.diagnosis, `units` by shown_units
OTHER = ("sensors", "static_deflection_m", "prior", "measurement", "diagnosis", "units")
MOST_DEGREES = 3600.0  # of an angle, which has lost digits beyond
SMALLEST, LARGEST = 1e-30, 1e30  # sizes of numbers in a rig; their fourth powers, and quotients of those, are numbers


@dataclass(frozen=True)
class RigFile:
    """A rig file that is read once: where it was read from, and what was given."""

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
        model = build_model({**self.given, "sensors": list(sensors)}, str(self.path), reading)
        _sensors(self.given.get("sensors"), model.structure, str(self.path))  # those it names must be possible too
        return model


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
    return rig if isinstance(rig, RigFile) else RigFile(Path(rig), _with_whole_paths(read_yaml(rig), Path(rig).parent))


def _with_whole_paths(given, folder):
    """A rig dict in which the files that items of `foundation:` name, from its folder, are found from anywhere."""
    items = given.get("foundation")
    for item in items if isinstance(items, list) else []:
        if isinstance(item, dict) and isinstance(item.get("file"), str):
            item["file"] = realpath(folder / item["file"])
    return given


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
        {"rotor": {"kind": ..., options}, "cracks": [...], "bearings": [...], "foundation": [...], "effects": [...],
        "sensors": [nodes], "static_deflection_m": {node: prescribed value, real}, "prior": see `uncertainty`}
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
    with named(where):
        rig = plain(rig)
    if not isinstance(rig, dict):
        raise RotorstudyError(f"{where}: expected sections {', '.join(SECTIONS)}, found {type(rig).__name__}")
    check_known("section", rig, [*SECTIONS, *OTHER], where)
    _check_sizes(rig, where)
    if "rotor" not in rig:
        raise RotorstudyError(f"section 'rotor' is missing in {where}")
    place = f"{where}, rotor"
    plugin = registry().get("rotor", kind_of(rig["rotor"], place), place)
    options = check_options(plugin.function, without_kind(rig["rotor"]), place)
    with named(place):
        check_structure(plugin.function(**options), plugin, place)
    function = on_housings(plugin.function, _housings(rig, where))
    structure, origin = function(**options), Holder("rotor", "", function, options, plugin.uncertain)
    bearing_nodes = tuple(item["node"] for item in _at_nodes(rig.get("bearings")))
    check_known("node", bearing_nodes, structure.nodes, f"{where}, bearings")
    structure = replace(structure, bearing_nodes=bearing_nodes)
    structure = replace(structure, casings=_carried("on", rig, structure, (), where))
    sensors = _sensors(rig.get("sensors"), structure, where)
    riding = _carried("relative_to", rig, structure, [n for n in sensors if n in structure.nodes], where)
    structure = replace(structure, labels=_labels(rig), origin=origin, riding=riding, reading=reading or Reading())
    terms = []
    for section in ("cracks", "bearings", "foundation", "effects"):
        if not isinstance(rig.get(section) or [], list):
            raise RotorstudyError(f"section '{section}' in {where} must be a list of items that start with '- kind:'")
        for i, item in enumerate(rig.get(section) or []):
            place, is_foundation = f"{where}, {section}[{i}]", section == "foundation"
            terms.append(make_term(SECTIONS[section], item, structure, sensors, place, is_foundation=is_foundation))
        if SECTIONS[section] == "bearing" and rig.get(section):
            own = tuple(term for term in terms if term.carries and not term.is_foundation)
            under = tuple(term for term in terms if term.is_foundation)
            structure = replace(structure, support=_support(structure, terms), bearings=own, foundation=under)
            structure = replace(structure, films=films_of(structure))
    _check_together(structure, terms, where)
    for node in structure.housings:
        here = structure.index(node, "housing")
        entries = [e for term in terms if term.is_foundation for p in term.parameters for e in p.entries]
        if not any((e.order == 2 or e.frequency_only) and e.matrix[here, here] for e in entries):
            raise RotorstudyError(f"{where}, foundation: what the bearing at node {node} stands on has no mass")
    held = _held_deflection(rig.get("static_deflection_m"), structure, where)
    model = Model(structure, tuple(terms), sensors, held)
    return model if rig.get("prior") is None else with_uncertainty(model, rig["prior"], f"{where}, prior")


def _check_sizes(given, where, key=""):
    """Raise for a number that no machine has in any unit: its powers would leave the range of numbers."""
    inside = given.items() if isinstance(given, dict) else enumerate(given) if isinstance(given, (list, tuple)) else ()
    for name, value in inside:
        _check_sizes(value, where, f"{key}[{name}]" if isinstance(name, int) else f"{key}.{name}".lstrip("."))
    if isinstance(given, (int, float)) and given and not SMALLEST <= abs(given) <= LARGEST and np.isfinite(given):
        raise RotorstudyError(f"{key} = {given!r} in {where}: must be from {SMALLEST:g} to {LARGEST:g} in size, or 0")
    if key.endswith(("_deg", "_rad")) and isinstance(given, (int, float)) and MOST_DEGREES < abs(given) < np.inf:
        raise RotorstudyError(f"{key} = {given!r} in {where}: an angle must be within {MOST_DEGREES:g} in size")


def _check_together(structure, terms, where):
    """Raise if two effects of a kind cannot be on the rotor together."""
    for one, other in combinations(terms, 2):
        plugin = registry().plugins["effect"].get(one.kind)
        if one.kind == other.kind and plugin and plugin.together:
            with named(f"{where}, two effects {one.kind}"):
                plugin.together(structure, one.options, other.options)


def _support(structure, terms):
    """Static stiffness (dof, dof) of the bearings, N/m, a typical one where it is not stated: for usual sizes alone."""
    springs = sum(springs_at_rest(structure, term) for term in terms if term.carries)
    alike = springs[0, :, 0] + springs[1, :, 1]  # without what acts on the conjugate
    return (alike + alike.T) / 4


def _at_nodes(items):
    """Items of a section that have a node; mistakes are found when their terms are made."""
    items = items if isinstance(items, list) else []
    return [item for item in items if isinstance(item, dict) and isinstance(item.get("node"), int)]


def _housings(rig, where):
    """Nodes of the items of the section `foundation:`, each once; all must have a bearing."""
    items, found, carried = rig.get("foundation") or [], [], [one["node"] for one in _at_nodes(rig.get("bearings"))]
    for i, item in enumerate(items if isinstance(items, list) else []):
        given = item if isinstance(item, dict) else {}
        given = [value for key, value in given.items() if str(key).endswith(("node", "_nodes"))]
        given = [node for value in given for node in (value if isinstance(value, list) else [value])]
        found += given
        check_known("node of a bearing", given, carried, f"{where}, foundation[{i}]")
    return dict.fromkeys(found)


def _carried(key, rig, structure, sensors, where):
    """{node of a probe: node of the housing that a key names}: "relative_to", of probes that ride on it, or "on" it."""
    measured, found = rig.get("measurement"), {}
    probes = measured.get("probes") if isinstance(measured, dict) else None
    if not isinstance(probes, list) or not all(isinstance(probe, dict) for probe in probes):
        return {}  # said where the section is read
    called = {bearing.get("label", bearing["node"]): bearing["node"] for bearing in _at_nodes(rig.get("bearings"))}
    called |= {node: node for node in structure.bearing_nodes} | {f"bearing {name}": at for name, at in called.items()}
    for i, probe in enumerate(probes):
        place, to = f"{where}, measurement.probes[{i}]", probe.get(key)
        if probe.get("on") is not None and probe.get("relative_to") is not None:
            raise RotorstudyError(f"{place}: give 'on:' (a casing) or 'relative_to:' (the shaft against one), not both")
        for node in [probe["node"]] if probe.get("node") is not None else sensors:
            housing = {**called, "bearing": node}.get(to) if to is not None else None
            if to is not None and housing not in structure.housings:
                raise RotorstudyError(
                    f"{key} = {to!r} in {place}: must be a bearing on the foundation, by its label or node, or "
                    "'bearing' for the one at the probe's own node (on a foundation: nodes "
                    f"{list(structure.housings)})"
                )
            if found.setdefault(node, housing) != housing:
                raise RotorstudyError(f"{place}: all probes of node {node} need the same bearing under '{key}:'")
    found = {node: housing for node, housing in found.items() if housing is not None}
    for node in found if key == "on" else ():
        if node in structure.nodes or isinstance(node, bool) or not isinstance(node, int):
            raise RotorstudyError(
                f"{where}, measurement.probes: node = {node!r} of a transducer with 'on:' must be a number that no "
                f"node of the rotor has (nodes: {list(structure.nodes)})"
            )
    return found


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
    if given is None:
        return None
    if not isinstance(given, dict):
        raise RotorstudyError(f"static_deflection_m = {given!r} in {where}: must be a mapping of nodes to metres")
    held = np.zeros(len(structure.dofs))
    check_known("node", given, structure.nodes, f"{where}, static_deflection_m")
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
        if node not in structure.measurable or isinstance(node, bool):
            raise RotorstudyError(f"sensors: node {node!r} in {where} does not exist (nodes: {list(structure.nodes)})")
    return tuple(given)


def named_plugins(rig):
    """The plugins that a rig dict names, a list of Plugin."""
    found = []
    for section, kind in SECTIONS.items():
        items = rig.get(section) or []
        items = [items] if isinstance(items, dict) else items
        found += [registry().get(kind, item["kind"], section) for item in items]
    depths = [item["depth"] for item in rig.get("cracks") or [] if "depth" in item]
    return found + [registry().get("depth", depth["kind"], "depth") for depth in depths]
