"""Everything a real record does wrong ends in a clear error or a named finding, never in a silent wrong verdict."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from slow_effects import SLOW

from rotorstudy.commands.line import main
from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.records import records_dataset

sys.path.insert(0, str(Path(__file__).parents[1] / "measured"))
from machine import TIME, channels, records, section, write, write_rig

SPEED = 80.0


@pytest.fixture(scope="module")
def record():
    (found,) = records(speeds=[SPEED])
    return found, channels(found)


def refused(capsys, folder, rig, path, *words):
    status = main(["diagnose", str(path), "--rig", str(rig), "--out", str(folder / "out")])
    printed = capsys.readouterr()
    assert status == 1 and printed.out == ""
    error = printed.err.strip().splitlines()[-1]
    assert error.startswith("error: ")
    for word in words:
        assert word in error, error
    assert not (folder / "out").exists() and not list(folder.glob(".*partial"))


def changed(name, record):
    """Channels of the record with a fault."""
    left, right = record["disc 1 left"].copy(), record["disc 1 right"]
    middle = left.mean()
    holed = left.copy()
    holed[1000:3000] = np.nan
    marks = np.arange(1, 31) * 2 * np.pi / SPEED
    pulses = 5 * np.exp(-0.5 * ((TIME[:, None] - marks) * SPEED / 0.1) ** 2).sum(axis=1)
    return {
        "gaps": {"disc 1 left": holed},
        "clipping": {"disc 1 left": np.minimum(left, middle + 0.8 * (left.max() - middle))},
        # the wires of left and right exchanged, each in the unit of the other
        "swapped probes": {
            "disc 1 left": right * 1e-3 * -7874.0,
            "disc 1 right": left / 7874.0 * -1e3,
        },
        "speed label": {"speed": record["speed"] * 1.03},
        "dead keyphasor": {"key": np.full(len(TIME), 1.0)},
        "keyphasor polarity": {"key": -pulses},
        "too few revolutions": {},
    }[name]


FAULTS = [
    "gaps", "clipping", "swapped probes", "speed label", "dead keyphasor", "keyphasor polarity",
    "too few revolutions",
]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_record_with_an_error_is_not_diagnosed(fault, record, tmp_path, capsys):
    found, original = record
    rig = write_rig(tmp_path / "rig.yaml", keyphasor=section()["keyphasor"] | {"polarity": "positive"})
    path = write("csv", tmp_path, found, name="run", **changed(fault, original))
    if fault == "too few revolutions":
        path.write_text("".join(path.read_text().splitlines(keepends=True)[:300]))
    refused(capsys, tmp_path, rig, path, "run.csv", fault)


def test_a_record_without_phase_reference_or_unit_is_refused(record, tmp_path, capsys):
    found, _ = record
    path = write("csv", tmp_path, found, name="run")
    probes = section()["probes"]
    without = [{key: value for key, value in probe.items() if key != "unit"} for probe in probes[1:]]
    refused(capsys, tmp_path, write_rig(tmp_path / "a.yaml", probes=[probes[0], *without]), path, "unit")
    lines = [line.split(",") for line in path.read_text().splitlines()]
    key = lines[0].index("key")
    path.write_text("\n".join(",".join(row[:key] + row[key + 1 :]) for row in lines))
    refused(capsys, tmp_path, write_rig(tmp_path / "b.yaml"), path, "key")


def test_a_unit_declared_a_thousandfold_wrong_is_a_finding(record, tmp_path):
    found, _ = record
    path = write("csv", tmp_path, found, name="run")
    probes = [{**p, "unit": "m"} if p["unit"] == "mm" else p for p in section()["probes"]]
    _, _, findings = measured_spectrum([path], write_rig(tmp_path / "rig.yaml", probes=probes))
    assert {"units", "weak probe"} <= {finding.name for finding in findings}


RIG = {
    "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
    "effects": [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6},
    ],
    "measurement": {"harmonics": [0, 1, -1]},
}


@pytest.fixture
def spectrum(tmp_path):
    """An imported spectrum of the rig, and the rig file."""
    rig, out = tmp_path / "rig.yaml", tmp_path / "spectrum.nc"
    rig.write_text(yaml.safe_dump(RIG))
    simulated = ["simulate", str(rig), "--speeds", "100", "200", "--noise", "1", "--rate", "2000"]
    assert main([*simulated, "--out", str(tmp_path / "records.nc")]) == 0
    assert main(["import", str(tmp_path / "records.nc"), "--rig", str(rig), "--out", str(out)]) == 0
    return out, rig


def test_a_spectrum_that_cannot_be_trusted_is_refused(spectrum, tmp_path, capsys):
    path, rig = spectrum
    with xr.open_dataset(path) as data:
        data = data.load()
    broken = data.copy(deep=True)
    broken.amplitude[0, 0, 0, 0] = np.nan
    silent = data.copy(deep=True)
    silent.covariance[:] = 0
    twice = xr.concat([data.isel(speed=[0]), data.isel(speed=[0])], "speed", data_vars="minimal")
    for name, changed, word in (("nan", broken, "NaN"), ("zero", silent, "all zero"), ("twice", twice, "twice")):
        changed.to_netcdf(tmp_path / f"{name}.nc")
        capsys.readouterr()
        refused(capsys, tmp_path, rig, tmp_path / f"{name}.nc", f"{name}.nc", word)


def test_what_the_command_line_refuses(spectrum, tmp_path, capsys):
    path, rig = spectrum
    base = ["diagnose", str(path), "--rig", str(rig)]
    (tmp_path / "file").write_text("precious")
    capsys.readouterr()
    for options, words in (
        (["--out", str(tmp_path / "file")], ["is a file"]),
        (["--out", str(tmp_path)], ["contains an input"]),
        (["--out", str(tmp_path / "no" / "out")], ["does not exist"]),
        (["--out", str(tmp_path / "out"), "--hold-out", "150"], ["150", "not measured", "100, 200"]),
        (["--out", str(tmp_path / "out"), "--hold-out", "100", "200"], ["every speed"]),
    ):
        assert main([*base, *options]) == 1
        error = capsys.readouterr().err
        assert error.startswith("error: ") and all(word in error for word in words), error
    assert main(["diagnose", str(path), str(tmp_path / "records.nc"), *base[2:], "--out", str(tmp_path / "out")]) == 1
    assert "give it alone" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"model_eror": 0.1}, ["model_eror", "did you mean 'model_error'"]),
        ({"model_error": -0.1}, ["model_error = -0.1"]),
        ({"uncertainty": {"eccentricty": 0.1}}, ["eccentricty", "did you mean 'eccentricity'", "uncertainty"]),
        ({"uncertainty": {"default": -0.1}}, ["default = -0.1", "not be negative"]),
        ({"nuisance": {"probe_gian": 0.1}}, ["probe_gian", "did you mean 'probe_gain'"]),
        ({"nuisance": {"unbalance": 0.1}}, ["unbalance", "measuring chain"]),
        ({"nuisance": {"probe_gain": 0.0}}, ["probe_gain = 0", "positive"]),
        ({"base_rates": {"bwo": 2.0}}, ["bwo", "did you mean 'bow'"]),
        ({"base_rates": {"bow": 0.0}}, ["base_rates.bow", "greater than 0"]),
        ({"leave_out": ["bwo"]}, ["bwo", "did you mean 'bow'"]),
        ([1], ["expected keys and values"]),
    ],
)
def test_settings_are_checked_with_near_misses(given, words):
    from rotorstudy import RotorstudyError
    from rotorstudy.model.rig import build_model

    with pytest.raises(RotorstudyError) as error:
        settings = read_settings({**RIG, "diagnosis": given}, "rig.yaml")
        check_names(settings, build_model(RIG), "rig.yaml, diagnosis")
    assert "rig.yaml, diagnosis" in str(error.value)
    for word in words:
        assert word in str(error.value), error.value


@pytest.mark.usefixtures("unrendered")
def test_warnings_go_into_the_verdict(spectrum, tmp_path, capsys):
    """A record with few revolutions is used, and the verdict says so."""
    _, rig = spectrum
    short = ["simulate", str(rig), "--speeds", "100", "200", "--noise", "1", "--rate", "2000", "--duration", "0.2"]
    assert main([*short, "--out", str(tmp_path / "short.nc")]) == 0
    capsys.readouterr()
    assert main(["diagnose", str(tmp_path / "short.nc"), "--rig", str(rig), "--out", str(tmp_path / "out")]) == 0
    assert "few revolutions" in capsys.readouterr().err
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert verdict["summary"].endswith("Check the records first: few revolutions.")
    assert "few revolutions" in {finding["name"] for finding in verdict["findings"]}
    assert "few revolutions" in (tmp_path / "out" / "index.html").read_text()


def test_the_same_record_without_a_fault_is_accepted(record, tmp_path):
    """The negative control of the faults above."""
    found, _ = record
    rig = write_rig(tmp_path / "rig.yaml", keyphasor=section()["keyphasor"] | {"polarity": "positive"})
    spectrum, _, findings = measured_spectrum([write("csv", tmp_path, found, name="run")], rig)
    assert findings == [] and np.allclose(spectrum.speed, SPEED, rtol=1e-3)


def test_a_shaft_that_turns_the_other_way_is_refused(record, tmp_path, capsys):
    found, original = record
    path = write("csv", tmp_path, found, name="run")
    wrong_way = write_rig(tmp_path / "a.yaml", rotation="with_angles")
    refused(capsys, tmp_path, wrong_way, path, "sense of rotation", "Correct 'rotation:'")
    backwards = {name: values[::-1] for name, values in original.items() if name != "time"}
    path = write("csv", tmp_path, found, name="backwards", **backwards)
    refused(capsys, tmp_path, write_rig(tmp_path / "b.yaml"), path, "backwards.csv", "sense of rotation")


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("csv", "not a readable table"),
        ("mat", "not a readable MATLAB file"),
        ("uff", "no data set 58"),
        ("nc", "not a readable NetCDF file"),
    ],
)
def test_an_empty_or_truncated_file_is_refused(kind, words, record, tmp_path, capsys):
    found, _ = record
    rig, empty, cut = write_rig(tmp_path / "rig.yaml"), tmp_path / f"empty.{kind}", tmp_path / f"cut.{kind}"
    empty.write_bytes(b"")
    refused(capsys, tmp_path, rig, empty, f"empty.{kind}", words)
    if kind == "nc":
        whole = tmp_path / "whole.nc"
        records_dataset([found]).to_netcdf(whole)
    else:
        whole = write(kind, tmp_path, found, name="whole")
    content = whole.read_bytes()
    cut.write_bytes(content[: content.index(b"\n") + 1] if kind == "csv" else content[: int(0.6 * len(content))])
    refused(capsys, tmp_path, rig, cut, f"cut.{kind}", *(["empty or incomplete"] if kind == "csv" else []))


def test_a_last_row_cut_short_does_no_harm(record, tmp_path):
    found, _ = record
    rig, path = write_rig(tmp_path / "rig.yaml"), write("csv", tmp_path, found, name="run")
    whole = measured_spectrum([path], rig)[0]
    text = path.read_text()
    path.write_text(text[: text[:-400].rindex(",")])
    cut = measured_spectrum([path], rig)[0]
    assert np.abs(cut.amplitude - whole.amplitude).max() < 0.01 * np.abs(whole.amplitude).max()


@pytest.fixture
def simulated(tmp_path):
    """Records of the rig as NetCDF with changes: function(name, sensors, speed, **attributes of displacement)."""

    def make(name, sensors=(2, 4), speed=80.0, units="m"):
        (found,) = records(speeds=[speed])
        data = records_dataset([found]).sel(node=list(sensors))
        data.displacement.attrs["units"] = units
        if not units:
            del data.displacement.attrs["units"]
        data.to_netcdf(tmp_path / f"{name}.nc")
        return tmp_path / f"{name}.nc"

    return make


def plain_rig(path, **changes):
    """The rig for records in the project's own axes."""
    write_rig(path)
    rig = {key: value for key, value in yaml.safe_load(path.read_text()).items() if key != "sensors"}
    path.write_text(yaml.safe_dump({**rig, "measurement": {"harmonics": [0, 1, -1]}, **changes}))
    return path


def test_sensors_that_do_not_fit_are_refused(simulated, tmp_path, capsys):
    both, one = simulated("both"), simulated("one", sensors=[2], speed=100.0)
    rig = plain_rig(tmp_path / "rig.yaml")
    assert measured_spectrum([both], rig)[0].sensors == (2, 4)
    with pytest.raises(RotorstudyError, match=r"one.nc, 100 rad/s has nodes \[2\].*same probes"):
        measured_spectrum([both, one], rig)
    refused(capsys, tmp_path, plain_rig(tmp_path / "a.yaml", sensors=[2, 3]), both, "node 3", "leave it out")
    probes = [{"channel": name, "node": 3, "angle_deg": angle} for name, angle in (("x", 0.0), ("y", 90.0))]
    elsewhere = plain_rig(tmp_path / "b.yaml", measurement={"probes": probes})
    refused(capsys, tmp_path, elsewhere, both, "no probe", "nodes 2, 4")


@pytest.mark.parametrize("units", ["", "inch"])
def test_a_netcdf_file_without_a_known_unit_is_refused(units, simulated, tmp_path, capsys):
    path = simulated("units", units=units)
    refused(capsys, tmp_path, plain_rig(tmp_path / "rig.yaml"), path, "units.nc", "state 'unit:'")


def test_a_rig_without_values_is_refused(spectrum, tmp_path, capsys):
    path, _ = spectrum
    rig = tmp_path / "empty_rig.yaml"
    effects = [{"kind": "external_damping"}, RIG["effects"][1]]
    rig.write_text(yaml.safe_dump({**RIG, "effects": effects}))
    capsys.readouterr()
    refused(capsys, tmp_path, rig, path, "external_damping", "no value")


QUICK = {"diagnosis": {"leave_out": SLOW, "candidates_per_round": 4}}
OTHER = {
    **RIG,
    "rotor": {"kind": "jeffcott", "mass_kg": 8.0, "stiffness_N_per_m": 2e5},
    "effects": [
        {"kind": "external_damping", "external_damping_N_s_per_m": 400.0},
        {"kind": "unbalance", "eccentricity_m": 6e-5, "eccentricity_phase_rad": -2.0},
    ],
}


def verdict_on(rig, truth, tmp_path, capsys, settings=QUICK):
    """The verdict on records simulated with `truth`."""
    (tmp_path / "truth.yaml").write_text(yaml.safe_dump(truth))
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig | settings))
    simulated = ["simulate", str(tmp_path / "truth.yaml"), "--speeds", "100", "200", "300", "--noise", "1"]
    assert main([*simulated, "--rate", "2000", "--out", str(tmp_path / "records.nc")]) == 0
    out = tmp_path / "verdict"
    assert main(["diagnose", str(tmp_path / "records.nc"), "--rig", str(tmp_path / "rig.yaml"), "--out", str(out)]) == 0
    capsys.readouterr()
    return json.loads((out / "verdict.json").read_text())


@pytest.mark.usefixtures("unrendered")
def test_records_of_another_machine_are_told(tmp_path, capsys):
    verdict = verdict_on(RIG, OTHER, tmp_path, capsys, settings={})  # by the whole library
    assert verdict["verdict"] != "nothing"
    assert "far from the rig" in {finding["name"] for finding in verdict["findings"]}
    assert "far from the rig" in verdict["summary"]


@pytest.mark.usefixtures("unrendered")
def test_a_hidden_effect_is_not_taken_for_another_machine(tmp_path, capsys):
    asymmetry = {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.02, "shaft_asymmetry_phase_rad": 1.0}
    rig = {**RIG, "measurement": {"harmonics": [0, 1, -1, 2]}}  # without 2X it shows by its square alone, at 0X
    verdict = verdict_on(rig, {**rig, "effects": [*rig["effects"], asymmetry]}, tmp_path, capsys)
    assert verdict["findings"] == [] and verdict["verdict"] != "nothing"


@pytest.mark.usefixtures("unrendered")
def test_the_gap_of_the_probes_is_told_and_can_be_given(tmp_path, capsys):
    """A gap of a millimetre is what most proximity probes show; it must not silently become a preload."""
    gap = {"kind": "sensor_gap", "sensor_gap_m": 1e-3, "sensor_gap_phase_rad": 2.5}
    behind = {**RIG, "effects": [*RIG["effects"], gap]}
    silent = verdict_on(RIG, behind, tmp_path, capsys)
    assert "probe gap" in {finding["name"] for finding in silent["findings"]} and "probe gap" in silent["summary"]
    named = {cause["effect"] for cause in silent["causes"]}
    assert ("sensor_gap" in silent["not_considered"]) == ("static_preload" in named)
    given = verdict_on(
        {**RIG, "effects": [*RIG["effects"], {**gap, "sensor_gap_m": 1.05e-3}]}, behind, tmp_path, capsys
    )
    assert given["verdict"] == "nothing" and given["findings"] == []


@pytest.mark.usefixtures("unrendered")
def test_mil_declared_as_mm_is_told(spectrum, tmp_path, capsys):
    """A factor of 39 is no gain error of a probe."""
    with xr.open_dataset(tmp_path / "records.nc") as data:
        data = data.load()
    data.displacement[:] = data.displacement / 0.0254
    data.to_netcdf(tmp_path / "mil.nc")
    (tmp_path / "ac.yaml").write_text(yaml.safe_dump({**RIG, "measurement": {"harmonics": [1, -1]}} | QUICK))
    given = ["diagnose", str(tmp_path / "mil.nc"), "--rig", str(tmp_path / "ac.yaml"), "--out", str(tmp_path / "o")]
    assert main(given) == 0
    assert "mil taken as mm" in capsys.readouterr().err
    verdict = json.loads((tmp_path / "o" / "verdict.json").read_text())
    assert {"units", "far from the rig"} <= {finding["name"] for finding in verdict["findings"]}
