"""The numbers of bearings (clearance, viscosity, load) as parameters of a model: their relative changes.

A number is named by the path of an option. `bearings[left].radial_clearance_m` is that of the bearing labelled "left";
one without a label is named by its place in the list, from 0. `bearings.viscosity_Pa_s` scales the viscosity of all
bearings that have one together. Any bearing plugin has such parameters: the bearing is built anew at every change,
and the derivatives are differences of its entries. An effect with `changes_bearing` is such a change at a node, as a
cause.
"""

import re
from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np

from rotorstudy.errors import CannotAct, NoSteadyState, RotorstudyError, unknown_name
from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.option_numbers import number_paths, path_pattern, scaled
from rotorstudy.model.options import check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term

NAME = re.compile(r"bearings(\[(?P<which>[^\]]*)\])?\.(?P<path>.+)")
# Relative, of central differences: errors of 1e-9 (its square) by truncation, and 3e-10 by round-off where the film is
# found to 1e-14, as by a short bearing that solves for its eccentricity
STEP = 3e-5


def is_bearing_number(name: str) -> bool:
    """Whether the name of a parameter is that of a number of bearings."""
    return NAME.fullmatch(name) is not None


def with_bearing_numbers(model: Model, names: Iterable[str], where: str = "the bearings") -> Model:
    """The model with numbers of its bearings among its parameters, each a relative change of value zero.

    model  : built from a rig
    names  : names of parameters; only those of numbers of bearings are added
    where  : where the names come from, for error messages
    raises : RotorstudyError if no bearing has such a number
    """
    wanted = [name for name in dict.fromkeys(names) if is_bearing_number(name) and name not in model.names]
    if not wanted:
        return model
    bearings = list(enumerate(_bearings(model.terms)))
    for name in wanted:
        if not any(_pattern(name, *one) for one in bearings):
            known = [known for one in bearings for known in bearing_numbers(*one)]
            place = f"{where}; an option that the rig does not state has no number"
            raise unknown_name("number of the bearings", name, known, place)
    numbers = tuple(
        Term(
            "bearing number",
            (Parameter(name, "1", (), typical=1.0),),
            {name: 0.0},
            carries=True,
            is_bearing_number=True,
        )
        for name in wanted
    )
    values = {u.name: v for term in model.terms for u, v in zip(term.unknowns, term.theta, strict=True)}
    usual = {u.name: u.typical for term in model.terms for u in term.unknowns if np.isnan(values[u.name])}
    return replace(
        model,
        terms=with_bearings_at(model.structure, (*model.terms, *numbers), values | usual | dict.fromkeys(wanted, 0.0)),
    )


def with_bearings_at(structure: Structure, terms: tuple[Term, ...], values: dict[str, float]) -> tuple[Term, ...]:
    """The terms with the bearings that have some numbers, and the derivatives there as the entries of these numbers.

    terms  : of a model with numbers of its bearings
    values : name -> value of the amplitudes of the bearings, and of their numbers, the relative changes
    raises : NoSteadyState if there is no bearing with these numbers: none is zero or negative, and none outside what
             its plugin allows
    """
    numbers = {unknown.name: term for term in terms if term.is_bearing_number for unknown in term.unknowns}
    changes = {name: values[name] for name in numbers}
    built, slopes = {}, {name: [] for name in changes}
    for place, bearing in enumerate(_bearings(terms)):
        patterns = {name: _meant(term, name, place, bearing, structure) for name, term in numbers.items()}
        patterns = {name: pattern for name, pattern in patterns.items() if pattern}
        if any(changes[name] for name in patterns):
            built[id(bearing)] = _rebuilt(structure, bearing, patterns, changes)
        for name in patterns:
            ends = (
                _rebuilt(structure, bearing, patterns, {**changes, name: changes[name] + step}).unknowns
                for step in (STEP, -STEP)
            )
            for above, below in zip(*ends, strict=True):
                slopes[name] += _slopes(above.entries, below.entries, values[above.name])
    return tuple(_with_entries(term, slopes) if term.is_bearing_number else built.get(id(term), term) for term in terms)


def bearings_with_changes(items: list[dict], terms: tuple[Term, ...], changes: dict[str, float]) -> list[dict]:
    """The section `bearings` of a rig with some of the numbers changed.

    items   : as in the rig
    terms   : of its model
    changes : name of a number -> relative change
    """
    found = []
    for place, (item, bearing) in enumerate(zip(items, _bearings(terms), strict=True)):
        patterns = {name: pattern for name in changes if (pattern := _pattern(name, place, bearing))}
        options = _changed(bearing.options, patterns, changes)
        found.append({**item, **{key: value for key, value in options.items() if value != bearing.options[key]}})
    return found


def number_slope(structure: Structure, node: int, number: str) -> tuple[Entry, ...]:
    """Entries of the force of the bearings at a node per relative change of a number that they have.

    raises : CannotAct if none has this number, or a value
    """
    found = []
    for bearing in structure.bearings:
        if _at_node(bearing, structure) == node and number in bearing.options and not np.isnan(bearing.theta).any():
            pattern = {number: path_pattern(number)}
            ends = (_rebuilt(structure, bearing, pattern, {number: step}).unknowns for step in (STEP, -STEP))
            for value, above, below in zip(bearing.theta, *ends, strict=True):
                found += _slopes(above.entries, below.entries, value)
    if not found:
        raise CannotAct(f"no bearing at node {node} has a value of {number}")
    return tuple(found)


def changeable_numbers(structure: Structure, sensors: tuple[int, ...] = ()) -> list[dict]:
    """Places {"node", "number"} of the numbers of the bearings of a rig that wear, dirt or heat may change."""
    return [
        {"node": _at_node(bearing, structure), "number": number}
        for bearing in structure.bearings
        for number in registry().get("bearing", bearing.kind).changeable
        if not np.isnan(bearing.theta).any()
    ]


def bearing_numbers(place: int, bearing: Term) -> list[str]:
    """Names of all numbers of a bearing at a place, from 0, in the list of the rig."""
    which = bearing.label if bearing.label != "" else place
    return [f"bearings[{which}].{path}" for path in number_paths(bearing.options)]


def uncertain_bearing_numbers(terms: tuple[Term, ...], stated: Iterable[str] = ()) -> dict[str, float]:
    """Numbers of bearings that their plugins state to be uncertain.

    terms   : of a model
    stated  : names of numbers; those that they mean are left out
    returns : name -> relative standard deviation
    """
    found, stated = {}, [name for name in stated if is_bearing_number(name)]
    for place, bearing in enumerate(_bearings(terms)):
        which = bearing.label if bearing.label != "" else place
        said = [pattern for name in stated if (pattern := _pattern(name, place, bearing))]
        free = [p for p in number_paths(bearing.options) if not any(pattern.fullmatch(p) for pattern in said)]
        for path, share in registry().get("bearing", bearing.kind).uncertain.items():
            if any(map(path_pattern(path).fullmatch, free)):
                found[f"bearings[{which}].{path}"] = share
    return found


def _bearings(terms):
    """The terms of bearings in the order of the rig."""
    return [term for term in terms if term.carries and not term.is_bearing_number]


def _pattern(name, place, bearing):
    """Pattern of the paths of the options of a bearing that a name means; None if it means none of them."""
    which, path = NAME.fullmatch(name).group("which", "path")
    pattern = path_pattern(path)
    if which not in (None, str(bearing.label if bearing.label != "" else place)):
        return None
    return pattern if any(map(pattern.fullmatch, number_paths(bearing.options))) else None


def _meant(term, name, place, bearing, structure):
    """Pattern of the paths of the options of a bearing that an amplitude changes, of a number or an effect; or None."""
    if "number" not in term.options:
        return _pattern(name, place, bearing)
    number, node = term.options["number"], term.options["node"] or structure.default_node()
    here = _at_node(bearing, structure) == node and number in bearing.options
    return path_pattern(number) if here else None


def _at_node(bearing, structure):
    return bearing.options.get("node") or structure.default_node()


def _changed(options, patterns, changes):
    for name, pattern in patterns.items():
        options = scaled(options, pattern, float(1 + changes[name]))
    return options


def _rebuilt(structure, bearing, patterns, changes):
    """A bearing with other numbers."""
    lost = [name for name in patterns if not changes[name] > -1]
    if lost:
        raise NoSteadyState(f"{lost[0]} would be zero or negative")
    function, options = registry().get("bearing", bearing.kind).function, _changed(bearing.options, patterns, changes)
    with _none_with_these_numbers():
        given = check_options(function, options, f"bearing {bearing.kind}", ("structure",))
        parameters = tuple(function(structure=structure, **given))
    guard = cache(_guarded)  # entries of one gain keep one
    return replace(
        bearing,
        parameters=tuple(
            replace(p, entries=tuple(e if e.gain is None else replace(e, gain=guard(e.gain)) for e in p.entries))
            for p in parameters
        ),
    )


def _slopes(above, below, value):
    """Entries of the derivative by a number, from those of an amplitude on both sides of it, times its value."""
    share, found, gain_slope = value / (2 * STEP), [], cache(_gain_slope)  # entries of one gain keep one
    for one, other in zip(above, below, strict=True):
        if one.gain is None and other.gain is None:
            found.append(replace(one, matrix=share * (np.asarray(one.matrix) - other.matrix)))
        elif np.array_equal(one.matrix, other.matrix):
            found.append(replace(one, matrix=share * np.asarray(one.matrix), gain=gain_slope(one.gain, other.gain)))
        else:
            found += [one.times(share), other.times(-share)]
    return found


def _gain_slope(above, below):
    return lambda *at: above(*at) - below(*at)


def _guarded(gain):
    """A gain that says where there is no bearing with its numbers."""

    def guarded(*at):
        with _none_with_these_numbers():
            return gain(*at)

    return guarded


@contextmanager
def _none_with_these_numbers():
    try:
        yield
    except RotorstudyError as error:
        raise NoSteadyState(f"no bearing with these numbers: {error}") from None


def _with_entries(term, slopes):
    (parameter,) = term.parameters
    return replace(term, parameters=(replace(parameter, entries=tuple(slopes[term.full_name(parameter)])),))
