"""The facts stated by each plugin, as tables made from the registry alone."""

import inspect
from contextlib import suppress
from dataclasses import fields
from itertools import product
from typing import get_args

from typing_extensions import is_typeddict

from rotorstudy.authoring.invariants.bench import bench_of, bench_structure, typical_term
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.options import annotations, choices, option_names
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
    found["in detail"] = " ".join((plugin.function.__doc__ or "").strip().partition("\n")[2].split())
    found["options"] = _options(kind, plugin)
    found["inside options"] = "; ".join(_inside(plugin.function))
    if kind in ("bearing", "effect"):
        found["parameters"] = _parameters(kind, plugin)
    if kind in ("rotor", "bearing"):
        found["uncertain by"] = ", ".join(f"{path} {percent(share)}" for path, share in plugin.uncertain.items())
    own = {field.name: field.default for field in fields(plugin) if isinstance(getattr(plugin, field.name), bool)}
    claims = [name for name in sorted(own) if getattr(plugin, name) != own[name]]
    found["claims"] = ", ".join(name.replace("_", " ") for name in claims)
    alike = registry().confounders(plugin.name) if kind == "effect" else {}
    found["confounders"] = "; ".join(f"{confounder}: {separation}" for confounder, separation in alike.items())
    found["source"], found["checked against"] = plugin.source, plugin.checked
    return {heading: text for heading, text in found.items() if text}


def _options(kind, plugin):
    """'name = default' of every option, or (needed), or (optional) if nothing is its default."""
    known = inspect.signature(plugin.function).parameters
    defaults = {name: known[name].default for name in option_names(plugin.function, GIVEN.get(kind, ()))}
    marks = {inspect.Parameter.empty: " (needed)", None: " (optional)"}
    texts = {name: f" = {d:g}" if isinstance(d, float) else f" = {d}" for name, d in defaults.items()}
    texts |= {name: marks[d] for name, d in defaults.items() if d in (None, inspect.Parameter.empty)}
    return ", ".join(map("".join, texts.items()))


def _inside(function):
    """Choices of options, and the keys of the items of options that are lists or mappings; ? marks an optional key."""
    found = []
    for name, annotation in annotations(function).items():
        if name in choices(function):
            found.append(f"{name}: {' or '.join(map(str, get_args(annotation)))}")
        for inner in [annotation, *get_args(annotation), *(b for a in get_args(annotation) for b in get_args(a))]:
            if is_typeddict(inner):
                keys = [key if key in inner.__required_keys__ else f"{key}?" for key in inner.__annotations__]
                found.append(f"{name} with {', '.join(keys)}")
    return found


def _parameters(kind, plugin):
    """'key (typically size)' of every amplitude, at the first possible place on a bench rotor; of every choice."""
    if kind == "effect":
        parameters = typical_term(plugin, *bench_of(plugin)).parameters
    else:
        known = choices(plugin.function)
        options = (plugin.example | dict(zip(known, chosen, strict=True)) for chosen in product(*known.values()))
        parameters = [*plugin.function(bench_structure(), **plugin.example)]
        for chosen in options:
            with suppress(RotorstudyError):  # another choice, which the file of the example excludes
                parameters += plugin.function(bench_structure(), **chosen)
    found = {}
    for p in parameters:
        more = " and a phase" if p.is_complex else "" if p.default is None else f", by default {p.default:g}"
        found[p.key] = f"{p.key} (typically {p.typical:.3g}{more})"
    return ", ".join(found.values())


def tables():
    """Kind -> DataFrame with one row per plugin and one column per heading."""
    import pandas as pd

    zoo = registry().plugins
    rows = {kind: [facts(kind, zoo[kind][name]) for name in sorted(zoo[kind])] for kind in KINDS}
    return {kind: pd.DataFrame(own).fillna("") for kind, own in rows.items()}
