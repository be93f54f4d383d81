"""Command line: the zoo and your own files for it; simulate a rig, import records, identify and diagnose a rig."""

import argparse
import sys
from pathlib import Path

from rotorstudy.errors import PluginError, RotorstudyError
from rotorstudy.model.registry import blamed, registry

HARMONICS = (0, 1, 2, 3, 5, 7, -1, -3, -5)
BLIND = "workflow/config/blind.yaml"  # of the project, wherever the command is given
MOST_SAMPLES = 20_000_000  # of a record, about a gigabyte while it is made

EPILOG = """examples:
  rotorstudy plugins
  rotorstudy new crack my_crack
  rotorstudy check plugins/cracks/my_crack.py
  rotorstudy simulate rig.yaml --speeds 88 308 --out records.nc
  rotorstudy identify records.nc --rig rig.yaml --unknowns internal_damping external_damping
  rotorstudy import run_1.csv run_2.csv --rig rig.yaml --out spectrum.nc
  rotorstudy diagnose run_1.csv run_2.csv --rig rig.yaml --out diagnosis
  rotorstudy blind --cases 60 --seed 7 --out blind_7
"""


def parser():
    top = argparse.ArgumentParser(
        prog="rotorstudy", description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    plugins = commands.add_parser("plugins", help="list the zoo: kind, name, source, one line each")
    plugins.add_argument(
        "--name", help="all that this one plugin says of itself: options, parameters, claims, confounders"
    )
    plugins.add_argument("--kind", help="only this kind: rotor, crack, depth, bearing, effect, spectrum, estimator")

    new = commands.add_parser("new", help="write a working plugin file to start from")
    new.add_argument("kind", help="rotor, crack, depth, bearing, effect, spectrum or estimator")
    new.add_argument("name", help="of the plugin and its file")
    new.add_argument("--folder", help="where to write it (default: the kind's folder in plugins/)")

    check = commands.add_parser("check", help="try every invariant of its kind on a plugin file; say what holds")
    check.add_argument("file", help="plugin file")

    simulate = commands.add_parser("simulate", help="records of the steady state of a rig, as NetCDF")
    simulate.add_argument("rig", help="rig file (YAML) with a value for every parameter")
    simulate.add_argument(
        "--speeds", type=float, nargs="+", required=True, metavar="RAD_S", help="spin speeds in rad/s"
    )
    simulate.add_argument(
        "--harmonics", type=int, nargs="+", default=HARMONICS, help="harmonics of the reference signal"
    )
    simulate.add_argument(
        "--duration", type=float, default=1.0, metavar="S", help="length of each record in s (default 1)"
    )
    simulate.add_argument(
        "--rate", type=float, default=10000.0, metavar="HZ", help="samples per second (default 10000)"
    )
    simulate.add_argument("--noise", type=float, default=0.0, metavar="PERCENT", help="white noise, percent of the rms")
    simulate.add_argument("--seed", type=int, default=0, help="of the noise (default 0)")
    simulate.add_argument("--out", required=True, help="NetCDF file to write")

    measured = commands.add_parser("import", help="measured records to a spectrum with covariance and a quality page")
    measured.add_argument(
        "records", nargs="+", help="record files (.nc, .csv, .mat, .uff) or tables of harmonics (.csv)"
    )
    measured.add_argument(
        "--rig", required=True, help="rig file; its section 'measurement:' says how to read the files"
    )
    measured.add_argument("--out", required=True, help="NetCDF file to write")
    measured.add_argument("--quality", help="HTML page to write (default: quality.html beside --out)")

    diagnose = commands.add_parser("diagnose", help="what the simulation of a rig gets wrong, and the cause")
    diagnose.add_argument(
        "records", nargs="+", help="record files, tables of harmonics, or one spectrum that `import` wrote"
    )
    diagnose.add_argument(
        "--rig", required=True, help="rig file with a value for every parameter; its section 'diagnosis:' has settings"
    )
    diagnose.add_argument("--out", required=True, metavar="DIR", help="folder to write verdict, figures and page to")
    diagnose.add_argument(
        "--hold-out",
        type=float,
        nargs="+",
        metavar="RAD_S",
        help="measured speeds in rad/s that no fit sees (default: those of the rig file, else about a quarter)",
    )

    identify = commands.add_parser("identify", help="estimate parameters of a rig from records")
    identify.add_argument("records", help="NetCDF file as `simulate` writes it")
    identify.add_argument(
        "--rig", required=True, help="rig file; parameters it gives a value for are held, unless named below"
    )
    identify.add_argument(
        "--unknowns", nargs="+", metavar="NAME", help="parameters to estimate (default: those without a value)"
    )
    identify.add_argument(
        "--harmonics",
        type=int,
        nargs="+",
        default=HARMONICS,
        help="harmonics to use; those left out count as noise only if they leak",
    )
    identify.add_argument("--spectrum", default="regression", help="spectrum plugin (default regression)")
    identify.add_argument(
        "--estimator", default="maximum_likelihood", help="estimator plugin (default maximum_likelihood)"
    )
    identify.add_argument("--phase", default="reference", help="reference, keyphasor or none (default reference)")
    identify.add_argument("--out", help="NetCDF file to write the estimates to")

    blind = commands.add_parser("blind", help="hide effects in simulated measurements and see what a diagnosis finds")
    blind.add_argument("--config", help=f"what to draw (default: {BLIND} of the project)")
    blind.add_argument("--cases", type=int, metavar="N", help="number of cases (default: the configuration's)")
    blind.add_argument("--seed", type=int, metavar="S", help="of all random numbers (default: the configuration's)")
    blind.add_argument("--cores", type=int, default=1, metavar="K", help="processes; results are the same (default 1)")
    blind.add_argument("--out", required=True, help="folder to write to")
    return top


def main(arguments=None):
    """Run the command line; returns the exit status."""
    given = parser().parse_args(arguments)
    try:
        if given.command == "plugins":
            return list_plugins(given)
        for failure in registry().failures:
            print(f"warning: {failure}", file=sys.stderr)
        commands = {
            "new": new,
            "check": check,
            "simulate": simulate,
            "import": import_records,
            "diagnose": diagnose,
            "identify": identify,
            "blind": blind,
        }
        return commands[given.command](given)
    except RotorstudyError as error:
        message = error
    except (OSError, MemoryError) as error:
        message = blamed(error) or f"{type(error).__name__}: {error}"
    except Exception as error:
        message = blamed(error)
        if not message:
            raise
    print(f"error: {message}", file=sys.stderr)
    return 1


def check_out(out, *inputs, option="--out"):
    """A result goes to a new or old file in a folder that exists, and never over an input."""
    path = Path(out)
    if path.is_dir():
        raise RotorstudyError(f"{option} {out}: is a folder; name a file in it")
    if not path.parent.is_dir():
        raise RotorstudyError(f"{option} {out}: the folder '{path.parent}' does not exist; make it first")
    for given in inputs:
        if path.resolve() == Path(given).resolve():
            raise RotorstudyError(f"{option} {out}: would overwrite an input; choose another name")


def list_plugins(given):
    from rotorstudy.errors import unknown_name
    from rotorstudy.model.kinds import KINDS

    if given.kind and given.kind not in KINDS:
        raise unknown_name("kind", given.kind, KINDS, "--kind")
    zoo = registry()
    shown = [(kind, plugin) for kind, plugin in zoo if given.kind in (None, kind)]
    if given.name:
        return show_plugin(given.name, [one for one in shown if one[1].name == given.name], shown)
    if shown:
        widths = [max(len(text) for text in column) for column in zip(*((k, p.name) for k, p in shown), strict=True)]
        for kind, plugin in shown:
            print(f"{kind:{widths[0]}}  {plugin.name:{widths[1]}}  {plugin.summary} [{plugin.source}]")
    if zoo.failures:
        raise PluginError("; ".join(zoo.failures))
    return 0


def show_plugin(name, found, known):
    """What the plugins of a name say of themselves."""
    from rotorstudy.authoring.facts import facts
    from rotorstudy.errors import unknown_name

    if not found:
        raise unknown_name("plugin", name, [plugin.name for _, plugin in known], "--name")
    for kind, plugin in found:
        print(f"{kind} {plugin.name} ({plugin.file})")
        for heading, text in facts(kind, plugin).items():
            print(f"  {heading:16} {text}")
    return 0


def new(given):
    from rotorstudy.authoring.files import new_plugin

    path = new_plugin(given.kind, given.name, given.folder)
    print(f"wrote {path}; edit it, then: rotorstudy check {path}")
    return 0


def check(given):
    from rotorstudy.authoring.files import check_file, left_to_write

    rows = check_file(given.file)
    broken = [row for row in rows if row[-1]]
    for kind, name, claim, wrong in rows:
        print(f"{'fails' if wrong else 'holds'}  {kind} {name}: {claim}" + (f"\n       {wrong}" if wrong else ""))
    print(f"{len(rows) - len(broken)} of {len(rows)} hold")
    if left := left_to_write(given.file):
        print(f"note: {' and '.join(left)} in {given.file} still say what the template says; name your own")
    return 1 if broken else 0


def simulate(given):
    import numpy as np

    from rotorstudy.measurement.noise import standard_normal
    from rotorstudy.measurement.record_files import records_dataset
    from rotorstudy.measurement.records import check_record, simulate_records
    from rotorstudy.model.rig import load_rig, named_plugins
    from rotorstudy.response.harmonic import check_speed
    from rotorstudy.store import provenance, read_yaml, save

    for name, value in (("--duration", given.duration), ("--rate", given.rate)):
        if not 0 < value < np.inf:
            raise RotorstudyError(f"{name} {value:g}: must be positive and finite")
    if not 0 <= given.noise < np.inf or given.seed < 0:
        raise RotorstudyError(f"--noise {given.noise:g} --seed {given.seed}: must not be negative, and finite")
    if given.duration * given.rate > MOST_SAMPLES:
        raise RotorstudyError(
            f"--duration {given.duration:g} at --rate {given.rate:g}: more than {MOST_SAMPLES:.0e} samples a speed; "
            "shorten the record or sample more slowly"
        )
    check_out(given.out, given.rig)
    model = load_rig(given.rig)
    time = np.arange(round(given.duration * given.rate)) / given.rate
    records = simulate_records(model, check_speed(given.speeds), given.harmonics, time)
    for i, record in enumerate(records):
        check_record(record, given.harmonics)
        if given.noise:
            x, y = standard_normal(given.seed, i, 1, (2, *record.displacement.shape))[0]
            moving = record.displacement - record.displacement.mean(axis=-1, keepdims=True)
            size = given.noise / 100 * np.sqrt(np.mean(np.abs(moving) ** 2, axis=-1, keepdims=True) / 2)
            record.displacement[:] += size * (x + 1j * y)
    rig = read_yaml(given.rig)
    attributes = provenance(rig, named_plugins(rig), given.seed if given.noise else None)
    save(records_dataset(records).assign_attrs(attributes), given.out)
    print(f"wrote {len(records)} record(s) of {len(time)} samples to {given.out}")
    return 0


def import_records(given):
    from rotorstudy.measurement.measurement import measurement_dataset, read_measurement
    from rotorstudy.model.rig import named_plugins
    from rotorstudy.presentation.quality_page import write_page
    from rotorstudy.store import provenance, read_yaml, save

    page = given.quality or Path(given.out).parent / "quality.html"
    check_out(given.out, given.rig, *given.records)
    check_out(page, given.rig, given.out, *given.records, option="--quality")
    measurement = read_measurement(given.records, given.rig)
    write_page(measurement, page, f"Quality of {', '.join(Path(path).name for path in given.records)}")
    for finding in measurement.findings:
        print(finding, file=sys.stderr)
    if measurement.errors:
        raise RotorstudyError(
            f"{len(measurement.errors)} of the findings are errors, so no spectrum was written; leave these records "
            f"out or correct them (see {page})"
        )
    rig = read_yaml(given.rig)
    attributes = {**provenance(rig, named_plugins(rig)), "records": ", ".join(map(str, given.records))}
    save(measurement_dataset(measurement).assign_attrs(attributes), given.out)
    count = len(measurement.spectrum.speed)
    print(f"wrote the spectrum of {count} speed(s) to {given.out}, their quality to {page}")
    return 0


def diagnose(given):
    from rotorstudy.presentation.diagnosis_files import diagnose_files

    if Path(given.out).is_file():
        raise RotorstudyError(f"--out {given.out}: is a file; name a folder")
    if not Path(given.out).parent.is_dir():
        raise RotorstudyError(f"--out {given.out}: the folder '{Path(given.out).parent}' does not exist; make it first")
    inputs = [Path(path).resolve() for path in (given.rig, *given.records)]
    if Path(given.out).resolve() in [path.parent for path in inputs]:
        raise RotorstudyError(f"--out {given.out}: holds an input; name a folder of its own")
    verdict = diagnose_files(given.records, given.rig, given.out, given.hold_out)
    for finding in verdict.findings:
        print(finding, file=sys.stderr)
    for broken in set(verdict.broken_plugins) - set(registry().failures):  # those were printed before
        print(f"warning: {broken}", file=sys.stderr)
    print(verdict.summary)
    print(f"wrote {Path(given.out) / 'index.html'}")
    return 0


def identify(given):
    import numpy as np

    from rotorstudy.inference.identification import Problem, estimate_by, magnitude_and_phase
    from rotorstudy.measurement.record_files import load_records
    from rotorstudy.measurement.records import full_spectrum
    from rotorstudy.model.rig import load_rig, named_plugins
    from rotorstudy.store import dataset, provenance, read_yaml, save

    if given.out:
        check_out(given.out, given.rig, given.records)
    method, estimator = registry().get("spectrum", given.spectrum), registry().get("estimator", given.estimator)
    model = load_rig(given.rig)
    unknowns = model.unknown_names(given.unknowns)
    spectrum = full_spectrum(load_records(given.records), given.harmonics, method, given.phase)
    problem = Problem(model, spectrum, unknowns)
    estimate = estimate_by(estimator, problem)
    names, theta, covariance = magnitude_and_phase(unknowns, estimate.theta, estimate.covariance)
    std = np.sqrt(np.diag(covariance))
    units = model.reported_units(names)
    for name, value, half, unit in zip(names, theta, 1.96 * std, units, strict=True):
        print(f"{name:24} {value: .6g} ± {half:.2g} {unit} (95 %)")
    if np.isfinite(estimate.misfit):
        from scipy.stats import chi2

        freedom = 2 * spectrum.amplitude.size - len(names)
        low, high = chi2.ppf([0.025, 0.975], freedom) / freedom
        expected = f"{low:.2g} to {high:.2g} expected if the model explains a record with noise"
        misfit = float(estimate.misfit) / freedom
        print(f"misfit {misfit:.3g} per degree of freedom ({expected})")
        if misfit > high:
            print(
                "warning: the model does not explain the records; the stated intervals are not valid", file=sys.stderr
            )
        elif misfit < low:
            print("note: the model fits better than usual", file=sys.stderr)
    if given.out:
        coordinates = {"parameter": (list(names), "1", "identified parameter")}
        variables = {
            "estimate": (("parameter",), theta, "SI", "estimated parameter"),
            "standard_deviation": (("parameter",), std, "SI", "stated standard deviation"),
            "unit": (("parameter",), np.array(units, object), "1", "unit of each parameter"),
        }
        rig = read_yaml(given.rig)
        attributes = provenance(rig, [*named_plugins(rig), method, estimator])
        save(dataset(variables, coordinates, title="identification").assign_attrs(attributes), given.out)
    return 0


def blind(given):
    from rotorstudy.blind.config import load_blind
    from rotorstudy.blind.run import run_blind
    from rotorstudy.presentation.blind_page import write_pages

    if Path(given.out).is_file():
        raise RotorstudyError(f"--out {given.out}: is a file; name a folder")
    config = load_blind(given.config or Path(__file__).parents[3] / BLIND)
    data, criteria, rows = run_blind(config, given.out, cases=given.cases, seed=given.seed, cores=given.cores)
    write_pages(data, criteria, rows, given.out)
    for row in criteria.itertuples():
        value = f"{row.reached:.3g} ({row.low:.3g} to {row.high:.3g}), {row.cases} cases"
        print(f"{row.status:15} {row.what} {row.needed}: {value}")
    print(f"wrote {given.out}/criteria.html, cases.html, blind.nc and figures")
    return 0


if __name__ == "__main__":
    sys.exit(main())
