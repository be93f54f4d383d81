"""`rotorstudy diagnose`: what the simulation of a rig gets wrong, and the cause."""

import sys
from pathlib import Path

from rotorstudy.commands.outputs import check_folder


def add(commands):
    parser = commands.add_parser("diagnose", help="what the simulation of a rig gets wrong, and the cause")
    parser.add_argument(
        "records", nargs="+", help="record files, tables of harmonics, or one spectrum that `import` wrote"
    )
    parser.add_argument(
        "--rig", required=True, help="rig file with a value for every parameter; its section 'diagnosis:' has settings"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder to write verdict, figures and page to")
    parser.add_argument(
        "--hold-out",
        type=float,
        nargs="+",
        metavar="RAD_S",
        help="measured speeds in rad/s held out of every fit (default: those of the rig file, else about a quarter)",
    )
    parser.set_defaults(func=run)


def run(given):
    """Write verdict, data, extended rig, figures and page into a folder."""
    from rotorstudy.model.registry import registry
    from rotorstudy.presentation.diagnosis_files import diagnose_files

    check_folder(given.out, given.rig, *given.records)
    verdict = diagnose_files(given.records, given.rig, given.out, given.hold_out)
    for finding in verdict.findings:
        print(finding, file=sys.stderr)
    for broken in verdict.broken_plugins:
        if broken not in registry().failures:  # those were printed before
            print(f"warning: {broken}", file=sys.stderr)
    print(verdict.summary)
    print(f"wrote {Path(given.out) / 'index.html'}")
    return 0
