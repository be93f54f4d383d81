"""The numbers of a rotor (modulus, lengths, masses) as parameters of its model: their relative changes.

A number is named by the path of an option, after "rotor.": `rotor.youngs_modulus_Pa`, `rotor.discs[0].mass_kg`. A path
that fits several numbers scales them together: `rotor.outer_diameter_m` every outer diameter, `rotor.discs` masses and
moments of all discs. Any rotor plugin has such parameters: the derivatives are differences of its matrices.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.option_numbers import number_paths, path_pattern, scaled
from rotorstudy.model.structure import Matrices, Structure
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.model.variation import Variation

PREFIX = "rotor."


def is_rotor_number(name: str) -> bool:
    """Whether the name of a parameter is that of a number of the rotor."""
    return name.startswith(PREFIX)


def with_rotor_numbers(model: Model, names: Iterable[str], where: str = "the rotor") -> Model:
    """The model with numbers of its rotor among its parameters, each a relative change of value zero.

    model  : built from a rig
    names  : names of parameters; only those of numbers of the rotor are added
    where  : where the names come from, for error messages
    raises : RotorstudyError if the rotor has no such number, or its matrices do not depend on it
    """
    known = [p.name for term in model.terms if term.variation for p in term.parameters]
    wanted = list(dict.fromkeys([*known, *filter(is_rotor_number, names)]))
    if wanted == known:
        return model
    others = tuple(term for term in model.terms if not term.variation)
    return replace(model, terms=(*others, rotor_term(model.structure, wanted, where)))


def rotor_term(structure: Structure, names: list[str], where: str = "the rotor") -> Term:
    """The Term whose amplitudes are relative changes of numbers of the rotor.

    structure : built by a rotor plugin
    where     : where the names come from, for error messages
    raises    : RotorstudyError as `with_rotor_numbers`
    """
    variation = _variation(structure, names, where)
    slopes = variation.slopes_at(np.zeros(len(names)))
    parameters = []
    for name, *parts in zip(names, *slopes, strict=True):
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


def uncertain_numbers(structure: Structure) -> dict[str, float]:
    """Numbers of a rotor that its plugin states to be uncertain, and on which its matrices depend.

    returns : name -> relative standard deviation; empty for a structure without a plugin
    """
    found = {}
    for path, share in structure.origin.uncertain.items() if structure.origin else ():
        try:
            rotor_term(structure, [PREFIX + path])
        except RotorstudyError:  # this rotor is described by other options
            continue
        found[PREFIX + path] = share
    return found


def _variation(structure, names, where):
    """The Variation of a rotor with some of its numbers."""
    patterns = [_pattern(structure, name, where) for name in names]

    def build(changes):
        options = structure.origin.options
        for pattern, change in zip(patterns, changes, strict=True):
            options = scaled(options, pattern, 1 + change) if change else options
        return structure.origin.rebuilt(options).matrices

    return Variation(build, len(names))


def _pattern(structure, name, where):
    """Regular expression for the paths of the numbers meant by a name; an error if there is none."""
    if structure.origin is None:
        raise RotorstudyError(f"{name} in {where}: the rotor was not built by a plugin, so it has no named numbers")
    pattern = path_pattern(name.removeprefix(PREFIX))
    if not any(pattern.fullmatch(path) for path in number_paths(structure.origin.options)):
        raise unknown_name("number of the rotor", name, rotor_numbers(structure), where)
    return pattern


def rotor_numbers(structure: Structure) -> list[str]:
    """Names of all numbers of a rotor, each at its place."""
    return [PREFIX + path for path in number_paths(structure.origin.options)]


def rotor_with_changes(rotor: dict, structure: Structure, changes: dict[str, float]) -> dict:
    """The section `rotor` of a rig with some of its numbers changed.

    rotor     : as in the rig
    structure : of that rotor
    changes   : name of a number -> relative change
    """
    given = options = structure.origin.options
    for name, change in changes.items():
        options = scaled(options, _pattern(structure, name, "the rotor"), float(1 + change))
    return {**rotor, **{key: value for key, value in options.items() if number_paths(value) and value != given[key]}}
