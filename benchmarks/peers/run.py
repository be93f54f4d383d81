"""rotorstudy beside ROSS and beside scipy on one rotor, in one run: python benchmarks/peers/run.py ROSS_PYTHON OUT

Each task runs in a process of its own with one BLAS thread. The rows go to OUT/peers.csv and to a page, OUT/index.html;
`page.py` puts them into docs/.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.presentation.tables import write_csv, write_html

HERE = Path(__file__).parent
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
ROSS, SCIPY = "ROSS", "scipy solve_ivp"
# name, task of rotorstudy and its runs, other package, its task and runs; a first run of several is not counted
TASKS = (
    ("import, build, response at one speed", "first", 5, ROSS, "first", 5),
    ("modes at one speed, 4 elements", "modes", 20, ROSS, "modes", 6),
    ("modes at one speed, 48 elements", "modes 48", 6, ROSS, "modes 48", 6),
    ("unbalance response at 51 speeds, 4 elements", "response", 20, ROSS, "response", 6),
    ("unbalance response at 51 speeds, 48 elements", "response 48", 6, ROSS, "response 48", 3),
    ("start from rest, 5000 instants, by modes", "from rest", 20, ROSS, "from rest", 6),
    ("start from rest, 5000 instants, by an integrator", "from rest, integrator", 1, ROSS, "from rest", 6),
    ("steady state of a cracked rotor at one speed", "crack", 20, ROSS, "crack", 3),
    ("steady state of a cracked rotor at one speed", "crack", 20, SCIPY, "crack by solve_ivp", 1),
    ("steady state without a crack at one speed", "steady", 20, SCIPY, "steady by solve_ivp", 1),
)


def run(python, task, runs, *arguments):
    """What a task printed; a task with import runs in a new process each time, of which the median counts."""
    if task == "first" and runs > 1:
        found = [run(python, task, 1) for _ in range(runs)]
        return found[0] | {"seconds": float(np.median([one["seconds"] for one in found]))}
    script = "with_rotorstudy.py" if python == sys.executable else "with_ross.py"
    command = [python, str(HERE / script), task, str(runs), *map(str, arguments)]
    threads = dict.fromkeys(THREADS, "1")
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | threads)
    found = json.loads(done.stdout.splitlines()[-1])
    found["result"] = np.array(found.pop("real")) + 1j * np.array(found.pop("imag"))
    return found


def difference(ours, theirs, task):
    """Largest difference over the largest value; of modes, of the lowest eight to the nearest of the other's."""
    if task.startswith("modes"):
        lowest = ours[np.argsort(abs(ours))][:16]
        return max(abs(theirs - mode).min() / abs(mode) for mode in lowest)
    return abs(ours - theirs).max() / abs(theirs).max()


def main():
    """Run every task, write the table."""
    ross, out = sys.argv[1], Path(sys.argv[2])
    losses = run(ross, "losses", 1)["result"][0]
    done, rows = {}, []
    for name, our_task, our_runs, package, their_task, their_runs in TASKS:
        for python, task, runs in ((sys.executable, our_task, our_runs), (ross, their_task, their_runs)):
            if (python, task) not in done:
                arguments = (losses.real, losses.imag) if python == sys.executable else ()
                done[python, task] = run(python, task, runs, *arguments)
        ours, theirs = done[sys.executable, our_task], done[ross, their_task]
        rows.append({
            "task": name, "other package": package, "rotorstudy s": ours["seconds"], "other s": theirs["seconds"],
            "ratio": theirs["seconds"] / ours["seconds"], "rotorstudy MB": ours["memory_MB"],
            "other MB": theirs["memory_MB"], "difference": difference(ours["result"], theirs["result"], our_task),
        })  # fmt: skip
        print(rows[-1], flush=True)
    out.mkdir(parents=True, exist_ok=True)
    note = [
        "The shaft of Chapter 6 in rotorstudy, in ROSS, and by solve_ivp of scipy on the matrices of ROSS.",
        "Processor seconds of one thread, medians of one run of the benchmark; the first run of each task, in which a "
        "package loads or compiles, is not counted, except where the import is the task.",
        "ratio: seconds of the other package over those of rotorstudy; below 1 the other package is faster.",
        "difference: largest difference of the results over the largest value.",
        "ROSS applies the force of the crack of the step before, which explains its difference there.",
    ]
    table = pd.DataFrame(rows)
    write_csv(table, out / "peers.csv")
    write_html(out / "index.html", "Beside other packages", note, {"": table}, digits=3)


if __name__ == "__main__":
    main()
