"""The numbers of a rig (modulus, masses, clearances) as parameters of its model, each a relative change.

`rotor.discs[0].mass_kg` is that of the first disc. `bearings[left].radial_clearance_m` is that of the bearing labelled
"left"; one without a label is named by its place in the list, from 0. A path that fits several numbers scales them
together: `rotor.outer_diameter_m` every outer diameter, `rotor.discs` masses and moments of all discs,
`bearings.viscosity_Pa_s` the viscosity of all bearings that have one.

Any plugin of a rotor or bearing has them: it is built anew with other options, and the derivatives are differences of
its matrices (`variation`) or of its entries. An effect with `changes_bearing` is a change of one at a node, as a cause.

An effect that is a constant force on the rotor changes the load of its oil films, in size and direction, and with it
their coefficients: by equilibrium on the springs of all bearings, whose stiffness does not matter where there are two.
"""

import re
from collections.abc import Callable, Iterable
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import CannotAct, NoSteadyState, RotorstudyError, unknown_name
from rotorstudy.model.bearings import at_housings, journal_shift, running_position, springs_at_rest
from rotorstudy.model.entries import Entry, unscaled
from rotorstudy.model.options import check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.shaft import is_regular
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.model.variation import Matrices, Variation

# Relative, of central differences: errors of 1e-9 (its square) by truncation, and 3e-10 by round-off where the film is
# found to 1e-14, as by a short bearing that solves for its eccentricity
STEP = 3e-5
# fields of a Structure that its plugin gives; the others are set where a rig is read
OF_THE_SHAFT = (
    "mass", "stiffness", "gyroscopic", "static_load", "stiffness_loss", "shape_at", "curvature_at", "section_at",
    "length", "node_positions", "discs",
)  # fmt: skip
NAME = re.compile(r"(?P<section>rotor|bearings)(\[(?P<which>[^\]]*)\])?\.(?P<path>.+)")


def is_number(name: str) -> bool:
    """Whether the name of a parameter is that of a number of the rotor or of its bearings."""
    return NAME.fullmatch(name) is not None


def _section_of(name):
    """Section of a number, "rotor" or "bearings"; None if the name is no number's."""
    found = NAME.fullmatch(name)
    return found and found["section"]


def number_paths(options: object, path: str = "") -> list[str]:
    """Paths of the numbers other than zero among options of a plugin; whole ones are counts and nodes."""
    if isinstance(options, dict):
        inside = [(f"{path}.{key}" if path else key, value) for key, value in options.items()]
    elif isinstance(options, (list, tuple)):
        inside = [(f"{path}[{i}]", value) for i, value in enumerate(options)]
    else:
        return [path] if isinstance(options, float) and options else []
    return [found for here, value in inside for found in number_paths(value, here)]


@lru_cache(maxsize=1024)
def path_pattern(name: str) -> re.Pattern:
    """Pattern of the paths meant by a name: that of a number, or of what holds several, at any depth."""
    keys = (re.escape(key) if key.endswith("]") else re.escape(key) + r"(\[\d+\])?" for key in name.split("."))
    return re.compile(r"(.*\.)?" + r"\.".join(keys) + r"(\..*)?")


def scaled(options: object, pattern: re.Pattern, factor: float, path: str = "") -> object:
    """The options with the numbers whose path matches a pattern multiplied by a factor."""
    if isinstance(options, dict):
        return {k: scaled(v, pattern, factor, f"{path}.{k}" if path else k) for k, v in options.items()}
    if isinstance(options, (list, tuple)):
        return [scaled(value, pattern, factor, f"{path}[{i}]") for i, value in enumerate(options)]
    return options * factor if isinstance(options, float) and pattern.fullmatch(path) else options


@dataclass(frozen=True, eq=False)
class Holder:
    """What has numbers: the rotor, or a bearing."""

    section: str
    which: str  # label of a bearing, else its place; empty for the rotor
    function: Callable  # builds it of its options
    options: dict  # in SI
    uncertain: dict  # path -> usual relative standard deviation

    @cached_property
    def paths(self) -> list[str]:
        """Of all its numbers."""
        return number_paths(self.options)

    def name(self, path: str) -> str:
        """The name of its number at a path."""
        return f"{self.section}[{self.which}].{path}" if self.which else f"{self.section}.{path}"

    def pattern(self, name: str) -> re.Pattern | None:
        """Pattern of the paths of its numbers that a name means; None if nothing matches."""
        section, which, path = NAME.fullmatch(name).group("section", "which", "path")
        if section != self.section or which not in (None, self.which):
            return None
        return path_pattern(path) if any(map(path_pattern(path).fullmatch, self.paths)) else None

    def changed(self, changes: dict[str, float]) -> dict:
        """Its options with some of its numbers changed; changes : name -> relative change."""
        options = self.options
        for name, change in changes.items():
            if change and (pattern := self.pattern(name)):
                options = scaled(options, pattern, float(1 + change))
        return options


def numbers(model) -> list[str]:
    """Names of all numbers of the rotor and of its bearings, each at its place."""
    return [holder.name(path) for holder in _holders(model) for path in holder.paths]


def with_numbers(model, names: Iterable[str], where: str = "the rig"):
    """The model with numbers of its rotor and of its bearings among its parameters, of value zero."""
    wanted = [name for name in dict.fromkeys(names) if is_number(name) and name not in model.names]
    for name in wanted:
        _check_known(model, name, where)
    rotor = rotor_numbers(wanted)
    if rotor:
        known = [p.name for term in model.terms if term.variation for p in term.parameters]
        others = tuple(term for term in model.terms if not term.variation)
        model = replace(model, terms=(*others, _rotor_term(model.structure, [*known, *rotor], where)))
    if len(wanted) == len(rotor):
        return model
    kind, parts = {"carries": True, "is_bearing_number": True}, [name for name in wanted if name not in rotor]
    terms = (Term("bearing number", (Parameter(name, "1", (), 1.0),), {name: 0.0}, **kind) for name in parts)
    model = replace(model, terms=(*model.terms, *terms))
    values = dict(zip(model.names, model.nominal.tolist(), strict=True))
    values |= dict.fromkeys((model.names[p] for p in model.bearing_numbers), 0.0)
    return replace(model, terms=with_bearings_at(model.structure, model.terms, values))


def rotor_numbers(names: Iterable[str]) -> list[str]:
    """Those of some names that mean numbers of the rotor."""
    return [name for name in names if _section_of(name) == "rotor"]


def rotor_at(structure: Structure, values: dict[str, float]) -> Structure:
    """The rotor at the relative changes of its numbers among some values, for effects that are built of its shaft.

    raises : NoSteadyState if the plugin builds no rotor of these numbers
    """
    changes = tuple((name, values[name]) for name in rotor_numbers(values) if values[name])
    return _rotor_at(structure, changes) if changes else structure


@lru_cache(maxsize=16)  # one, and those with each number beside its value
def _rotor_at(structure, changes):
    _check_positive(dict(changes))
    built = _built_rotor(structure.origin, dict(changes))
    return replace(structure, **{name: getattr(built, name) for name in OF_THE_SHAFT})


def _built_rotor(rotor, changes):
    """The Structure with changed numbers, also negative ones, which a fit may try on its way; or NoSteadyState."""
    with _none_with_these_numbers("rotor"):
        return rotor.function(**rotor.changed(changes))


def uncertain_numbers(model, section: str, stated: Iterable[str] = ()) -> dict[str, float]:
    """{name: relative standard deviation} of uncertain numbers of "rotor" or "bearings" that no name `stated` means."""
    found, stated = {}, [name for name in stated if is_number(name)]
    for holder in (holder for holder in _holders(model) if holder.section == section):
        said = [pattern for name in stated if (pattern := holder.pattern(name))]
        free = [path for path in holder.paths if not any(pattern.fullmatch(path) for pattern in said)]
        for path, share in holder.uncertain.items():
            if any(map(path_pattern(path).fullmatch, free)) and depends_on(model, holder.name(path)):
                found[holder.name(path)] = share
    return found


def rig_with_changes(rig: dict, model, changes: dict[str, float]) -> dict:
    """A rig dict with relative changes of some of its numbers, {name: change}."""

    def changed(item, holder):
        new = {k: v for k, v in holder.changed(changes).items() if number_paths(v) and v != holder.options[k]}
        return {**item, **new}

    found = {**rig, "rotor": changed(rig["rotor"], model.structure.origin)}
    for section in ("bearings", "foundation"):
        holders = [holder for term, holder in bearings_of(model.terms) if term.is_foundation == (section != "bearings")]
        if holders:
            found[section] = [changed(*one) for one in zip(rig[section], holders, strict=True)]
    return found


def _holders(model):
    """What has numbers in a model, the rotor first."""
    rotor = [model.structure.origin] if model.structure.origin else []
    return rotor + [holder for _, holder in bearings_of(model.terms)]


def _check_known(model, name, where):
    """Raise if nothing has the number of this name."""
    holders, section = _holders(model), _section_of(name)
    if any(holder.pattern(name) for holder in holders):
        return
    if section == "rotor" and not model.structure.origin:
        raise RotorstudyError(f"{name} in {where}: the rotor was not built by a plugin, so it has no named numbers")
    known = [holder.name(path) for holder in holders if holder.section == section for path in holder.paths]
    place = where if section == "rotor" else f"{where}; an option that the rig does not state has no number"
    raise unknown_name(f"number of the {section}", name, known, place)


def depends_on(model, name: str) -> bool:
    """Whether the model depends on a number; one of a rotor that is described by other options does not."""
    try:
        return _section_of(name) == "bearings" or bool(_rotor_term(model.structure, [name], "the rotor"))
    except RotorstudyError:
        return False


def _rotor_term(structure, names, where):
    """The Term whose amplitudes are relative changes of numbers of the rotor."""

    def build(changes):
        return _built_rotor(structure.origin, dict(zip(names, changes, strict=True))).matrices

    variation, parameters = Variation(build, len(names)), []
    for name, *parts in zip(names, *variation.slopes, strict=True):
        slope = Matrices(*parts)
        if not any(part.any() for part in slope):
            raise RotorstudyError(f"{name} in {where}: the rotor does not depend on it; leave it out")
        table = (
            Entry(-slope.stiffness),
            Entry(-slope.mass, order=2),
            Entry(1j * slope.gyroscopic, order=1, gain=lambda speed: speed),
            Entry(slope.static_load, on="one"),
        )
        parameters.append(Parameter(name, "1", tuple(e for e in table if np.any(e.matrix)), typical=1.0))
    return Term("rotor", tuple(parameters), dict.fromkeys(names, 0.0), variation=variation)


def bearings_of(terms: Iterable[Term]) -> list[tuple[Term, Holder]]:
    """The terms of bearings in the order of the rig, each with its numbers."""
    found = []
    for term in (term for term in terms if term.carries and not term.is_bearing_number):
        plugin, which = registry().get("bearing", term.kind), str(term.label if term.label != "" else len(found))
        found.append((term, Holder("bearings", which, plugin.function, term.options, plugin.uncertain)))
    return found


def with_bearings_at(structure: Structure, terms: tuple[Term, ...], values: dict[str, float]) -> tuple[Term, ...]:
    """The terms with bearings at amplitudes and relative changes by name; NoSteadyState if there are none such."""
    changing = {u.name: term for term in terms if term.is_bearing_number and term.carries for u in term.unknowns}
    pushing = [(_constant_force(p), term, p) for term in terms for p in term.parameters if p.loads_films]
    built, slopes, films, known = {}, {name: [] for name in changing}, [], iter(structure.films)
    for bearing, holder in bearings_of(terms):
        meant = {name: _number_meant(term, name, bearing, holder, structure) for name, term in changing.items()}
        own = {name: values[name] for name, number in meant.items() if number}
        no_causes = {name: 0.0 for name in own if "number" in changing[name].options}
        carried = next(known).carried if pushing and _load(bearing) else None
        forces = () if carried is None else (force * value_of(*at, values) for force, *at in pushing)
        state = partial(_State.at, meant, no_causes, sum(_load_by(force, carried) for force in forces))
        here, theta = state(own), [values[unknown.name] for unknown in bearing.unknowns]
        if any(own.values()) or here.load:
            built[id(bearing)] = _rebuilt(structure, bearing, holder, here)
        for name in own:
            ends = [state({**own, name: own[name] + step}) for step in (STEP, -STEP)]
            slopes[name] += _slopes(structure, bearing, holder, ends, theta)
        if carried is not None:
            films.append(_film(structure, bearing, holder, carried, theta, here))
    built |= {id(term): _with_entries(term, slopes, films) for term in terms if term.is_bearing_number}
    return tuple(built.get(id(term), term) for term in terms)


class _State(NamedTuple):
    """How a bearing differs from that of the rig."""

    changes: dict[str, float] = {}  # relative, of its numbers
    load: complex = 0.0  # N, that is added to its own
    # changes without those of causes: displacements count from where the journal then runs
    sound: dict[str, float] = {}

    @classmethod
    def at(cls, meant, no_causes, load, changes):
        """That at changes of amplitudes, {amplitude: change}; meant : {amplitude: the number that it changes}."""
        return cls(_together(changes, meant), load, _together(changes | no_causes, meant))


class Film(NamedTuple):
    """An oil film whose load follows the constant forces on the rotor."""

    load: float  # N
    carried: np.ndarray  # (2, dof) its load, complex, by a unit force along gravity and across it at each coordinate
    along: list[Entry]  # derivatives of its entries by a load, N, along gravity
    across: list[Entry]  # likewise, across it


def films_of(structure: Structure) -> tuple[Film, ...]:
    """The Film of every bearing of a rig that has one."""
    films = [(bearing, holder) for bearing, holder in bearings_of(structure.bearings) if _load(bearing)]
    carried = _carried(structure, [bearing for bearing, _ in films]) if films else ()
    return tuple(_film(structure, *one, own, one[0].theta, _State()) for one, own in zip(films, carried, strict=True))


def loading_films(parameters: Iterable[Parameter], films: tuple[Film, ...]) -> tuple[Parameter, ...]:
    """The parameters, those that are constant forces with what they change of films."""

    def loading(force, turn):
        loads = [(film, _load_by(turn * force, film.carried)) for film in films]
        return tuple(
            entry.times(share)
            for film, load in loads
            for share, entries in ((load.real, film.along), (load.imag, film.across))
            for entry in (entries if share else ())
        )

    forces = [(p, _constant_force(p) if films else None) for p in parameters]
    return tuple(p if f is None else replace(p, films=(loading(f, 1), loading(f, 1j))) for p, f in forces)


def _constant_force(parameter):
    """Force (dof,) of one unit of a parameter that is a constant force and nothing else; otherwise None."""
    if not parameter.entries or any(not e.is_constant or e.shift or e.gain for e in unscaled(parameter.entries)):
        return None
    return sum(np.asarray(e.matrix) for e in parameter.entries)


def _load(bearing):
    """Options of size and angle of the load of a bearing; None if it does not depend on one."""
    return registry().get("bearing", bearing.kind).load


def _load_by(force, carried):
    """Load of a film, N, complex, by a force (dof,), N, complex; carried : as of a Film."""
    return carried[0] @ force.real + carried[1] @ force.imag


def _carried(structure, films):
    """`Film.carried` of some films on the springs of all bearings, at the loads of the rig and at a usual speed.

    On rigid ones, if the springs carry no load.
    """
    springs = {id(term): springs_at_rest(structure, term) for term in (*structure.bearings, *structure.foundation)}
    dof, nodes = len(structure.dofs), [structure.index(_at_node(film, structure)) for film in films]
    whole = np.kron(np.eye(2), structure.stiffness) + sum(springs.values()).reshape(2 * dof, 2 * dof)
    if not is_regular(whole):
        return [np.outer([1, 1j], structure.carried_at(structure.dofs[node][0])) for node in nodes]
    moved = np.linalg.inv(whole).reshape(2 * dof, 2, dof)
    own = (springs[id(film)][:, node].reshape(2, -1) for film, node in zip(films, nodes, strict=True))
    return [real + 1j * imaginary for real, imaginary in (np.tensordot(one, moved, 1) for one in own)]


def value_of(term: Term, parameter: Parameter, values: dict[str, float]) -> complex | float:
    """Of a parameter of a term, by the values of its amplitudes."""
    name = term.full_name(parameter)
    return values[f"{name}_real"] + 1j * values[f"{name}_imag"] if parameter.is_complex else values[name]


def _film(structure, bearing, holder, carried, theta, state):
    """The Film of a bearing with amplitudes in a _State."""
    size, derivatives = holder.changed(state.changes)[_load(bearing)[0]], []
    for step in (STEP * size, 1j * STEP * size):
        ends = [state._replace(load=state.load + part) for part in (step, -step)]
        derivatives.append(_slopes(structure, bearing, holder, ends, np.divide(theta, size)))
    return Film(size, carried, *derivatives)


def number_slope(structure: Structure, node: int | None, number: str) -> tuple[Entry, ...]:
    """Entries of the force of the bearings at a node, or of all, per change of a number; CannotAct if none has it."""
    found = []
    for bearing, holder in bearings_of(structure.bearings):
        here = node in (None, _at_node(bearing, structure))
        if here and number in holder.paths and not np.isnan(bearing.theta).any():
            ends = [_State({holder.name(number): step}) for step in (STEP, -STEP)]
            found += _slopes(structure, bearing, holder, ends, bearing.theta)
    if not found:
        raise CannotAct(f"no bearing{'' if node is None else f' at node {node}'} has a value of {number}")
    return tuple(found)


def changeable_numbers(structure: Structure, sensors: tuple[int, ...] = ()) -> list[dict]:
    """Places {"node", "number"} of what wear, dirt or heat may change of bearings, or of all: they have one oil."""
    each = [
        {"node": _at_node(bearing, structure), "number": number}
        for bearing in structure.bearings
        for number in registry().get("bearing", bearing.kind).changeable
        if not np.isnan(bearing.theta).any()
    ]
    numbers = [one["number"] for one in each]
    return each + [{"number": one} for one in dict.fromkeys(numbers) if numbers.count(one) > 1]


def _at_node(bearing, structure):
    return bearing.options.get("node") or structure.default_node()


def _number_meant(term, name, bearing, holder, structure):
    """Name of the number of a bearing that an amplitude changes, of a number or an effect; None if it changes none."""
    if "number" not in term.options:
        return name if holder.pattern(name) else None
    if bearing.is_foundation:
        return None
    number, here = term.options["number"], term.options["node"] in (None, _at_node(bearing, structure))
    return holder.name(number) if here and number in holder.paths else None


def _together(changes, meant):
    """Changes of numbers by name, from those of amplitudes, of which several may change the same number."""
    found = {}
    for name, change in changes.items():
        found[meant[name]] = (1 + found.get(meant[name], 0.0)) * (1 + change) - 1
    return found


def _rebuilt(structure, bearing, holder, state):
    """A bearing in a _State."""
    _check_positive(state.changes)
    options = holder.changed(state.changes)
    if state.load:
        size, angle = _load(bearing)
        load = options[size] * np.exp(1j * options[angle]) + state.load
        options = {**options, size: float(abs(load)), angle: float(np.angle(load))}
    with _none_with_these_numbers("bearing"):
        given = check_options(holder.function, options, f"bearing {bearing.kind}", ("structure",))
        parameters = holder.function(structure=structure, **given)
        if before := running_position(bearing.kind, holder.changed(state.sound)):
            shifted = before, running_position(bearing.kind, options), state.load
            parameters = journal_shift(structure, _at_node(bearing, structure), parameters, *shifted)
        parameters = at_housings(structure, parameters, from_ground=bearing.is_foundation)

    @cache  # entries of one gain keep one
    def guard(gain):
        def guarded(*at):
            with _none_with_these_numbers("bearing"):
                return gain(*at)

        return guarded

    guarded = (
        replace(p, entries=tuple(e if e.gain is None else replace(e, gain=guard(e.gain)) for e in p.entries))
        for p in parameters
    )
    return replace(bearing, parameters=tuple(guarded), options=options)


def _slopes(structure, bearing, holder, ends, theta):
    """Entries of the derivative by a number of a bearing with amplitudes; ends : a _State on each side of it."""
    ends = (_rebuilt(structure, bearing, holder, end) for end in ends)
    above, below = ([(i, e) for i, u in enumerate(end.unknowns) for e in u.entries] for end in ends)
    gain_slope = cache(lambda above, below: lambda *at: above(*at) - below(*at))  # entries of one gain keep one
    found = []
    for (i, one), (_, other) in zip(above, below, strict=True):
        share = theta[i] / (2 * STEP)
        if one.gain is None and other.gain is None:
            found.append(replace(one, matrix=share * (np.asarray(one.matrix) - other.matrix)))
        elif np.array_equal(one.matrix, other.matrix):
            found.append(replace(one, matrix=share * np.asarray(one.matrix), gain=gain_slope(one.gain, other.gain)))
        else:
            found += [one.times(share), other.times(-share)]
    return found


def _check_positive(changes):
    """Raise NoSteadyState if a number would not be positive any more; changes : name -> relative change."""
    if lost := [name for name, change in changes.items() if not change > -1]:
        raise NoSteadyState(f"{lost[0]} would be zero or negative")


@contextmanager
def _none_with_these_numbers(what):
    try:
        yield
    except RotorstudyError as error:
        raise NoSteadyState(f"no {what} with these numbers: {error}") from None


def _with_entries(term, slopes, films):
    if not term.carries:
        return replace(term, parameters=loading_films(term.parameters, films))
    (parameter,) = term.parameters
    return replace(term, parameters=(replace(parameter, entries=tuple(slopes[term.full_name(parameter)])),))
