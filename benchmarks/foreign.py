"""The diagnosis on records of the independent simulator in tests/foreign: python benchmarks/foreign.py --cases 100

Each case is diagnosed as by a user: record and rig file on disk, spectrum, verdict. One row per case goes to
`cases.csv`, the shares with their 95 % bounds (`foreign_scores.py`) to `summary.csv`; truth and verdict of each case
stay in `cases/`.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads slow them down
os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import numpy as np
import pandas as pd
from foreign.cases import CHAIN_FAULTS, draw_case
from foreign.faults import FAMILIES
from foreign.files import write_case
from foreign.stepping import NoSteadyState
from foreign_scores import by_kind, summary
from foreign_truth import (
    REFUSED,
    change_of,
    in_library,
    judged,
    left_by_base,
    left_out,
    size_beside,
    sizes_judged,
    truth_of,
)

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig

VISIBLE = 0.01  # least change of a harmonic by an effect, over the healthy 1X; a smaller one is drawn again
QUICK = (0, 1, -1, 2, -2, 3, -3)  # harmonics of a quick run
PAIRED = [name for name in FAMILIES if name != "healthy"]
KINDS = [*FAMILIES, *CHAIN_FAULTS, "pair", "outside"]  # outside: any family, with its effects left out of the library


def drawn(seed, kind, quick):
    """A case of a kind: healthy, one family, a fault of the chain, a pair of families, or any family."""
    rng = np.random.default_rng([seed, 1])
    size = {"speeds": 6, "count": int(rng.integers(2, 6))} if quick else {}
    if kind == "pair":
        kind = "+".join(rng.choice(PAIRED, 2, replace=False))
    if kind == "outside":
        kind = str(rng.choice(PAIRED))
    if kind in CHAIN_FAULTS:
        return draw_case(seed, "healthy", chain_fault=kind, **size), kind
    return draw_case(seed, kind, visible=0.0 if kind == "healthy" else VISIBLE, **size), None


class Work(NamedTuple):
    """A case to be diagnosed.

    out           : folder of results
    rig_error     : of the rig file, 0: none, 1: as real ones have
    without_truth : whether the effects that are its truth are left out of the library
    """

    number: int
    seed: int
    kind: str
    out: Path
    rig_error: float
    quick: bool
    without_truth: bool


def run_case(work):
    """Row of one case."""
    seed, kind, quick = work.seed, work.kind, work.quick
    row = {"case": work.number, "seed": seed, "kind": kind}
    try:
        case, fault = drawn(seed, kind, quick)
    except (NoSteadyState, ValueError) as problem:
        return row | {"verdict": "not drawn", "named": str(problem)}
    true, outside = truth_of(case, fault), work.without_truth or kind == "outside"
    row |= {
        "families": "+".join(one["family"] for one in true),
        "mass_kg": case.rotor.mass,
        "elements": len(case.rotor.elements),
        "probed_nodes": len(case.nodes),
        "known": not outside and all(in_library(one["family"]) for one in true),
        "size": np.nan,
    }
    error = np.array([0.005, 0.02, 0.05]) * work.rig_error  # of modulus, bearings, unbalance
    folder = Path(work.out) / "cases" / f"{work.number:04d}"
    try:
        with tempfile.TemporaryDirectory() as files, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            write_case(case, files, *error, seed, QUICK if quick else None)
            start = time.process_time()
            rig = read_rig(Path(files) / "rig.yaml")
            spectrum, model, findings = measured_spectrum([Path(files) / "record.nc"], rig)
            settings = read_settings(rig.given, "rig.yaml")
            if outside:
                settings = settings.model_copy(update={"leave_out": left_out(true)})
            found = investigate(spectrum, model, settings=settings, findings=findings)
            seconds = time.process_time() - start
            folder.mkdir(parents=True, exist_ok=True)
            for name in ("rig.yaml", "truth.json"):
                shutil.copy(Path(files) / name, folder)
    except RotorstudyError as problem:
        right = fault in REFUSED and f"node {true[-1]['node']}: {REFUSED[fault]}" in str(problem)
        return row | {"verdict": "refused", "named": str(problem), "alone": right, "in_set": right, "wrong": False}
    except np.linalg.LinAlgError as problem:  # a defect of the package
        return row | {"verdict": "crashed", "named": str(problem), "alone": False, "in_set": False, "wrong": True}
    (folder / "verdict.json").write_text(found.verdict.model_dump_json(indent=1), encoding="utf-8")
    whole = with_model_error(spectrum, settings)
    sizes = [
        left_by_base(change, model, whole, settings) for change in (change_of(case, spectrum.harmonics) if true else [])
    ]
    right = judged(case, true, found.verdict)
    sized = sizes_judged(true, found.verdict.causes if right["alone"] else ())
    return row | right | sized | {
        "size": min(sizes, default=0.0),
        "beside": size_beside(case, true, model, whole, settings) if kind == "pair" else np.nan,
        "p_before": found.verdict.residual_p_value.before,
        "p_after": found.verdict.residual_p_value.after,
        "residual_share": found.verdict.residual_share,
        "seconds": seconds,
    }  # fmt: skip


def main():
    """Draw, diagnose, score, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first case, to go on with a seed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--families", nargs="+", choices=KINDS, default=KINDS, metavar="FAMILY")
    parser.add_argument("--out", type=Path, default=Path("foreign_cases"))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--rig-error", type=float, default=1.0, help="0: the rig file is exact; 1: as real ones are")
    parser.add_argument("--quick", action="store_true", help="rotors of 2 to 5 elements, 6 speeds, harmonics to 3X")
    parser.add_argument("--without-truth", action="store_true", help="leave the effects that are the truth out")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    last = given.first + given.cases
    work = [
        Work(i, 100_000 * given.seed + i, kind, given.out, given.rig_error, given.quick, given.without_truth)
        for i, kind in zip(range(last), cycle(given.families))
        if i >= given.first
    ]
    rows = []
    with ProcessPoolExecutor(given.processes) as pool:
        for row in pool.map(run_case, work):
            rows.append(row)
            said = {
                key: row.get(key) for key in ("case", "kind", "size", "verdict", "named", "stated", "alone", "seconds")
            }
            print(json.dumps(said, default=str), flush=True)
            pd.DataFrame(rows).to_csv(given.out / "cases.csv", index=False)
    table = pd.DataFrame(rows)
    shares = summary(table)
    shares.to_csv(given.out / "summary.csv", index=False)
    with pd.option_context("display.width", 200, "display.max_columns", 30, "display.max_colwidth", 60):
        print(by_kind(table).to_string())
        print(shares.to_string(index=False, float_format=lambda value: f"{value:.3f}"))


if __name__ == "__main__":
    main()
