"""Unbalance of a real rotor kit: python benchmarks/rotor_kit.py [--tables]

The rig of examples/rotor_kit is updated by its baseline and two trial runs; the unbalance of both discs in every other
condition is then identified with it, one condition at a time. Nothing else of those conditions is used. `--tables`
writes the tables of harmonics in examples/rotor_kit/runs from the published figures.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from scipy.stats import chi2

from rotorstudy.diagnosis.runs.joint import identify_runs
from rotorstudy.model.estimated_rig import write_rig
from rotorstudy.model.rig import read_rig

KIT = Path(__file__).parents[1] / "examples" / "rotor_kit"
PROBES = ("plane1_x", "plane1_y", "plane2_x", "plane2_y")
UPDATING = ("BASE", "A008", "A016")
SHOWN = (*UPDATING, "A020", "A025", "B010")
USUAL = 30.0  # g mm, prior standard deviation of each part of an unbalance
MIL = 25.4  # µm
HALVES = 200  # of the conditions, drawn at random, from which influence and scatter are learned
MEASURABLE = 24.0  # g mm, from which the phase of an unbalance is scored
SIZE = "mean absolute error of the unbalance of a disc"
PHASE = f"mean absolute error of the phase, of {MEASURABLE:.0f} g mm and more"


def published():
    """Tables of harmonics of every condition, {condition: text}, its unbalance, {condition: (2,) g mm}, and change.

    The change is that of 1X of the probes, {condition: (speed * probe,) µm}, complex.
    """
    added = pd.read_csv(KIT / "published" / "added_unbalance.csv").set_index("condition")
    moved = {name: _phasors(rows) for name, rows in _changes().groupby("condition")}
    changes = {name: MIL * np.conj(one.to_numpy().ravel()) for name, one in moved.items()}
    true = {
        name: np.array([row[f"disc{d}_g_mm"] * np.exp(-1j * np.deg2rad(row[f"disc{d}_hole_deg"])) for d in (1, 2)])
        for name, row in added.iterrows()
    }
    return {name: _table(one) for name, one in moved.items()}, true, changes


def baseline_records():
    """Tables of harmonics of each of the records of the baseline."""
    return [_table(_phasors(rows)) for _, rows in _changes().query("condition == 'BASE'").groupby("record")]


def _changes():
    return pd.read_csv(KIT / "published" / "one_x_minus_baseline.csv")


def _phasors(rows):
    """Published phasors (speed, probe) of some rows, mean of their repeats: lags of each probe, mil."""
    mean = rows.groupby("speed").mean(numeric_only=True)
    return pd.DataFrame({probe: mean[f"{probe}_real_mil"] + 1j * mean[f"{probe}_imag_mil"] for probe in PROBES})


def _table(moved):
    """The text of a table of harmonics, by `_phasors` relative to the baseline.

    The y probes are 90 degrees ahead of x, and hole angles count against the sense of rotation.
    """
    baseline = pd.read_csv(KIT / "published" / "baseline_mean.csv")
    rpm, lines = baseline.set_index("speed").speed_rpm, ["speed_rpm,node,harmonic,amplitude_mil,phase_deg"]
    for speed, whole in (moved + _phasors(baseline).loc[moved.index]).iterrows():
        for plane in (1, 2):
            x, y = np.conj(whole[[f"plane{plane}_x", f"plane{plane}_y"]])
            for n, z in ((1, (x + 1j * y) / 2), (-1, np.conj(x - 1j * y) / 2)):
                lines.append(f"{rpm[speed]},{plane},{n},{abs(z):.6f},{np.degrees(np.angle(z)):.3f}")
    return "\n".join(lines) + "\n"


def estimated(rig, folder, condition, text):
    """Unbalance of both discs, (4,) real and imaginary parts in g mm, and its covariance."""
    (folder / f"{condition}.csv").write_text(text)
    run = {
        "name": condition,
        "records": [f"{condition}.csv"],
        "unbalances": [{"node": f"disc {d}", "std_g_mm": USUAL} for d in (1, 2)],
    }
    (folder / "run.yaml").write_text(yaml.safe_dump({"runs": [run]}))
    joint = identify_runs(folder / "run.yaml", rig).joint
    names = [f"eccentricity[added {d}]_{part} @ {condition}" for d in (1, 2) for part in ("real", "imag")]
    theta, covariance = joint.of(names)
    return 1e3 * theta, 1e6 * covariance


def scores(found, true):
    """Rows (quantity, value) over conditions; found : {condition: (theta, covariance)}."""
    size, phase, split, resultant, inside, inside_resultant = [], [], [], [], [], []
    together = np.kron([1.0, 1.0], np.eye(2))
    for condition, (theta, covariance) in found.items():
        u, t = theta[::2] + 1j * theta[1::2], true[condition]
        size += list(np.abs(np.abs(u) - np.abs(t)))
        phase += [abs(np.degrees(np.angle(a / b))) for a, b in zip(u, t, strict=True) if abs(b) >= MEASURABLE]
        off = theta - np.column_stack([t.real, t.imag]).ravel()
        inside.append(off @ np.linalg.solve(covariance, off) < chi2.ppf(0.95, 4))
        both, spread = together @ off, together @ covariance @ together.T
        resultant.append(np.hypot(*both))
        inside_resultant.append(both @ np.linalg.solve(spread, both) < chi2.ppf(0.95, 2))
        split.append(np.sqrt(np.trace(covariance) / np.trace(spread)))
    return [
        ("conditions", len(found)),
        (f"{SIZE} (g mm)", np.mean(size)),
        (f"{PHASE} (degrees)", np.mean(phase)),
        ("mean error of the sum of both discs, as a vector (g mm)", np.mean(resultant)),
        ("95 % regions of both discs that hold the truth", np.mean(inside)),
        ("95 % regions of the sum that hold the truth", np.mean(inside_resultant)),
        ("uncertainty of the discs over that of their sum", np.median(split)),
    ]


def least_error(changes, true):
    """Rows (quantity, value): the least mean errors that the scatter from run to run allows any estimator (Cramer-Rao).

    The changes of all conditions are fitted by one linear influence of both unbalances and an offset, that of the
    baseline. What is left is the scatter; estimators that know its covariance, and the influence, reach this bound.
    """
    added, moved = (np.array([of[name] for name in changes]) for of in (true, changes))
    influence, scatter = _linear(added, moved)
    known = influence[:2].conj() @ np.linalg.solve(scatter, influence[:2].T)  # information of complex amplitudes
    std = np.sqrt(np.diag(np.linalg.inv(known)).real / 2)  # of a part of the unbalance of each disc
    mean = np.sqrt(2 / np.pi) * std  # of the absolute value of a normal variable
    large = np.array([mean / np.maximum(np.abs(one), 1e-9) for one in added])[np.abs(added) >= MEASURABLE]
    return [(f"least {SIZE} (g mm)", mean.mean()), (f"least {PHASE} (degrees)", np.degrees(large.mean()))]


def error_from_half(changes, true):
    """Rows (quantity, value): errors in half of the conditions, influence and scatter learned from the other half."""
    rng, errors = np.random.default_rng(0), []
    added, moved = (np.array([of[name] for name in changes]) for of in (true, changes))
    for _ in range(HALVES):
        order = rng.permutation(len(added))
        learned, scored = order[: len(order) // 2], order[len(order) // 2 :]
        influence, scatter = _linear(added[learned], moved[learned])
        weighted = influence[:2].conj() @ np.linalg.inv(scatter)
        off = moved[scored] - influence[2]
        found = np.linalg.solve(weighted @ influence[:2].T, weighted @ off.T).T
        large = np.abs(added[scored]) >= MEASURABLE
        size = np.abs(np.abs(found) - np.abs(added[scored])).mean()
        phase = np.degrees(np.abs(np.angle(found[large] / added[scored][large]))).mean()
        errors.append((size, phase))
    size, phase = np.median(errors, axis=0)
    return [(f"{SIZE}, learned from the other half (g mm)", size), (f"{PHASE}, likewise (degrees)", phase)]


def _linear(added, moved):
    """Influence (3, probe) of both unbalances and an offset, by least squares, and covariance of what is left."""
    regressors = np.column_stack([added, np.ones(len(added))])
    influence, *_ = np.linalg.lstsq(regressors, moved, rcond=None)
    left = moved - regressors @ influence
    return influence, left.T @ left.conj() / (len(added) - regressors.shape[1])


def main():
    """Update the rig, identify the unbalance of the other conditions and print the scores."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tables", action="store_true", help="write examples/rotor_kit/runs and stop")
    given = parser.parse_args()
    tables, true, changes = published()
    if given.tables:
        for name in SHOWN:
            (KIT / "runs" / f"{name}.csv").write_text(tables[name])
        return
    rest = {name: text for name, text in tables.items() if name not in UPDATING}
    complete = {name: text for name, text in rest.items() if text.count("\n") == 9}  # at both speeds
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        rig = updated_rig(folder)
        found = {name: estimated(rig, folder, name, text) for name, text in complete.items()}
    for series in ("AB", "A", "B"):
        print(f"conditions {' and '.join(series)}")
        for name, value in scores({name: one for name, one in found.items() if name[0] in series}, true):
            print(f"{value:8.3g}  {name}")
    print("what the scatter from run to run allows")
    at_both = {name: changes[name] for name in complete}
    for name, value in [*least_error(at_both, true), *error_from_half(at_both, true)]:
        print(f"{value:8.3g}  {name}")


def updated_rig(folder):
    """The rig updated by the baseline and the trial runs."""
    write_rig(identify_runs(KIT / "updating.yaml", KIT / "rig.yaml").rig, folder / "updated.yaml", "updated")
    return read_rig(folder / "updated.yaml")


if __name__ == "__main__":
    main()
