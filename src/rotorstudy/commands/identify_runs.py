"""`rotorstudy identify --runs`: update a rig by several runs of one machine, fitted together."""

import sys

from rotorstudy.commands.outputs import JSON, NETCDF, YAML, check_file
from rotorstudy.errors import RotorstudyError
from rotorstudy.units import ANY_ANGLE, with_interval

NOT_WITH_RUNS = ("unknowns", "cause", "harmonics", "spectrum")


def identify_several(given):
    """Print the shared parameters, what was unknown in each run, and how well each run is explained."""
    from rotorstudy.diagnosis.runs.joint import identify_runs, shared_names
    from rotorstudy.model.estimated_rig import write_rig

    for name in NOT_WITH_RUNS:
        if getattr(given, name) is not None:
            raise RotorstudyError(f"--{name} is for a single set of records; leave it out, or leave out --runs")
    if given.out:
        check_file(given.out, given.rig, given.runs, suffixes=(*NETCDF, *JSON))
    if given.rig_out:
        check_file(given.rig_out, given.rig, given.runs, option="--rig-out", suffixes=YAML)
    found = identify_runs(given.runs, given.rig)
    for finding in found.findings:
        print(finding, file=sys.stderr)
    print("parameters of the machine")
    _print_estimates(found, shared_names(found.joint))
    for run in found.joint.runs:
        cost, rows = found.joint.misfits[run.name]
        print(f"run '{run.name}': misfit {cost / rows:.3g} per component of the spectrum")
        _print_estimates(found, [run.joint_name(name) for name in run.own.names])
    if given.out:
        _save(given, found)
    if given.rig_out:
        write_rig(found.rig, given.rig_out, f"{given.rig} updated by the runs of {given.runs}")
    names = [*shared_names(found.joint), *(run.joint_name(n) for run in found.joint.runs for n in run.own.names)]
    rows = [(name, *map(float, found.of(name))) for name in names]
    misfits = {name: float(cost / count) for name, (cost, count) in found.joint.misfits.items()}
    keys = ("name", "value", "standard_deviation")
    return {"estimates": [dict(zip(keys, row, strict=True)) for row in rows], "misfit_per_component": misfits}


def _save(given, found):
    """Write the estimates, their covariance, and how well each run is explained, to a NetCDF or JSON file."""
    import numpy as np

    from rotorstudy.model.rig import named_plugins, read_rig
    from rotorstudy.store import dataset, provenance, save, write_text

    joint = found.joint
    names = list(joint.prior.names)
    own = {run.joint_name(name): run.name for run in joint.runs for name in run.own.names}
    units = {run.joint_name(n): u for run in joint.runs for n, u in zip(run.model.names, run.model.units, strict=True)}
    ratio = np.array([found.ratio.get(name, 1.0) for name in names])
    _, covariance = joint.of(names)
    values = np.array([found.of(name)[0] for name in names])
    coordinates = {
        "parameter": (names, "1", "parameter; of one run only: parameter @ run"),
        "other": (names, "1", "parameter"),
        "run": (list(joint.misfits), "1", "run"),
    }
    variables = {
        "estimate": (("parameter",), values, "SI", "estimated parameter"),
        "covariance": (("parameter", "other"), covariance * np.outer(ratio, ratio), "SI", "of the estimates"),
        "unit": (("parameter",), np.array([units[name] for name in names], object), "1", "unit of each parameter"),
        "own_of_run": (("parameter",), np.array([own.get(n, "") for n in names], object), "1", "run that has it alone"),
        "misfit": (("run",), np.array([cost for cost, _ in joint.misfits.values()]), "1", "weighted sum of squares"),
        "data_count": (("run",), np.array([rows for _, rows in joint.misfits.values()]), "1", "number of real data"),
    }
    rig = read_rig(given.rig).given
    told = {"runs": str(given.runs), "findings": "\n".join(map(str, found.findings))}
    data = dataset(variables, coordinates, title="identification by several runs")
    data = data.assign_attrs(provenance(rig, named_plugins(rig)) | told)
    if given.out.lower().endswith(JSON):
        import json

        write_text(given.out, json.dumps(data.to_dict(), indent=1) + "\n")
    else:
        save(data, given.out)


def _print_estimates(found, names):
    """Print values with their uncertainty; an eccentricity as its unbalance, at an angle of the user's picture."""
    joint, done = found.joint, set()
    units = {run.joint_name(n): u for run in joint.runs for n, u in zip(run.model.names, run.model.units, strict=True)}
    unbalances = _unbalances(joint)
    width = max(40, *map(len, names)) if names else 40
    for name in names:
        stem = name.replace("_real", "").replace("_imag", "")
        if stem not in unbalances:
            print(f"  {name:{width}} {with_interval(*found.of(name), units[name])}")
        elif stem not in done:
            done.add(stem)
            print(f"  {stem.replace('eccentricity', 'unbalance'):{width}} {_unbalance(found, stem, unbalances[stem])}")


def _unbalances(joint):
    """{joint name of an eccentricity, without its part: eccentricity of 1 kg m, in m}."""
    return {
        run.joint_name(f"{term.full_name(p)}_real").replace("_real", ""): p.also["unbalance"][1]
        for run in joint.runs
        for term in run.model.terms
        for p in term.parameters
        if "unbalance" in p.also
    }


def _unbalance(found, stem, factor):
    """The size and the angle of an unbalance with standard deviations and 95 % intervals."""
    import numpy as np

    from rotorstudy.inference.estimate import magnitude_and_phase
    from rotorstudy.units import shown_unit

    name, *run = stem.split(" @ ")
    parts = [f"{name}_{part}" for part in ("real", "imag")]
    theta, covariance = found.joint.of([" @ ".join([part, *run]) for part in parts])
    _, (size, angle), spread = magnitude_and_phase(parts, theta, covariance)
    unit, shown = shown_unit("kg m")
    std = np.sqrt(np.diag(spread))
    degrees = np.degrees(found.conventions.sense * angle) % 360
    weight = with_interval(size / factor * shown, std[0] / factor * shown, unit, least=0.0)
    known = with_interval(degrees, np.degrees(std[1]), "°").strip()
    return f"{weight} at {known if std[1] < ANY_ANGLE else 'any angle'}"
