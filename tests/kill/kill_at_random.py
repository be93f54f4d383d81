"""Kill -9 at random moments, on request: python tests/kill/kill_at_random.py [WHAT ...] [--times N] [--seed S]

WHAT is workflow, diagnose or blind (default: all). Each is run once undisturbed. Then N times (default 10) it is
started in a session of its own, whose processes are all killed after a random part of that time, and run again to its
end. Files must be those of the undisturbed run but for run times. All runs use a copy of the project made at the start,
so that neither an edit nor a commit changes what they are compared with. Where files differ all are kept.
"""

import argparse
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

import xarray as xr

ROOT = Path(__file__).parents[2]
PROJECT = ("src", "plugins", "workflow", "examples", "Snakefile")
PYTHON = [sys.executable, "-m"]
SNAKE = [*PYTHON, "snakemake", "--cores", "1", "--snakefile", "../project/Snakefile", "--quiet", "all"]
SMALL = ["--configfile", "../project/workflow/config/test/config.yaml"]
TARGETS = ["results/chapter_2/identification/physical.nc", "results/cracks/comparison.nc"]
BLIND = ["--config", "../project/workflow/config/test/blind.yaml"]
COMMANDS = {  # what is run in a folder, again and again, until it ends well
    "workflow": [[*SNAKE, *SMALL, "--unlock"], [*SNAKE, *SMALL, "--rerun-incomplete", *TARGETS]],
    "diagnose": [[*PYTHON, "rotorstudy", "diagnose", "records.nc", "--rig", "rig.yaml", "--out", "results"]],
    "blind": [[*PYTHON, "rotorstudy", "blind", *BLIND, "--cases", "2", "--out", "results"]],
}
TIMED = ("cases.html",)  # has a table of run times; cases.csv has the same cases without them
SECONDS = re.compile(rb'(?<="seconds": )[0-9.e-]+|[0-9.]+ s of one core|[0-9.e+-]+ s a case')


def prepare(what, folder):
    """Write what a command reads."""
    folder.mkdir()
    if what == "diagnose":
        examples = folder.parent / "project/examples"
        shutil.copy(examples / "jeffcott.yaml", folder / "rig.yaml")
        simulate = ["simulate", str(examples / "jeffcott_with_a_fault.yaml"), "--speeds", "60", "90", "200", "300"]
        run([*PYTHON, "rotorstudy", *simulate, "--noise", "1", "--out", "records.nc"], folder)


def run(command, folder, seconds=None):
    """Run a command in a session of its own and kill all of that after some seconds. Whether it was killed."""
    environment = os.environ | {"PYTHONPATH": str(folder.parent / "project/src"), "OPENBLAS_NUM_THREADS": "1"}
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


def compared(first, second):
    """(files that differ, number of files) of two folders, apart from logs and files of run times."""
    held = {path.relative_to(root) for root in (first, second) for path in root.rglob("*") if path.is_file()}
    shown = sorted(path for path in held if "logs" not in path.parts and path.name not in TIMED)
    return [path for path in shown if not _alike(first / path, second / path)], len(shown)


def _alike(one, other):
    """Whether two files hold the same but for run times."""
    if not (one.is_file() and other.is_file()):
        return False
    if one.suffix == ".nc":
        with xr.open_dataset(one) as here, xr.open_dataset(other) as there:
            here, there = (data.drop_vars("case_seconds", errors="ignore") for data in (here, there))
            return here.identical(there)
    return SECONDS.sub(b"0", one.read_bytes()) == SECONDS.sub(b"0", other.read_bytes())


def main():
    """Run, kill, run again, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", nargs="*", default=list(COMMANDS), metavar="WHAT")
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    place = Path(tempfile.mkdtemp(prefix="kill_"))
    for name in PROJECT:
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, place / "project" / name)
    wrong = sum(_disturbed(what, given, place) for what in given.what)
    print(f"{wrong} runs differ" + (f"; all files are kept in {place}" if wrong else ""))
    if not wrong:
        shutil.rmtree(place)
    return int(wrong > 0)


def _disturbed(what, given, place):
    """Kill and repeat a command again and again. Number of runs whose files differ from those of an undisturbed one."""
    moments, wrong, whole = random.Random(given.seed), 0, place / f"{what}_whole"
    prepare(what, whole)
    start = time.perf_counter()
    for command in COMMANDS[what]:
        run(command, whole)
    needed = time.perf_counter() - start
    for i in range(given.times):
        folder = place / f"{what}_{i}"
        prepare(what, folder)
        moment = moments.uniform(0.05, 0.95) * needed
        killed = run(COMMANDS[what][-1], folder, moment)
        for command in COMMANDS[what]:
            run(command, folder)
        off, count = compared(whole / "results", folder / "results")
        end = f"killed after {moment:.1f} of {needed:.1f} s" if killed else "had ended before"
        print(f"{what} {i}: {end}, {count - len(off)} of {count} files equal", flush=True)
        for path in off:
            print(f"    {path} differs", flush=True)
        wrong += bool(off)
        if not off:
            shutil.rmtree(folder)
    return wrong


if __name__ == "__main__":
    sys.exit(main())
