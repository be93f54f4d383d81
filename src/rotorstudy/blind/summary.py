"""A blind test as one Dataset, and what its figures show: counts over size, and answers by truth."""

import numpy as np

from rotorstudy.blind.meanings import MEANS
from rotorstudy.blind.scoring import ANSWERS_WITHOUT_CAUSE, is_chain
from rotorstudy.model.registry import registry
from rotorstudy.store import dataset

SIZE_EDGES = np.array([0.3, 1.0, 2.0, 3.0, 6.0, 12.0, 30.0, 100.0, 300.0])
CASE_NUMBERS = {
    "size": ("1", "size in standard deviations, of the smaller effect if two"),
    "beside": ("1", "the same where the other of two effects is there, and of unknown size"),
    "probability": ("1", "stated probability of the first cause"),
    "gain_true": ("1", "error on held-out speeds after over before, against the signal without noise"),
    "gain": ("1", "the same against the measurement"),
    "seconds": ("s", "time of the diagnosis, of one core"),
}
CASE_TEXTS = ("group", "machine", "families", "verdict", "answer")
CASE_FLAGS = ("known", "alone", "in_set", "wrong", "names_rotor")
CRITERION_NUMBERS = {
    "reached": "value reached",
    "low": "lower 95 % bound",
    "high": "upper 95 % bound",
    "found": "count behind the value",
    "cases": "cases, or intervals where these are counted",
}
CRITERION_TEXTS = {
    "what": "quantity",
    "kind": "share, calibration or median",
    "needed": "values that are accepted",
    "status": "how it is judged",
    "reasons": "what went wrong most often",
}


def summary(rows, criteria):
    """All cases and criteria as a Dataset; rows : of `scoring.score`, criteria : of `criteria.judge`, DataFrames."""
    case, one = ("case",), ("criterion",)
    variables = {f"case_{name}": (case, rows[name].to_numpy(float), *said) for name, said in CASE_NUMBERS.items()}
    variables |= {f"case_{n}": (case, rows[n].to_numpy(object), "1", f"{n} of the case") for n in CASE_TEXTS}
    variables |= {f"case_{n}": (case, rows[n].to_numpy(bool).astype("i1"), "1", f"case is {n}") for n in CASE_FLAGS}
    for names, kind in ((CRITERION_NUMBERS, float), (CRITERION_TEXTS, object)):
        variables |= {f"criterion_{n}": (one, criteria[n].to_numpy(kind), "1", said) for n, said in names.items()}
    coordinates = {
        "case": (rows.case.to_numpy(int), "1", "number of the case"),
        "criterion": (criteria.key.to_numpy(object), "1", "key of the acceptance criterion"),
    }
    return dataset(variables, coordinates, title="Blind tests of the diagnosis")


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
