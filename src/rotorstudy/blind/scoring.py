"""Verdicts against truths: what was found, how surely, how often wrongly, with the bounds that so many cases allow."""

import numpy as np

from rotorstudy.blind.chain import LABEL
from rotorstudy.model.registry import registry
from rotorstudy.store import dataset

SIZE_EDGES = np.array([0.3, 0.6, 1.0, 2.0, 3.0, 6.0, 12.0, 30.0])
CONFIDENCE_EDGES = np.array([0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0])
ANSWERS_WITHOUT_CAUSE = ("nothing", "unknown", "failed")
INTERVAL = 1.959964  # standard deviations of a 95 % interval


def binomial_bounds(found, of, confidence=0.95):
    """Clopper and Pearson's bounds of a share; 0 to 1 where there are no cases."""
    from scipy.stats import beta

    tail = (1 - confidence) / 2
    low = beta.ppf(tail, found, of - found + 1) if found else 0.0
    high = beta.ppf(1 - tail, found + 1, of - found) if found < of else 1.0
    return float(low), float(high)


def is_chain(effect):
    """Whether an effect belongs to the measuring chain: it acts on the output, or on the label of the speed."""
    plugin = registry().plugins["effect"].get(effect)
    return effect == LABEL or (plugin is not None and plugin.acts_on == "output")


def same_cause(true, named):
    """Whether a named cause is a true one: the effect, and its place where there is more than one."""
    if true["effect"] != named["effect"]:
        return False
    where = named.get("where") or {}
    if true["places"] > 1 and any(key not in where for key in true["where"]):
        return False
    return all(where[key] == value for key, value in true["where"].items() if key in where)


def stated_set(verdict):
    """Causes that a verdict names, alone or among those it cannot tell apart."""
    if verdict["verdict"] in ANSWERS_WITHOUT_CAUSE:
        return []
    return [*verdict.get("causes", []), *verdict.get("ambiguous_with", [])]


def score_case(truth, answer):
    """One row: what was hidden, what was answered, what is right about it.

    answer : {"verdict": dict, "held_out": None or {"speed", "before", "after"} predicted harmonics, "seconds": s}
    """
    verdict, true = answer["verdict"], truth["effects"]
    named, stated = (verdict.get("causes") or []) if stated_set(verdict) else [], stated_set(verdict)
    known = bool(true) and truth["kind"] != "foreign"
    found = [any(same_cause(t, c) for c in named) for t in true]
    inside = [any(same_cause(t, c) for c in stated) for t in true]
    exact = known and all(found) and len(named) == len(true)
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
    }  # fmt: skip


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
    """For each parameter with an interval, whether it holds the truth; phases count around the circle."""
    result = []
    for t in true:
        cause = next(c for c in named if same_cause(t, c))
        for name, estimate in cause.get("parameters", {}).items():
            if name not in t["parameters"] or not estimate.get("std"):
                continue
            off = estimate["value"] - t["parameters"][name]
            if name.endswith("_phase"):
                off = np.angle(np.exp(1j * off))
            result.append(bool(abs(off) <= INTERVAL * estimate["std"]))
    return result


def score(truths, answers):
    """Rows of all cases, as a DataFrame."""
    import pandas as pd

    return pd.DataFrame([score_case(truth, answer) for truth, answer in zip(truths, answers, strict=True)])


def calibration(rows):
    """Per bin of confidence: mean confidence, share right, cases; and the expected calibration error."""
    stated = rows[rows.posterior_probability.notna()]
    place = np.clip(np.digitize(stated.posterior_probability, CONFIDENCE_EDGES) - 1, 0, len(CONFIDENCE_EDGES) - 2)
    count = np.bincount(place, minlength=len(CONFIDENCE_EDGES) - 1)
    said = np.bincount(place, stated.posterior_probability, len(count))
    right = np.bincount(place, stated.first_right.astype(float), len(count))
    error = np.abs(said - right).sum() / count.sum() if count.sum() else np.nan
    return said, right, count, float(error)


def found_half(rows):
    """Size at which half the cases are right, with 95 % bounds by likelihood, of a logistic curve over log size.

    The steepness is fitted to all cases; a share of 2 % of wrong answers at any size keeps single ones from ruling.
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


def share_over_size(rows, chosen, right):
    """found, of (bin,) of rows by size."""
    place = np.digitize(rows["size"], SIZE_EDGES[1:-1])
    of = np.bincount(place[chosen], minlength=len(SIZE_EDGES) - 1)
    return np.bincount(place[chosen & right], minlength=len(SIZE_EDGES) - 1), of


def summary(rows, criteria):
    """Everything as a Dataset; criteria : DataFrame of `criteria.reached`."""
    single = (rows.known & (rows.kind != "two")).to_numpy(bool)
    naming = (rows.states_causes & (rows.kind != "two")).to_numpy(bool)
    right = rows.right.to_numpy(bool)
    variables, bins = {}, ("size_bin",)
    for name, chosen, long_name in (
        ("completeness", single, "share of hidden effects found, cause and place"),
        ("reliability", naming, "share of named causes that are true"),
    ):
        k, n = share_over_size(rows, chosen, right)
        bounds = np.array([binomial_bounds(a, b) for a, b in zip(k, n, strict=True)])
        variables[name] = (bins, np.where(n > 0, k / np.maximum(n, 1), np.nan), "1", long_name)
        variables[f"{name}_low"] = (bins, bounds[:, 0], "1", f"{long_name}, lower 95 % bound")
        variables[f"{name}_high"] = (bins, bounds[:, 1], "1", f"{long_name}, upper 95 % bound")
        variables[f"{name}_cases"] = (bins, n, "1", f"cases behind it: {long_name}")
    said, correct, count, error = calibration(rows)
    many = np.maximum(count, 1)
    bounds = np.array([binomial_bounds(int(a), int(b)) for a, b in zip(correct, count, strict=True)])
    variables |= {
        "stated_confidence": (("confidence_bin",), np.where(count, said / many, np.nan), "1", "mean stated confidence"),
        "share_right": (("confidence_bin",), np.where(count, correct / many, np.nan), "1", "share that is true"),
        "share_right_low": (("confidence_bin",), bounds[:, 0], "1", "lower 95 % bound"),
        "share_right_high": (("confidence_bin",), bounds[:, 1], "1", "upper 95 % bound"),
        "confidence_cases": (("confidence_bin",), count, "1", "cases"),
        "calibration_error": ((), error, "1", "expected calibration error"),
    }  # fmt: skip
    truths, answers, matrix = confusion(rows)
    variables["confusion"] = (("truth", "answer"), matrix, "1", "cases of a truth that were answered so")
    variables["accepted"] = (
        ("truth", "answer"),
        confounders_of(truths, answers),
        "1",
        "1 right, 2 a declared confounder",
    )
    families, half = found_half(rows)
    for i, name in enumerate(("found_half", "found_half_low", "found_half_high")):
        variables[name] = (("family",), half[:, i], "1", "change over noise at which half the effects are found")
    for name, unit, long_name in (
        ("size", "1", "change over noise, of the smaller effect if two"),
        ("beyond", "1", "the same of what base parameters and calibration cannot take over"),
        ("noise_percent", "percent", "noise of a harmonic over the rms vibration"),
        ("posterior_probability", "1", "confidence of the first cause"),
        ("gain", "1", "error on held-out speeds after over before, against the signal without noise"),
        ("gain_measured", "1", "the same against the measurement"),
        ("seconds", "s", "time of the diagnosis"),
    ):
        variables[f"case_{name}"] = (("case",), rows[name].to_numpy(float), unit, long_name)
    for name in ("kind", "rig", "truth", "verdict", "answer"):
        variables[f"case_{name}"] = (("case",), rows[name].to_numpy(object), "1", f"{name} of the case")
    for name in ("known", "exact", "right", "inside", "confounder", "names_rotor"):
        variables[f"case_{name}"] = (("case",), rows[name].to_numpy(bool).astype("i1"), "1", f"case is {name}")
    for name in ("reached", "low", "high", "found", "cases"):
        variables[f"criterion_{name}"] = (("criterion",), criteria[name].to_numpy(float), "1", name)
    for name in ("needed", "status", "why"):
        variables[f"criterion_{name}"] = (("criterion",), criteria[name].to_numpy(object), "1", name)
    middle = np.sqrt(SIZE_EDGES[1:] * SIZE_EDGES[:-1])
    coordinates = {
        "size_bin": (middle, "1", "change over noise, geometric middle of the bin"),
        "confidence_bin": ((CONFIDENCE_EDGES[1:] + CONFIDENCE_EDGES[:-1]) / 2, "1", "confidence, middle of the bin"),
        "truth": (truths, "1", "what was hidden"),
        "answer": (answers, "1", "what was named, or the verdict without a cause"),
        "family": (families, "1", "effect"),
        "case": (rows.case.to_numpy(int), "1", "number of the case"),
        "criterion": (criteria.what.to_list(), "1", "what was promised"),
    }
    return dataset(variables, coordinates, title="Blind tests of the diagnosis")


def confusion(rows):
    """Truths, answers, and counts (truth, answer) of cases with at most one effect; twos and foreign are not in it."""
    seen = rows[rows.kind.isin(["clean", "single", "chain"])]
    one = seen.answer.where(~seen.answer.str.contains(" + ", regex=False), "two causes")
    truths = sorted(seen.truth.unique(), key=lambda name: (name != "clean", is_chain(name), name))
    answers = [name for name in truths if name != "clean"]
    answers += sorted(set(one) - set(answers) - set(ANSWERS_WITHOUT_CAUSE) - {"two causes"})
    answers = ["nothing", *answers, "two causes", "unknown", "failed"]
    matrix = np.array([[int(((seen.truth == t) & (one == a)).sum()) for a in answers] for t in truths], int)
    return truths, answers, matrix.reshape(len(truths), len(answers))


def confounders_of(truths, answers):
    """(truth, answer) 1 where the answer is right, 2 where it is a declared confounder, else 0."""
    zoo = registry().plugins["effect"]
    found = np.zeros((len(truths), len(answers)), int)
    for i, t in enumerate(truths):
        for j, a in enumerate(answers):
            if a == t or (t == "clean" and a == "nothing"):
                found[i, j] = 1
            elif t in zoo and a in dict(zoo[t].confounders):
                found[i, j] = 2
    return found
