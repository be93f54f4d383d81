"""Diagnosis of the replayed experiments: error at each speed left out, and comparison with the thesis's estimates."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotorstudy.diagnosis.result import Verdict
from rotorstudy.diagnosis.search import base_model
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.diagnosis.verdict import diagnose
from rotorstudy.diagnosis.words import gain_in_words, place, readable
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_model_error
from rotorstudy.inference.problem import magnitude_and_phase
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import read_rig
from rotorstudy.response.measured import measured_response
from rotorstudy.store import as_complex, load
from rotorstudy.thesis.checks import shown_name
from rotorstudy.thesis.config import load_replay
from rotorstudy.thesis.replay import thesis_estimates
from rotorstudy.units import number, p_value, shown_unit

UNLIMITED = 1e3  # times the stated uncertainty: parameters are free, as in the thesis
WORST = 4  # harmonics named in a sentence
SHEETS = {
    "harmonics": "Harmonics",
    "left_out": "Error at each speed left out, rms over the harmonics",
    "parameters": "The thesis's estimates",
}


@dataclass(frozen=True)
class Compared:
    """A parameter of the thesis's model by three fits, lengths in µm.

    is_phase    : of a complex parameter
    is_positive : it cannot be negative in a passive part
    on_weight   : it acts on the static deflection alone, as crack forces do
    thesis      : its estimate;  base, extended : value and standard deviation without and with the causes found
    """

    rig: str
    parameter: str
    unit: str
    is_phase: bool
    is_positive: bool
    on_weight: bool
    thesis: float
    base: tuple[float, float]
    extended: tuple[float, float]

    def row(self):
        """A row of the page's table."""
        found = {"rig": self.rig, "parameter": self.parameter, "unit": self.unit, "thesis": self.thesis}
        for name, (value, std) in (("base", self.base), ("extended", self.extended)):
            found |= {name: value, f"{name} ±": std}
        return found


def leave_one_out(records, rig_path):
    """Rows, one per speed: verdict and rms error (m) at that speed, which is left out of every fit.

    base, extended : the rig within its stated uncertainties, without and with the causes found
    without_limits : the rig with every parameter free
    """
    rig = read_rig(rig_path)
    spectrum, model, _ = measured_spectrum(records, rig)
    settings = read_settings(rig.given, str(rig_path))
    free = settings.model_copy(update={"uncertainty": {k: UNLIMITED * v for k, v in settings.uncertainty.items()}})
    rows = []
    for i, speed in enumerate(spectrum.speed):
        verdict = diagnose(spectrum, model, hold_out=[speed], settings=settings)
        seen = np.arange(len(spectrum.speed)) != i
        whole, prior = base_model(model, free)
        fitted = fit(whole, with_model_error(spectrum.at_speeds(seen), settings), prior)
        off = spectrum.amplitude[i] - predicted(whole, spectrum.at_speeds([i]), fitted.theta)[0]
        rows.append({
            "speed": float(speed), "verdict": verdict.verdict, "causes": sorted(map(place, verdict.causes)),
            "base": verdict.gain.before_m, "extended": verdict.gain.after_m,
            "without_limits": float(np.sqrt(np.mean(np.abs(off) ** 2))), "summary": gain_in_words(verdict),
        })  # fmt: skip
    return rows


def harmonic_rows(config, data, folder):
    """One row per harmonic: its measured size and the residual of each model (µm rms over the speeds).

    config : ReplayConfig;  data : Dataset of verdict.nc;  folder : of the published values
    The thesis's estimates are compared as in the thesis: without 0X and 1X of the slow roll, at the other speeds.
    """
    harmonics = [int(n) for n in data.harmonic.values]
    measured = as_complex(data.measured)[..., 0]
    slow = int(np.argmin(data.speed.values))
    moving = np.arange(len(data.speed)) != slow
    taken_off = np.where(np.isin(harmonics, (0, 1)), measured[slow], 0)
    theta = thesis_estimates(config, folder, config.all_speeds)
    shown = measured_response(config.model, data.speed.values[moving], harmonics, theta)[..., 0]
    left = {
        "thesis, residual": measured[moving] - taken_off - shown,
        "base, residual": measured - as_complex(data.base)[..., 0],
        "extended, residual": measured - as_complex(data.extended)[..., 0],
    }
    sizes = {"measured": measured, "slow roll": measured[[slow]], **left}
    microns = {f"{name} (µm)": 1e6 * np.sqrt(np.mean(np.abs(v) ** 2, axis=0)) for name, v in sizes.items()}
    sigma = {
        f"{name} (σ)": np.sqrt((data[f"residual_{when}"][..., 0] ** 2).mean("speed")).values
        for name, when in (("base", "before"), ("extended", "after"))
    }
    return [
        {"rig": readable(config.name), "harmonic": f"{n}X", **{k: float(v[i]) for k, v in columns.items()}}
        for columns in [microns | sigma]
        for i, n in enumerate(harmonics)
    ]


def compared_parameters(config, data, folder):
    """Compared of each parameter of the thesis's model: the thesis's estimate, and ours without and with the causes.

    config : ReplayConfig;  data : Dataset of verdict.nc;  folder : of the published values
    """
    names = list(config.model.names)
    printed = thesis_estimates(config, folder, config.all_speeds)
    chosen = data.sel(parameter=names)
    fits = {"thesis": (printed, np.ones(len(names)))}
    for source, prefix in (("base", "base_"), ("extended", "")):
        fits[source] = (chosen[f"{prefix}estimate"].values, chosen[f"{prefix}std"].values)
    found = {}
    for source, (theta, std) in fits.items():
        shown, theta, covariance = magnitude_and_phase(names, theta, np.diag(std**2))
        found[source] = dict(zip(shown, zip(theta, np.sqrt(np.diag(covariance)), strict=True), strict=True))
    compared = []
    for term in config.model.terms:
        effect = registry().plugins["effect"].get(term.kind)
        for p in term.parameters:
            full = term.full_name(p)
            for name, unit in ((full, p.unit), (f"{full}_phase", "rad")) if p.is_complex else ((full, p.unit),):
                unit, factor = shown_unit(unit) if unit == "m" else (unit, 1.0)
                (value, _), *fitted = (found[source][name] for source in fits)
                base, extended = ((one * factor, std * factor) for one, std in fitted)
                kind = {
                    "is_phase": name != full,
                    "is_positive": bool(effect and effect.is_positive(p.name)),
                    "on_weight": {entry.on for entry in p.entries} == {"static"},
                }
                fits_of = {"thesis": value * factor, "base": base, "extended": extended}
                compared.append(Compared(readable(config.name), shown_name(name), unit, **kind, **fits_of))
    return compared


def left_out_rows(config, rows):
    """Rows of `leave_one_out` as a page shows them, µm."""
    return [
        {
            "rig": readable(config.name),
            "speed left out (Hz)": row["speed"] / (2 * np.pi),
            "verdict": row["verdict"],
            "causes": "; ".join(row["causes"]),
            **{f"{key.replace('_', ' ')} (µm)": 1e6 * row[key] for key in ("without_limits", "base", "extended")},
        }
        for row in rows
    ]


def notes_on(config, verdict, harmonics, left_out):
    """Sentences on one rig: residuals of its model, verdict, and errors at the speeds left out.

    harmonics, left_out : from `harmonic_rows`, `leave_one_out`
    """
    rig = readable(config.name).capitalize()
    wrong = sorted(harmonics, key=lambda row: -row["base (σ)"])[:WORST]
    where = ", ".join(
        f"{row['harmonic']} by {row['base, residual (µm)']:.3g} µm ({row['base (σ)']:.2g} σ)" for row in wrong
    )
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
        f"{rig}, cause: {_explained(verdict)} Remaining residual under noise alone: {after}.",
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
    """Sentences, one per rig, on the thesis's estimates that the extended model contradicts by two standard deviations.

    compared : from `compared_parameters`, of all rigs
    """
    found = []
    for rig in dict.fromkeys(one.rig for one in compared):
        own = [one for one in compared if one.rig == rig and not one.is_phase]
        forces = [one for one in own if one.on_weight]
        changed = [one for one in own if abs(one.extended[0] - one.thesis) > 2 * one.extended[1]]
        gone = sum(abs(one.extended[0]) < 2 * one.extended[1] for one in forces)
        other = sum(one in changed for one in forces)
        said = ", ".join(
            f"{one.parameter} from {number(one.thesis)} to {number(one.extended[0])} ± {one.extended[1]:.2g} {one.unit}"
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
    """Summary of the page in two sentences.

    verdicts : name -> Verdict;  harmonics : from `harmonic_rows`, of all rigs;  left_out : name -> `leave_one_out`
    """
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
        f"{one.rig.capitalize()}, contradiction: the {model} model needs {one.parameter} {value:.3g} ± "
        f"{std:.2g} {one.unit}. No passive part has that, so the model is not the explanation."
        for one in compared
        for model, (value, std) in (("base", one.base), ("extended", one.extended))
        if one.is_positive and value < -2 * std
    ]


def shared_causes(verdicts):
    """A sentence on the causes that are named or cannot be ruled out in every rig; verdicts : name -> Verdict."""
    named = [{place(cause) for cause in v.causes + v.ambiguous_with} for v in verdicts.values()]
    shared = ", ".join(sorted(set.intersection(*named)))
    kinds = {v.verdict for v in verdicts.values()}
    doubt = " As it explains no rig, it is a hint where to look, not a cause." if kinds == {"unknown"} else ""
    return f"Named or not ruled out in every rig: {shared or 'nothing'}.{doubt if shared else ''}"


def replays_page(configs, folders, reference):
    """Tables and notes of the page on the diagnoses of the replayed experiments.

    Parameters
    ----------
    configs : list
        Paths of the replay configurations.
    folders : list
        Of each the folder with verdict.json, verdict.nc and left_out.json.
    reference : str or Path
        Folder of the published values.

    Returns
    -------
    tables : dict
        Rows (list of dicts) of each sheet of `SHEETS`.
    notes : list of str
        The summary first.
    """
    harmonics, shown, compared, notes, verdicts, left_out = [], [], [], [], {}, {}
    for path, folder in zip(configs, map(Path, folders), strict=True):
        config, data = load_replay(path), load(folder / "verdict.nc")
        verdict = verdicts[config.name] = Verdict.model_validate_json((folder / "verdict.json").read_bytes())
        rows, wrong = json.loads((folder / "left_out.json").read_bytes()), harmonic_rows(config, data, reference)
        left_out[config.name], shown = rows, shown + left_out_rows(config, rows)
        harmonics += wrong
        compared += compared_parameters(config, data, reference)
        notes += notes_on(config, verdict, wrong, rows)
    notes = [
        in_short(verdicts, harmonics, left_out),
        LEGEND,
        *notes,
        shared_causes(verdicts),
        *impossible_values(compared),
        *changed_estimates(compared),
        UNDECIDED[0],
        *(f"Not decided either: {text}" for text in UNDECIDED[1:]),
    ]
    return {"harmonics": harmonics, "left_out": shown, "parameters": [one.row() for one in compared]}, notes


LEGEND = (
    "Thesis: its own estimates from all speeds, with 0X and 1X of the slow roll subtracted as in Eq. (3.1). Base: its "
    "model, with dampings, crack and eccentricity within the limits of its impact tests and of usual machining. "
    "Without limits: its model with every parameter free. Extended: the base model and the causes found."
)
UNDECIDED = (
    "What three or four speeds of one pair of probes cannot decide: on the rig of Chapter 3, modelled with one "
    "coordinate, a bow and a 1X force that is independent of the speed have the same response. An uncoupled run would "
    "separate them.",
    "All speeds but the slow roll lie well below the critical speed (at a quarter to two fifths of it): there an "
    "unbalance grows with the square of the speed, a bow by its resonance, and a 1X runout that drifts resembles "
    "either. A coast-down through the critical speed would separate them.",
    "A mirror image of 1X at -1X may be unequal or skewed probes, runout, or supports of unequal stiffness. Exchange "
    "the two probes, or turn both by 45 degrees.",
    "0X is almost entirely sensor gap, so the side force by which 0X would reveal internal damping is below the stated "
    "error. Measure the gap with the shaft at rest before and after each run.",
    "The noise beyond the rounding was never published; 1 µm and 5 % of each harmonic are assumed. Repeated records "
    "would give it. With fewer equations than effects in the library, a fit by several causes together proves none.",
)
