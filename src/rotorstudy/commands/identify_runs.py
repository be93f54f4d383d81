"""`rotorstudy identify --runs`: update a rig by several runs of one machine, fitted together."""

from rotorstudy.commands.shared import JSON, estimate_rows, tell
from rotorstudy.units import ends_of_interval, shown_unit, with_interval


def identify_several(given):
    """Print the shared parameters, what was unknown in each run, and how well each run is explained."""
    from rotorstudy.diagnosis.runs.joint import identify_runs, shared_names
    from rotorstudy.model.estimated_rig import write_rig

    found = identify_runs(given.runs, given.rig)
    tell(found.findings)
    runs = found.joint.runs
    units = {run.joint_name(n): u for run in runs for n, u in zip(run.model.names, run.model.units, strict=True)}
    known, least = found.joint.posterior.by_name, {}
    for run in runs:
        theta = [known.get(run.joint_name(n), (v,))[0] for n, v in zip(run.model.names, run.model.stated, strict=True)]
        least |= {run.joint_name(n): value for n, value in run.model.least_possible(theta).items()}
    own = {run.name: [run.joint_name(name) for name in run.own.names] for run in runs}
    shared = shared_names(found.joint)
    every = [name for names in (shared, *own.values()) for name in names]
    rows, warnings = estimate_rows(((name, *known[name], units[name]) for name in every), least)
    tell(f"warning: {warning}" for warning in warnings)
    ends = {row["name"]: row["interval_95"] for row in rows}
    print(f"parameters of the machine (unbalances: angles {found.conventions.shaft_angles})")
    _print_estimates(found, shared, units, ends)
    for run, names in own.items():
        cost, count = found.joint.misfits[run]
        print(f"run '{run}': misfit {cost / count:.3g} per component of the spectrum")
        _print_estimates(found, names, units, ends)
    if given.out:
        _save(given, found, units, own)
    if given.rig_out:
        write_rig(found.rig, given.rig_out, f"{given.rig} updated by the runs of {given.runs}")
    misfits = {name: float(cost / count) for name, (cost, count) in found.joint.misfits.items()}
    return {"estimates": rows, "misfit_per_component": misfits, "warnings": warnings}


def _print_estimates(found, names, units, ends):
    """Print values with their uncertainty; an eccentricity as its unbalance, at an angle of the user's picture."""
    shown, width = {}, max([40, *map(len, names)])
    for run in found.joint.runs:
        every = ((p, term.full_name(p)) for term in run.model.terms for p in term.parameters)
        for name, factor in ((name, p.also["unbalance"][1]) for p, name in every if "unbalance" in p.also):
            real, imag = parts = [run.joint_name(f"{name}_{part}") for part in ("real", "imag")]
            told = name.replace("eccentricity", "unbalance", 1) + real.removeprefix(f"{name}_real")
            shown |= {real: (told, parts, factor), imag: None}
    for name in names:
        if name not in shown:
            print(f"  {name:{width}} {with_interval(*found.joint.posterior.by_name[name], units[name], ends[name])}")
        elif shown[name]:
            told, parts, factor = shown[name]
            print(f"  {told:{width}} {_unbalance(found, parts, factor)}")


def _unbalance(found, parts, factor):
    """The size and the angle of an unbalance of which 1 kg m is a factor of the parameter, as text."""
    import numpy as np

    from rotorstudy.inference.estimate import magnitude_and_phase

    _, (size, angle), spread = magnitude_and_phase(["x_real", "x_imag"], *found.joint.of(parts))
    unit, shown = shown_unit("kg m")
    std = np.sqrt(np.diag(spread))
    size, wide = size / factor * shown, std[0] / factor * shown
    weight = with_interval(size, wide, unit, ends_of_interval(size, wide, 0.0))
    return f"{weight} at {with_interval(found.conventions.sense * angle % (2 * np.pi), std[1], 'rad').strip()}"


def _save(given, found, units, own):
    """Write the estimates, their covariance, and how well each run is explained, to a NetCDF or JSON file."""
    import json

    import numpy as np

    from rotorstudy.model.rig import read_rig
    from rotorstudy.store import provenance, save, write_text
    from rotorstudy.studies.common import results

    joint, rig = found.joint, read_rig(given.rig)
    names = list(joint.prior.names)
    alone = {name: run for run, some in own.items() for name in some}
    theta, covariance = joint.of(names)
    costs, counts = np.array(list(joint.misfits.values())).T
    along = {"parameter": names, "other": names, "run": list(joint.misfits)}
    shown = {"estimate": theta, "covariance": covariance, "misfit": costs, "data_count": counts.astype(int)}
    shown |= {"unit": [units[name] for name in names], "own_of_run": [alone.get(name, "") for name in names]}
    said = {"runs": str(given.runs), "findings": "\n".join(map(str, found.findings))}
    data = results("joint_estimate", "identification by several runs", **along, **shown, **said)
    data = data.assign_attrs(provenance(rig.given, rig.plugins))
    if given.out.lower().endswith(JSON):
        write_text(given.out, json.dumps(data.to_dict(), indent=1) + "\n")
    else:
        save(data, given.out)
