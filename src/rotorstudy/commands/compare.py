"""`rotorstudy compare`: find what changed in a machine between two states."""

import sys
from pathlib import Path

from rotorstudy.commands.outputs import check_folder


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("compare", help="find what changed in a machine between two states")
    for state in ("before", "after"):
        parser.add_argument(
            f"--{state}",
            nargs="+",
            required=True,
            metavar="RECORDS",
            help=f"record files, tables of harmonics, or one imported spectrum of the state {state}",
        )
    parser.add_argument(
        "--rig", required=True, help="rig file with a value for every parameter; settings in its section 'diagnosis:'"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="output folder for verdict, figures and page")
    parser.set_defaults(func=run)


def run(given):
    """Write verdict, data, the rig after the change, figures and page into a folder."""
    from rotorstudy.presentation.change_files import compare_files

    check_folder(given.out, given.rig, *given.before, *given.after)
    verdict = compare_files(given.before, given.after, given.rig, given.out)
    for finding in verdict.findings:
        print(finding, file=sys.stderr)
    print(verdict.summary)
    print(f"wrote {Path(given.out) / 'index.html'}")
    return verdict.model_dump(mode="json")
