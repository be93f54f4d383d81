"""What changed between two states of machines of the independent simulator: python benchmarks/changes.py

Both states are measured by the same chain: a runout of 20 µm, gains off by 5 % and angles of probes off by 5 degrees
(one standard deviation each). In unchanged cases only the noise, the start and the scatter from run to run are drawn
again. In changed ones an unbalance is added to the second state, a tenth of what `diagnose` is given to find. One line
a case, then the shares.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import many_cases
import numpy as np

from rotorstudy.blind.machines.cases import draw_case
from rotorstudy.blind.machines.files import write_case
from rotorstudy.blind.machines.measuring import record, surface_runout
from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.blind.run import read_case
from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.errors import RotorstudyError

RUNOUT, GAIN, ANGLE = 20e-6, 0.05, np.deg2rad(5)  # m, 1, rad
SHARE = 0.1  # of the unbalance in the second state, of that given to a single run
HARMONICS = (0, 1, -1, 2, -2, 3, -3)
COLUMNS = {
    "in_set": "its cause and place are stated",
    "alone": "its cause and place are stated alone",
    "wrong": "another cause is named alone",
    "size_error": "median relative error of its size",
}


def drawn(seed, family):
    """A small machine, seen by a poor measuring chain."""
    rng = np.random.default_rng([seed, 2])
    case = draw_case(seed, family, speeds=6, count=int(rng.integers(2, 6)))
    probes = {}
    for node, pair in case.probes.items():
        runout = surface_runout(rng, [probe.angle for probe in pair], RUNOUT)
        off = {"gain": 1 + GAIN * rng.normal(size=2), "angle_error": ANGLE * rng.normal(size=2)}
        probes[node] = tuple(
            replace(probe, runout=profile, **{name: float(values[i]) for name, values in off.items()})
            for i, (probe, profile) in enumerate(zip(pair, runout, strict=True))
        )
    return replace(case, probes=probes)


def measured(case, seed, share, folder):
    """Spectrum, model, and settings and findings, of a state with a share of the effect, which is linear in it."""
    moved = case.healthy.displacement + share * (case.steady.displacement - case.healthy.displacement)
    steady = replace(case.healthy, displacement=moved)
    records = record(np.random.default_rng([seed, 3]), steady, case.nodes, case.probes, case.chain, case.zero)
    folder.mkdir()
    write_case(replace(case, records=records), folder, harmonics=HARMONICS)
    spectrum, model, settings, findings = read_case(folder)
    chain = settings.nuisance | {"probe_gain": GAIN, "probe_angle": ANGLE}
    return spectrum, model, {"settings": settings.model_copy(update={"nuisance": chain}), "findings": findings}


def run_case(work):
    """Row of a seed: verdict on the change and CPU time (s)."""
    seed, changed = work
    try:
        return _row(drawn(seed, "unbalance" if changed else "healthy"), seed, changed) | {"changed": changed}
    except (NoSteadyState, RotorstudyError) as error:
        return {"verdict": f"not drawn or refused: {str(error)[:100]}", "changed": changed}


def _row(case, seed, changed):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        before, model, known = measured(case, 2 * seed, 0.0, folder / "before")
        after, *_ = measured(case, 2 * seed + 1, SHARE * changed, folder / "after")
        start = time.process_time()
        found = compare(before, after, model, **known).diagnosis.verdict
        stated = names(found)
        row = {"verdict": found.verdict, "seconds": time.process_time() - start, "stated": str(stated[:4])}
        if not changed:
            return row
        (effect,) = case.effects
        true = ("unbalance", effect["node"])
        row |= {"in_set": true in stated, "alone": found.verdict == "cause" and stated == [true]}
        row["wrong"] = found.verdict == "cause" and "unbalance" not in [name for name, _ in stated]
        for cause in (*found.causes, *found.ambiguous_with):
            if (cause.effect, cause.where.get("node")) == true:
                row["size_error"] = abs(cause.parameters["unbalance"].value / (SHARE * effect["moment_kg_m"]) - 1)
    return row


def names(verdict):
    """Effects and nodes of the causes stated."""
    return [(c.effect, c.where.get("node")) for c in (*verdict.causes, *verdict.ambiguous_with)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=7001, help="first seed (below 9000)")
    parser.add_argument("--unchanged", type=int, default=40)
    parser.add_argument("--changed", type=int, default=20)
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    count = given.unchanged + given.changed
    cases = {given.first + i: (given.first + i, i >= given.unchanged) for i in range(count)}
    rows = many_cases.rows_of(run_case, cases, key="seed", processes=given.processes)
    rows = rows[~rows.verdict.str.startswith("not drawn")]
    still, moved = rows[~rows.changed], rows[rows.changed]
    found = {"nothing claimed where nothing changed": still.verdict == "nothing",
             "change found": moved.verdict != "nothing"}  # fmt: skip
    found |= {what: moved[name].dropna().infer_objects() for name, what in COLUMNS.items() if name in rows}
    found |= {"CPU time of a comparison (s)": rows.seconds}
    print(many_cases.shares(found).to_string(index=False))


if __name__ == "__main__":
    main()
