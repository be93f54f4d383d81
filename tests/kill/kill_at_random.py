"""Kill -9 at random moments, on request: python tests/kill/kill_at_random.py [WHAT ...] [--times N] [--seed S]

WHAT is workflow, diagnose or blind (default: all). Each is run once undisturbed. Then N times (default 10) it is
started in a session of its own, whose processes are all killed after a random part of that time, and run again to its
end. Files must be those of the undisturbed run but for run times. Commit nothing meanwhile: they name the commit.
"""

import argparse
import filecmp
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PYTHON = [sys.executable, "-m"]
SNAKE = [*PYTHON, "snakemake", "--cores", "1", "--snakefile", str(ROOT / "Snakefile"), "--quiet", "all"]
SMALL = ["--configfile", str(ROOT / "workflow/config/test/config.yaml")]
TARGETS = ["results/chapter_2/identification/physical.nc", "results/cracks/comparison.nc"]
BLIND = ["--config", str(ROOT / "workflow/config/test/blind.yaml")]
COMMANDS = {  # what is run in a folder, again and again, until it ends well
    "workflow": [[*SNAKE, *SMALL, "--unlock"], [*SNAKE, *SMALL, "--rerun-incomplete", *TARGETS]],
    "diagnose": [[*PYTHON, "rotorstudy", "diagnose", "records.nc", "--rig", "rig.yaml", "--out", "results"]],
    "blind": [[*PYTHON, "rotorstudy", "blind", *BLIND, "--cases", "2", "--out", "results"]],
}
TIMED = ("cases.html",)  # has a table of run times; cases.csv has the same cases without them
SECONDS = re.compile(r'"seconds": [0-9.e-]+|[0-9.]+ s of one core|[0-9.e+-]+ s a case')


def prepare(what, folder):
    """Write what a command reads."""
    folder.mkdir()
    if what == "diagnose":
        shutil.copy(ROOT / "examples/jeffcott.yaml", folder / "rig.yaml")
        simulate = ["simulate", str(ROOT / "examples/jeffcott_with_a_fault.yaml"), "--speeds", "60", "90", "200", "300"]
        run([*PYTHON, "rotorstudy", *simulate, "--noise", "1", "--out", "records.nc"], folder)


def run(command, folder, seconds=None):
    """Run a command in a session of its own and kill all of that after some seconds. Whether it was killed."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "OPENBLAS_NUM_THREADS": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    started = subprocess.Popen(command, cwd=folder, start_new_session=True, env=environment, **pipes)
    try:
        told, _ = started.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(started.pid, signal.SIGKILL)
        started.communicate()
        return True
    if started.returncode:
        sys.exit(f"{' '.join(command)} failed:\n{told}")
    return False


def differing(first, second):
    """Files of two folders that differ, apart from logs, temporary files, and times in texts."""
    held = {path.relative_to(root) for root in (first, second) for path in root.rglob("*") if path.is_file()}
    shown = sorted(path for path in held if "logs" not in path.parts and path.name not in TIMED)
    return [path for path in shown if not _same(first / path, second / path)], len(shown)


def _same(one, other):
    if not (one.is_file() and other.is_file()):
        return False
    if filecmp.cmp(one, other, shallow=False):
        return True
    if one.suffix == ".nc":
        import xarray as xr

        left, right = (xr.open_dataset(path).drop_vars("case_seconds", errors="ignore") for path in (one, other))
        return left.equals(right)
    if one.suffix not in (".json", ".html", ".csv", ".svg"):
        return False
    left, right = (SECONDS.sub("", path.read_text(encoding="utf-8")) for path in (one, other))
    return left == right


def main():
    """Run, kill, run again, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", nargs="*", default=list(COMMANDS), metavar="WHAT")
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    given, wrong = parser.parse_args(), 0
    moments = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as place:
        for what in given.what:
            whole = Path(place) / f"{what}_whole"
            prepare(what, whole)
            start = time.perf_counter()
            for command in COMMANDS[what]:
                run(command, whole)
            needed = time.perf_counter() - start
            for i in range(given.times):
                folder = Path(place) / f"{what}_{i}"
                prepare(what, folder)
                moment = moments.uniform(0.05, 0.95) * needed
                killed = run(COMMANDS[what][-1], folder, moment)
                for command in COMMANDS[what]:
                    run(command, folder)
                off, count = differing(whole / "results", folder / "results")
                wrong += bool(off)
                end = f"killed after {moment:.1f} of {needed:.1f} s" if killed else "had ended before"
                print(f"{what} {i}: {end}, {count - len(off)} of {count} files equal {list(map(str, off))}", flush=True)
                shutil.rmtree(folder)
    print(f"{wrong} runs differ")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
