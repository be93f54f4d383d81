"""The facts stated by each plugin, as tables made from the registry alone."""

import inspect

import numpy as np

from rotorstudy.authoring.invariants.bench import bench_of, bench_structure, typical_term
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.options import option_names
from rotorstudy.model.registry import registry
from rotorstudy.units import percent

GIVEN = {  # arguments passed by the engine, which are not options of a rig file
    "crack": ("angle",),
    "depth": ("depth_ratio",),
    "bearing": ("structure",),
    "effect": ("structure", "sensors"),
    "spectrum": ("signal", "time", "speed", "harmonics", "marks"),
    "estimator": ("problem",),
}


def facts(kind, plugin):
    """The facts of one plugin of a kind as {heading: text}, without empty texts."""
    found = {"name": plugin.name, "what it is": plugin.summary}
    found["options"] = _options(kind, plugin)
    if kind in ("bearing", "effect"):
        found["parameters"] = _parameters(kind, plugin)
    if kind in ("rotor", "bearing"):
        found["uncertain by"] = ", ".join(f"{path} {percent(share)}" for path, share in plugin.uncertain.items())
    found["claims"] = ", ".join(name.replace("_", " ") for name in _claims(plugin))
    alike = registry().confounders(plugin.name) if kind == "effect" else {}
    found["confounders"] = "; ".join(f"{confounder}: {separation}" for confounder, separation in alike.items())
    found["source"], found["checked against"] = plugin.source, plugin.checked
    return {heading: text for heading, text in found.items() if text}


def _options(kind, plugin):
    """'name = default' of every option, or (needed), or (optional) if nothing is its default."""
    known = inspect.signature(plugin.function).parameters
    names = option_names(plugin.function, GIVEN.get(kind, ()))
    defaults = {name: known[name].default for name in names}
    marks = {inspect.Parameter.empty: " (needed)", None: " (optional)"}
    return ", ".join(
        name
        + (marks[d] if d in (None, inspect.Parameter.empty) else f" = {d:g}" if isinstance(d, float) else f" = {d}")
        for name, d in defaults.items()
    )


def _parameters(kind, plugin):
    """'key (typically size)' of every amplitude, at the first possible place on a bench rotor."""
    structure, place = bench_of(plugin) if kind == "effect" else (bench_structure(), {})
    term = typical_term(plugin, structure, place)
    found = []
    for p in term.parameters:
        more = " and a phase" if p.is_complex else "" if p.default is None else f", by default {p.default:g}"
        found.append(f"{p.key} (typically {p.typical:.3g}{more})")
    return ", ".join(found)


def _claims(plugin):
    """Names of the flags that differ from the default of the kind."""
    own = {name for name, value in vars(plugin).items() if isinstance(value, (bool, np.bool_))}
    default = {name: field.default for name, field in type(plugin).__dataclass_fields__.items()}
    return [name for name in sorted(own) if getattr(plugin, name) != default[name]]


def tables():
    """Kind -> DataFrame with one row per plugin and one column per heading."""
    import pandas as pd

    zoo = registry().plugins
    return {
        kind: pd.DataFrame([facts(kind, zoo[kind][name]) for name in sorted(zoo[kind])]).fillna("") for kind in KINDS
    }
