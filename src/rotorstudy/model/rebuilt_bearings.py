"""Bearings with other numbers (clearance, viscosity, load): built anew, and the derivatives as entries.

Any bearing plugin has such numbers, as the derivatives are differences of the entries that it gives.
"""

from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np

from rotorstudy.errors import NoSteadyState, RotorstudyError
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

    terms  : of a model with numbers of its bearings
    values : name -> value of the amplitudes of the bearings, and of their numbers, the relative changes
    raises : NoSteadyState if there is no bearing with these numbers: none is zero or negative, and none outside what
             its plugin allows
    """
    changes = {name: values[name] for term in terms if term.is_bearing_number for name in term.values}
    built, slopes = {}, {name: [] for name in changes}
    for bearing, holder in bearings_of(terms):
        own = {name: changes[name] for name in holder.meant(changes)}
        if any(own.values()):
            built[id(bearing)] = _rebuilt(structure, bearing, holder, own)
        for name in own:
            ends = (
                _rebuilt(structure, bearing, holder, {**own, name: own[name] + step}).unknowns for step in (STEP, -STEP)
            )
            for above, below in zip(*ends, strict=True):
                slopes[name] += _slopes(above.entries, below.entries, values[above.name])
    return tuple(_with_entries(term, slopes) if term.is_bearing_number else built.get(id(term), term) for term in terms)


def _rebuilt(structure, bearing, holder, changes):
    """A bearing with other numbers."""
    lost = [name for name, change in changes.items() if not change > -1]
    if lost:
        raise NoSteadyState(f"{lost[0]} would be zero or negative")
    function = registry().get("bearing", bearing.kind).function
    with _none_with_these_numbers():
        given = check_options(function, holder.changed(changes), f"bearing {bearing.kind}", ("structure",))
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
    return replace(term, parameters=(replace(parameter, entries=tuple(slopes[parameter.name])),))
