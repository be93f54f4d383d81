"""rotorstudy beside ROSS and beside scipy on one rotor: python benchmarks/peers/run.py ROSS_PYTHON OUT [--page]

Each task runs in a process of its own with one BLAS thread. The rows go to OUT/peers.csv. With --page they go to
`docs/peers.csv` and, between marks, to `docs/peers.md` and the README; a test compares both with the file.
"""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1]))
from marked_pages import ROOT, table, with_numbers, write

HERE = Path(__file__).parent
ROWS, PAGE, README = ROOT / "docs/peers.csv", ROOT / "docs/peers.md", ROOT / "README.md"
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
ROSS, SCIPY = "ROSS", "scipy solve_ivp"
# name, task of rotorstudy (a function, the number of elements, and 1 for its other form) and its runs, other package,
# its task and runs; a first run of several is not counted
TASKS = (
    ("import, build, response at one speed", "first", 5, ROSS, "first", 5),
    ("modes at one speed, 4 elements", "modes 4", 20, ROSS, "modes 4", 6),
    ("modes at one speed, 48 elements", "modes 48", 6, ROSS, "modes 48", 6),
    ("unbalance response at 51 speeds, 4 elements", "response 4", 20, ROSS, "response 4", 6),
    ("unbalance response at 51 speeds, 48 elements", "response 48", 6, ROSS, "response 48", 3),
    ("start from rest, 5000 instants, by modes", "from_rest 4", 20, ROSS, "from_rest 4", 6),
    ("start from rest, 5000 instants, by an integrator", "from_rest 4 1", 1, ROSS, "from_rest 4", 6),
    ("steady state of a cracked rotor at one speed", "steady 4 1", 20, ROSS, "crack 4", 3),
    ("steady state of a cracked rotor at one speed", "steady 4 1", 20, SCIPY, "integrated 4 1", 1),
    ("steady state without a crack at one speed", "steady 4", 20, SCIPY, "integrated 4", 1),
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
    pd.DataFrame(rows).to_csv(out / "peers.csv", index=False)
    if "--page" in sys.argv:
        pd.DataFrame(rows).to_csv(ROWS, index=False, float_format="%.4g")
        write(pages(pd.read_csv(ROWS)))


def pages(rows):
    """{path: text} of the pages with the numbers of some rows."""
    heads = ("task", "beside", "rotorstudy, s", "other, s", "ratio", "rotorstudy, MB", "other, MB", "difference")
    lines = [
        (row["task"], row["other package"], *(_rounded(row[name]) for name in ("rotorstudy s", "other s", "ratio")),
         f"{row['rotorstudy MB']:.0f}", f"{row['other MB']:.0f}", f"{row['difference']:.1g}")
        for row in rows.to_dict("records")
    ]  # fmt: skip
    page, readme = (path.read_text(encoding="utf-8") for path in (PAGE, README))
    return {
        PAGE: with_numbers(page, "numbers", table(heads, lines)),
        README: with_numbers(readme, "peers", sentence(rows)),
    }


def sentence(rows):
    """What is faster and what slower than ROSS, for the README."""
    rows = rows[rows["other package"] == "ROSS"]

    def told(some, ratio):
        return ", ".join(f"{row.task} ({_rounded(ratio(row.ratio))} times)" for row in some.itertuples())

    faster, slower = rows[rows.ratio >= 1].sort_values("ratio"), rows[rows.ratio < 1]
    text = (
        f"On the shaft of Chapter 6, rotorstudy was faster than ROSS in {len(faster)} of {len(rows)} tasks: least in "
        f"{told(faster[:1], lambda r: r)}, most in {told(faster[-1:], lambda r: r)}."
    )
    if len(slower):
        text += f" ROSS was faster in {told(slower, lambda r: 1 / r)}."
    return textwrap.fill(text, 130)


def _rounded(value):
    """Two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.6g}"


if __name__ == "__main__":
    main()
