"""The numbers of a rig (modulus, masses, clearances) as parameters of its model, each a relative change.

They are named as in `option_numbers`. Any plugin of a rotor or bearing has them: it is built anew with other options,
and the derivatives are differences of its matrices (`variation`) or of its entries (`rebuilt_bearings`).
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.option_numbers import Holder, is_number, is_of, number_paths, path_pattern
from rotorstudy.model.rebuilt_bearings import bearings_of, number_term, with_bearings_at
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.model.variation import Matrices, Variation


def numbers(model: Model) -> list[str]:
    """Names of all numbers of the rotor and of its bearings, each at its place."""
    return [holder.name(path) for holder in _holders(model) for path in holder.paths]


def with_numbers(model: Model, names: Iterable[str], where: str = "the rig") -> Model:
    """The model with numbers of its rotor and of its bearings among its parameters, of value zero."""
    wanted = [name for name in dict.fromkeys(names) if is_number(name) and name not in model.names]
    for name in wanted:
        _check_known(model, name, where)
    rotor = [name for name in wanted if is_of("rotor", name)]
    if rotor:
        known = [p.name for term in model.terms if term.variation for p in term.parameters]
        others = tuple(term for term in model.terms if not term.variation)
        model = replace(model, terms=(*others, _rotor_term(model.structure, [*known, *rotor], where)))
    added = tuple(number_term(name) for name in wanted if name not in rotor)
    if not added:
        return model
    terms = (*model.terms, *added)
    values = {  # the typical one of an amplitude without a value
        u.name: u.typical if np.isnan(v) else v for t in terms for u, v in zip(t.unknowns, t.theta, strict=True)
    }
    return replace(model, terms=with_bearings_at(model.structure, terms, values))


def uncertain_numbers(model: Model, section: str, stated: Iterable[str] = ()) -> dict[str, float]:
    """{name: relative standard deviation} of uncertain numbers of "rotor" or "bearings" that no name `stated` means."""
    found, stated = {}, [name for name in stated if is_number(name)]
    for holder in (holder for holder in _holders(model) if holder.section == section):
        said = [holder.pattern(name) for name in holder.meant(stated)]
        free = [path for path in holder.paths if not any(pattern.fullmatch(path) for pattern in said)]
        for path, share in holder.uncertain.items():
            if any(map(path_pattern(path).fullmatch, free)) and _acts(model, holder.name(path)):
                found[holder.name(path)] = share
    return found


def rig_with_changes(rig: dict, model: Model, changes: dict[str, float]) -> dict:
    """A rig dict with relative changes of some of its numbers, {name: change}."""

    def changed(item, holder):
        options = holder.changed(changes)
        new = {k: v for k, v in options.items() if number_paths(v) and v != holder.options[k]}
        return {**item, **new}

    found = dict(rig)
    if any(is_of("rotor", name) for name in changes):
        found["rotor"] = changed(rig["rotor"], _rotor(model.structure))
    if any(is_of("bearings", name) for name in changes):
        every = bearings_of(model.terms)
        for section in ("bearings", "foundation"):
            holders = [holder for term, holder in every if term.is_foundation == (section == "foundation")]
            if holders:
                found[section] = [changed(*one) for one in zip(rig[section], holders, strict=True)]
    return found


def _holders(model):
    """What has numbers in a model, the rotor first."""
    rotor = [_rotor(model.structure)] if model.structure.origin else []
    return rotor + [holder for _, holder in bearings_of(model.terms)]


def _rotor(structure):
    return Holder("rotor", "", structure.origin.options, structure.origin.uncertain)


def _check_known(model, name, where):
    """Raise if nothing has the number of this name."""
    holders = _holders(model)
    if any(holder.pattern(name) for holder in holders):
        return
    section = "rotor" if is_of("rotor", name) else "bearings"
    if section == "rotor" and not model.structure.origin:
        raise RotorstudyError(f"{name} in {where}: the rotor was not built by a plugin, so it has no named numbers")
    known = [holder.name(path) for holder in holders if holder.section == section for path in holder.paths]
    place = where if section == "rotor" else f"{where}; an option that the rig does not state has no number"
    raise unknown_name(f"number of the {section}", name, known, place)


def _acts(model, name):
    """Whether the model depends on a number; one of a rotor that is described by other options does not."""
    try:
        return not is_of("rotor", name) or bool(_rotor_term(model.structure, [name], "the rotor"))
    except RotorstudyError:
        return False


def _rotor_term(structure: Structure, names: list[str], where: str) -> Term:
    """The Term whose amplitudes are relative changes of numbers of the rotor."""
    rotor = _rotor(structure)

    def build(changes):
        return structure.origin.rebuilt(rotor.changed(dict(zip(names, changes, strict=True)))).matrices

    variation = Variation(build, len(names))
    slopes, parameters = variation.slopes_at(np.zeros(len(names))), []
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
