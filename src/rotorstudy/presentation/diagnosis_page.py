"""The page of a diagnosis: verdict, one picture, what next, what could hide; the evidence folded."""

import json
import re
from itertools import product

import pandas as pd

from rotorstudy.diagnosis.verdict import words
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words, place, readable, sizes
from rotorstudy.presentation.captions import CHANGE_FIGURES, DIAGNOSIS_FIGURES, ROTOR_FIGURES
from rotorstudy.presentation.charts import along_probes, bode_charts, is_sweep, speed_view
from rotorstudy.presentation.diagnosis_figures import shown_speed, worst_nodes
from rotorstudy.presentation.pages import cells, pictures, render
from rotorstudy.store import as_complex
from rotorstudy.units import p_value, percent, quantity, spins

MOST_LIMITS = 12  # detection limits on the page, the lowest first; all are in verdict.json
LEAST_SAID = 1e-3  # probability that the true cause is no effect of the library that a reader should know
NAMED = 6  # parameters in a list; more are counted by their kind
HEADINGS = {  # of a diagnosis, and of a comparison
    "nothing": ("nothing is missing", "nothing"),
    "cause": ("a cause is identified", "the cause is identified"),
    "ambiguous": ("more than one cause is possible",) * 2,
    "unknown": ("an unknown effect is missing", "an unknown cause"),
}


def diagnosis_page(verdict, data, figures, title, links=None, states=None):
    """The page as HTML; figures : name -> PNG (path or bytes); of a comparison, states : charts of both states."""
    axes = json.loads(data.attrs.get("axes", "{}"))
    labels = dict(zip(data.parameter.values.tolist(), data.label.values.tolist(), strict=True))
    limits = words.detection_limits(verdict)
    card, of_change = verdict.identifiability, "two_states" in figures
    tables = {
        "unexplained": [
            {"harmonic": f"{row.harmonic}X", "node": row.node, "share of the residual (%)": 100 * row.share}
            | {"standard deviations": row.sigma}
            for row in verdict.unexplained
        ],
        "moved": [
            {
                "parameter": labels[row.name],
                "stated": quantity(row.stated, row.unit, row.stated_std),
                "fitted": quantity(row.value, row.unit, row.std),
                "moved (stated standard deviations)": row.moved_sigma,
            }
            for row in verdict.base_parameters
        ],
        "limits": [
            {"effect": place(row), "parameter": readable(row.parameter)}
            | {"smallest detected": quantity(row.amplitude, row.unit), "relative to a typical one": row.of_typical}
            for row in limits[:MOST_LIMITS]
        ],
        "settings": [{"setting": key, "value": _setting(value)} for key, value in verdict.settings],
    }
    return render(
        "diagnosis.html",
        title=f"{'What changed in' if of_change else 'Diagnosis of'} {title}: {HEADINGS[verdict.verdict][of_change]}",
        links=links or {},
        verdict=verdict,
        answer=_answer(verdict),
        glance=_glance(verdict, of_change),
        next_steps=words.next_steps(verdict, of_change),
        hides=_hides(verdict),
        view=_view(data, of_change, axes),
        states=states,
        bode=_bode(data, axes),
        alternatives=[_with_probability(cause_in_words(c), c) for c in verdict.ambiguous_with],
        excluded=words.excluded_in_words(verdict) if verdict.verdict in ("cause", "ambiguous") else [],
        separated=words.separated(verdict) if verdict.ambiguous_with else {},
        figures=pictures(figures, {**CHANGE_FIGURES, **DIAGNOSIS_FIGURES, "centreline": ROTOR_FIGURES["centreline"]}),
        left={"p_value": p_value(verdict.residual_p_value.after), "share": percent(verdict.residual_share)},
        known_limits=len(limits),
        identifiability={
            "dead": _counted(labels[name] for name in card.dead),
            "known_by_prior_alone": _counted(labels[name] for name in card.known_by_prior_alone),
            "traded_off": _counted(
                f"{' and '.join(labels[name] for name in one.pair)} (correlation {one.correlation:.3f})"
                for one in card.traded_off
            ),
        },
        counts={name: data.sizes[name] for name in ("speed", "harmonic", "node")},
        **{name: cells(pd.DataFrame(rows), 3) for name, rows in tables.items()},
    )


def _counted(names):
    """Names as they are if they are few; of many that differ in their numbers only, one with how many there are."""
    names = list(names)
    if len(names) <= NAMED:
        return names
    kinds = {}
    for name in names:
        kinds.setdefault(re.sub(r"\d+(\.\d+)?", "#", name), []).append(name)
    few = [f"{alike[0]} and {len(alike) - 1} like it" if len(alike) > 1 else alike[0] for alike in kinds.values()]
    return few if len(few) <= 2 * NAMED else [*few[: 2 * NAMED], f"{len(few) - 2 * NAMED} more kinds, in verdict.json"]


def _answer(verdict):
    """The summary without the sentences on what could hide, which the page has below."""
    said = verdict.summary
    for sentence in words.hidden_in_words(verdict):
        said = said.replace(f" {sentence}", "")
    return said


def _hides(verdict):
    """What may be there although the verdict does not name it."""
    said = []
    if verdict.ambiguous_with:
        others = list(dict.fromkeys(map(place, verdict.ambiguous_with)))
        said.append(f"Not ruled out: {'; '.join(others)}.")
    if verdict.outside_probability >= LEAST_SAID:
        share = percent(verdict.outside_probability, 2)
        said.append(f"With a probability of {share} the true cause is no effect of the library.")
    if verdict.not_considered:
        others = ", ".join(map(readable, verdict.not_considered))
        said.append(f"Not considered, although it would look similar: {others}.")
    said += words.hidden_in_words(verdict)
    if found := words.smallest_detected(verdict):
        said.append(f"Smallest sizes detected with a probability of 95 %: {'; '.join(found)} (more below).")
    return said


def _view(data, of_change, axes):
    """The charts of the speed and node that a reader chooses: measured, base, extended."""
    here = data.transpose("speed", "node", "harmonic", ...)
    labels = ("change, measured", "nothing changed", "with the cause") if of_change else (
        "measured", "rig as given, fitted", "with what was added")  # fmt: skip
    said = zip(("measured", "base", "extended"), labels, (6, 1, 0), strict=True)
    spectra = {name: (label, hue, as_complex(here[name])) for name, label, hue in said}
    return speed_view(
        "diagnosis",
        data.speed.values,
        data.node.values,
        data.harmonic.values,
        spectra,
        {"measured": here.standard_deviation.values},
        (shown_speed(data), int(worst_nodes(data, 1)[0])),
        axes,
        ["held out of every fit" if held else "fitted" for held in data.held_out.values],
        [(labels[1], 1, here.residual_before.values), (labels[2], 0, here.residual_after.values)],
    )


def _bode(data, axes):
    """Bode plots of the models with the measured points; None with few speeds, or without 1X and -1X."""
    if not is_sweep(data.speed, data.harmonic) or "probes" not in axes:
        return None
    here = data.sortby("speed").transpose("speed", "harmonic", "node", ...)
    nodes, harmonics, speed = here.node.values.tolist(), here.harmonic.values, here.speed.values
    of = {n: along_probes(axes, nodes, harmonics, as_complex(here[n])) for n in ("measured", "base", "extended")}

    curves, points = {node: {} for node in nodes}, {node: {} for node in nodes}
    for node, (name, label) in product(nodes, (("base", "rig"), ("extended", "with cause"))):
        curves[node] |= {f"{probe}, {label}": one for probe, one in of[name][node].items()}
        points[node] |= {f"{probe}, {label}": one for probe, one in of["measured"][node].items()}
    return bode_charts("bode", speed, curves, points, points_speed=speed)


def _with_probability(text, cause):
    return f"{text}; probability {percent(cause.probability)}"


def _glance(verdict, of_change):
    """The verdict as rows (name, text): cause, place, size, probability, gain; of an unknown one less."""
    rows, gain = [], verdict.gain
    if verdict.verdict == "unknown":
        rows = list(words.known_and_not(verdict, of_change).items())
    else:
        named = "Cause" if verdict.verdict == "cause" else "Most likely"
        for cause in verdict.causes:
            rows.append((named, _with_probability(place(cause), cause)))
            rows += [(f"its {name}", text) for name, text in sizes(cause).items()]
    if verdict.verdict == "nothing":
        rows.append(("Residual under noise alone", p_value(verdict.residual_p_value.before)))
        detected = "; ".join(words.smallest_detected(verdict))
        rows.append(("Detected with 95 % probability", detected or "no effect is detectable"))
    if gain is None:
        rows.append(("Gain", "not known; no speed was held out"))
    elif verdict.causes:
        lengths = f"{quantity(gain.before_m, 'm')} to {quantity(gain.after_m, 'm')} rms"
        sigmas = f"{gain.before_sigma:.3g} to {gain.after_sigma:.3g} standard deviations"
        rows.append(("Error at held-out speeds", f"{lengths}, {sigmas}, at {spins(gain.speeds)}"))
    return rows


def _setting(value):
    """A setting as text."""
    if isinstance(value, dict):
        return ", ".join(f"{key}: {one}" for key, one in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return "by default" if value is None else str(value)
