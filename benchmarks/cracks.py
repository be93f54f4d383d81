"""Cracks of the independent simulator (blind.machines), in millimetres: python benchmarks/cracks.py --cases 100

Random machines with one crack of 5 to 40 % of the diameter, or a slot that never closes, measured at seven speeds in
two planes with 1 % noise (`crack_cases.py`). Each takes the way of a user: record and rig file on disk, spectrum, and
`identify --cause transverse_crack`; with `--diagnose` every so many are also diagnosed with the whole library. One row
a case goes to `cracks.csv`, the shares with their 95 % bounds to `summary.csv` and to a page. A run can be done in
parts: cases that are in `cracks.csv` already are not repeated (another version of the package needs another folder).
"""

import argparse
import os
import tempfile
import time
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads slow them down
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pandas as pd
from crack_cases import drawn, truth_of
from crack_page import INTERVAL, SIZES, is_right, page, summary

from rotorstudy.blind.machines.files import write_case
from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.one_cause.answer import interval_of
from rotorstudy.diagnosis.one_cause.identify import identify_cause
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig

SLOTS = 5  # every fifth seed is a slot
START, END = "<!-- cracks -->", "<!-- /cracks -->"
RIG_ERROR = np.array([0.005, 0.02, 0.05])  # of the rig file: modulus, bearings, unbalance
HARMONICS = list(range(-4, 5))
LAW = {"gradual": "gradual", "switching": "sudden", "open": "none"}  # names of the simulator -> of the package


class Work(NamedTuple):
    """A case; diagnose : whether it is diagnosed with the whole library, too."""

    seed: int
    kind: str
    rig_error: float
    diagnose: bool


def run_case(work):
    """Row of one case."""
    row = {"seed": work.seed, "kind": work.kind}
    try:
        case = drawn(work.seed, work.kind)
    except (NoSteadyState, ValueError) as problem:
        return row | {"outcome": f"not drawn: {problem}"}
    true = truth_of(case)
    row |= {f"true_{key}": value for key, value in true.items()}
    row |= {"elements": len(case.rotor.elements), "mass_kg": case.rotor.mass,
            "change": max(value for k, value in case.truth["harmonics_changed"].items() if k != "0")}  # fmt: skip
    with tempfile.TemporaryDirectory() as files, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        write_case(case, files, *RIG_ERROR * work.rig_error, work.seed, HARMONICS)
        try:
            rig = read_rig(Path(files) / "rig.yaml")
            spectrum, model, findings = measured_spectrum([Path(files) / "record.nc"], rig)
            settings = read_settings(rig.given, "rig.yaml")
            row |= _identified(spectrum, model, settings, true)
            row |= _diagnosed(spectrum, model, settings, findings, true) if work.diagnose else {}
        except (RotorstudyError, np.linalg.LinAlgError) as problem:
            return row | {"outcome": f"{type(problem).__name__}: {problem}"}
    return row | {"outcome": "done"}


def _identified(spectrum, model, settings, true):
    """What `identify --cause transverse_crack` finds."""
    start = time.process_time()
    found = identify_cause(spectrum, model, "transverse_crack", settings)
    row = {"seconds": time.process_time() - start, "breathing": found.cause.variant["breathing"]}
    row |= {"p_value": found.p_value, "law_right": found.cause.variant["breathing"] == LAW[true["breathing"]]}
    stated = [(one, _errors(one, true)) for one in (found.cause, *(causes[0] for causes in found.elsewhere))]
    row |= {"stated": len(stated), "stated_right": any(is_right(errors, true) for _, errors in stated)}
    for name in SIZES:
        row |= {name: found.cause.shape[name], f"{name}_std": found.cause.shape_std[name]}
        row |= {f"{name}_error": stated[0][1][name]}
        held = [abs(errors[name]) <= INTERVAL * one.shape_std[name] for one, errors in stated[1:]]
        low, high = interval_of(found, name)
        row[f"{name}_held"] = low <= found.cause.shape[name] - stated[0][1][name] <= high or any(held)
    return row


def _errors(cause, true):
    """Found less true position (m), depth over the diameter, and angle (rad)."""
    turn = np.pi if true["breathing"] == "open" else 2 * np.pi  # a slot looks the same from both sides
    errors = {name: cause.shape[name] - true[name] for name in SIZES}
    errors["angle_rad"] = (errors["angle_rad"] + turn / 2) % turn - turn / 2
    return errors


def _diagnosed(spectrum, model, settings, findings, true):
    """What the verdict of `diagnose` says."""
    start = time.process_time()
    verdict = investigate(spectrum, model, settings=settings, findings=findings).verdict
    causes = verdict.causes if verdict.verdict in ("cause", "ambiguous") else []
    cracks = [c for c in causes if c.effect == "transverse_crack"]
    depth = cracks[0].parameters["depth_ratio"] if cracks else None
    held = {"verdict_depth": np.nan, "verdict_low": np.nan, "verdict_high": np.nan}
    if depth:
        half = INTERVAL * (depth.std or 0.0)
        low, high = depth.interval_95 or (depth.value - half, depth.value + half)
        held = {"verdict_depth": depth.value, "verdict_low": low, "verdict_high": high}
    return held | {
        "verdict": verdict.verdict,
        "named": " + ".join(c.effect + "".join(f" {v}" for v in c.where.values()) for c in causes),
        "verdict_breathing": cracks[0].variant["breathing"] if cracks else "",
        "verdict_position_error": cracks[0].parameters["position_m"].value - true["position_m"] if cracks else np.nan,
        "verdict_warned": any(one.name == "form of the cause" for one in verdict.findings),
        "verdict_seconds": time.process_time() - start,
    }


def main():
    """Draw, identify, diagnose, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--first", type=int, default=1, help="seed of the first case")
    parser.add_argument("--diagnose", type=int, default=0, metavar="N", help="of N seeds diagnose two, too (0: none)")
    parser.add_argument("--rig-error", type=float, default=1.0, help="0: the rig file is exact; 1: as real ones are")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=np.inf, help="no case is begun later than that")
    parser.add_argument("--out", type=Path, default=Path("crack_cases"))
    parser.add_argument(
        "--page", type=Path, help="Markdown page with the marks <!-- cracks --> to write the numbers to"
    )
    parser.add_argument("--records", type=Path, help="a copy of cracks.csv, for the page")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    file = given.out / "cracks.csv"
    rows = pd.read_csv(file).to_dict("records") if file.exists() else []
    for row in _new_rows(given, {row["seed"] for row in rows}):
        print(row, flush=True)
        rows.append(row)
        pd.DataFrame(rows).sort_values("seed").to_csv(file, index=False, float_format="%.5g")
    table = pd.DataFrame(rows).sort_values("seed")
    summary(table).to_csv(given.out / "summary.csv", index=False)
    print(summary(table).to_string(index=False))
    if given.page:
        before, _, rest = given.page.read_text(encoding="utf-8").partition(START)
        given.page.write_text(f"{before}{START}\n{page(table)}{END}{rest.partition(END)[2]}", encoding="utf-8")
    if given.records:
        table.to_csv(given.records, index=False, float_format="%.5g")


def _new_rows(given, known):
    """Rows of the cases asked for that are not known yet, as they are done, until the time is over."""
    end = time.monotonic() + 60 * given.minutes
    seeds = [seed for seed in range(given.first, given.first + given.cases) if seed not in known]
    work = [
        Work(seed, "crack" if seed % SLOTS else "slot", given.rig_error,
             bool(given.diagnose) and seed % given.diagnose < 2)
        for seed in seeds
    ]  # fmt: skip
    with ProcessPoolExecutor(given.processes) as pool:
        for done in as_completed([pool.submit(_in_time, one, end) for one in work]):
            if done.result() is not None:
                yield done.result()


def _in_time(work, end):
    """`run_case` before the end on the monotonic clock, which processes share; None after it."""
    return run_case(work) if time.monotonic() < end else None


if __name__ == "__main__":
    main()
