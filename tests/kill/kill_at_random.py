"""Kill -9 at random moments, on request: python tests/kill/kill_at_random.py [WHAT ...] [--times N] [--seed S]

WHAT is workflow, diagnose or blind (default: all). Each is run once undisturbed. Then N times (default 10) it is
started in a session of its own, whose processes are all killed after a random part of that time, and run again to its
end. Files must be those of the undisturbed run but for run times. All runs use a copy of the project made at the start,
so that neither an edit nor a commit changes what they are compared with. Of files that differ the first place and the
largest relative difference are printed, and all files are kept.
"""

import argparse
import json
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

from blas_threads import differences

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
SECONDS = re.compile(r'(?<="seconds": )[0-9.e-]+|[0-9.]+ s of one core|[0-9.e+-]+ s a case')


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
    """({file: how it differs}, number of files) of two folders, apart from logs and files of run times."""
    held = {path.relative_to(root) for root in (first, second) for path in root.rglob("*") if path.is_file()}
    shown = sorted(path for path in held if "logs" not in path.parts and path.name not in TIMED)
    said = {str(path): _difference(first / path, second / path) for path in shown}
    return {path: difference for path, difference in said.items() if difference}, len(shown)


def _difference(one, other):
    """How two files differ but for run times: where first, and by how much at most. Empty if they do not."""
    if not (one.is_file() and other.is_file()):
        return "is in one folder only"
    if one.read_bytes() == other.read_bytes():
        return ""
    if one.suffix == ".png":
        return "its bytes differ"
    found = differences(_content(one), _content(other))
    sizes = [size for _, size in found if size < float("inf")]
    numbers = f", of them {len(sizes)} numbers, by at most {max(sizes):.1e} of themselves" if sizes else ""
    return f"{len(found)} values differ, first {found[0][0]}{numbers}" if found else ""


def _content(path):
    """What a file holds, as dicts and lists; the lines of a text. Without run times."""
    if path.suffix == ".nc":
        import xarray as xr

        with xr.open_dataset(path) as data:
            return data.drop_vars("case_seconds", errors="ignore").to_dict()
    text = SECONDS.sub("0", path.read_text(encoding="utf-8"))
    return json.loads(text) if path.suffix == ".json" else text.splitlines()


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
        for path, difference in off.items():
            print(f"    {path}: {difference}", flush=True)
        wrong += bool(off)
        if not off:
            shutil.rmtree(folder)
    return wrong


if __name__ == "__main__":
    sys.exit(main())
