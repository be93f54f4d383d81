"""Simulate records of a rotor with a fault, and diagnose them."""

import shlex
import subprocess
import sys
from pathlib import Path

from rotorstudy.commands.shared import check_folder, file_of_project
from rotorstudy.store import copied

EXAMPLES = file_of_project("examples", "examples")
RIG, MACHINE = "jeffcott.yaml", "jeffcott_with_a_fault.yaml"
SPEEDS = ["100", "200", "300", "400", "500"]


def add(parser):
    parser.add_argument("--out", default="demo", metavar="DIR", help="output folder (default: demo)")


def run(given):
    """Copy two rig files into the folder, and print and run the commands as a user would."""
    check_folder(given.out)
    folder = Path(given.out)
    folder.mkdir(exist_ok=True)
    for name in (RIG, MACHINE):
        copied(EXAMPLES / name, folder / name)
    records, diagnosis = str(folder / "machine.nc"), str(folder / "diagnosis")
    for arguments in (
        ["simulate", str(folder / MACHINE), "--speeds", *SPEEDS, "--noise", "2", "--out", records],
        ["diagnose", records, "--rig", str(folder / RIG), "--out", diagnosis],
    ):
        print(f"$ rotorstudy {shlex.join(arguments)}", flush=True)
        status = subprocess.run([sys.executable, "-m", "rotorstudy", *arguments], check=False).returncode
        if status:
            return status, {}
    return {"page": f"{diagnosis}/index.html"}
