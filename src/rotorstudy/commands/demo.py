"""`rotorstudy demo`: records of a simulated rotor with a fault, and their diagnosis."""

import shlex
import subprocess
import sys
from pathlib import Path

from rotorstudy.commands.outputs import check_folder
from rotorstudy.store import copied

RIG, MACHINE = "jeffcott.yaml", "jeffcott_with_a_fault.yaml"
SPEEDS = ["100", "200", "300", "400", "500"]


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("demo", help="simulate records of a rotor with a fault, and diagnose them")
    parser.add_argument("--out", default="demo", metavar="DIR", help="output folder (default: demo)")
    parser.set_defaults(func=run)


def run(given):
    """Copy two rig files into the folder, and print and run the commands as a user would."""
    check_folder(given.out)
    folder = Path(given.out)
    folder.mkdir(exist_ok=True)
    for name in (RIG, MACHINE):
        copied(_examples() / name, folder / name)
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


def _examples():
    """Folder of the example rigs: in an installed package their copy, else that of the project."""
    packaged = Path(__file__).parents[1] / "examples"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "examples"
