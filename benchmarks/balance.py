"""How often the stated intervals of a balancing hold, on independent machines: python benchmarks/balance.py

Every machine is balanced in two planes from one set of readings, with the rig as drawn and as updated by
`identify --runs`, by these readings or others, and those with a trial mass. The corrections are then put on the
machine, whose true vibration and whose next reading, in another run, are compared with their 95 % intervals, at every
speed and probe.
"""

import argparse
import json
import tempfile
from functools import partial
from pathlib import Path

import many_cases
import numpy as np
import pandas as pd
from named_machines.balancing import PLANES, PROBES, draw

from rotorstudy.diagnosis.runs.balance import balance_files
from rotorstudy.diagnosis.runs.joint import identify_runs
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.estimated_rig import write_rig

TRIAL = 2e-5  # m, eccentricity by the trial mass


def write_table(path, machine, shown):
    """Write harmonics 1 and -1 (speed, harmonic, probe), m."""
    of = {"speed_rad_per_s": machine.speeds, "harmonic": (1, -1), "node": [node + 1 for node in PROBES]}
    rows = pd.MultiIndex.from_product(of.values(), names=of)
    pd.DataFrame({"amplitude_m": np.abs(shown).ravel(), "phase_rad": np.angle(shown).ravel()}, rows).to_csv(path)


def balanced(seed, updated="", share=1.0):
    """Shares of the 95 % intervals of the vibration left, and of the next reading, that hold the truth.

    updated : by which records the rig is, "" as drawn;  share : of the uncertainty that the rig states
    """
    machine, rng = draw(seed), np.random.default_rng([seed, 31])
    given = json.loads(json.dumps(machine.rig, default=float))
    stated = given["diagnosis"]["uncertainty"]
    stated |= {name: share * value for name, value in stated.items()}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        rig = folder / "rig.yaml"
        rig.write_text(json.dumps(given))
        own = machine.scattered(rng)
        write_table(folder / "baseline.csv", machine, machine.reading(machine.motion(own=own), rng))
        if updated:
            size, angle = TRIAL * machine.rig["rotor"]["discs"][0]["mass_kg"], rng.uniform(0, 360)
            trial = machine.motion([(PLANES[0], size * np.exp(1j * np.radians(angle)))], machine.scattered(rng))
            write_table(folder / "trial.csv", machine, machine.reading(trial, rng))
            runs = [
                {"name": "baseline", "records": ["baseline.csv"]},
                {"name": "trial", "records": ["trial.csv"],
                 "unbalances": [{"node": PLANES[0] + 1, "unbalance_g_mm": 1e6 * size, "angle_deg": angle}]},
            ]  # fmt: skip
            (folder / "runs.yaml").write_text(json.dumps({"runs": runs}, default=float))
            rig = folder / "updated.yaml"
            write_rig(identify_runs(folder / "runs.yaml", folder / "rig.yaml").rig, rig, "updated")
        if updated == "by other records":
            write_table(folder / "baseline.csv", machine, machine.reading(machine.motion(own=own), rng))
        found, _ = balance_files([folder / "baseline.csv"], rig, [node + 1 for node in PLANES])
    added = list(zip(PLANES, found.corrections @ [1, 1j], strict=True))
    left = np.abs(machine.motion(added, own)).sum(axis=1)
    shown = np.abs(machine.reading(machine.motion(added, machine.scattered(rng)), rng)).sum(axis=1)
    return {
        name: float(np.mean((low <= true) & (true <= high)))
        for name, (low, _, high), true in (("left", found.after, left), ("next", found.next_reading, shown))
    }


def run_case(seed, updated):
    """Row of a machine."""
    try:
        return balanced(seed, updated)
    except RotorstudyError as error:
        return {"refused": str(error)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    seeds = {seed: seed for seed in range(given.seed, given.seed + given.machines)}
    for updated in ("", "by these records", "by other records"):
        rows = many_cases.rows_of(partial(run_case, updated=updated), seeds, key="seed", processes=given.processes)
        for name in ("left", "next"):
            per = rows[name].dropna()
            std = per.std() / np.sqrt(len(per))
            print(f"{f'updated {updated}' if updated else 'as drawn'}, {name}: {per.mean():.1%} ± {std:.1%} of the "
                  f"intervals of {len(per)} machines", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
