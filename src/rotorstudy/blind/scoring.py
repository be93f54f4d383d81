"""Comparison of verdicts with the truth: right and wrong causes, sizes, calibration, with 95 % bounds."""

import numpy as np
import pandas as pd

from rotorstudy.blind.machines.cases import CHAIN_FAULTS
from rotorstudy.blind.meanings import ALL_SWAPPED, CRACKS, MEANS, REFUSED, SWAPPED, compared
from rotorstudy.model.registry import registry
from rotorstudy.units import HALF_INTERVAL

PROBABILITY_EDGES = np.array([0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0])
ANSWERS_WITHOUT_CAUSE = ("nothing", "unknown", "convention", "refused", "failed")
CRACK_ANGLE = 10.0  # degrees, error of the angle of a crack that is found


def share_bounds(found: int, of: int) -> tuple[float, float]:
    """95 % bounds of a share by Clopper and Pearson; 0 to 1 where there are no cases."""
    from scipy.stats import binomtest

    return tuple(map(float, binomtest(found, of).proportion_ci(0.95, "exact"))) if of else (0.0, 1.0)


def is_chain(effect: str) -> bool:
    """Whether an effect, or a family of the simulator, belongs to the measuring chain."""
    plugin = registry().plugins["effect"].get(effect)
    return effect in CHAIN_FAULTS or (plugin is not None and plugin.acts_on_output)


def name_of(cause):
    """Effect and place in a few characters."""
    return cause["effect"] + "".join(f" {value}" for value in (cause.get("where") or {}).values())


def score_case(truth, answer):
    """One row: what was hidden (of `injection.draw`), what was answered (of `run.answer_case`), what is right."""
    verdict, true = answer["verdict"], truth["true"]
    row = {key: truth[key] for key in ("case", "kind", "families", "machine", "mass_kg", "elements", "probed_nodes",
                                       "known")}  # fmt: skip
    row |= {"seed": str(truth["seed"]), "group": group_of(truth["families"], truth["known"])}
    row |= {key: np.nan if truth[key] is None else truth[key] for key in ("size", "beside")}
    row |= _judged(truth, verdict)
    before, after = _held_out_errors(truth, answer.get("held_out"))
    named = verdict.get("causes", []) if row["alone"] else []
    gain = verdict.get("gain") or {} if row["causes"] else {}
    return row | _sizes_judged(true, named) | _crack_judged(truth, named) | {
        "gain": gain.get("ratio", np.nan),
        "gain_sigma": gain["after_sigma"] / gain["before_sigma"] if "after_sigma" in gain else np.nan,
        "rise_probability": gain.get("rise_probability", np.nan),
        "gain_true": after / before if before > 0 else np.nan,
        "seconds": float(answer.get("seconds", np.nan)),
    }  # fmt: skip


def group_of(families, known):
    """clean, single, chain, two, or outside (what the library lacks, whatever it is)."""
    if not families or not known:
        return "outside" if families else "clean"
    return "two" if "+" in families else "chain" if families in CHAIN_FAULTS else "single"


def grouped(rows):
    """Rows with the column `group`, also those of a file, which may lack it and has nan for no families."""
    families = rows.families.fillna("").astype(str)
    return rows.assign(families=families, group=list(map(group_of, families, rows.known.astype(bool))))


def _judged(truth, verdict):
    """What is right about a verdict."""
    true, kind = truth["true"], verdict["verdict"]
    causes, others = verdict.get("causes") or [], verdict.get("ambiguous_with") or []
    if kind not in ("cause", "ambiguous"):
        causes, others = [], []
    stated = [*causes, *others]
    match = {id(cause): [compared(one, cause) for one in true] for cause in stated}
    nothing = {"causes": 0, "names_rotor": False, "probability": np.nan, "first_right": False, "stated": ""}
    if kind in ("refused", "failed"):
        right = kind == "refused" and truth["fault"] in REFUSED and (
            f"node {true[-1]['node']}: {SWAPPED}" in verdict["error"]
            or (truth["probed_nodes"] == 1 and ALL_SWAPPED in verdict["error"])
        )  # fmt: skip
        return nothing | {"verdict": kind, "answer": kind, "named": verdict["error"], "alone": right, "in_set": right,
                          "wrong": kind == "failed"}  # fmt: skip
    if (chain := verdict.get("measuring_chain")) is not None:
        said = chain["hypothesis"]
        right = len(true) == 1 and MEANS[true[0]["family"]].convention == said
        return nothing | {"verdict": "convention", "answer": "convention", "named": said, "alone": right,
                          "in_set": right, "wrong": not right, "first_right": right}  # fmt: skip

    def every(chosen):
        return bool(true) and all(any(match[id(cause)][i][1] for cause in chosen) for i in range(len(true)))

    return {
        "verdict": kind,
        "answer": " + ".join(sorted(cause["effect"] for cause in causes)) or kind,
        "named": " + ".join(map(name_of, verdict.get("causes") or [])),
        "stated": " | ".join(map(name_of, others)),
        "causes": len(causes),
        "alone": kind == "cause" and every(causes) and all(
            any(there or beside for _, there, beside in match[id(cause)]) for cause in causes
        ),
        "in_set": every(stated),
        "wrong": kind == "cause" and any(not any(name or beside for name, _, beside in match[id(cause)])
                                         for cause in causes),
        "names_rotor": bool(stated) and not any(is_chain(cause["effect"]) for cause in stated),
        # among the effects of the library, times the probability that the truth is one of those
        "probability": causes[0].get("probability", np.nan) * (1 - verdict.get("outside_probability", 0.0))
        if causes else np.nan,
        "first_right": bool(causes) and any(there for _, there, _ in match[id(causes[0])]),
    }  # fmt: skip


def _held_out_errors(truth, held_out):
    """Rms error (m) of base and extended model on held-out speeds, against what the probes show without noise."""
    if not held_out or not held_out["speed"] or "without_noise" not in truth:
        return np.nan, np.nan
    real, imag = np.array(truth["without_noise"])  # (speed, harmonic, node)
    at = [int(np.abs(np.array(truth["speeds_rad_per_s"]) - w).argmin()) for w in held_out["speed"]]
    shown = (real + 1j * imag)[at]
    errors = (np.abs(shown - np.asarray(held_out[part])) for part in ("before", "after"))
    return tuple(float(np.sqrt(np.mean(error**2))) for error in errors)


def _errors_of(true, causes):
    """(parameter, error, whether the 95 % interval holds the truth) of every size that a named true effect states."""
    found = []
    for one in true:
        for cause in causes:
            for name, key in MEANS[one["family"]].sizes.items() if compared(one, cause)[1] else ():
                stated = cause["parameters"].get(name)
                if stated is None or not stated.get("std") or key not in one:
                    continue
                error = stated["value"] - one[key]
                error = _turned(one, error) if key.endswith("_rad") else error
                low, high = interval(stated)
                found.append((name, float(error), low <= stated["value"] - error <= high))
    return found


def _turned(true, error):
    """Error of an angle (rad) in (-pi, pi], of a slot, which faces either way, in (-pi/2, pi/2]."""
    fold = 2 if true["family"].startswith("open_crack") else 1
    return np.angle(np.exp(1j * fold * error)) / fold


def interval(stated):
    """Ends of the 95 % interval of a parameter of a verdict."""
    ways = (-HALF_INTERVAL, HALF_INTERVAL)
    return stated.get("interval_95") or [stated["value"] + way * stated["std"] for way in ways]


def _sizes_judged(true, causes):
    """Number of sizes to compare, of 95 % intervals that hold theirs, and whether the angle of a crack is right."""
    errors = _errors_of(true, causes)
    angles = [np.rad2deg(error) for name, error, _ in errors if name in ("angle_rad", "crack_angle_rad")]
    right = all(abs(error) <= CRACK_ANGLE for error in angles)
    return {"sizes": len(errors), "covered": sum(holds for *_, holds in errors), "angle_right": right}


def _crack_judged(truth, causes):
    """Errors of the first crack among some causes: place (of the length), angle (degrees), flexibility (relative).

    `held` : the stated 95 % interval holds the true flexibility.
    """
    found = dict.fromkeys(("place_error", "angle_error_deg", "flexibility_error", "flexibility_held"), np.nan)
    true = [one for one in truth["true"] if one["family"] in ("crack_form", "open_crack_form")]
    cracks = [cause for cause in causes if cause["effect"] in CRACKS]
    if not true or not cracks:
        return found
    one = true[0]
    stated = cracks[0].get("parameters", {})
    if angle := stated.get("angle_rad", stated.get("crack_angle_rad")):
        found["angle_error_deg"] = float(np.rad2deg(_turned(one, angle["value"] - one["phase_rad"])))
    if "position_m" in stated:
        found["place_error"] = abs(stated["position_m"]["value"] - one["position_m"]) / one["length_m"]
    if yields := stated.get("flexibility_rad_per_N_m"):
        true, (low, high) = one["across_rad_per_N_m"], interval(yields)
        found |= {"flexibility_error": yields["value"] / true - 1, "flexibility_held": float(low <= true <= high)}
    return found


def score(truths, answers):
    """Rows of all cases, as a DataFrame."""
    return pd.DataFrame([score_case(truth, answer) for truth, answer in zip(truths, answers, strict=True)])


def calibration(probability, right):
    """By bin of PROBABILITY_EDGES the sum of stated probabilities, of right ones, of cases; the calibration error."""
    bins = len(PROBABILITY_EDGES) - 1
    place = np.clip(np.digitize(probability, PROBABILITY_EDGES) - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    stated, true = (np.bincount(place, values, bins) for values in (probability, right))
    return stated, true, count, float(np.abs(stated - true).sum() / count.sum()) if count.sum() else np.nan
