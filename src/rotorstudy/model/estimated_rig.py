"""A rig with estimated values and their covariance, as the next command reads it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rotorstudy.model.cracks import keys_from_depth
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import SECTIONS, SMALLEST
from rotorstudy.model.rig_items import make_term, spellings
from rotorstudy.model.rig_numbers import is_number, rig_with_changes
from rotorstudy.model.uncertainty import uncertainty_section
from rotorstudy.store import write_text


def rig_with_estimate(rig: dict, model: Model, names: Sequence[str], theta: np.ndarray, covariance: np.ndarray) -> dict:
    """A rig dict with estimates (parameter,) of some names, and their covariance in its `prior`."""
    theta = np.asarray(theta)
    relative = np.array([1 + value if is_number(name) else 1.0 for name, value in zip(names, theta, strict=True)])
    covariance = np.asarray(covariance) / np.outer(relative, relative)  # relative to the new value
    known = np.isfinite(theta) & np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0)
    names, theta = [name for name, good in zip(names, known, strict=True) if good], theta[known]
    covariance = covariance[np.ix_(known, known)]
    result = rig_with_values(rig, model, dict(zip(names, theta, strict=True)))
    if model.uncertainty is not None:
        kept = [i for i, name in enumerate(model.uncertainty.names) if name not in names]
        whole = np.zeros((len(names) + len(kept),) * 2)
        whole[: len(names), : len(names)] = covariance
        whole[len(names) :, len(names) :] = model.uncertainty.covariance[np.ix_(kept, kept)]
        names, covariance = [*names, *(model.uncertainty.names[i] for i in kept)], whole
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
