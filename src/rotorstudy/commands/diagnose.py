"""`rotorstudy diagnose`: find where the simulation of a rig differs from its records, and the cause."""

import sys
from pathlib import Path

from rotorstudy.commands.outputs import check_folder
from rotorstudy.commands.speeds import add_rpm, in_rad_s


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("diagnose", help="find what a rig file lacks to explain the records")
    parser.add_argument(
        "records", nargs="+", help="record files, tables of harmonics, or one spectrum written by `import`"
    )
    parser.add_argument(
        "--rig", required=True, help="rig file with a value for every parameter; settings in its section 'diagnosis:'"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="output folder for verdict, figures and page")
    parser.add_argument(
        "--hold-out",
        type=float,
        nargs="+",
        metavar="RAD_S",
        help="measured speeds in rad/s that no fit uses (default: those of the rig file, else a quarter of 5 or more)",
    )
    add_rpm(parser)
    parser.set_defaults(func=run)


def run(given):
    """Write verdict, data, extended rig, figures and page into a folder."""
    from rotorstudy.model.registry import registry
    from rotorstudy.presentation.diagnosis_files import diagnose_files

    check_folder(given.out, given.rig, *given.records)
    verdict = diagnose_files(given.records, given.rig, given.out, in_rad_s(given.hold_out, given.rpm))
    for finding in verdict.findings:
        print(finding, file=sys.stderr)
    for broken in verdict.broken_plugins:
        if broken not in registry().failures:  # already printed
            print(f"warning: {broken}", file=sys.stderr)
    print(verdict.summary)
    print(f"wrote {Path(given.out) / 'index.html'}")
    return verdict.model_dump(mode="json")
