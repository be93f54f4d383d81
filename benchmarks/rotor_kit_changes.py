"""What changed on a real rotor kit since its baseline: python benchmarks/rotor_kit_changes.py [CONDITION ...]

`compare` is given the baseline and one other condition of examples/rotor_kit, with the rig updated by two trial runs;
by default all conditions at both speeds but those. Where nothing changed: pairs of the three records of the baseline.
One line a comparison, then the scores.
"""

import argparse
import tempfile
import time
from itertools import combinations
from pathlib import Path

import many_cases
import numpy as np
from rotor_kit import UPDATING, baseline_records, published, updated_rig

from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.measurement.measurement import measured_spectrum

NODES = (6, 9)  # of the discs
CONFIDENT = 0.95  # posterior probability
OF_CHANGES = {"in_set": "unbalance among the causes stated", "places_in_set": "the discs that were loaded, too"}
OF_ALL = {
    "confident_and_wrong": "named with more than 95 %, alone or not, and wrong",
    "seconds": "CPU time (s), median",
}


def compared(rig, folder, before, after, true):
    """Row of two tables of harmonics; true : (2,) unbalance of each disc, g mm, or None where nothing changed."""
    spectra = []
    for name, text in (("before", before), ("after", after)):
        (folder / f"{name}.csv").write_text(text)
        spectra.append(measured_spectrum([folder / f"{name}.csv"], rig))
    (first, model, findings), (second, _, _) = spectra
    start = time.process_time()
    found = compare(first, second, model, settings=read_settings(rig.given, str(rig.path)), findings=tuple(findings))
    verdict = found.diagnosis.verdict
    row = {"verdict": verdict.verdict, "seconds": time.process_time() - start}
    return row if true is None else row | {"true": str(np.round(true, 1))} | judged(verdict, true)


def judged(verdict, true):
    """What is right about a verdict; true : (2,) unbalance of each disc, g mm."""
    stated = [*verdict.causes, *verdict.ambiguous_with]
    names = {cause.effect for cause in stated}
    places = {cause.where.get("node") for cause in stated if cause.effect == "unbalance"}
    loaded = {node for node, one in zip(NODES, true, strict=True) if one}
    return {
        "stated": [(c.effect, c.where.get("node"), round(float(c.posterior_probability), 3)) for c in stated],
        "in_set": "unbalance" in names,
        "places_in_set": loaded <= places or (verdict.resultant is not None and "unbalance" in names),
        "confident_and_wrong": any(
            c.posterior_probability > CONFIDENT
            and (c.effect != "unbalance" or (c.where["node"] not in loaded and verdict.resultant is None))
            for c in verdict.causes
        ),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conditions", nargs="*", help="by default all, and the records of the baseline among them")
    given = parser.parse_args()
    tables, true, _ = published()
    complete = [n for n, text in tables.items() if n not in UPDATING and text.count("\n") == 9]
    cases = {name: (tables["BASE"], tables[name], true[name]) for name in given.conditions or complete}
    if not given.conditions:
        pairs = combinations(enumerate(baseline_records()), 2)
        cases |= {f"baseline {i}, {j}": (one, other, None) for (i, one), (j, other) in pairs}
    with tempfile.TemporaryDirectory() as folder:
        rig = updated_rig(Path(folder))
        rows = many_cases.rows_of(lambda case: compared(rig, Path(folder), *case), cases, key="condition")
    still = rows.condition.str.startswith("baseline")
    changed = rows[~still & (rows.verdict != "nothing")]
    found = {"a change is found": rows[~still].verdict != "nothing"}
    found |= {f"of these: {what}": changed[name].astype(bool) for name, what in OF_CHANGES.items() if name in rows}
    found |= {what: rows[name].dropna().infer_objects() for name, what in OF_ALL.items() if name in rows}
    found |= {"nothing changed, and nothing claimed": rows[still].verdict == "nothing"}
    print(many_cases.shares(found).to_string(index=False))


if __name__ == "__main__":
    main()
