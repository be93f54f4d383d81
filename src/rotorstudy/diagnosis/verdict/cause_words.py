"""A cause in words: its name, its place and its sizes. ± is one standard deviation."""

import numpy as np

from rotorstudy.diagnosis.verdict.result import Place
from rotorstudy.model.registry import registry
from rotorstudy.units import ANY_ANGLE, interval, quantity, unit_ending

FEW = 3  # amplitudes of a cause that are all said
SMALL = 1e-3  # m; lengths below are said in µm
ABSENT = 3.0  # standard deviations; of a cause with many amplitudes, a sentence names those above


def readable(name):
    """A name without underscores."""
    return name.replace("_", " ")


def place(named):
    """'unbalance at node 2 (disc A)', 'bow in elements 5 to 8' for a Place, Cause or DetectionLimit.

    For a Candidate without the rig's label.
    """
    label = named.label.removesuffix(f" node {named.where.get('node')}") if isinstance(named, Place) else ""
    labelled = f" ({label})" if label else ""
    said = {"node": f"at node {{}}{labelled}", "element": "in element {}", "foundation": "of the foundation at node {}"}
    if "last_element" in named.where:
        said |= {"element": "in elements {}", "last_element": "to {}"}
    if "number" in named.where:
        said["number"] = f"({without_unit(named.where['number'])})"
    where = " ".join(
        said.get(key, f"({_plural(readable(key), value)} {{}})").format(_listed(value))
        for key, value in named.where.items()
    )
    return f"{readable(named.effect)} {where}".strip().replace(") (", ", ")


def _plural(key, value):
    return f"{key}s" if isinstance(value, list) and len(value) > 1 else key


def _listed(value):
    """'2', or '1, 2 and 3' for a list."""
    *first, last = map(str, value) if isinstance(value, list) else [str(value)]
    return f"{', '.join(first)} and {last}" if first else last


def _direction(cause):
    """The preposition of the angle of a cause, and the multiple of that angle that is the phase of its amplitude."""
    fold = registry().get("effect", cause.effect).fold
    return ("at" if fold == 1 else "along"), fold


def _is_open(phase):
    """Whether the records leave the phase of an amplitude open."""
    return phase.std is not None and not phase.std < ANY_ANGLE


def _angle(phase, fold):
    """Value and standard deviation of the direction of a phase, rad."""
    return phase.value / fold, None if phase.std is None else phase.std / fold


def _present(cause):
    """The parameters of a cause that say something.

    Of more than a few amplitudes those that differ from zero, with their phases; of a cause of fixed size its shape.
    """
    amplitudes = {name: one for name, one in cause.parameters.items() if one.part in ("amplitude", "magnitude")}
    if registry().get("effect", cause.effect).fixed and any(one.part == "shape" for one in cause.parameters.values()):
        absent = set(amplitudes)  # its shape says all
    elif len(amplitudes) > FEW:
        deviations = {name: abs(one.value) / one.std if one.std else np.inf for name, one in amplitudes.items()}
        least = min(ABSENT, max(deviations.values()))
        absent = {name for name, size in deviations.items() if size < least}
    else:
        return cause.parameters
    found, is_present = {}, True
    for name, one in cause.parameters.items():
        is_present = is_present if one.part == "phase" else name not in absent  # a phase follows its amplitude
        found |= {name: one} if is_present else {}
    return found


def cause_in_words(cause):
    """'unbalance at node 2 (eccentricity 12.00 ± 0.10 µm at 30.0 ± 1.0 °)'."""
    texts, (word, fold) = [], _direction(cause)
    for name, one in _present(cause).items():
        if one.part == "phase":
            value, std = _angle(one, fold)
            texts[-1] += f" {word} any angle" if _is_open(one) else f" {word} {quantity(value, one.unit, std)}"
        else:
            label = "" if name == cause.effect else f"{without_unit(name, one.unit)} "
            texts.append(label + quantity(*_in_its_unit(name, one)))
    texts += [f"{option} {value}" for option, value in _variants(cause).items()]
    where, sizes_of_it = place(cause), ", ".join(texts)
    # one pair of brackets: "looseness at node 1 (bearing; play 0.82 µm)"
    return f"{where.removesuffix(')')}; {sizes_of_it})" if where.endswith(")") else f"{where} ({sizes_of_it})"


def without_unit(name, own=""):
    """Readable name of a parameter; its unit, or that of its ending, is said with its value."""
    ending, unit = unit_ending(name)
    return readable(name.removesuffix(ending) if unit == (own or unit) else name)


def _in_its_unit(name, estimate):
    """Value, unit and standard deviation of a parameter; of a length in its shape in mm, or in m where it is small."""
    value, std = estimate.value, estimate.std
    unit = estimate.unit or (unit_ending(name)[1] if estimate.part == "shape" else "")
    if estimate.part != "shape" or unit != "m" or abs(value) < SMALL:
        return value, unit, std
    return 1e3 * value, "mm", None if std is None else 1e3 * std


def sizes(cause):
    """{label: text} of the parameters of a cause with their 95 % intervals; angles are those of the direction."""
    found, stem, (_, fold) = {}, "", _direction(cause)
    for name, one in cause.parameters.items():
        (value, unit, std), label = _in_its_unit(name, one), "size"
        if one.part == "phase":
            value, std = _angle(one, fold)
            label = "phase" if fold == 1 else "stiff direction"
        else:
            stem = name
        if stem != cause.effect:
            label = f"{readable(stem)}, {label}" if one.part == "phase" else without_unit(stem, one.unit)
        text = quantity(value, unit, std)
        known = std is not None and np.isfinite(std) and std > 0
        if one.part == "phase" and _is_open(one):
            found[label] = "not known"
        elif known:
            least = 0.0 if one.part == "magnitude" else -np.inf
            ends = one.interval_95 and np.array(one.interval_95) * (1e3 if unit == "mm" else 1.0)
            found[label] = f"{text} (95 %: {interval(value, unit, std, least, ends)})"
        else:
            found[label] = text
    return found | _variants(cause)


def _variants(cause):
    """{'breathing': 'gradual or sudden'} of the alternatives that the records leave, the most probable first."""
    left = (cause.variant, *cause.other_variants)
    return {readable(key): " or ".join(dict.fromkeys(readable(one[key]) for one in left)) for key in cause.variant}
