"""A rig with estimated values and their covariance, as the next command reads it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorstudy.model.cracks import keys_from_depth
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import SECTIONS, SMALLEST, build_model
from rotorstudy.model.rig_items import make_term, spellings, with_options
from rotorstudy.model.rig_numbers import is_number, rig_with_changes, rotor_numbers, value_of
from rotorstudy.model.uncertainty import uncertainty_section
from rotorstudy.store import write_text

SETTLED = 1e-2  # standard deviations by which a number of the rotor still changes when effects are built again
REBUILDS = 10
LEAST_CHANGE = -0.5  # of a number of the rotor of which effects are built: it keeps its sign


def with_effects_at(models: Sequence[Model], rig: dict, values: dict[str, float]) -> list[Model]:
    """Models with their effects as on a rotor of other numbers: a stiffness loss is a share of the fitted modulus.

    Matrices and bearings follow the numbers in every response, effects by this alone: to build them takes as long.

    models : each of the rig and further effects, with the same sensors
    rig : dict that they were built of;  values : name -> relative change, of other amplitudes without effect
    """
    one, numbers = models[0], {n: max(values[n], LEAST_CHANGE) for n in rotor_numbers(values) if values[n]}
    if not numbers:
        return list(models)
    given = {**rig_with_changes(rig, one, numbers), "sensors": list(one.sensors), "prior": None}
    built = build_model(given, reading=one.structure.reading)
    known, effects = {(term.kind, term.label): term for term in built.terms}, registry().plugins["effect"]

    def moved(term):
        if (term.kind, term.label) in known:
            return known[term.kind, term.label]
        if term.acts_on_output or term.kind not in effects:
            return term
        return replace(with_options(term, {}, built.structure, built.sensors), values=term.values)

    return [replace(model, terms=tuple(map(moved, model.terms))) for model in models]


def with_values(model: Model, values: dict[str, float]) -> Model:
    """The model with other values of some of its amplitudes, by name."""
    known = dict(zip(model.names, model.stated.tolist(), strict=True)) | values
    terms = (replace(t, values={p.name: value_of(t, p, known) for p in t.parameters}) for t in model.terms)
    return replace(model, terms=tuple(terms))


def settled(fitted: Callable, known: Callable):
    """What is fitted with effects built of the numbers that are found.

    fitted : function(name -> relative change of a number of the rotor with which they are built, the last result)
    known  : function(result) -> {name: (value, standard deviation)}
    """
    at, found = {}, None
    for _ in range(REBUILDS):
        found = fitted(at, found)
        here = known(found)
        here = {name: here[name] for name in rotor_numbers(here)}
        if all(abs(value - at.get(name, 0.0)) <= SETTLED * std for name, (value, std) in here.items()):
            break
        at = {name: max(value, LEAST_CHANGE) for name, (value, _) in here.items()}
    return found


def rig_with_estimate(rig: dict, model: Model, names: Sequence[str], theta: np.ndarray, covariance: np.ndarray) -> dict:
    """A rig dict with estimates (parameter,) of some names, and their covariance in its `prior`."""
    from scipy.linalg import block_diag

    theta = np.asarray(theta)
    relative = np.array([1 + value if is_number(name) else 1.0 for name, value in zip(names, theta, strict=True)])
    covariance = np.asarray(covariance) / np.outer(relative, relative)  # relative to the new value
    known = np.isfinite(theta) & np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0)
    names, theta = [name for name, good in zip(names, known, strict=True) if good], theta[known]
    covariance = covariance[np.ix_(known, known)]
    result = rig_with_values(rig, model, dict(zip(names, theta, strict=True)))
    if model.uncertainty is not None:
        kept = [i for i, name in enumerate(model.uncertainty.names) if name not in names]
        covariance = block_diag(covariance, model.uncertainty.covariance[np.ix_(kept, kept)])
        names = [*names, *(model.uncertainty.names[i] for i in kept)]
    return {**result, "prior": uncertainty_section(names, covariance)}


def rig_with_values(rig: dict, model: Model, values: dict[str, float]) -> dict:
    """A rig dict with new values of some amplitudes, {name as in `model.names`: value}."""
    values = {name: value if abs(value) >= SMALLEST else 0.0 for name, value in values.items()}  # as a rig states it
    result = dict(rig)
    for section in ("cracks", "bearings", "foundation", "effects"):
        items = [_item(SECTIONS[section], item, model, values) for item in rig.get(section) or []]
        if items:
            result[section] = items
    return rig_with_changes(result, model, {name: value for name, value in values.items() if is_number(name)})


def _item(section, item, model, values):
    """An item of a rig with the values of its own parameters; a stiffness loss then replaces the depth."""
    term = make_term(section, item, model.structure, model.sensors, section)
    found = {}
    for parameter in term.parameters:
        name = term.full_name(parameter)
        if parameter.is_complex:
            given = complex(term.values.get(parameter.name, 0))
            value = complex(values.get(f"{name}_real", given.real), values.get(f"{name}_imag", given.imag))
            if f"{name}_real" in values or f"{name}_imag" in values:
                found |= {parameter.key: abs(value), parameter.phase_key: float(np.angle(value))}
        elif name in values:
            least = 0.0 if section == "crack" else -np.inf  # no rig states a negative loss, where a fit may end
            found[parameter.key] = float(max(values[name], least))
    if found and "depth" in item:
        plugin, rest = registry().get(section, item["kind"]), {k: v for k, v in item.items() if k != "depth"}
        options = {k: v for k, v in rest.items() if k not in ("kind", "label")}
        item = {**rest, **keys_from_depth(item["depth"], plugin, model.structure, options, section)}
    replaced = spellings(found, term.parameters)
    return {**{key: value for key, value in item.items() if key not in replaced}, **found}


def write_rig(rig: dict, path: str | Path, comment: str) -> None:
    """Write a rig as YAML, atomically, below a comment."""
    import yaml

    head = "".join(f"# {line}\n" for line in comment.splitlines())
    write_text(path, head + yaml.safe_dump(rig, sort_keys=False, allow_unicode=True))
