"""`rotorstudy identify`: estimate parameters of a rig from records, tables of harmonics or a spectrum."""

import sys

from rotorstudy.commands.outputs import check_file
from rotorstudy.errors import unknown_name
from rotorstudy.model.registry import registry


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("identify", help="estimate parameters of a rig from records")
    parser.add_argument(
        "records",
        nargs="+",
        help="record files (.nc, .csv, .mat, .uff), tables of harmonics (.csv), or one spectrum written by `import`",
    )
    parser.add_argument(
        "--rig",
        required=True,
        help="rig file; parameters with a value are known unless named in --unknowns; its section 'measurement:' says "
        "how to read the files",
    )
    parser.add_argument(
        "--unknowns",
        nargs="+",
        metavar="NAME",
        help="parameters to estimate (default: those without a value); "
        "'rotor.youngs_modulus_Pa' is the relative change of that number of the rotor",
    )
    parser.add_argument(
        "--harmonics", type=int, nargs="+", metavar="N", help="measured harmonics to use (default: all)"
    )
    parser.add_argument(
        "--spectrum",
        metavar="NAME",
        help="spectrum plugin for the records (default: harmonics and covariance as `import` writes them)",
    )
    parser.add_argument(
        "--estimator", default="maximum_likelihood", help="estimator plugin (default maximum_likelihood)"
    )
    parser.add_argument("--out", help="NetCDF file to write the estimates to")
    parser.add_argument(
        "--rig-out", metavar="FILE", help="rig file to write, with the estimates and, in 'prior:', their covariance"
    )
    parser.set_defaults(func=run)


def run(given):
    """Print the estimates with their intervals, and the misfit."""
    import numpy as np

    from rotorstudy.inference.problem import Problem, magnitude_and_phase
    from rotorstudy.inference.rig_estimate import estimate_rig
    from rotorstudy.measurement.measurement import measured_spectrum
    from rotorstudy.model.estimated_rig import rig_with_estimate, write_rig
    from rotorstudy.model.rig import read_rig
    from rotorstudy.model.rotor_numbers import with_rotor_numbers
    from rotorstudy.store import dataset, provenance, save

    if given.out:
        check_file(given.out, given.rig, *given.records)
    if given.rig_out:
        check_file(given.rig_out, given.rig, *given.records, *([given.out] if given.out else []), option="--rig-out")
    method = registry().get("spectrum", given.spectrum) if given.spectrum else None
    estimator = registry().get("estimator", given.estimator)
    rig = read_rig(given.rig)
    spectrum, model, findings = measured_spectrum(given.records, rig, method)
    for finding in findings:
        print(finding, file=sys.stderr)
    model = with_rotor_numbers(model, given.unknowns or (), "--unknowns")
    unknowns = model.unknown_names(given.unknowns)
    spectrum = _chosen(spectrum, given.harmonics)
    estimate = estimate_rig(estimator, Problem(model, spectrum, unknowns), rig.given)
    names, theta, covariance = magnitude_and_phase(unknowns, estimate.theta, estimate.covariance)
    std = np.sqrt(np.diag(covariance))
    units = model.reported_units(names)
    for name, value, half, unit in zip(names, theta, 1.96 * std, units, strict=True):
        print(f"{name:24} {value: .6g} ± {half:.2g} {unit} (95 %)")
    if np.isfinite(estimate.misfit):
        _print_misfit(float(estimate.misfit), spectrum.data_count - len(names))
    if given.out:
        coordinates = {"parameter": (list(names), "1", "identified parameter")}
        variables = {
            "estimate": (("parameter",), theta, "SI", "estimated parameter"),
            "standard_deviation": (("parameter",), std, "SI", "stated standard deviation"),
            "unit": (("parameter",), np.array(units, object), "1", "unit of each parameter"),
        }
        attributes = provenance(rig.given, [*rig.plugins, estimator, *([method] if method else [])])
        attributes |= {"records": ", ".join(map(str, given.records))}
        save(dataset(variables, coordinates, title="identification").assign_attrs(attributes), given.out)
    if given.rig_out:
        found = rig_with_estimate(rig.given, model, unknowns, estimate.theta, estimate.covariance)
        write_rig(found, given.rig_out, f"{given.rig} identified from {', '.join(map(str, given.records))}")
    return 0


def _chosen(spectrum, harmonics):
    """The spectrum at the requested harmonics, by default all."""
    from rotorstudy.response.coupling import check_harmonics

    if harmonics is None:
        return spectrum
    for n in harmonics:
        if n not in spectrum.harmonics:
            where = "--harmonics; 'measurement: harmonics:' of the rig file says which are taken from the records"
            raise unknown_name("harmonic", n, spectrum.harmonics, where)
    return spectrum.at_harmonics(check_harmonics(harmonics))


def _print_misfit(misfit, freedom):
    """Print the misfit per degree of freedom and its 95 % range for a model that explains the records."""
    from scipy.stats import chi2

    low, high = chi2.ppf([0.025, 0.975], freedom) / freedom
    expected = f"{low:.2g} to {high:.2g} expected if the model explains a record with noise"
    print(f"misfit {misfit / freedom:.3g} per degree of freedom ({expected})")
    if misfit / freedom > high:
        print("warning: the model does not explain the records; the stated intervals are not valid", file=sys.stderr)
    elif misfit / freedom < low:
        print("note: the misfit is below the expected range", file=sys.stderr)
