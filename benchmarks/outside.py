"""Learn when a verdict misses the true cause: python benchmarks/outside.py --within DIR ... --without DIR ...

The folders are of `benchmarks/foreign.py`: cases, pairs among them, diagnosed with the whole library, and (by
`--without-truth`) without the effects that are the truth. A logistic regression says from a verdict with causes how
probable it is that the truth is not among them, if a share of `--outside` of all faults is of a kind that the library
lacks. `src/rotorstudy/diagnosis/verdict/outside.yaml` has the coefficients, the number of verdicts, and the calibration
error of predictions for cases that were left out; the features of all verdicts are kept in `benchmarks/outside.csv`.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from scipy.optimize import minimize
from scipy.special import expit

from rotorstudy.blind.scoring import calibration
from rotorstudy.diagnosis.verdict.outside import FEATURES, features
from rotorstudy.diagnosis.verdict.result import Verdict

PARTS = 10  # of the cases, each predicted from the others
RIDGE = 1.0  # precision of the prior of a coefficient, for a feature scaled to a standard deviation of one
LEAST_SPREAD = 0.1  # of a feature that hardly varies
ROWS = Path(__file__).with_suffix(".csv")
TARGET = Path(__file__).parents[1] / "src/rotorstudy/diagnosis/verdict/outside.yaml"


def read(folder):
    """Table of cases with the features of their verdicts, of those with causes that fit; in_set : among these."""
    rows = pd.read_csv(folder / "cases.csv").assign(in_set=lambda table: table.among_fitting)
    files = {n: folder / f"cases/{n:04d}/verdict.json" for n in rows.case}
    known = {n: Verdict.model_validate_json(file.read_text()) for n, file in files.items() if file.exists()}
    rows = rows[[n in known and known[n].outside_probability > 0 for n in rows.case]]
    verdicts = [known[n] for n in rows.case]
    shown = pd.DataFrame([features(verdict) for verdict in verdicts], columns=list(FEATURES), index=rows.index)
    return pd.concat([rows[["case", "kind", "in_set"]], shown], axis=1)


def regression(table, weight):
    """Intercept and coefficients (feature,), none negative: what speaks against a cause never speaks for it."""
    values, missed = table[list(FEATURES)].to_numpy(float), 1 - table.in_set.to_numpy(float)
    scale = np.maximum(values.std(axis=0), LEAST_SPREAD)

    def loss(theta):
        odds = theta[0] + values / scale @ theta[1:]
        return np.sum(weight * (np.logaddexp(0, odds) - missed * odds)) + 0.5 * RIDGE * np.sum(theta[1:] ** 2)

    bounds = [(None, None), *[(0, None)] * len(FEATURES)]
    found = minimize(loss, np.zeros(1 + len(FEATURES)), bounds=bounds, method="L-BFGS-B").x
    return found[0], found[1:] / scale


def learned(within, without, share):
    """Content of outside.yaml, from the tables of both libraries and the share of faults outside the library."""
    table = pd.concat([within, without], ignore_index=True)
    weight = np.repeat([1 - share, share], [len(within), len(without)])
    weight *= len(table) / weight.sum()
    predicted = np.zeros(len(table))
    for part in range(PARTS):
        left = (table.case % PARTS == part).to_numpy()
        intercept, coefficients = regression(table[~left], weight[~left])
        predicted[left] = expit(intercept + table.loc[left, list(FEATURES)].to_numpy(float) @ coefficients)
    intercept, coefficients = regression(table, weight)
    count = len(within)
    error = calibration(1 - predicted[:count], within.in_set.to_numpy(float))[-1]
    return {
        "verdicts_with_the_true_effect": count,
        "of_these_right": int(within.in_set.sum()),
        "verdicts_without_it": len(without),
        "share_of_faults_outside": share,
        "calibration_error_left_out": round(float(error), 4),
        "intercept": round(float(intercept), 4),
        "coefficients": {name: round(float(value), 4) for name, value in zip(FEATURES, coefficients, strict=True)},
    }


def main():
    """Read both folders, learn, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("--within", "--without"):
        parser.add_argument(name, type=Path, nargs="+", required=True, metavar="DIR")
    parser.add_argument("--outside", type=float, default=0.1)
    given = parser.parse_args()
    chosen = {"with": given.within, "without": given.without}
    tables = {name: pd.concat([read(one) for one in folders]) for name, folders in chosen.items()}
    pd.concat(tables, names=["library", None]).to_csv(ROWS, float_format="%.6g")
    found = learned(tables["with"], tables["without"], given.outside)
    TARGET.write_text("# written by benchmarks/outside.py\n" + yaml.safe_dump(found, sort_keys=False), encoding="utf-8")
    print(TARGET.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
