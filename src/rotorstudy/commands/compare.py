"""Find what changed in a machine between two states."""

from rotorstudy.commands.shared import add_rig_and_folder, check_folder, conclude


def add(parser):
    for state in ("before", "after"):
        told = f"record files, tables of harmonics, or one imported spectrum of the state {state}"
        parser.add_argument(f"--{state}", nargs="+", required=True, metavar="RECORDS", help=told)
    add_rig_and_folder(parser)


def run(given):
    """Write verdict, data, the rig after the change, figures and page into a folder."""
    from rotorstudy.presentation.diagnosis_files import compare_files

    check_folder(given.out, given.rig, *given.before, *given.after)
    return conclude(compare_files(given.before, given.after, given.rig, given.out), given.out)
