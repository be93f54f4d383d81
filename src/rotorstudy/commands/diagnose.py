"""Find what a rig file lacks to explain the records."""

from rotorstudy.commands.shared import add_rig_and_folder, add_rpm, check_folder, conclude, in_rad_s, tell


def add(parser):
    told = "record files, tables of harmonics, or one spectrum written by `import`"
    parser.add_argument("records", nargs="+", help=told)
    add_rig_and_folder(parser)
    told = "measured speeds in rad/s that no fit uses (default: those of the rig file, else a quarter of 5 or more)"
    parser.add_argument("--hold-out", type=float, nargs="+", metavar="RAD_S", help=told)
    add_rpm(parser)


def run(given):
    """Write verdict, data, extended rig, figures and page into a folder."""
    from rotorstudy.model.registry import registry
    from rotorstudy.presentation.diagnosis_files import diagnose_files

    check_folder(given.out, given.rig, *given.records)
    verdict = diagnose_files(given.records, given.rig, given.out, in_rad_s(given.hold_out, given.rpm))
    known = registry().failures  # already said
    tell(f"warning: {broken}" for broken in verdict.broken_plugins if broken not in known)
    return conclude(verdict, given.out)
