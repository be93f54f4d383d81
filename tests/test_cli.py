"""The command line: what it prints, what it refuses, and with which exit status."""

import io
import json
import logging
import os
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from one_line_errors import run
from threadpoolctl import threadpool_info, threadpool_limits

from rotorstudy import __version__, load_rig
from rotorstudy.authoring.files import _folder_of
from rotorstudy.commands import blind, demo
from rotorstudy.commands.line import COMMANDS, QUIET_S, main, parser, show_progress
from rotorstudy.diagnosis import investigate
from rotorstudy.store import load, save

RIG = str(Path(__file__).parents[1] / "examples" / "jeffcott.yaml")


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "records.nc"
    run("simulate", RIG, "--speeds", 80 * np.pi / 3, "308", "--noise", "1", "--seed", "1", "--out", path)
    return path


def refused(printed, *words):
    out, err = printed
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1
    for word in words:
        assert word in err, err


def test_identify_finds_what_was_simulated_within_its_intervals(records, tmp_path, command):
    out = tmp_path / "estimates.nc"
    names = ["internal_damping", "external_damping", "eccentricity", "stiffness_loss"]
    command("identify", records, "--rig", RIG, "--unknowns", *names, "--out", out)
    found, where = load(out), {"parameter": [*names[:3], "eccentricity_phase", names[3]]}
    true = xr.DataArray([20.0, 100.0, 5e-6, np.pi / 6, 2.5e5], where)
    # five standard deviations: one in a million for a right interval, and far less than any real error
    assert (abs(found.estimate - true) < 5 * found.standard_deviation).all()
    assert list(found.unit.values) == ["N s/m", "N s/m", "m", "rad", "N/m"]


def test_identify_warns_when_the_model_does_not_explain_the_records(records, tmp_path, command):
    names = ["--unknowns", "internal_damping", "external_damping"]
    out, err = command("identify", records, "--rig", RIG, *names)
    assert "misfit" in out and err == ""
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(Path(RIG).read_text().replace("mass_kg: 2.0", "mass_kg: 2.4"))
    out, err = command("identify", records, "--rig", wrong, *names)
    assert "misfit" in out
    assert err == "warning: the model does not explain the records; the stated intervals are not valid\n"


def test_identify_states_an_eccentricity_as_an_unbalance_too(records, command):
    said = command("identify", records, "--rig", RIG, "--unknowns", "eccentricity", "--units", "oz in").out.splitlines()
    assert [line.split()[0] for line in said[:3]] == ["eccentricity", "unbalance", "eccentricity_phase"]
    (mass,) = np.diag(load_rig(RIG).structure.mass)
    ounce_inch = 0.028349523125 * 0.0254
    eccentricity = float(said[0].split()[1]) * 1e-6
    assert said[1].split()[4:6] == ["oz", "in"]
    assert float(said[1].split()[1]) == pytest.approx(eccentricity * mass / ounce_inch, rel=1e-3)


def test_identify_notes_a_fit_better_than_usual(records, tmp_path, command):
    """As of a covariance that is stated four times too large."""
    given = ["--rig", RIG, "--unknowns", "external_damping"]
    command("import", records, *given[:2], "--out", tmp_path / "right.nc")
    data = load(tmp_path / "right.nc")
    save(data.assign(covariance=data.covariance.copy(data=4 * data.covariance.values)), tmp_path / "wide.nc")
    told = [command("identify", tmp_path / f"{name}.nc", *given).err for name in ("right", "wide")]
    said = "note: the misfit is below the expected range: the noise is smaller than stated, and intervals are wide\n"
    assert told == ["", said]


def test_the_help_of_every_command_can_be_read(capsys):
    def help_of(*command):
        with pytest.raises(SystemExit) as stop:
            main([*command, "--help"])
        assert stop.value.code == 0
        return capsys.readouterr().out

    commands = re.findall(r"^    (\w+) ", help_of(), re.M)
    assert {"demo", "new", "import", "diagnose", "blind"} <= set(commands)
    for command in commands:
        assert help_of(command).startswith(f"usage: rotorstudy {command}")


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_given_twice_is_refused_as_its_first_values_would_be_lost(command, capsys):
    """With each of the options that take values; once each, none is said to be given twice."""
    commands = next(one for one in parser()._actions if one.choices).choices
    name = command.__name__.split(".")[-1].removesuffix("_records")
    taking = [one for one in commands[name]._actions if one.option_strings and one.nargs != 0]
    assert taking or name == "check"
    for option in taking:
        values = [option.option_strings[-1], *(["1"] * (option.nargs if isinstance(option.nargs, int) else 1))]
        for times in (2, 1):
            with pytest.raises(SystemExit):
                commands[name].parse_args([*(values * times), "--no-such-option"])
            assert (f"{values[0]} is given twice" in capsys.readouterr().err) == (times == 2), (name, values)


ONE, IDENTIFY = "simulate {rig} --out {out} --speeds 88", "identify {records} --rig {rig} --unknowns external_dampin"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("simulate {rig} --out {out} --speeds 0", ["speed 0 rad/s", "> 0"]),
        (f"{ONE} --rate 100", ["Nyquist", "harmonic 7", "up to 3"]),
        ("simulate {rig} --out {out} --speeds 8 --duration 0.1", ["revolutions", "at least one"]),
        (f"{ONE} --duration -1", ["--duration", "positive"]),
        (f"{ONE} --duration inf", ["--duration", "finite"]),
        (f"{ONE} --duration 1e9", ["samples per speed", "shorten"]),
        (f"{ONE} --noise nan", ["--noise nan"]),
        (f"{ONE} --seed -3", ["--seed -3"]),
        (f"{ONE} 4500 --rate 20000", ["no steady state at 42970 rpm (4500 rad/s)", "threshold"]),
        ("simulate {rig} --speeds 88 --out {rig}", ["would overwrite an input"]),
        ("simulate {rig} --speeds 88 --out {folder}", ["is a folder"]),
        ("simulate {rig} --speeds 88 --out {folder}/none/x.nc", ["does not exist"]),
        ("simulate {rig} --speeds 88 --out {folder}/a.csv", ["a.csv: the file is written as NetCDF; give it a name"]),
        (IDENTIFY, ["did you mean 'external_damping'"]),
        (f"{IDENTIFY}g --spectrum ftt", ["unknown spectrum 'ftt'", "'fft'"]),
        (f"{IDENTIFY}g --estimator least_square", ["'least_squares'"]),
        ("identify {records} --rig {rig}", ["name the unknowns"]),
    ],
)
def test_a_mistake_is_answered_in_one_line_and_nothing_is_written(records, tmp_path, command, line, words):
    rig, out = tmp_path / "rig.yaml", tmp_path / "x.nc"
    rig.write_text(Path(RIG).read_text())
    out.write_text("precious")
    line = line.format(rig=rig, out=out, records=records, folder=tmp_path)
    refused(command(*line.split(), status=1), *words)
    assert rig.read_text() == Path(RIG).read_text() and out.read_text() == "precious"
    assert sorted(tmp_path.iterdir()) == [rig, out]


def in_unit(unit):
    return lambda data: data.assign(displacement=data.displacement.assign_attrs(units=unit))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (in_unit("um"), ["units", "less than a probe can resolve"]),
        (in_unit("furlong"), ["'furlong', which is not read; convert it", "um"]),
        (lambda data: data.assign(displacement=data.displacement.drop_attrs()), ["changed.nc", "state 'unit:'"]),
        (lambda data: data.drop_vars(["reference", "keyphasor"]), ["no phase reference"]),
        (None, ["does not exist"]),
    ],
)
def test_identify_refuses_files_it_cannot_trust(records, tmp_path, command, change, words):
    path = tmp_path / "changed.nc"
    if change:
        change(load(records)).to_netcdf(path)
    refused(command("identify", path, "--rig", RIG, "--unknowns", "external_damping", status=1), *words)


def test_identify_says_what_it_repaired(records, tmp_path, command):
    """A missing sample is left out with a warning; a record without keyphasor has its phase from the reference."""
    names = ["--rig", RIG, "--unknowns", "internal_damping", "external_damping"]
    clean, err = command("identify", records, *names)
    assert err == ""
    data = load(records)
    data.drop_vars("keyphasor").to_netcdf(tmp_path / "reference.nc")
    data.displacement[0, 0, 0, 7] = np.nan
    data.to_netcdf(tmp_path / "hole.nc")
    out, err = command("identify", tmp_path / "hole.nc", *names)
    assert err.startswith("warning: ") and "gaps" in err and out != clean
    said = command("identify", tmp_path / "reference.nc", *names, status=1)
    refused(said, "reference signal has no harmonic [4, -4]")
    rig = tmp_path / "rig.yaml"
    rig.write_text(Path(RIG).read_text() + "measurement: {harmonics: [0, 1, -1, 2, 3, -3]}\n")
    out, err = command("identify", tmp_path / "reference.nc", "--rig", rig, *names[2:])
    assert err == "" and out.startswith("internal_damping")


def test_identify_takes_some_of_the_measured_harmonics(records, command):
    base = ["identify", records, "--rig", RIG, "--unknowns", "external_damping"]
    out, fewer = command(*base).out, command(*base, "--harmonics", 1, -1, 2).out
    assert "external_damping" in out and fewer != out
    refused(command(*base, "--harmonics", 1, 9, status=1), "unknown harmonic '9'", "measurement: harmonics:")


def test_a_new_plugin_is_written_where_one_stands(tmp_path, command, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command("new", "crack", "brand_new").out.startswith("wrote rotorstudy_plugins/brand_new.py;")
    assert (tmp_path / "rotorstudy_plugins/brand_new.py").is_file()
    monkeypatch.chdir(Path(__file__).parents[1])
    assert _folder_of("crack").parts[-2:] == ("plugins", "cracks")


def test_the_files_that_commands_read_are_in_the_wheel():
    """What the wheel is told to hold is what `blind` and `demo` read, where an installed package looks for it."""
    root = Path(__file__).parents[1]
    included = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    packaged = {root / source: target for source, target in included["force-include"].items()}
    assert packaged[blind.CONFIG] == "rotorstudy/blind/blind.yaml"
    for name in (demo.RIG, demo.MACHINE):
        assert packaged[demo.EXAMPLES / name] == f"rotorstudy/examples/{name}"


def test_a_shell_that_completes_is_answered(tmp_path, monkeypatch, command):
    """The package argcomplete is asked if the shell does; without it, or without a shell that asks, nothing happens."""
    asked = []
    fake = SimpleNamespace(autocomplete=lambda commands: asked.append(commands.prog))
    monkeypatch.setitem(sys.modules, "argcomplete", fake)
    assert main(["plugins", "--kind", "depth"]) == 0 and asked == []
    monkeypatch.setenv("_ARGCOMPLETE", "1")
    assert main(["plugins", "--kind", "depth"]) == 0 and asked == ["rotorstudy"]
    monkeypatch.setitem(sys.modules, "argcomplete", None)  # not installed
    command("plugins", "--kind", "depth")


def test_every_command_prints_json_alone_on_stdout(records, tmp_path, command):
    names = ["--unknowns", "internal_damping", "external_damping"]
    out, err = command("identify", records, "--rig", RIG, *names, "--json", "--quiet")
    assert [one["name"] for one in json.loads(out)["estimates"]] == names[1:]
    assert "internal_damping" in err  # what is said without --json
    assert json.loads(command("check", RIG, "--json").out)["errors"] == 0
    out, err = command("identify", tmp_path / "none.nc", "--rig", RIG, "--json", status=1)
    assert "none.nc" in json.loads(out)["error"] and err.startswith("error: ")
    with pytest.raises(SystemExit) as stop:
        command("check", RIG, "--wrong")
    assert stop.value.code == 2


def test_streams_that_are_closed_or_full_give_no_traceback(tmp_path, monkeypatch, capsys):
    """A scheduler may close them (`>&-`), which Python shows as None; the answer to a full disk may not fit on it."""
    full = SimpleNamespace(write=lambda text: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    monkeypatch.setattr("sys.stdout", full)
    assert main(["check", RIG, "--json"]) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith("error: OSError: [Errno 28]")
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(f"sys.{name}", None)
    assert main(["check", RIG]) == 0 and main(["check", "none.yaml"]) == 1


@pytest.mark.usefixtures("unrendered")
def test_units_of_a_rig_and_of_the_command_line(tmp_path, command):
    rig = tmp_path / "rig.yaml"
    rig.write_text(Path(RIG).read_text() + "units: [mil, oz in, rad/s]\n")
    analyse = ["analyse", rig, "--out", tmp_path / "analysis", "--speeds", 400, 800, "--json"]

    def shown(*more, status=0):
        return json.loads(command(*analyse, *more, status=status).out)

    for units, heading in (((), "1X (mil pp)"), (("--units", "um", "peak"), "1X (µm peak)")):
        assert "1X_m" in shown(*units)["resonances"][0]  # for a program always SI
        assert heading in (tmp_path / "analysis" / "index.html").read_text(encoding="utf-8")
    error = shown("--units", "inch", status=1)["error"]
    assert "unknown unit 'inch' in --units" in error and "oz in" in error
    rig.write_text(Path(RIG).read_text() + "units: [mil, um]\n")
    assert "both units of length" in shown(status=1)["error"]


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0 and capsys.readouterr().out == f"rotorstudy {__version__}\n"


@pytest.mark.parametrize(("stated", "used"), [(None, "1"), ("3", "3")])
def test_linear_algebra_uses_one_thread_unless_more_are_stated_to_a_command(stated, used):
    """Of a job the number is stated by Snakemake, for all its processes together."""
    names = [f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL")]
    own = {name: value for name, value in os.environ.items() if name not in names}
    code = f"import os, sys; sys.path.insert(0, 'workflow'); import {{}}; print(*[os.environ[n] for n in {names}])"
    both = "\n".join(map(code.format, ("rotorstudy.commands", "jobs.run")))
    environment = own | ({} if stated is None else dict.fromkeys(names, stated))
    asked = subprocess.run([sys.executable, "-c", both], env=environment, capture_output=True, text=True, check=True)
    assert asked.stdout.split() == [used] * 3 + ["1"] * 3


@pytest.mark.parametrize(("stated", "used"), [([], 1), (["OMP"], 1), (["OPENBLAS", "MKL"], 2)])
def test_a_diagnosis_from_python_uses_one_thread_unless_more_are_stated(stated, used, monkeypatch):
    """Also where numpy was imported before; and afterwards as many as before."""
    for library in ("OPENBLAS", "OMP", "MKL"):
        monkeypatch.delenv(f"{library}_NUM_THREADS", raising=False)
    for library in stated:
        monkeypatch.setenv(f"{library}_NUM_THREADS", "2")

    def threads():
        return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}

    class Asked:
        @property
        def sensors(self):
            assert threads() == {used}
            raise KeyboardInterrupt

    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(KeyboardInterrupt):
            investigate(Asked(), None)
        assert threads() == {2}


def test_progress_of_short_commands_is_shown_in_a_terminal_alone(tmp_path, capsys):
    """The messages themselves carry the seconds since the start."""
    stream, logger = io.StringIO(), logging.getLogger("rotorstudy")
    handler = show_progress(stream)
    try:
        logger.getChild("diagnosis").info("searching %d candidates", 3)
    finally:
        logger.removeHandler(handler)
        logger.setLevel(logging.NOTSET)
    assert re.fullmatch(r" +0\.\d s  searching 3 candidates\n", stream.getvalue())
    late = logging.makeLogRecord({"msg": "fitting", "levelno": logging.DEBUG, "created": time.time() + QUIET_S + 1})
    early = logging.makeLogRecord({"msg": "fitting more", "levelno": logging.DEBUG, "created": late.created + 1})
    for record in (late, early):  # a detail is shown after some seconds without another message
        handler.handle(record)
    assert stream.getvalue().splitlines()[1:] == [f"  {QUIET_S + 1:.1f} s  fitting"]
    run("simulate", RIG, "--speeds", "88", "--duration", "0.1", "--out", tmp_path / "r.nc")
    assert main(["import", str(tmp_path / "r.nc"), "--rig", RIG, "--out", str(tmp_path / "s.nc")]) in (0, 1)
    assert "reading" not in capsys.readouterr().err
