"""The rig extended by what was found: base parameters as fitted, causes as effects with their values."""

import numpy as np

from rotorstudy.model.rig import SECTIONS, make_term


def extended_rig(given, diagnosis):
    """The rig dict with base parameters at their fitted values and every cause of the best explanation as an effect.

    given : rig dict as read from its file;  what calibrates the measuring chain stays out
    """
    model = diagnosis.search.base.model
    fitted = dict(zip(diagnosis.best.model.names, diagnosis.best.theta, strict=True))
    rig = dict(given)
    for section in ("cracks", "bearings", "effects"):
        items = []
        for item in given.get(section) or []:
            term = make_term(SECTIONS[section], item, model.structure, model.sensors, section)
            items.append({**item, **_values(term, fitted)})
        if items:
            rig[section] = items
    causes = diagnosis.search.best.causes
    if causes:
        labels = {item.get("label") for item in rig.get("effects", [])}
        free = (f"found {n}" for n in range(1, len(labels) + len(causes) + 1) if f"found {n}" not in labels)
        rig["effects"] = [*rig.get("effects", []), *(_effect(cause, fitted, next(free)) for cause in causes)]
    return rig


def _effect(cause, fitted, label):
    """A cause as an item of a rig file."""
    values = _values(cause.term, fitted)
    return {"kind": cause.effect, "label": label, **cause.where, **cause.shape, **values}


def _values(term, fitted):
    """Configuration keys of a term's parameters with their fitted values."""
    values = {}
    for parameter in term.parameters:
        name = term.full_name(parameter)
        if parameter.is_complex:
            value = complex(fitted[f"{name}_real"], fitted[f"{name}_imag"])
            values |= {parameter.key: abs(value), parameter.phase_key: float(np.angle(value))}
        else:
            values[parameter.key] = float(fitted[name])
    return values


def write_rig(rig, path, comment):
    """A rig dict as YAML, atomically, headed by a comment."""
    import yaml

    from rotorstudy.store import write_text

    head = "".join(f"# {line}\n" for line in comment.splitlines())
    write_text(path, head + yaml.safe_dump(rig, sort_keys=False, allow_unicode=True))
