"""The page on the diagnoses of the replayed experiments: its tables, and sentences on what they show."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from rotorstudy.diagnosis.verdict.cause_words import place, readable
from rotorstudy.diagnosis.verdict.result import Verdict
from rotorstudy.presentation.pages import Table
from rotorstudy.store import load
from rotorstudy.units import number, p_value
from thesis.config import load_replay
from thesis.left_out import compared_parameters, harmonic_rows
from thesis.texts import page

WORST = 4  # harmonics named in a sentence
SHEETS = {"harmonics": "Harmonics", "left_out": "Error at each speed left out, rms over the harmonics"}
SHEETS["parameters"] = "The thesis's estimates"


def left_out_rows(config, rows):
    """Rows of `leave_one_out` as a page shows them, µm."""
    found = []
    for row in rows:
        errors = {f"{key.replace('_', ' ')} (µm)": 1e6 * row[key] for key in ("without_limits", "base", "extended")}
        said = {"verdict": row["verdict"], "causes": "; ".join(row["causes"]), **errors}
        found.append({"rig": readable(config.name), "speed left out (Hz)": row["speed"] / (2 * np.pi), **said})
    return found


def notes_on(config, verdict, harmonics, left_out):
    """Sentences on one rig: residuals by `harmonic_rows`, verdict, and errors at the speeds left out."""
    rig = readable(config.name).capitalize()
    wrong = sorted(harmonics, key=lambda row: -row["base (σ)"])[:WORST]
    said = "{harmonic} by {base, residual (µm):.3g} µm ({base (σ):.2g} σ)"
    where = ", ".join(said.format_map(row) for row in wrong)
    before, after = (p_value(p) for p in (verdict.residual_p_value.before, verdict.residual_p_value.after))
    gained = "; ".join(
        f"{row['speed'] / (2 * np.pi):.3g} Hz: {1e6 * row['base']:.3g} to {1e6 * row['extended']:.3g} µm "
        f"({1e6 * row['without_limits']:.3g})"
        for row in left_out
    )
    better = sum(row["extended"] < row["base"] for row in left_out)
    return [
        f"{rig}, residual: fitted within the limits of its other measurements, the thesis's model has its largest "
        f"residuals at {where}; under noise alone {before}.",
        f"{rig}, cause: {_explained(verdict)} The rest, under noise and the model-form error: {after}.",
        f"{rig}, error at a speed left out: adding the causes improves the prediction of {better} of {len(left_out)} "
        f"speeds; {gained}; in brackets the thesis's model with every parameter free. Named whichever speed is left "
        f"out: {', '.join(_always(left_out)) or 'no cause, so none of them is established'}.",
    ]


def _always(rows):
    """Causes that are named whichever speed is left out; rows : from `leave_one_out`."""
    return sorted(set.intersection(*(set(row["causes"]) for row in rows)))


def _explained(verdict):
    """A sentence on what explains a rig's residual, without amplitudes, which the records do not determine."""
    causes = " together with ".join(map(place, verdict.causes))
    others = ", ".join(dict.fromkeys(map(place, verdict.ambiguous_with)))
    removed = 100 * (1 - verdict.residual_share)
    return {
        "nothing": "no effect is missing.",
        "cause": f"{causes}; it removes {removed:.3g} % of the excess error (rms).",
        "ambiguous": f"{causes}, or {others or 'another'}; it removes {removed:.3g} % of the excess error (rms).",
        "unknown": "no effect of the library explains it (verdict: unknown). The closest explanation, "
        f"{causes or 'nothing'}, removes {removed:.3g} % of the excess error (rms); it is not a finding.",
    }[verdict.verdict]


def changed_estimates(compared):
    """Sentences, one a rig, on estimates of the thesis two standard deviations off those of the extended model."""
    found = []
    for rig in dict.fromkeys(one["rig"] for one in compared):
        own = [one for one in compared if one["rig"] == rig and one["kind"] != "phase"]
        forces = [one for one in own if one["kind"] == "force"]
        changed = [one for one in own if abs(one["extended"] - one["thesis"]) > 2 * one["extended ±"]]
        gone = sum(abs(one["extended"]) < 2 * one["extended ±"] for one in forces)
        other = sum(one in changed for one in forces)
        said = ", ".join(
            f"{one['parameter']} from {number(one['thesis'])} to {number(one['extended'])} ± {one['extended ±']:.2g} "
            f"{one['unit']}"
            for one in changed
            if one not in forces
        )
        found.append(
            f"{rig.capitalize()}, thesis's estimates that change: {said or 'none of damping and unbalance'}; "
            f"{other} of {len(forces)} crack forces dk p_n differ from the thesis's by more than two standard "
            f"deviations, and {gone} are zero within two when other causes may explain their harmonic (table below)."
        )
    return found


def in_short(verdicts, harmonics, left_out):
    """Summary of the page in two sentences, of Verdicts, rows of all rigs, and rows of `leave_one_out` by rig."""
    worst = {}
    for row in harmonics:
        if row["base (σ)"] > worst.get(row["rig"], row)["base (σ)"] or row["rig"] not in worst:
            worst[row["rig"]] = row
    where = "; ".join(f"{rig}: {row['harmonic']}, {row['base, residual (µm)']:.3g} µm" for rig, row in worst.items())
    told = "; ".join(
        f"{readable(name)}: {v.verdict}" + (", not established" if v.causes and not _always(left_out[name]) else "")
        for name, v in verdicts.items()
    )
    return f"Summary: largest residuals of the thesis's model: {where}. Verdicts on the cause: {told}."


def impossible_values(compared):
    """Sentences on parameters that are negative by two standard deviations but cannot be; compared : of all rigs."""
    return [
        f"{one['rig'].capitalize()}, contradiction: the {model} model needs {one['parameter']} {one[model]:.3g} ± "
        f"{one[f'{model} ±']:.2g} {one['unit']}. No passive part has that, so the model is not the explanation."
        for one in compared
        for model in ("base", "extended")
        if one["kind"] == "positive" and one[model] < -2 * one[f"{model} ±"]
    ]


def shared_causes(verdicts):
    """A sentence on the causes that are named or cannot be ruled out in every rig; verdicts : name -> Verdict."""
    named = [{place(cause) for cause in v.causes + v.ambiguous_with} for v in verdicts.values()]
    shared = ", ".join(sorted(set.intersection(*named)))
    kinds = {v.verdict for v in verdicts.values()}
    doubt = " As it explains no rig, it is a hint where to look, not a cause." if kinds == {"unknown"} else ""
    return f"Named or not ruled out in every rig: {shared or 'nothing'}.{doubt if shared else ''}"


def replays_page(configs, folders, reference):
    """The page, and a table of each sheet of `SHEETS`, of replays and the folders of their diagnoses."""
    found, notes, verdicts, left_out = {name: [] for name in SHEETS}, [], {}, {}
    first, *others = yaml.safe_load(Path(reference, "undecided.yaml").read_text(encoding="utf-8"))
    for path, folder in zip(configs, map(Path, folders), strict=True):
        config, data = load_replay(path), load(folder / "verdict.nc")
        verdict = verdicts[config.name] = Verdict.model_validate_json((folder / "verdict.json").read_bytes())
        rows, wrong = json.loads((folder / "left_out.json").read_bytes()), harmonic_rows(config, data, reference)
        left_out[config.name] = rows
        found["left_out"] += left_out_rows(config, rows)
        found["harmonics"] += wrong
        found["parameters"] += compared_parameters(config, data, reference)
        notes += notes_on(config, verdict, wrong, rows)
    notes += [shared_causes(verdicts), *impossible_values(found["parameters"])]
    notes += [*changed_estimates(found["parameters"]), first, *(f"Not decided either: {text}" for text in others)]
    summary = in_short(verdicts, found["harmonics"], left_out)
    tables = {n: pd.DataFrame(rows).drop(columns=["kind", "thesis ±"], errors="ignore") for n, rows in found.items()}
    shown = {heading: tables[name] for name, heading in SHEETS.items()}
    whole = page("replays", tables["harmonics"], notes, digits=3, shown=shown, summary=summary)
    return {"replays": whole, **{f"replays_{name}": Table(table) for name, table in tables.items()}}
