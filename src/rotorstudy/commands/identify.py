"""Estimate parameters of a rig from records, or from several runs."""

from rotorstudy.commands.identify_runs import identify_several
from rotorstudy.commands.shared import JSON, NETCDF, YAML, check_file, estimate_rows, tell
from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.registry import registry
from rotorstudy.units import p_value, unit_ending, with_interval

NOT_WITH_RUNS = ("unknowns", "cause", "harmonics", "spectrum", "estimator")
ESTIMATOR = "maximum_likelihood"  # by default
MOST_OF_A_CAUSE = 3  # more shapes than that trade off


def add(parser):
    told = "record files (.nc, .csv, .mat, .uff), tables of harmonics (.csv), or one spectrum written by `import`"
    parser.add_argument("records", nargs="*", help=told)
    told = """instead of records: YAML file that lists several runs, their records and what is added in each; they are
    fitted together, within the uncertainty that the rig file states"""
    parser.add_argument("--runs", metavar="FILE", help=told)
    told = "rig file; parameters with a value are known unless in --unknowns; 'measurement:' says how to read the files"
    parser.add_argument("--rig", required=True, help=told)
    told = """parameters to estimate (default: those without a value); 'rotor.youngs_modulus_Pa' is the relative change
    of that number of the rotor"""
    parser.add_argument("--unknowns", nargs="+", metavar="NAME", help=told)
    told = """an effect known to be the cause, such as transverse_crack: its place and shape are searched beside the
    parameters of the rig, which all need a value; 'diagnosis:' of the rig file says how accurate they are"""
    parser.add_argument("--cause", metavar="EFFECT", help=told)
    told = "how many of that cause there are, 1 to 3 (default 1)"
    parser.add_argument("--count", type=int, default=1, metavar="N", help=told)
    told = "measured harmonics to use (default: all)"
    parser.add_argument("--harmonics", type=int, nargs="+", metavar="N", help=told)
    told = "spectrum plugin for the records (default: harmonics and covariance as `import` writes them)"
    parser.add_argument("--spectrum", metavar="NAME", help=told)
    parser.add_argument("--estimator", default=ESTIMATOR, help=f"estimator plugin (default {ESTIMATOR})")
    parser.add_argument("--out", help="NetCDF file to write the estimates to")
    told = "rig file to write, with the estimates and, in 'prior:', their covariance"
    parser.add_argument("--rig-out", metavar="FILE", help=told)


def run(given):
    """Print the estimates with their intervals, and the misfit."""
    import numpy as np

    from rotorstudy.inference.estimate import estimate_rig, magnitude_and_phase
    from rotorstudy.inference.problem import Problem
    from rotorstudy.measurement.measurement import measured_spectrum
    from rotorstudy.model.estimated_rig import rig_with_estimate, write_rig
    from rotorstudy.model.rig import read_rig
    from rotorstudy.model.rig_numbers import with_numbers
    from rotorstudy.response.coupling import check_harmonics

    _check_options(given)
    if given.runs:
        return identify_several(given)
    method = registry().get("spectrum", given.spectrum) if given.spectrum else None
    estimator = registry().get("estimator", given.estimator)
    rig = read_rig(given.rig)
    spectrum, model, findings = measured_spectrum(given.records, rig, method)
    tell(findings)
    if given.harmonics is not None:
        where = "--harmonics; 'measurement: harmonics:' of the rig file says which are taken from the records"
        check_known("harmonic", given.harmonics, spectrum.harmonics, where)
        spectrum = spectrum.at_harmonics(check_harmonics(given.harmonics))
    if given.cause:
        return _run_cause(given, rig, spectrum, model)
    model = with_numbers(model, given.unknowns or (), "--unknowns")
    unknowns = model.unknown_names(given.unknowns)
    estimate = estimate_rig(estimator, Problem(model, spectrum, unknowns), rig.given)
    names, theta, covariance = magnitude_and_phase(unknowns, estimate.theta, estimate.covariance)
    found = zip(names, theta, np.sqrt(np.diag(covariance)), model.reported_units(names), strict=True)
    rows, warnings = estimate_rows(found, model.least_possible(model.filled(unknowns, estimate.theta)))
    _print_estimates(rows, {term.full_name(p): p for term in model.terms for p in term.parameters})
    freedom = spectrum.data_count - len(names)
    if np.isfinite(estimate.misfit):
        warnings += _print_misfit(float(estimate.misfit), freedom)
    tell(f"warning: {warning}" for warning in warnings)
    if given.out:
        _save(given, rig, [*rig.plugins, estimator, *([method] if method else [])], rows)
    if given.rig_out:
        found = rig_with_estimate(rig.given, model, unknowns, estimate.theta, estimate.covariance)
        write_rig(found, given.rig_out, f"{given.rig} identified from {', '.join(map(str, given.records))}")
    return {"estimates": rows, "misfit": float(estimate.misfit), "degrees_of_freedom": freedom, "warnings": warnings}


def _check_options(given):
    """Raise unless the options go together and the files to be written can be."""
    if bool(given.runs) == bool(given.records):
        raise RotorstudyError("identify: give either record files, or a file of several runs with --runs")
    for name in NOT_WITH_RUNS if given.runs else ():
        if getattr(given, name) not in (None, ESTIMATOR):
            raise RotorstudyError(f"--{name} is for a single set of records; leave it out, or leave out --runs")
    if given.cause and (given.unknowns or given.rig_out or given.estimator != ESTIMATOR):
        raise RotorstudyError(
            "--cause estimates all that the rig file leaves uncertain, by maximum likelihood; leave out --unknowns, "
            "--estimator and --rig-out ('diagnose' writes an extended rig)"
        )
    if not 1 <= given.count <= MOST_OF_A_CAUSE or (given.count > 1 and not given.cause):
        raise RotorstudyError(f"--count {given.count}: the number of effects of --cause, 1 to {MOST_OF_A_CAUSE}")
    inputs = [given.rig, *([given.runs] if given.runs else given.records)]
    if given.out:
        check_file(given.out, *inputs, suffixes=(*NETCDF, *JSON) if given.runs else NETCDF)
        inputs.append(given.out)
    if given.rig_out:
        check_file(given.rig_out, *inputs, option="--rig-out", suffixes=YAML)


def _run_cause(given, rig, spectrum, model):
    """Print the shape and the size of a cause with their intervals, and which of its alternatives fits."""
    from rotorstudy.diagnosis.one_cause.answer import far_amplitudes, shown_names
    from rotorstudy.diagnosis.one_cause.identify import identify_cause
    from rotorstudy.diagnosis.settings import check_names, read_settings

    settings = read_settings(rig.given, given.rig)
    check_names(settings, model, f"{given.rig}, diagnosis")
    found = identify_cause(spectrum, model, given.cause, settings, given.count)
    every = [_explanation(one) for one in (found, *found.elsewhere)]
    for i, one in enumerate(every):
        said = [given.cause + "".join(f", {key} {value}" for key, value in place.items()) for place in one["places"]]
        print(f"or, explaining the records as well, {' and '.join(said)}" if i else "\n".join(said))
        _print_estimates(one["estimates"])
    for told, misfit in sorted(found.misfits.items(), key=lambda one: one[1]):
        print(f"misfit above the best, {told}: {misfit:.3g}")
    print(f"misfit by noise alone: {p_value(found.p_value)}")
    warnings, names = [], shown_names(found.causes)
    if found.p_value < settings.significance:
        warnings.append(f"{given.cause} does not explain the records; its intervals are not valid")
    for name, away in far_amplitudes(found.causes, found.fit.values).items():
        told = f"{names[name]} is {abs(away):.1f} times as far from its usual value as its usual standard deviation"
        warnings.append(f"{told}: the cause has another form than the model, and its intervals are not valid")
    tell(f"warning: {warning}" for warning in warnings)
    best, *others = every
    if given.out:
        _save(given, rig, [*rig.plugins, registry().get("effect", given.cause)], best["estimates"])
    return best | {"elsewhere": others, "misfits_above_best": found.misfits, "warnings": warnings}


def _explanation(found):
    """The places and numbers of an Identified, as for JSON."""
    from rotorstudy.diagnosis.one_cause.answer import estimates_of

    places = [{**cause.where, **cause.variant} for cause in found.causes]
    return {"places": places, "estimates": estimate_rows(estimates_of(found))[0], "p_value": found.p_value}


def _print_estimates(rows, parameters=()):
    """Print each estimate with its standard deviation and its 95 % interval; an eccentricity is an unbalance, too."""
    width = max(24, *(len(row["name"]) for row in rows))
    for name, value, std, unit, ends in map(dict.values, rows):
        stem, bracket, label = name.partition("[")
        ending, own = unit_ending(stem)  # whose value may be shown in another unit
        told = stem.removesuffix(ending) + bracket + label if own == unit else name
        print(f"{told:{width}} {with_interval(value, std, unit, ends)}")
        for other, (unit, factor) in parameters[name].also.items() if name in parameters else ():
            told, scaled = name.replace(parameters[name].name, other, 1), [end / factor for end in ends]
            print(f"{told:{width}} {with_interval(value / factor, std / factor, unit, scaled)}")


def _print_misfit(misfit, freedom):
    """Print the misfit per degree of freedom and its 95 % range for a model that explains them; a warning if not."""
    from rotorstudy.inference.fit import chi_square_cost

    if freedom < 1:
        tell(["note: as many unknowns as data: the misfit does not tell whether the model explains the records"])
        return []
    low, high = (chi_square_cost(p, freedom) / freedom for p in (0.975, 0.025))
    expected = f"{low:.2g} to {high:.2g} expected if only noise is left"
    print(f"misfit {misfit / freedom:.3g} per degree of freedom ({expected})")
    if misfit / freedom < low:
        tell(["note: the misfit is below the expected range: the noise is smaller than stated, and intervals are wide"])
    above = misfit / freedom > high
    return ["the model does not explain the records; the stated intervals are not valid"] if above else []


def _save(given, rig, plugins, rows):
    """Write the estimates to a NetCDF file."""
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.common import results

    kinds = ("parameter", "estimate", "standard_deviation", "unit", "interval")
    found = dict(zip(kinds, map(list, zip(*map(dict.values, rows), strict=True)), strict=True))
    origin = provenance(rig.given, plugins) | {"records": ", ".join(map(str, given.records))}
    save(results("estimate", "identification", **found).assign_attrs(origin), given.out)
