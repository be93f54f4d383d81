"""A blind test as one Dataset: curves over size, calibration, confusion, cases and criteria."""

import numpy as np

from rotorstudy.blind.criteria import attributes
from rotorstudy.blind.meanings import MEANS
from rotorstudy.blind.scoring import (
    ANSWERS_WITHOUT_CAUSE,
    PROBABILITY_EDGES,
    calibration,
    is_chain,
    share_bounds,
)
from rotorstudy.model.registry import registry
from rotorstudy.store import dataset

SIZE_EDGES = np.array([0.3, 1.0, 2.0, 3.0, 6.0, 12.0, 30.0, 100.0, 300.0])
CRITERION_NUMBERS = {
    "reached": "value reached",
    "low": "lower 95 % bound",
    "high": "upper 95 % bound",
    "found": "count behind the value",
    "cases": "cases, or intervals where these are counted",
}
CRITERION_TEXTS = {"what": "quantity", "kind": "share, coverage, calibration or median", "status": "how it is judged"}


def summary(rows, criteria):
    """All results as a Dataset; rows : DataFrame of `scoring.score`;  criteria : list of Criterion."""
    truths, answers, matrix = confusion(rows)
    variables = {
        **_over_size(rows),
        **_calibration(rows),
        "confusion": (("truth", "answer"), matrix, "1", "cases by truth and answer"),
        "accepted": (("truth", "answer"), confounders_of(truths, answers), "1", "1 right, 2 a declared confounder"),
        **_cases(rows),
        **_criteria(criteria),
    }
    probability = (PROBABILITY_EDGES[1:] + PROBABILITY_EDGES[:-1]) / 2
    middle = np.sqrt(SIZE_EDGES[1:] * SIZE_EDGES[:-1])
    coordinates = {
        "size_bin": (middle, "1", "size, geometric middle of the bin"),
        "probability_bin": (probability, "1", "posterior probability, middle of the bin"),
        "truth": (truths, "1", "what was hidden"),
        "answer": (answers, "1", "what was named, or the verdict without a cause"),
        "case": (rows.case.to_numpy(int), "1", "number of the case"),
        "criterion": ([c.key for c in criteria], "1", "key of the acceptance criterion"),
    }
    return dataset(variables, coordinates, title="Blind tests of the diagnosis").assign_attrs(attributes(criteria))


def _over_size(rows):
    """Completeness and reliability over the size of an effect, with 95 % bounds."""
    single = rows.group.isin(["single", "chain"]).to_numpy(bool)
    naming = ((rows.causes > 0) & (rows.group != "two")).to_numpy(bool)
    right, variables, bins = rows.in_set.to_numpy(bool), {}, ("size_bin",)
    for name, chosen, long_name in (
        ("completeness", single, "share of hidden effects found, cause and place"),
        ("reliability", naming, "share of named causes that are true"),
    ):
        k, n = share_over_size(rows, chosen, right)
        bounds = np.array([share_bounds(a, b) for a, b in zip(k, n, strict=True)])
        variables[name] = (bins, np.where(n > 0, k / np.maximum(n, 1), np.nan), "1", long_name)
        variables[f"{name}_low"] = (bins, bounds[:, 0], "1", f"{long_name}, lower 95 % bound")
        variables[f"{name}_high"] = (bins, bounds[:, 1], "1", f"{long_name}, upper 95 % bound")
        variables[f"{name}_cases"] = (bins, n, "1", f"cases behind it: {long_name}")
    return variables


def _calibration(rows):
    """Share of true causes by their stated posterior probability, with 95 % bounds."""
    stated = rows[rows.probability.notna()]
    said, correct, count, error = calibration(stated.probability.to_numpy(float), stated.first_right.to_numpy(float))
    many, by = np.maximum(count, 1), ("probability_bin",)
    bounds = np.array([share_bounds(int(a), int(b)) for a, b in zip(correct, count, strict=True)])
    return {
        "stated_probability": (by, np.where(count, said / many, np.nan), "1", "mean stated posterior probability"),
        "share_right": (by, np.where(count, correct / many, np.nan), "1", "share of the stated causes that is true"),
        "share_right_low": (by, bounds[:, 0], "1", "lower 95 % bound"),
        "share_right_high": (by, bounds[:, 1], "1", "upper 95 % bound"),
        "probability_cases": (by, count, "1", "cases"),
        "calibration_error": ((), error, "1", "expected calibration error"),
    }


def _cases(rows):
    """What is known of every case."""
    variables, along = {}, ("case",)
    for name, unit, long_name in (
        ("size", "1", "size in standard deviations, of the smaller effect if two"),
        ("beside", "1", "the same where the other of two effects is there, and of unknown size"),
        ("probability", "1", "stated probability of the first cause"),
        ("gain_true", "1", "error on held-out speeds after over before, against the signal without noise"),
        ("gain", "1", "the same against the measurement"),
        ("seconds", "s", "time of the diagnosis, of one core"),
    ):
        variables[f"case_{name}"] = (along, rows[name].to_numpy(float), unit, long_name)
    for name in ("group", "machine", "families", "verdict", "answer"):
        variables[f"case_{name}"] = (along, rows[name].to_numpy(object), "1", f"{name} of the case")
    for name in ("known", "alone", "in_set", "wrong", "names_rotor"):
        variables[f"case_{name}"] = (along, rows[name].to_numpy(bool).astype("i1"), "1", f"case is {name}")
    return variables


def _criteria(criteria):
    """Every acceptance criterion: what is needed, what is reached, and why not."""
    variables, along = {}, ("criterion",)
    for name, long_name in CRITERION_NUMBERS.items():
        values = np.array([getattr(c, name) for c in criteria], float)
        variables[f"criterion_{name}"] = (along, values, "1", long_name)
    needed = np.array([c.needed or (np.nan, np.nan) for c in criteria], float).reshape(-1, 2)
    variables["criterion_least"] = (along, needed[:, 0], "1", "lowest accepted value, nan for information")
    variables["criterion_most"] = (along, needed[:, 1], "1", "highest accepted value, nan for information")
    for name, long_name in CRITERION_TEXTS.items():
        values = np.array([getattr(c, name) for c in criteria], object)
        variables[f"criterion_{name}"] = (along, values, "1", long_name)
    reasons = np.array(["; ".join(c.reasons) for c in criteria], object)
    return variables | {"criterion_reasons": (along, reasons, "1", "what went wrong most often")}


def share_over_size(rows, chosen, right):
    """Right cases and all cases (bin,) among the chosen rows, by size; chosen, right : (case,) bool."""
    place = np.digitize(rows["size"], SIZE_EDGES[1:-1])
    of = np.bincount(place[chosen], minlength=len(SIZE_EDGES) - 1)
    return np.bincount(place[chosen & right], minlength=len(SIZE_EDGES) - 1), of


def confusion(rows):
    """Truths, answers, and counts (truth, answer), of cases with at most one effect, which the library has."""
    seen = rows[rows.group.isin(["clean", "single", "chain"])]
    one = seen.answer.where(~seen.answer.str.contains("+", regex=False), "two causes")
    families = seen.families.where(seen.families != "", "clean")
    truths = sorted(families.unique(), key=lambda name: (name != "clean", is_chain(name), name))
    others = {"nothing", "two causes", *ANSWERS_WITHOUT_CAUSE}
    usual = [name for family in truths if family != "clean" for name in MEANS[family][0] if name in set(one)]
    answers = list(dict.fromkeys(usual)) + sorted(set(one) - set(usual) - others)
    answers = ["nothing", *answers, "two causes", *ANSWERS_WITHOUT_CAUSE[1:]]
    matrix = np.array([[int(((families == t) & (one == a)).sum()) for a in answers] for t in truths], int)
    return truths, answers, matrix.reshape(len(truths), len(answers))


def confounders_of(truths, answers):
    """(truth, answer): 1 where the answer is right, 2 where it is a declared confounder, else 0."""
    zoo = registry().plugins["effect"]
    found = np.zeros((len(truths), len(answers)), int)
    for i, t in enumerate(truths):
        means = MEANS[t][0] if t in MEANS else ()
        alike = {name for one in means if one in zoo for name in registry().confounders(one)}
        for j, a in enumerate(answers):
            if a in means or (t == "clean" and a == "nothing"):
                found[i, j] = 1
            elif a in alike:
                found[i, j] = 2
    return found
