"""Learn when a verdict misses the true cause: python benchmarks/outside.py --within DIR ... --without DIR ...

The folders are of `benchmarks/foreign.py`: cases, pairs among them, diagnosed with the whole library, and (of the kind
"outside", or by `--without-truth`) without the effects that are the truth. A logistic regression says from a verdict
with causes how probable it is that the truth is not among them, if a share of `--outside` of all faults is of a kind
that the library lacks, and a share of `--pairs` are two at once, whatever their shares in the folders. Of each kind the
verdicts without causes count as drawn, too: they are the cases that need no probability.
`src/rotorstudy/diagnosis/verdict/outside.yaml` has the coefficients, the number of verdicts, and the calibration error
of predictions for cases that were left out; the features of all verdicts are kept in `benchmarks/outside.csv`, empty
where a verdict has no causes that fit. `make outside` draws the cases, diagnoses them and learns from them; the table
of the repository was put together from several versions, whose seeds are not all known.
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
    """Table of the cases of a folder: seed, kind, whether the truth is among the causes, and the features of these."""
    rows = pd.read_csv(folder / "cases.csv").assign(in_set=lambda table: table.among_fitting)
    files = {n: folder / f"cases/{n:04d}/verdict.json" for n in rows.case}
    known = {n: Verdict.model_validate_json(file.read_text()) for n, file in files.items() if file.exists()}
    rows = rows[rows.case.isin(known) & (rows.verdict != "nothing")]
    verdicts = [known[n] for n in rows.case]
    nothing = np.full(len(FEATURES), np.nan)
    shown = [features(v) if v.outside_probability > 0 else nothing for v in verdicts]
    shown = pd.DataFrame(shown, columns=list(FEATURES), index=rows.index)
    return pd.concat([rows[["seed", "kind", "in_set"]], shown], axis=1)


def weighted(table, outside, pairs):
    """Verdicts with causes, and their weights: of the cases drawn, each kind of fault has its share."""
    kind = np.where(table["library"] == "without", "outside", np.where(table.kind == "pair", "pair", "single"))
    share = pd.Series({"outside": outside, "pair": (1 - outside) * pairs, "single": (1 - outside) * (1 - pairs)})
    weight = share[kind].to_numpy() / pd.Series(kind).map(pd.Series(kind).value_counts()).to_numpy()
    shown = table[list(FEATURES)].notna().all(axis=1).to_numpy()
    weight = weight[shown]
    return table[shown].reset_index(drop=True), weight * len(weight) / weight.sum()


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


def learned(table, outside, pairs):
    """Content of outside.yaml, from the cases diagnosed with both libraries and the shares of faults.

    table   : of `read`, with a column `library`: "with" the true effect, or "without"
    outside : share of faults that the library lacks;  pairs : share of two faults at once among the others
    """
    table, weight = weighted(table, outside, pairs)
    predicted = np.zeros(len(table))
    for part in range(PARTS):
        left = np.arange(len(table)) % PARTS == part
        intercept, coefficients = regression(table[~left], weight[~left])
        predicted[left] = expit(intercept + table.loc[left, list(FEATURES)].to_numpy(float) @ coefficients)
    intercept, coefficients = regression(table, weight)
    within = (table["library"] == "with").to_numpy()
    error = calibration(1 - predicted[within], table.in_set[within].to_numpy(float))[-1]
    return {
        "verdicts_with_the_true_effect": int(within.sum()),
        "of_these_right": int(table.in_set[within].sum()),
        "verdicts_without_it": int((~within).sum()),
        "share_of_faults_outside": outside,
        "share_of_pairs": pairs,
        "calibration_error_left_out": round(float(error), 4),
        "intercept": round(float(intercept), 4),
        "coefficients": {name: round(float(value), 4) for name, value in zip(FEATURES, coefficients, strict=True)},
    }


def main():
    """Read both folders, learn, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("--within", "--without"):
        parser.add_argument(name, type=Path, nargs="*", default=[], metavar="DIR")
    parser.add_argument("--outside", type=float, default=0.1)
    parser.add_argument("--pairs", type=float, default=0.1)
    given = parser.parse_args()
    chosen = {"with": given.within, "without": given.without}
    new = [read(one).assign(library=name) for name, folders in chosen.items() for one in folders]
    new = [one.assign(library=one["library"].where(one["kind"] != "outside", "without")) for one in new]
    table = pd.concat(new).set_index("library").reset_index() if new else pd.read_csv(ROWS)
    table.to_csv(ROWS, index=False, float_format="%.6g")
    found = learned(table, given.outside, given.pairs)
    TARGET.write_text("# written by benchmarks/outside.py\n" + yaml.safe_dump(found, sort_keys=False), encoding="utf-8")
    print(TARGET.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
