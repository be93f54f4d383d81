"""Cases of the independent simulator of blind tests, by kind and by seed: python benchmarks/foreign.py --cases 100

What `rotorstudy blind` does in one go, a case after the other: a line and a row of `cases.csv` for each, and the
criteria with their 95 % bounds at the end; rig file, truth and verdict of each case stay in `cases/`.

Faults whose form is not the library's, half of the cases, and a fifth of pairs:

    python benchmarks/foreign.py --families forms --sizes 3 300 --seed 1 --cases 100 --records RECORDS --out OUT

Development uses seeds 1 to 99; a number that is published comes from a seed of 7000 or more, used once.
"""

import argparse
from functools import partial
from itertools import cycle
from pathlib import Path

import many_cases
import numpy as np
from foreign_page import by_kind

from rotorstudy.blind.criteria import judge, printed
from rotorstudy.blind.injection import KINDS_OF_CASES, Order
from rotorstudy.blind.machines.cases import CHAIN_FAULTS
from rotorstudy.blind.machines.faults import FAMILIES
from rotorstudy.blind.machines.forms import FORMS
from rotorstudy.store import write_text

QUICK = (0, 1, -1, 2, -2, 3, -3)  # harmonics of a quick run
KINDS = [*FAMILIES, *CHAIN_FAULTS, "pair", "outside"]  # outside: any family, with its effects left out of the library
MIX = [  # of --families forms: half of another form, a fifth of pairs
    "crack_form", "home", "form_pair", "coupling_form", "healthy", "crack_form", "home", "open_crack_form", "pair",
    "rub_form", "crack_form", "home", "form_pair", "looseness_form", "home", "open_crack_form", "form_outside",
    "form_pair", "home", "stiffening_form", "crack_form", "home", "form_pair", "rub_form", "healthy", "crack_form",
    "home", "open_crack_form", "pair", "clearance_form", "crack_form", "home", "form_pair", "coupling_form", "home",
    "crack_form", "form_outside", "form_pair", "home", "dry_friction_form",
]  # fmt: skip
# How often a case of forms is on each machine; pairs and faults of the library's form only on those with elements
MACHINES = {"jeffcott": 0.1, "offset_disc": 0.1, "between_bearings": 0.35, "overhung": 0.2, "many_elements": 0.15,
            "films": 0.1}  # fmt: skip


def line(row):
    """What a case was and what was said of it, in one line."""
    right = "wrong" if row.get("wrong") else "alone" if row.get("alone") else "in set" if row.get("in_set") else ""
    if row.get("group") == "clean":
        right = "ok" if row["verdict"] == "nothing" else "FALSE ALARM"
    if row.get("group") == "outside":
        right = {"unknown": "ok", "cause": "NAMED"}.get(row["verdict"], "")
    others = f" | {row['stated']}" if row.get("stated") else ""
    return (
        f"{row['case']:4d} {row['kind']:18s} {row['families'][:34]:34s} {row['machine']:16s} {row['size']:6.1f} "
        f"{row['verdict']:10s} {right:7s} {row.get('seconds', 0):6.1f} s  {row['named']}{others}"
    )


def orders(given):
    """The Order of every case asked for, by number."""
    forms = any(name == "forms" or name in FORMS or name.startswith("form_") for name in given.families)
    kinds = [kind for name in given.families for kind in (MIX if name == "forms" else [name])]
    elements, speeds = ((2, 5), (6, 6)) if given.quick else (None, (6, 8) if forms else (8, 8))
    wanted = given.only or range(given.first, given.first + given.cases)
    return {
        number: Order(
            number, 100_000 * given.seed + number, kind, MACHINES if forms else {"any": 1.0}, elements, speeds,
            QUICK if given.quick else None, tuple(given.sizes),
        )
        for number, kind in zip(range(max(wanted) + 1), cycle(kinds), strict=False)
        if number in wanted
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first case, to go on with a seed")
    parser.add_argument("--only", type=int, nargs="+", metavar="N", help="numbers of the cases to diagnose")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--families", nargs="+", choices=[*KINDS_OF_CASES, "forms"], default=KINDS, metavar="FAMILY",
        help=f"kinds in turn: {', '.join(KINDS_OF_CASES)}; 'forms' is a mixture of them on all machines",
    )  # fmt: skip
    parser.add_argument("--sizes", type=float, nargs=2, default=(0.0, np.inf), help="range of sizes that are drawn")
    parser.add_argument("--records", type=Path, help="folder that keeps the records, or has them already")
    parser.add_argument("--out", type=Path, default=Path("foreign_cases"))
    parser.add_argument("--resume", action="store_true", help="keep the cases of OUT that are done, by this version")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="rotors of 2 to 5 elements, 6 speeds, harmonics to 3X")
    given = parser.parse_args()
    file = given.out / "cases.csv"
    if not given.resume:
        file.unlink(missing_ok=True)
    run = partial(many_cases.run_case, out=given.out, records=given.records)
    rows = many_cases.rows_of(run, orders(given), file, processes=given.processes, line=line)
    criteria = judge(rows)
    write_text(given.out / "criteria.csv", criteria.to_csv(index=False))
    print(by_kind(rows).to_string())
    print(printed(criteria))
    print(f"seconds of one core for a diagnosis: median {rows.seconds.median():.3g}, longest {rows.seconds.max():.3g}")


if __name__ == "__main__":
    main()
