"""A cause in words: its name, its place and its sizes. ± is one standard deviation."""

import numpy as np

from rotorstudy.diagnosis.verdict.result import Place
from rotorstudy.model.registry import registry
from rotorstudy.units import ANY_ANGLE, ends_of_interval, interval, quantity, unit_ending

FEW = 3  # amplitudes of a cause that are all said
SMALL = 1e-3  # m; lengths below are said in µm
ACTS_BY = {"force": "a force", "moment": "a moment", "bending": "bending moments"}
ABSENT = 3.0  # standard deviations; of a cause with many amplitudes, a sentence names those above
PLACES = {"node", "element"}


def readable(name):
    """A name without underscores."""
    return name.replace("_", " ")


def place(named):
    """'unbalance at node 2 (disc A)', 'bow in elements 5 to 8' of a Place; of a Candidate without the rig's label."""
    label = named.label.removesuffix(f" node {named.where.get('node')}") if isinstance(named, Place) else ""
    labelled = f" ({label})" if label else ""
    said = {"node": f"at node{{}} {{}}{labelled}", "element": "in element{} {}"}
    said["foundation"] = "of the foundation at node{} {}"
    options, where = dict(named.where), []
    if "number" in options:
        said["number"] = f"({without_unit(options['number'])})"
    if "last_element" in options:
        ends = np.atleast_1d(options["element"]), np.atleast_1d(options.pop("last_element"))
        options["element"] = [f"{one} to {last}" if last > one else one for one, last in zip(*ends, strict=True)]
    for key, value in options.items():
        several = isinstance(value, list) and (len(value) > 1 or " to " in str(value))
        both = "and " * (bool(where) and key in PLACES and options.keys() >= PLACES)  # of two parts of one fault
        where.append(both + said.get(key, f"({readable(key)}{{}} {{}})").format("s" * several, _listed(value)))
    return f"{readable(named.effect)} {' '.join(where)}".strip().replace(") (", ", ")


def force_in_words(force):
    """'a force at node 2' of a FreeForce or a OnePlace."""
    ((place, number),) = force.where.items()
    return f"{ACTS_BY[force.motion]} {'at' if place == 'node' else 'in'} {place} {number}"


def _listed(value):
    """'2', or '1, 2 and 3' for a list."""
    *first, last = map(str, value) if isinstance(value, list) else [str(value)]
    return f"{', '.join(first)} and {last}" if first else last


def _said(cause):
    """(name, label, estimate, whether the records leave it open) of each parameter of a cause, as it is said.

    Its phase is that of the direction, a multiple of which the amplitude has; a length of the shape is in mm, or small.
    """
    fold = registry().get("effect", cause.effect).fold
    for name, one in cause.parameters.items():
        unit, factor = one.unit, 1.0
        if one.part == "phase":
            factor = 1 / fold
        elif one.part == "shape":
            unit = unit or unit_ending(name)[1]
            unit, factor = ("mm", 1e3) if unit == "m" and not abs(one.value) < SMALL else (unit, 1.0)
        scaled = {"value": factor * one.value, "std": one.std and factor * one.std, "unit": unit}
        ends = one.interval_95 and [factor * end for end in one.interval_95]
        is_angle = one.part == "phase" or (one.part == "shape" and unit == "rad")
        is_open = is_angle and one.std is not None and not one.std < ANY_ANGLE
        yield name, without_unit(name, one.unit), one.model_copy(update=scaled | {"interval_95": ends}), is_open


def _absent(cause):
    """Names of the amplitudes that say nothing: of more than a few those near zero, of a cause of fixed size all."""
    amplitudes = {name: one for name, one in cause.parameters.items() if one.part in ("amplitude", "magnitude")}
    if registry().get("effect", cause.effect).fixed and any(one.part == "shape" for one in cause.parameters.values()):
        return set(amplitudes)  # its shape says all
    deviations = {name: abs(one.value) / one.std if one.std else np.inf for name, one in amplitudes.items()}
    least = min(ABSENT, max(deviations.values(), default=0.0)) if len(amplitudes) > FEW else 0.0
    return {name for name, size in deviations.items() if size < least}


def cause_in_words(cause):
    """'unbalance at node 2 (eccentricity 12.00 ± 0.10 µm at 30.0 ± 1.0 °)'."""
    texts, absent, is_said = [], _absent(cause), True
    word = "at" if registry().get("effect", cause.effect).fold == 1 else "along"
    for name, label, one, is_open in _said(cause):
        size = quantity(one.value, one.unit, one.std)
        is_said = is_said if one.part == "phase" else name not in absent  # a phase follows its amplitude
        if is_said and one.part == "phase":
            texts[-1] += f" {word} {'any angle' if is_open else size}"
        elif is_said:
            texts.append(size if name == cause.effect else f"{label} {size}")
    texts += [f"{option} {value}" for option, value in _variants(cause).items()]
    where, sizes_of_it = place(cause), ", ".join(texts)
    # one pair of brackets: "looseness at node 1 (bearing; play 0.82 µm)"
    return f"{where.removesuffix(')')}; {sizes_of_it})" if where.endswith(")") else f"{where} ({sizes_of_it})"


def without_unit(name, own=""):
    """Readable name of a parameter; its unit, or that of its ending, is said with its value."""
    ending, unit = unit_ending(name)
    return readable(name.removesuffix(ending) if unit == (own or unit) else name)


def sizes(cause):
    """{label: text} of the parameters of a cause with their 95 % intervals; angles are those of the direction."""
    found, stem = {}, ""
    direction = "phase" if registry().get("effect", cause.effect).fold == 1 else "stiff direction"
    for name, label, one, is_open in _said(cause):
        if one.part == "phase":
            label = direction if stem == cause.effect else f"{readable(stem)}, {direction}"
        else:
            stem, label = name, "size" if name == cause.effect else label
        text = quantity(one.value, one.unit, one.std)
        if is_open:
            text = "not known"
        elif one.std is not None and np.isfinite(one.std) and one.std > 0:
            least = 0.0 if one.part == "magnitude" else -np.inf
            ends = one.interval_95 or ends_of_interval(one.value, one.std, least)
            text += f" (95 %: {interval(one.unit, one.std, ends)})"
        found[label] = text
    return found | _variants(cause)


def _variants(cause):
    """{'breathing': 'gradual or sudden'} of the alternatives that the records leave, the most probable first."""
    left = (cause.variant, *cause.other_variants)
    return {readable(key): " or ".join(dict.fromkeys(readable(one[key]) for one in left)) for key in cause.variant}
