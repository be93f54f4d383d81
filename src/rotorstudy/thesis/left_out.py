"""What a diagnosis gains at each speed when that speed is left out, and what it says of a thesis's own model."""

import numpy as np

from rotorstudy.diagnosis.search import base_model
from rotorstudy.diagnosis.verdict import investigate
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_model_error
from rotorstudy.inference.problem import magnitude_and_phase
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig
from rotorstudy.presentation.diagnosis_page import chance, gain_in_words, place
from rotorstudy.presentation.diagnosis_report import read_settings
from rotorstudy.response.harmonic import measured_response
from rotorstudy.store import as_complex
from rotorstudy.thesis.checks import shown_name
from rotorstudy.thesis.replay import thesis_estimates

UNLIMITED = 1e3  # times the stated uncertainty: as the thesis fits, with no limit on any parameter
WORST = 4  # harmonics named in a sentence


def leave_one_out(records, rig_path):
    """Rows, one a speed: verdict and error there (m rms) when no fit has seen it.

    base, extended : the rig as its uncertainties allow, and with the causes found
    without_limits : the rig's own parameters fitted freely
    """
    rig = read_rig(rig_path)
    spectrum, model, _ = measured_spectrum(records, rig)
    settings = read_settings(rig.given, str(rig_path))
    free = settings.model_copy(update={"uncertainty": {k: UNLIMITED * v for k, v in settings.uncertainty.items()}})
    rows = []
    for i, speed in enumerate(spectrum.speed):
        verdict = investigate(spectrum, model, hold_out=[speed], settings=settings).verdict
        seen = np.arange(len(spectrum.speed)) != i
        whole, prior = base_model(model, free)
        fitted = fit(whole, with_model_error(spectrum.at_speeds(seen), settings), prior)
        off = spectrum.amplitude[i] - predicted(whole, spectrum.at_speeds([i]), fitted.theta)[0]
        gain = verdict["gain"]
        rows.append({
            "speed": float(speed), "verdict": verdict["verdict"], "causes": sorted(map(place, verdict["causes"])),
            "base": gain["before_m"], "extended": gain["after_m"],
            "without_limits": float(np.sqrt(np.mean(np.abs(off) ** 2))), "summary": gain_in_words(verdict),
        })  # fmt: skip
    return rows


def harmonic_rows(config, data, folder):
    """A row a harmonic: what was measured, and what each model leaves (µm rms over the speeds).

    config : ReplayConfig;  data : Dataset of verdict.nc;  folder : of the published values
    The thesis's estimates are compared as the thesis does: without 0X and 1X of the slow roll, at the other speeds.
    """
    harmonics = [int(n) for n in data.harmonic.values]
    measured = as_complex(data.measured)[..., 0]
    slow = int(np.argmin(data.speed.values))
    moving = np.arange(len(data.speed)) != slow
    taken_off = np.where(np.isin(harmonics, (0, 1)), measured[slow], 0)
    theta = thesis_estimates(config, folder, config.all_speeds)
    shown = measured_response(config.model, data.speed.values[moving], harmonics, theta)[..., 0]
    left = {
        "thesis, left": measured[moving] - taken_off - shown,
        "base, left": measured - as_complex(data.base)[..., 0],
        "extended, left": measured - as_complex(data.extended)[..., 0],
    }
    sizes = {"measured": measured, "slow roll": measured[[slow]], **left}
    microns = {f"{name} (µm)": 1e6 * np.sqrt(np.mean(np.abs(v) ** 2, axis=0)) for name, v in sizes.items()}
    sigma = {
        f"{name} (σ)": np.sqrt((data[f"residual_{when}"][..., 0] ** 2).mean("speed")).values
        for name, when in (("base", "before"), ("extended", "after"))
    }
    return [
        {"rig": config.name.replace("_", " "), "harmonic": f"{n}X", **{k: float(v[i]) for k, v in columns.items()}}
        for columns in [microns | sigma]
        for i, n in enumerate(harmonics)
    ]


def parameter_rows(config, data, folder):
    """A row a parameter of the thesis: its estimate, and ours within the limits, before and after the causes."""
    printed = dict(zip(config.model.names, thesis_estimates(config, folder, config.all_speeds), strict=True))
    chosen = data.sel(parameter=list(printed))
    found = {}
    for source in ("base_", ""):
        theta, std = chosen[f"{source}estimate"].values, chosen[f"{source}std"].values
        names, theta, covariance = magnitude_and_phase(list(printed), theta, np.diag(std**2))
        found[source] = dict(zip(names, zip(theta, np.sqrt(np.diag(covariance)), strict=True), strict=True))
    thesis = magnitude_and_phase(list(printed), np.array(list(printed.values())), np.eye(len(printed)))
    rows = []
    for name, value in zip(thesis[0], thesis[1], strict=True):
        (unit,) = config.model.reported_units([name])
        small = 1e6 if unit == "m" else 1.0
        columns = {"thesis": value * small}
        for label, source in (("base", "base_"), ("extended", "")):
            columns |= {label: found[source][name][0] * small, f"{label} ±": found[source][name][1] * small}
        unit = "µm" if unit == "m" else unit
        rows.append({"rig": config.name.replace("_", " "), "parameter": shown_name(name), "unit": unit, **columns})
    return rows


def left_out_rows(config, rows):
    """Rows of `leave_one_out` as a page shows them, µm."""
    return [
        {
            "rig": config.name.replace("_", " "),
            "speed left out (Hz)": row["speed"] / (2 * np.pi),
            "verdict": row["verdict"],
            "causes": "; ".join(row["causes"]),
            **{f"{key.replace('_', ' ')} (µm)": 1e6 * row[key] for key in ("without_limits", "base", "extended")},
        }
        for row in rows
    ]


def notes_on(config, verdict, harmonics, left_out):
    """Sentences on one rig: where its model is wrong, the verdict, what holds on speeds left out.

    harmonics, left_out : from `harmonic_rows`, `leave_one_out`
    """
    rig = config.name.replace("_", " ").capitalize()
    wrong = sorted(harmonics, key=lambda row: -row["base (σ)"])[:WORST]
    where = ", ".join(
        f"{row['harmonic']} by {row['base, left (µm)']:.3g} µm ({row['base (σ)']:.2g} σ)" for row in wrong
    )
    before, after = (chance(verdict["residual_p_value"][when]) for when in ("before", "after"))
    always = set.intersection(*(set(row["causes"]) for row in left_out))
    gained = "; ".join(
        f"{row['speed'] / (2 * np.pi):.3g} Hz: {1e6 * row['base']:.3g} to {1e6 * row['extended']:.3g} µm "
        f"({1e6 * row['without_limits']:.3g})"
        for row in left_out
    )
    better = sum(row["extended"] < row["base"] for row in left_out)
    return [
        f"{rig}, what is wrong: drawn to what its own other measurements allow, the thesis's model misses most at "
        f"{where}; chance of that by noise: {before}.",
        f"{rig}, which cause: {_explained(verdict)} Chance of what is left by noise: {after}.",
        f"{rig}, what adding causes gains at a speed left out: {better} of {len(left_out)} speeds are foretold better; "
        f"{gained}; in brackets the thesis's model with every parameter free. Named whichever speed is left out: "
        f"{', '.join(sorted(always)) or 'no cause, so none of them is established'}.",
    ]


def _explained(verdict):
    """A sentence on what explains a rig's residual, without sizes that the records do not fix."""
    causes = " together with ".join(map(place, verdict["causes"]))
    others = ", ".join(dict.fromkeys(map(place, verdict["ambiguous_with"])))
    removed = 100 * (1 - verdict["residual_share"])
    return {
        "nothing": "nothing is missing.",
        "cause": f"{causes}; it removes {removed:.3g} % of the excess error (rms).",
        "ambiguous": f"{causes}, or {others or 'another'}; it removes {removed:.3g} % of the excess error (rms).",
        "unknown": "no effect of the library explains it (verdict: unknown). What comes nearest, "
        f"{causes or 'nothing'}, removes {removed:.3g} % of the excess error (rms); it is no finding.",
    }[verdict["verdict"]]


def changed_estimates(rows):
    """Sentences, one a rig, on the thesis's estimates that the extended model contradicts by more than two deviations.

    rows : from `parameter_rows`
    """
    found = []
    for rig in dict.fromkeys(row["rig"] for row in rows):
        own = [row for row in rows if row["rig"] == rig and not row["parameter"].endswith("phase")]
        changed = [row for row in own if abs(row["extended"] - row["thesis"]) > 2 * row["extended ±"]]
        named = [row for row in changed if not row["parameter"].startswith("dk")]
        forces = [row for row in own if row["parameter"].startswith("dk")]
        gone = sum(abs(row["extended"]) < 2 * row["extended ±"] for row in forces)
        other = sum(row in changed for row in forces)
        said = ", ".join(
            f"{row['parameter']} from {_round(row['thesis'])} to {_round(row['extended'])} ± {row['extended ±']:.2g} "
            f"{row['unit']}"
            for row in named
        )
        found.append(
            f"{rig.capitalize()}, which of the thesis's estimates change: {said or 'none of damping and unbalance'}; "
            f"{other} of {len(forces)} crack forces dk p_n differ from the thesis's by more than two deviations, and "
            f"{gone} are zero within two, once other causes may explain their harmonic (table below)."
        )
    return found


def _round(value):
    """Three digits without an exponent: 1140, not 1.14e+03."""
    return f"{float(f'{value:.3g}'):g}"


def in_short(verdicts, harmonics):
    """The answer of the page in two sentences.

    verdicts : name -> verdict.json;  harmonics : from `harmonic_rows`, of all rigs
    """
    worst = {}
    for row in harmonics:
        if row["base (σ)"] > worst.get(row["rig"], row)["base (σ)"] or row["rig"] not in worst:
            worst[row["rig"]] = row
    where = "; ".join(f"{rig}: {row['harmonic']}, {row['base, left (µm)']:.3g} µm" for rig, row in worst.items())
    told = "; ".join(f"{name.replace('_', ' ')}: {v['verdict']}" for name, v in verdicts.items())
    return f"In short: the thesis's model misses most at these harmonics ({where}). Verdicts on the cause: {told}."


def impossible_dampings(rows):
    """Sentences on dampings below zero by more than two deviations; rows : from `parameter_rows`."""
    return [
        f"{row['rig'].capitalize()}, what speaks against it: the {model} model needs {row['parameter']} "
        f"{row[model]:.3g} ± {row[f'{model} ±']:.2g} {row['unit']}. No passive part has that, so what it adds is not "
        "the explanation."
        for row in rows
        for model in ("base", "extended")
        if row["parameter"].endswith("damping") and row[model] < -2 * row[f"{model} ±"]
    ]


def shared_causes(verdicts):
    """A sentence on what is a cause, or cannot be ruled out, in every rig; verdicts : name -> verdict.json."""
    named = [{place(cause) for cause in v["causes"] + v["ambiguous_with"]} for v in verdicts.values()]
    shared = ", ".join(sorted(set.intersection(*named)))
    kinds = {v["verdict"] for v in verdicts.values()}
    doubt = " As no rig is explained by it, that is a hint where to look, not a cause." if kinds == {"unknown"} else ""
    return f"In every rig, among what is named or cannot be ruled out: {shared or 'nothing'}.{doubt if shared else ''}"


LEGEND = (
    "Thesis: its own estimates from all speeds, 0X and 1X of the slow roll taken off as in Eq. (3.1). Base: its model, "
    "its dampings, crack and disc drawn to what its impact tests and a lathe allow. Without limits: its model, every "
    "parameter free. Extended: base and the causes found."
)
UNDECIDED = (
    "What three or four speeds of one pair of probes cannot decide: on the rig of Chapter 3, modelled with one "
    "coordinate, a bow and a force at 1X that does not grow with the speed are the same at every speed. An uncoupled "
    "run tells.",
    "All speeds but the slow roll lie well below the critical speed (at a quarter to two fifths of it): an unbalance "
    "grows there with the square of the speed, a bow by its resonance, and a 1X runout that drifts looks like either. "
    "A coast-down through the critical speed tells.",
    "A mirror image of 1X at -1X may be unequal or skewed probes, runout, or supports of unequal stiffness. Exchange "
    "the two probes, or turn both by 45 degrees.",
    "0X is nearly all sensor gap, so the side force by which 0X would tell internal damping is below the stated error. "
    "Touch the shaft at rest before and after each run.",
    "The noise beyond the rounding was never published; 1 µm and 5 % of each harmonic are assumed. Repeated records "
    "tell. With fewer equations than a library has effects, agreement of several causes together is no proof of any.",
)
