"""What changed on a real rotor kit since its baseline: python benchmarks/rotor_kit_changes.py [CONDITION ...]

`compare` is given the baseline and one other condition of examples/rotor_kit, with the rig updated by two trial runs;
by default all conditions at both speeds but those. Where nothing changed: pairs of the three records of the baseline.
One line a comparison, then the scores.
"""

import argparse
import os
import tempfile
import time
from itertools import combinations
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads slow them down

import numpy as np
from rotor_kit import UPDATING, baseline_records, published, updated_rig
from scipy.stats import chi2

from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.measurement.measurement import measured_spectrum

NODES = (6, 9)  # of the discs
CONFIDENT = 0.95  # posterior probability


def compared(rig, folder, before, after):
    """The Verdict on two tables of harmonics, and the CPU time, s."""
    spectra = []
    for name, text in (("before", before), ("after", after)):
        (folder / f"{name}.csv").write_text(text)
        spectra.append(measured_spectrum([folder / f"{name}.csv"], rig))
    (first, model, findings), (second, _, _) = spectra
    start = time.process_time()
    found = compare(first, second, model, settings=read_settings(rig.given, str(rig.path)), findings=tuple(findings))
    return found.diagnosis.verdict, time.process_time() - start


def judged(verdict, true):
    """What is right about a verdict; true : (2,) unbalance of each disc, g mm."""
    stated = [*verdict.causes, *verdict.ambiguous_with]
    names = {cause.effect for cause in stated}
    places = {cause.where.get("node") for cause in stated if cause.effect == "unbalance"}
    loaded = {node for node, one in zip(NODES, true, strict=True) if one}
    row = {
        "verdict": verdict.verdict,
        "stated": [(c.effect, c.where.get("node"), round(float(c.posterior_probability), 3)) for c in stated],
        "in the set": "unbalance" in names,
        "places in the set": loaded <= places or (verdict.resultant is not None and "unbalance" in names),
        "confident and wrong": any(
            c.posterior_probability > CONFIDENT
            and (c.effect != "unbalance" or (c.where["node"] not in loaded and verdict.resultant is None))
            for c in verdict.causes
        ),
    }
    if verdict.resultant:
        found = verdict.resultant
        size, angle = 1e6 * found.size.value, found.angle.value
        expected = np.dot(found.weights, true)
        off = size * np.exp(1j * (angle - np.angle(expected))) - abs(expected) if expected else size + 0j
        turned = size * np.exp(1j * angle) - expected
        along, across = (turned * np.exp(-1j * angle)).real, (turned * np.exp(-1j * angle)).imag
        square = (along / (1e6 * found.size.std)) ** 2 + (across / (size * found.angle.std)) ** 2
        row |= {"off by": round(float(abs(off)), 2), "covered": bool(square < chi2.ppf(0.95, 2))}
    return row


def main():
    """Compare, print one line each, and the scores."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conditions", nargs="*", help="by default all")
    given = parser.parse_args()
    tables, true, _ = published()
    complete = [n for n, text in tables.items() if n not in UPDATING and text.count("\n") == 9]
    rows, times, balanced = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        rig = updated_rig(folder)
        for name in given.conditions or complete:
            verdict, seconds = compared(rig, folder, tables["BASE"], tables[name])
            rows.append(judged(verdict, true[name]))
            times.append(seconds)
            print(name, np.round(true[name], 1), f"{seconds:.1f} s", rows[-1], flush=True)
        for one, other in combinations(baseline_records() if not given.conditions else [], 2):
            verdict, seconds = compared(rig, folder, one, other)
            balanced.append(verdict.verdict == "nothing")
            print("baseline", f"{seconds:.1f} s", verdict.verdict, flush=True)
    changed = [row for row in rows if row["verdict"] != "nothing"]
    sums = [row for row in rows if "off by" in row]
    for name, values in {
        "comparisons": [len(rows)],
        "CPU time (s)": times,
        "a change is found": [row["verdict"] != "nothing" for row in rows],
        "of these: unbalance among the causes stated": [row["in the set"] for row in changed],
        "of these: the discs that were loaded, too": [row["places in the set"] for row in changed],
        "named with more than 95 %, alone or not, and wrong": [row["confident and wrong"] for row in rows],
        "error of the sum of both discs, as a vector (g mm)": [row["off by"] for row in sums],
        "95 % regions of the sum that hold the truth": [row["covered"] for row in sums],
        "nothing changed, and nothing claimed": balanced,
    }.items():
        if values:
            print(f"{np.mean(values):8.3g}  {name} ({len(values)})")


if __name__ == "__main__":
    main()
