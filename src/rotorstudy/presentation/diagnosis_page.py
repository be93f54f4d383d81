"""The page an engineer reads in two minutes: the verdict in words, the evidence, and what is assumed."""

import base64
import re
from html import escape

import numpy as np

from rotorstudy.model.registry import registry
from rotorstudy.presentation.diagnosis_figures import FIGURES
from rotorstudy.presentation.tables import CSS, html_table
from rotorstudy.store import write_text

SHOWN = {"m": ("µm", 1e6), "rad": ("°", 180 / np.pi), "s": ("ms", 1e3)}
MOST_LIMITS = 12  # detection limits on the page, the most sensitive first; all are in verdict.json
FEW = 3  # detection limits in a sentence
HARDLY = 3.0  # standard deviations, rms, below which a longer record helps to tell causes apart
TWO_SIDED = 1.96  # standard deviations of a 95 % interval
HEADINGS = {
    "nothing": "nothing is missing",
    "cause": "a cause is found",
    "ambiguous": "more than one cause is possible",
    "unknown": "something unknown is missing",
}
COLOUR = {"nothing": "#009E73", "cause": "#0072B2", "ambiguous": "#B07500", "unknown": "#A00000"}
PAGE_CSS = """
body { max-width: 70em; }
.verdict { border-left: 0.5em solid; padding: 0.4em 1em; background: #f6f6f6; font-size: 1.15em; max-width: 56em; }
.glance th { white-space: nowrap; } .glance td { max-width: 52em; } .glance { font-size: 1em; }
img { max-width: 100%; }
.error { color: #a00000; } .warning { color: #8a5a00; } .note { color: #444; }
figure { margin: 0.5em 0; } figcaption { max-width: 60em; color: #444; font-size: 0.9em; }
"""
CAPTIONS = {
    "what_is_wrong": "Left: measured minus simulated over its standard deviation (noise and stated model error), base "
    "parameters fitted; 1 is what chance does. Right: the force at the measured nodes that would make up for it; where "
    "not all of the rotor is measured the true force may act elsewhere. An effect of the measuring chain shows as a "
    "force too, though none acts.",
    "causes": "Best first. Each was fitted with the base parameters free; what it leaves is weighed against how finely "
    "it had to be tuned and against the number of causes it was chosen from.",
    "before_and_after": "The harmonics and one turn of the orbit, at the nodes with the largest residual.",
    "gain": "Base: the rig as given, fitted. Extended: with the causes.",
}


def summary(verdict, findings=()):
    """The verdict as a few plain sentences; findings : of the quality of the records."""
    doubts = dict.fromkeys(finding.name for finding in findings if finding.severity == "warning")
    alike = [name.replace("_", " ") for name in verdict.get("not_considered", [])]
    told = f" Not considered, though it looks alike: {', '.join(alike)}." if alike else ""
    return _said(verdict) + told + (f" Check the records first: {', '.join(doubts)}." if doubts else "")


def _said(verdict):
    kind, causes, others = verdict["verdict"], verdict["causes"], verdict["ambiguous_with"]
    if kind == "nothing":
        text = (
            "Nothing is missing: noise and the stated model error explain what the simulation does not show (chance of "
            f"a residual this large: {chance(verdict['residual_p_value']['before'])})."
        )
        found = smallest_found(verdict)
        if found:
            text += f" Of 100 records with one of these, 95 would have shown it: {', '.join(found)}."
        return text
    bent = ""
    if kind == "unknown" and verdict["parameter_p_value"] < verdict["settings"]["significance"]:
        bent = f"parameters as far off what is stated as they would have to be: {chance(verdict['parameter_p_value'])}"
    if not causes:
        left = f"a residual this large: {chance(verdict['residual_p_value']['before'])}"
        return f"Something is missing, and no effect of the library explains it (chance of {bent or left})."
    named = " together with ".join(cause_in_words(cause) for cause in causes)
    sure = min(cause["posterior_probability"] for cause in causes)
    if kind == "cause":
        text = f"Something is missing, and it is most likely {named}; confidence {percent(sure)}."
    elif kind == "ambiguous":
        text = f"Something is missing. It may be {named} (confidence {percent(sure)})"
        rest = ", ".join(dict.fromkeys(place(cause) for cause in others))
        text += f", but these cannot be ruled out: {rest}." if rest else ", but that is not sure."
    else:
        near = " together with ".join(map(place, causes))  # sizes of what is not the cause would be taken for findings
        text = f"Something is missing that no effect of the library explains. What comes nearest is {near}"
        text += f", which leaves {percent(verdict['residual_share'])} of the excess error (rms)"
        text += f" (chance of {bent})." if bent else "."
    return f"{text} {gain_in_words(verdict)}".strip()


def gain_in_words(verdict):
    gain = verdict["gain"]
    if gain is None:
        return "No speed was held out, so what adding it gains is not known."
    speeds = " and ".join(f"{w:.4g}" for w in gain["speeds"])
    change = "lowers" if gain["ratio"] < 1 else "raises"
    return (
        f"Adding it {change} the error at {speeds} rad/s, which no fit saw, from {quantity(gain['before_m'], 'm')} to "
        f"{quantity(gain['after_m'], 'm')} rms ({gain['before_sigma']:.3g} to {gain['after_sigma']:.3g} standard "
        "deviations)."
    )


def smallest_found(verdict):
    """The most sensitive detection limits, one a place, as short texts."""
    limits = {place(row): row for row in reversed(detection_limits(verdict))}
    return [f"{name} {quantity(row['amplitude'], row['unit'])}" for name, row in reversed(limits.items())][:FEW]


def detection_limits(verdict):
    """Detection limits, the most sensitive first; of real and imaginary part the larger one."""
    largest = {}
    for row in verdict["detection_limit"]:
        name = re.sub("_(real|imag)$", "", row["parameter"])
        largest[(place(row), name)] = {**row, "parameter": name}  # sorted: the last is the larger
    return sorted(largest.values(), key=lambda row: row["of_typical"])


def plain(name):
    """A parameter as a page names it, without the labels that the search gives."""
    return re.sub(r"\[cause \d+\]", "", re.sub(r"\[calibration \d+\]", " (calibration)", name)).replace("_", " ")


def place(cause):
    """'unbalance at node 2' for a cause or another dict with effect and where."""
    where = " ".join(
        ("at node {}" if key == "node" else f"({key} {{}})").format(v) for key, v in cause["where"].items()
    )
    if registry().get("effect", cause["effect"]).acts_on == "output":
        where = where.replace("at node", "of the probes at node")
    return f"{cause['effect'].replace('_', ' ')} {where}".strip()


def cause_in_words(cause):
    """'unbalance at node 2 (eccentricity 12.00 ± 0.10 µm at 30.0 ± 1.0 °)'."""
    parts, given = [], cause["parameters"]
    for name, value in given.items():
        if name.endswith("_phase") and name.removesuffix("_phase") in given:
            word, fold = _direction(cause)
            parts[-1] += f" {word} {quantity(value['value'] / fold, value['unit'], value['std'] / fold)}"
        else:
            label = "" if name == cause["effect"] else f"{plain(name)} "
            parts.append(f"{label}{quantity(value['value'], value['unit'], value['std'])}")
    return f"{place(cause)} ({', '.join(parts)})"


def _direction(cause):
    """The word before the angle of a cause, and how often that angle goes into the phase of its amplitude."""
    fold = registry().get("effect", cause["effect"]).fold
    return ("at" if fold == 1 else "along"), fold


def sizes(cause):
    """Parameters of a cause with their 95 % intervals, as {name: text}; an angle is that of the direction."""
    found, given = {}, cause["parameters"]
    fold = _direction(cause)[1]
    for name, value in given.items():
        is_phase = name.endswith("_phase") and name.removesuffix("_phase") in given
        amplitude = name.removesuffix("_phase") if is_phase else name
        label = ("phase" if fold == 1 else "stiff direction") if is_phase else "size"
        if amplitude != cause["effect"]:
            label = f"{plain(amplitude)}{', ' + label if is_phase else ''}"
        times = fold if is_phase else 1
        number, std = value["value"] / times, value["std"] and value["std"] / times
        text = quantity(number, value["unit"], std)
        known = std is not None and np.isfinite(std) and std > 0
        found[label] = f"{text} (95 %: {interval(number, value['unit'], std)})" if known else text
    return found


def not_considered(verdict, known=()):
    """Effects that look like a named cause by what they declare, but are no candidates; known : those of the rig."""
    effects, left_out = registry().plugins["effect"], verdict["settings"]["leave_out"]
    confounders = [
        confounder
        for cause in verdict["causes"]
        for confounder, _ in effects[cause["effect"]].confounders
        if confounder not in known
    ]
    return [t for t in dict.fromkeys(confounders) if t in effects and (t in left_out or not effects[t].candidate)]


def next_steps(verdict):
    """What to do or measure next, as plain sentences."""
    kind, steps = verdict["verdict"], []
    doubts = dict.fromkeys(f["name"] for f in verdict["findings"] if f["severity"] == "warning")
    if doubts:
        steps.append(f"Check the records first: {', '.join(doubts)} (see below).")
    if kind == "nothing":
        steps.append(
            "Nothing, unless something below the detection limits matters: then longer records, or speeds nearer to "
            "resonance, lower them."
        )
    if kind == "ambiguous":
        steps += [f"{text.rstrip('.')}." for text, _ in told_apart(verdict)]
        if verdict["gain"] and verdict["gain"]["before_sigma"] < HARDLY:
            steps.append("What is missing is hardly above the noise: longer records, or more of them.")
    if kind == "unknown":
        rest = ", ".join(f"{row['harmonic']}X at node {row['node']}" for row in verdict["unexplained"][:FEW])
        steps.append(
            (f"Look where the rest is: {rest}. " if rest else "")
            + "Physics that the library lacks can be added as an effect (docs/adding_a_model.md)."
        )
    alike = [name.replace("_", " ") for name in verdict["not_considered"]]
    if alike:
        steps.append(
            f"Rule out what was not considered and looks alike: {', '.join(alike)}"
            + (" (was the mean of the probes zeroed with the shaft at rest?)." if "sensor gap" in alike else ".")
        )
    if kind == "cause":
        steps.append(
            "Measure one more speed and compare: 'rotorstudy simulate extended_rig.yaml --speeds ...' predicts it."
        )
    if verdict["gain"] is None and kind != "nothing":
        steps.append("Hold out a speed ('--hold-out'), so that the gain is known.")
    return steps


def told_apart(verdict):
    """[(what would tell, [pairs of causes it tells apart])]"""
    groups = {}
    for line in filter(None, verdict["separating_measurement"].split("; ")):
        pair, _, text = line.partition(": ")
        text = text or pair
        groups.setdefault(text[:1].upper() + text[1:], []).append(pair.replace("_", " ") if text != pair else "")
    return list(groups.items())


def quantity(value, unit, std=None):
    """A number with its standard deviation as an engineer writes it: 12.00 ± 0.10 µm."""
    unit, factor = SHOWN.get(unit, (unit, 1.0))
    unit = "" if unit in ("1", "shape") else unit
    if std is None or not np.isfinite(std):
        return f"{value * factor:.3g} {unit}".strip()
    return f"{as_sure_as(value * factor, std * factor)} ± {as_sure_as(std * factor, std * factor)} {unit}".strip()


def as_sure_as(value, std):
    """A number with the two digits that a standard deviation leaves it; with an exponent if that were long."""
    last = int(np.floor(np.log10(std))) - 1 if std > 0 else -3
    if abs(value) >= 1e7 or last < -7:
        return f"{value:.2g}" if value == std else f"{value:.4g}"
    return f"{round(value, -last):.{max(0, -last)}f}"


def interval(value, unit, std):
    """The 95 % interval of a number: 11.80 to 12.20 µm."""
    unit, factor = SHOWN.get(unit, (unit, 1.0))
    unit = "" if unit in ("1", "shape") else unit
    ends = (as_sure_as((value + side * TWO_SIDED * std) * factor, std * factor) for side in (-1, 1))
    return f"{' to '.join(ends)} {unit}".strip()


def percent(share):
    return "above 99.9 %" if share > 0.999 else f"{100 * share:.3g} %"


def chance(probability):
    if probability < 1e-6:
        return "below one in a million"
    return f"{100 * probability:.3g} %" if probability > 0.1 else f"{100 * probability:.2g} %"


def write_page(verdict, data, figures, path, title):
    """Write the page; verdict : content of verdict.json, data : Dataset of verdict.nc, figures : folder of the PNG."""
    kind = verdict["verdict"]
    parts = [
        f"<h1>Diagnosis of {escape(title)}: {HEADINGS[kind]}</h1>",
        f'<p class="verdict" style="border-color: {COLOUR[kind]}">{escape(verdict["summary"])}</p>',
        *_glance(verdict),
        *_next(verdict),
        *_picture("what_is_wrong", figures),
        *_left(verdict),
        *_picture("causes", figures),
        *_picture("before_and_after", figures),
        *_picture("gain", figures),
        *_table(
            "Base parameters that moved by more than two of their stated deviations", _moved(verdict, data), "None."
        ),
        *_identifiability(verdict),
        *_table(
            "Detection limits",
            _limits(verdict),
            "None: no effect of the library shows in these records.",
            f"The smallest amplitude found in 95 of 100 such records, the {MOST_LIMITS} most sensitive of "
            f"{len(detection_limits(verdict))} (all in verdict.json). Anything smaller may be there unseen.",
        ),
        *_findings(verdict),
        *_table("Settings", _settings(verdict), ""),
        f"<p>{escape(_origin(verdict, data))}</p>",
    ]
    head = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Diagnosis of {escape(title)}</title>'
        f"<style>{CSS}{PAGE_CSS}</style>"
    )
    write_text(path, head + "\n".join(parts) + "</html>\n")


def _glance(verdict):
    """The verdict as a table: cause, place, size, confidence, gain, next step."""
    rows, gain = [], verdict["gain"]
    named = {"cause": "Cause", "unknown": "What comes nearest"}.get(verdict["verdict"], "Most likely")
    for cause in verdict["causes"]:
        sure = "" if verdict["verdict"] == "unknown" else f"; confidence {percent(cause['posterior_probability'])}"
        rows.append((named, f"{place(cause)}{sure}"))
        rows += [(f"its {name}", text) for name, text in sizes(cause).items()]
    if not verdict["causes"]:
        left = chance(verdict["residual_p_value"]["before"])
        rows.append(("Chance of such a residual by noise", left))
        rows.append(("Smallest found in 95 of 100", "; ".join(smallest_found(verdict)) or "no effect shows at all"))
    if gain is None:
        rows.append(("Gain", "not known, no speed was held out"))
    elif verdict["causes"]:
        speeds = ", ".join(f"{w:.4g}" for w in gain["speeds"])
        lengths = " to ".join(quantity(gain[key], "m") for key in ("before_m", "after_m"))
        sigmas = f"{gain['before_sigma']:.3g} to {gain['after_sigma']:.3g} standard deviations"
        rows.append(("Error at speeds no fit saw", f"{lengths} rms, {sigmas} ({speeds} rad/s)"))
    rows += [("What next" if i == 0 else "", text) for i, text in enumerate(next_steps(verdict))]
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
    angles = (
        "<p>Angles: of what turns with the shaft from its reference line, of what stands still from gravity (x), both "
        "in the sense of rotation. ± is one standard deviation.</p>"
    )
    return [f'<table class="glance">{cells}</table>', angles if verdict["causes"] else ""]


def _next(verdict):
    """What else it could be and which measurement would tell."""
    others = verdict["ambiguous_with"]
    if not others:
        return []
    items = "".join(
        f"<li>{escape(cause_in_words(c))}; confidence {percent(c['posterior_probability'])}</li>" for c in others
    )
    parts = ["<h2>What else it could be</h2>", f"<ul>{items}</ul>"]
    told = "".join(
        f"<li><b>{escape(text)}</b> ({escape('; '.join(pairs))})</li>" if any(pairs) else f"<li>{escape(text)}</li>"
        for text, pairs in told_apart(verdict)
    )
    return [*parts, "<h2>What would tell them apart</h2>", f"<ul>{told}</ul>"] if told else parts


def _left(verdict):
    rows = [
        {"harmonic": f"{row['harmonic']}X", "node": row["node"], "share of the rest (%)": 100 * row["share"],
         "standard deviations": row["sigma"]}
        for row in verdict["unexplained"]
    ]  # fmt: skip
    added = "With all causes added" if verdict["causes"] else "Nothing was added"
    note = (
        f"{added}: chance of a residual this large "
        f"{chance(verdict['residual_p_value']['after'])}; left of the excess error: "
        f"{percent(verdict['residual_share'])}."
    )
    return _table("What remains unexplained", rows, f"{note} No harmonic of a node stands out.", note)


def _moved(verdict, data):
    units = dict(zip(data.parameter.values, data.unit.values, strict=True))
    return [
        {
            "parameter": plain(row["name"]),
            "stated": quantity(row["stated"], units[row["name"]], row["stated_std"]),
            "fitted": quantity(row["value"], units[row["name"]], row["std"]),
            "moved (stated deviations)": row["moved_sigma"],
        }
        for row in verdict["base_parameters"]
    ]


def _limits(verdict):
    return [
        {
            "effect": place(row),
            "parameter": plain(row["parameter"]),
            "smallest found": quantity(row["amplitude"], row["unit"]),
            "of a typical one": row["of_typical"],
        }
        for row in detection_limits(verdict)[:MOST_LIMITS]
    ]


def _identifiability(verdict):
    card = verdict["identifiability"]
    lines = {
        "Seen by no harmonic": ", ".join(map(plain, card["dead"])),
        "Known by what the rig states alone, the records add nothing": ", ".join(
            map(plain, card["known_by_prior_alone"])
        ),
        "Traded off against each other": ", ".join(
            f"{plain(a)} and {plain(b)} ({row['correlation']:.3f})"
            for row in card["traded_off"]
            for a, b in [row["pair"]]
        ),
    }
    items = "".join(f"<li>{name}: {escape(text) or 'none'}</li>" for name, text in lines.items())
    return ["<h2>What the records say of the parameters</h2>", f"<ul>{items}</ul>"]


def _findings(verdict):
    items = "".join(
        f'<li class="{f["severity"]}"><b>{f["severity"]}: {escape(f["name"])}</b> ({escape(f["where"])}): '
        f"{escape(f['text'])}</li>"
        for f in verdict["findings"]
    )
    return ["<h2>Quality of the records</h2>", f"<ul>{items}</ul>" if items else "<p>Nothing wrong was seen.</p>"]


def _settings(verdict):
    text = {key: "by default" if value is None else str(value) for key, value in verdict["settings"].items()}
    return [{"setting": key, "value": value.strip("{}[]").replace("'", "") or "none"} for key, value in text.items()]


def _origin(verdict, data):
    origin = verdict["provenance"]
    return (
        f"{len(data.speed)} speeds, {len(data.harmonic)} harmonics, {len(data.node)} nodes; {verdict['candidates']} "
        f"candidates. rotorstudy {origin['rotorstudy_version']}, commit {origin['git_commit']}; records: "
        f"{origin['records']}; rig: {origin['rig']}."
    )


def _table(heading, rows, empty, note=""):
    import pandas as pd

    if not rows:
        return [f"<h2>{heading}</h2>", f"<p>{escape(empty)}</p>"]
    return [f"<h2>{heading}</h2>", f"<p>{escape(note)}</p>" if note else "", html_table(pd.DataFrame(rows), 3)]


def _picture(name, folder):
    encoded = base64.b64encode((folder / f"{name}.png").read_bytes()).decode()
    return [
        f"<h2>{FIGURES[name]}</h2>",
        f'<figure><img alt="{FIGURES[name]}" src="data:image/png;base64,{encoded}">'
        f"<figcaption>{CAPTIONS[name]}</figcaption></figure>",
    ]
