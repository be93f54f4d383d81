"""Write docs/rig_keys.md, the keys of every plugin that a rig file may name: python docs/rig_keys.py"""

import inspect
import re
from itertools import product
from pathlib import Path
from typing import Literal, get_args, get_origin

from typing_extensions import is_typeddict

from rotorstudy.authoring.facts import facts
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.model.registry import registry

PAGE = Path(__file__).parent / "rig_keys.md"
SECTIONS = {
    "rotor": "Section `rotor`",
    "bearing": "Items of `bearings` and `foundation`",
    "crack": "Items of `cracks`",
    "depth": "The key `depth` of a crack",
    "effect": "Items of `effects`",
}
COMMON = {
    "bearing": "Every bearing has a `node` (not needed for a rotor with one node) and may have a `label`. Any "
    "number among its options can be uncertain, as `bearings[label].radial_clearance_m` in `diagnosis: uncertainty:`.",
    "crack": "Every crack has `node` or `element` (not needed for a rotor with one place), and may have `angle_rad`, "
    "`weight_dominance`, `order`, `label`, and `depth` or the stiffness loss: `stiffness_loss` of an element, "
    "`stiffness_loss_N_per_m` of a node.",
    "effect": "Every effect may have a `label`, and a `node` unless it acts everywhere. "
    "A parameter with a phase also has the key that ends in `_phase_rad`.",
}
HEAD = """# Every key of a rig file

Written by `python docs/rig_keys.py` from the plugins; `rotorstudy plugins --name NAME` shows the same, with source and
typical sizes. [your_rig.md](your_rig.md) explains how a rig file is made. Angles may end in `_deg` instead of `_rad`;
an unbalance may be `unbalance_g_mm` or `unbalance_kg_m` instead of `mass_kg` and `eccentricity_m`. A key with `?` is
optional, one with `=` has that default, any other is needed. `xx/yy` stands for one key with each.
"""


def page():
    """The page as text."""
    parts = [HEAD]
    for kind, title in SECTIONS.items():
        parts.append(f"\n## {title}\n\n" + (COMMON[kind] + "\n\n" if kind in COMMON else ""))
        without = all(not facts(kind, one).get("parameters") for one in registry().plugins[kind].values())
        columns = ["kind", "what it is", "options", "parameters"][: 3 if without else 4]
        parts.append(f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|\n")
        for name, plugin in sorted(registry().plugins[kind].items()):
            found = facts(kind, plugin)
            keys = _bearing_keys(plugin) if kind == "bearing" else _keys(found.get("parameters", ""))
            options = "; ".join([found.get("options", ""), *_inside(plugin.function)])
            cells = [f"`{name}`", found["what it is"], _short(options), ", ".join(_gathered(keys))][: len(columns)]
            parts.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n")
    return "".join(parts)


def _short(options):
    """Marks instead of words; the node of an effect or a bearing, which all have, is not repeated."""
    text = options.replace(" (optional)", "?").replace(" (needed)", "")
    return re.sub(r"^node\?(, |$)|, node\?(?=;|$|,)", "", text)


def _gathered(keys):
    """Keys that differ in one part only, as a direction or an order, in one: k_xx_N, k_yy_N -> k_xx/yy_N."""
    found = {}
    for key in keys:
        varied = re.search(r"_(xx|xy|yx|yy|p?-?\d+X?)_", key)
        stem = (key[: varied.start()], key[varied.end() :]) if varied else (key, None)
        found.setdefault(stem, []).append(varied[1] if varied else "")
    return [stem if end is None else f"{stem}_{'/'.join(parts)}_{end}" for (stem, end), parts in found.items()]


def _keys(parameters):
    """Keys of parameters in the words of `facts`: 'key (typically 1), ...'."""
    return [text.split(" (")[0] for text in parameters.split("), ") if text]


def _bearing_keys(plugin):
    """Keys of the parameters of a bearing with every choice of its options."""
    choices = {name: get_args(a) for name, a in _annotations(plugin.function).items() if get_origin(a) is Literal}
    found = []
    for chosen in product(*choices.values()):
        options = plugin.example | dict(zip(choices, chosen, strict=True))
        found += [parameter.key for parameter in plugin.function(bench_structure(), **options)]
    return list(dict.fromkeys(found))


def _inside(function):
    """Sentences on the choices of options, and on the keys of the items of options that are lists or mappings."""
    found = []
    for name, annotation in _annotations(function).items():
        if get_origin(annotation) is Literal:
            found.append(f"{name}: {' or '.join(map(str, get_args(annotation)))}")
        for inner in [annotation, *get_args(annotation), *(b for a in get_args(annotation) for b in get_args(a))]:
            if is_typeddict(inner):
                keys = [key if key in inner.__required_keys__ else f"{key}?" for key in inner.__annotations__]
                found.append(f"{name} with {', '.join(keys)}")
    return found


def _annotations(function):
    return {name: p.annotation for name, p in inspect.signature(function).parameters.items()}


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
