"""`rotorstudy identify --runs`: update a rig by several runs of one machine, fitted together."""

import sys

from rotorstudy.commands.outputs import YAML, check_file
from rotorstudy.errors import RotorstudyError
from rotorstudy.units import with_interval

NOT_WITH_RUNS = ("unknowns", "cause", "harmonics", "spectrum", "out")


def identify_several(given):
    """Print the shared parameters, what was unknown in each run, and how well each run is explained."""
    from rotorstudy.diagnosis.runs import identify_runs, shared_names
    from rotorstudy.model.estimated_rig import write_rig

    for name in NOT_WITH_RUNS:
        if getattr(given, name) is not None:
            raise RotorstudyError(f"--{name} is for a single set of records; leave it out, or leave out --runs")
    if given.rig_out:
        check_file(given.rig_out, given.rig, given.runs, option="--rig-out", suffixes=YAML)
    found = identify_runs(given.runs, given.rig)
    for finding in found.findings:
        print(finding, file=sys.stderr)
    print("parameters of the machine")
    _print_estimates(found.joint, shared_names(found.joint))
    for run in found.joint.runs:
        cost, rows = found.joint.misfits[run.name]
        print(f"run '{run.name}': misfit {cost / rows:.3g} per component of the spectrum")
        _print_estimates(found.joint, [run.joint_name(name) for name in run.own.names])
    if given.rig_out:
        write_rig(found.rig, given.rig_out, f"{given.rig} updated by the runs of {given.runs}")
    return 0


def _print_estimates(joint, names):
    """Print values with standard deviations and 95 % intervals, complex ones by magnitude and phase."""
    import numpy as np

    units = {run.joint_name(n): u for run in joint.runs for n, u in zip(run.model.names, run.model.units, strict=True)}
    for name, value, std in zip(names, joint.of(names)[0], np.sqrt(np.diag(joint.of(names)[1])), strict=True):
        print(f"  {name:40} {with_interval(value, std, units[name])}")
