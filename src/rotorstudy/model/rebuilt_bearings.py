"""Bearings with other numbers (clearance, viscosity, load): built anew, and the derivatives as entries.

Any bearing plugin has such numbers, as the derivatives are differences of the entries that it gives.
An effect with `changes_bearing` is a change of one at a node, as a cause.
"""

from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np

from rotorstudy.errors import CannotAct, NoSteadyState, RotorstudyError
from rotorstudy.model.entries import Entry
from rotorstudy.model.foundation import at_housings
from rotorstudy.model.option_numbers import Holder
from rotorstudy.model.options import check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term

# Relative, of central differences: errors of 1e-9 (its square) by truncation, and 3e-10 by round-off where the film is
# found to 1e-14, as by a short bearing that solves for its eccentricity
STEP = 3e-5


def bearings_of(terms: Iterable[Term]) -> list[tuple[Term, Holder]]:
    """The terms of bearings in the order of the rig, each with its numbers."""
    found = [term for term in terms if term.carries and not term.is_bearing_number]
    plugins = [registry().get("bearing", term.kind) for term in found]
    return [
        (term, Holder("bearings", str(term.label if term.label != "" else place), term.options, plugin.uncertain))
        for place, (term, plugin) in enumerate(zip(found, plugins, strict=True))
    ]


def number_term(name: str) -> Term:
    """The Term of a number of bearings, without a change."""
    number = Parameter(name, "1", (), typical=1.0)
    return Term("bearing number", (number,), {name: 0.0}, carries=True, is_bearing_number=True)


def with_bearings_at(structure: Structure, terms: tuple[Term, ...], values: dict[str, float]) -> tuple[Term, ...]:
    """The terms with the bearings that have some numbers, and the derivatives there as the entries of these numbers.

    values : name -> amplitudes of the bearings, and relative changes of their numbers; NoSteadyState if none has them
    """
    changing = {unknown.name: term for term in terms if term.is_bearing_number for unknown in term.unknowns}
    built, slopes = {}, {name: [] for name in changing}
    for bearing, holder in bearings_of(terms):
        meant = {name: _number_meant(term, name, bearing, holder, structure) for name, term in changing.items()}
        own = {name: values[name] for name, number in meant.items() if number}
        if any(own.values()):
            built[id(bearing)] = _rebuilt(structure, bearing, holder, _together(own, meant))
        for name in own:
            ends = (
                _rebuilt(structure, bearing, holder, _together({**own, name: own[name] + step}, meant)).unknowns
                for step in (STEP, -STEP)
            )
            for above, below in zip(*ends, strict=True):
                slopes[name] += _slopes(above.entries, below.entries, values[above.name])
    return tuple(_with_entries(term, slopes) if term.is_bearing_number else built.get(id(term), term) for term in terms)


def number_slope(structure: Structure, node: int, number: str) -> tuple[Entry, ...]:
    """Entries of the force of the bearings at a node per relative change of a number; CannotAct if none has it."""
    found = []
    for bearing, holder in bearings_of(structure.bearings):
        if _at_node(bearing, structure) == node and number in holder.paths and not np.isnan(bearing.theta).any():
            name = holder.name(number)
            ends = (_rebuilt(structure, bearing, holder, {name: step}).unknowns for step in (STEP, -STEP))
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


def _at_node(bearing, structure):
    return bearing.options.get("node") or structure.default_node()


def _number_meant(term, name, bearing, holder, structure):
    """Name of the number of a bearing that an amplitude changes, of a number or an effect; None if it changes none."""
    if "number" not in term.options:
        return name if holder.pattern(name) else None
    if bearing.is_foundation:
        return None
    number, node = term.options["number"], term.options["node"] or structure.default_node()
    return holder.name(number) if _at_node(bearing, structure) == node and number in holder.paths else None


def _together(changes, meant):
    """Changes of numbers by name, from those of amplitudes, of which several may change the same number."""
    found = {}
    for name, change in changes.items():
        found[meant[name]] = (1 + found.get(meant[name], 0.0)) * (1 + change) - 1
    return found


def _rebuilt(structure, bearing, holder, changes):
    """A bearing with other numbers."""
    lost = [name for name, change in changes.items() if not change > -1]
    if lost:
        raise NoSteadyState(f"{lost[0]} would be zero or negative")
    function = registry().get("bearing", bearing.kind).function
    with _none_with_these_numbers():
        given = check_options(function, holder.changed(changes), f"bearing {bearing.kind}", ("structure",))
        parameters = at_housings(structure, function(structure=structure, **given), from_ground=bearing.is_foundation)
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
