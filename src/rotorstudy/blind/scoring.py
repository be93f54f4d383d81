"""Comparison of verdicts with the truth: right and wrong causes, calibration, coverage, with 95 % bounds."""

import numpy as np

from rotorstudy.blind.simulated_effects import SIMULATED_EFFECTS
from rotorstudy.model.registry import registry
from rotorstudy.units import HALF_INTERVAL

PROBABILITY_EDGES = np.array([0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0])
ANSWERS_WITHOUT_CAUSE = ("nothing", "unknown", "failed")


def share_bounds(found: int, of: int) -> tuple[float, float]:
    """95 % bounds of a share by Clopper and Pearson; 0 to 1 where there are no cases."""
    from scipy.stats import binomtest

    return tuple(map(float, binomtest(found, of).proportion_ci(0.95, "exact"))) if of else (0.0, 1.0)


def is_chain(effect: str) -> bool:
    """Whether an effect belongs to the measuring chain: it acts on the output or on the speed label."""
    if effect in SIMULATED_EFFECTS:
        return SIMULATED_EFFECTS[effect].on != "rotor"
    plugin = registry().plugins["effect"].get(effect)
    return plugin is not None and plugin.acts_on_output


def same_cause(true, named):
    """Whether a named cause is a true one: the effect, and its place where there is more than one."""
    if true["effect"] != named["effect"]:
        return False
    where = named.get("where") or {}
    if true["places"] > 1 and any(key not in where for key in true["where"]):
        return False
    return all(value in _parts(where[key]) for key, value in true["where"].items() if key in where)


def _parts(value):
    """Values of an option of the place: a list for a cause of several parts (harmonics of a runout)."""
    return value if isinstance(value, list) else [value]


def _count(causes):
    """Number of causes, each part by itself."""
    return sum(int(np.prod([len(_parts(value)) for value in (c.get("where") or {}).values()])) for c in causes)


def stated_set(verdict):
    """Causes that a verdict names, alone or among those it cannot tell apart."""
    if verdict["verdict"] in ANSWERS_WITHOUT_CAUSE:
        return []
    return [*verdict.get("causes", []), *verdict.get("ambiguous_with", [])]


def score_case(truth, answer):
    """One row: what was hidden, what was answered, and what is right about the answer.

    answer : {"verdict": dict, "held_out": None or {"speed", "before", "after"} predicted harmonics, "seconds": s}
    """
    verdict, true = answer["verdict"], truth["effects"]
    named, stated = (verdict.get("causes") or []) if stated_set(verdict) else [], stated_set(verdict)
    known = bool(true) and truth["kind"] != "foreign"
    found = [any(same_cause(t, c) for c in named) for t in true]
    inside = [any(same_cause(t, c) for c in stated) for t in true]
    exact = known and all(found) and _count(named) == len(true)
    hit = known and all(inside) and (exact or verdict["verdict"] == "ambiguous")
    confounder = bool(true) and any(c["effect"] in true[0]["confounders"] for c in stated)
    before, after = _held_out_errors(truth, answer.get("held_out"))
    measured = (verdict.get("gain") or {}).get("ratio", np.nan)
    return {
        "case": truth["case"],
        "kind": truth["kind"],
        "rig": truth["rig"],
        "noise_percent": truth["noise_percent"],
        "size": min((t["change_over_noise"] for t in true), default=0.0),
        "beyond": min((t.get("change_beyond_base", np.nan) for t in true), default=0.0),
        "truth": " + ".join(sorted(t["effect"] for t in true)) or "clean",
        "verdict": verdict["verdict"],
        "answer": " + ".join(sorted(c["effect"] for c in named)) or verdict["verdict"],
        "known": known,
        "named": _count(named),
        "states_causes": bool(stated),
        "exact": exact,
        "right": bool(hit),
        "inside": known and bool(stated) and all(inside),
        "confounder": confounder,
        "names_rotor": bool(stated) and not any(is_chain(c["effect"]) for c in stated),
        "posterior_probability": float(named[0].get("posterior_probability", np.nan)) if named else np.nan,
        "first_right": bool(named) and known and any(same_cause(t, named[0]) for t in true),
        "gain_measured": float(measured) if measured is not None else np.nan,
        "gain": after / before if before > 0 else np.nan,
        "seconds": float(answer.get("seconds", np.nan)),
        "covered": _covered(true, named) if exact else [],
    }


def _held_out_errors(truth, held_out):
    """Rms error (m) of base and extended model on held-out speeds, against what the probes show without noise."""
    if not held_out or not held_out["speed"]:
        return np.nan, np.nan
    real, imag = np.array(truth["without_noise"])
    shown = np.swapaxes(real + 1j * imag, 1, 2)  # (speed, harmonic, sensor)
    at = [int(np.abs(np.array(truth["speed_rad_per_s"]) - w).argmin()) for w in held_out["speed"]]
    return tuple(
        float(np.sqrt(np.mean(np.abs(shown[at] - np.asarray(held_out[part])) ** 2))) for part in ("before", "after")
    )


def _covered(true, named):
    """For each parameter with an interval, whether it holds the truth; angles count modulo one revolution."""
    result = []
    for t in true:
        cause = next(c for c in named if same_cause(t, c))
        for name, estimate in cause.get("parameters", {}).items():
            if name not in t["parameters"] or not estimate.get("std"):
                continue
            off = estimate["value"] - t["parameters"][name]
            if estimate.get("unit") == "rad":
                off = np.angle(np.exp(1j * off))
            result.append(bool(abs(off) <= HALF_INTERVAL * estimate["std"]))
    return result


def score(truths, answers):
    """Rows of all cases, as a DataFrame."""
    import pandas as pd

    return pd.DataFrame([score_case(truth, answer) for truth, answer in zip(truths, answers, strict=True)])


def calibration(probability, right):
    """Calibration of the stated posterior probabilities.

    Parameters
    ----------
    probability, right : (case,)
        Stated posterior probability of the first cause, and 1 where that cause is true, else 0.

    Returns
    -------
    stated, right, count : (probability bin,)
        Sum of the stated probabilities, number of true causes, and cases, by bin of PROBABILITY_EDGES.
    error : float
        Expected calibration error; nan without cases.
    """
    bins = len(PROBABILITY_EDGES) - 1
    place = np.clip(np.digitize(probability, PROBABILITY_EDGES) - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    stated, true = (np.bincount(place, values, bins) for values in (probability, right))
    return stated, true, count, float(np.abs(stated - true).sum() / count.sum()) if count.sum() else np.nan


def found_half(rows):
    """Change over noise at which half of the effects are found, by logistic regression on log size.

    All effects share one steepness; a lapse rate of 2 % limits the influence of single cases.
    rows    : DataFrame of `score`
    returns : effects (family,), and (family, 3) size with its 95 % likelihood bounds
    """
    from scipy.stats import chi2

    grid, steepness = np.geomspace(0.03, 300, 241), np.geomspace(0.5, 8, 15)

    def likelihood(part, slope):
        share = 0.01 + 0.98 / (1 + np.exp(-slope * np.log(part["size"].to_numpy()[:, None] / grid)))
        right = part.right.to_numpy(bool)[:, None]
        return np.where(right, np.log(share), np.log(1 - share)).sum(axis=0)

    seen = rows[rows.known & (rows["size"] > 0) & (rows.kind != "two")]
    families = sorted(seen.truth.unique())
    if not families:
        return [], np.zeros((0, 3))
    by_slope = [sum(likelihood(seen[seen.truth == f], b).max() for f in families) for b in steepness]
    slope, found = steepness[int(np.argmax(by_slope))], []
    for family in families:
        fitted = likelihood(seen[seen.truth == family], slope)
        allowed = grid[fitted >= fitted.max() - chi2.ppf(0.95, 1) / 2]
        found.append((grid[int(np.argmax(fitted))], allowed[0], allowed[-1]))
    return families, np.array(found)
