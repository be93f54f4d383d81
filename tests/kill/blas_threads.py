"""The verdict on 1 and on 2 BLAS threads, on request: all numbers of three diagnoses must agree to 1e-9."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-m", "rotorstudy"]
ALLOWED = 1e-9
SPEEDS = {"two_discs": ["60", "90", "120", "150", "180", "210"], "jeffcott": ["60", "90", "200", "300"]}


def run(folder, *arguments, threads=1):
    """Run a command of rotorstudy on a number of threads."""
    names = [f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL")]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")} | dict.fromkeys(names, str(threads))
    subprocess.run([*COMMAND, *arguments], cwd=folder, env=environment, check=True, capture_output=True)


def simulate(folder, rig, name):
    speeds = SPEEDS["two_discs" if "two_discs" in rig else "jeffcott"]
    run(folder, "simulate", str(ROOT / f"examples/{rig}.yaml"), "--speeds", *speeds, "--noise", "1", "--out", name)


def prepare(folder):
    """Write records and rigs; the names of the cases."""
    from rotorstudy.store import load, save

    rigs = {name: yaml.safe_load((ROOT / f"examples/{name}.yaml").read_text(encoding="utf-8")) for name in SPEEDS}
    del rigs["two_discs"]["cracks"]
    for case, rig in {"support": "jeffcott", "crack": "two_discs", "unknown": "jeffcott"}.items():
        (folder / f"{case}.yaml").write_text(yaml.safe_dump(rigs[rig]), encoding="utf-8")
    simulate(folder, "jeffcott_with_a_fault", "support.nc")
    simulate(folder, "two_discs", "crack.nc")
    records, draws = load(folder / "support.nc"), np.random.default_rng(5)
    motion = records.displacement.values
    for of_speed, speed in zip(motion, records.speed.values, strict=True):
        for n in (-4, -2, 3, 4, 6):
            amplitude = 0.3 * np.abs(motion).max() * (draws.normal(size=2) @ [1, 1j])
            added = amplitude * np.exp(1j * n * speed * records.time.values)
            of_speed[0] += added.real, added.imag
    records["displacement"] = records.displacement.copy(data=motion)
    save(records, folder / "unknown.nc")
    return ["support", "crack", "unknown"]


def differences(one, other, place=""):
    """(place, relative difference) of all values of two verdicts that differ; infinite unless both are numbers."""
    if isinstance(one, dict) and isinstance(other, dict) and set(one) == set(other):
        return [found for key in one for found in differences(one[key], other[key], f"{place}/{key}")]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = enumerate(zip(one, other, strict=True))
        return [found for i, pair in pairs for found in differences(*pair, f"{place}/{i}")]
    if one == other or (one != one and other != other):  # also where both are undefined
        return []
    numbers = isinstance(one, float) and isinstance(other, float)
    return [(place, abs(one - other) / max(abs(one), abs(other)) if numbers else np.inf)]


def main():
    """Diagnose on 1 and 2 threads, compare."""
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for case in prepare(folder):
            verdicts = []
            for threads in (1, 2):
                out = f"{case}_{threads}"
                run(folder, "diagnose", f"{case}.nc", "--rig", f"{case}.yaml", "--out", out, threads=threads)
                verdicts.append(json.loads((folder / out / "verdict.json").read_text(encoding="utf-8")))
            off = differences(*verdicts)
            largest = max((size for _, size in off), default=0.0)
            wrong += largest > ALLOWED
            verdict = verdicts[0]["verdict"]
            print(f"{case}: '{verdict}', {len(off)} numbers differ, at most by {largest:.1e}", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
