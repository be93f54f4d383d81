"""Everything a real record does wrong ends in a clear error, never in a silent wrong verdict."""

import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from one_line_errors import refused, undiagnosed

from rotorstudy import RotorstudyError, measured_spectrum
from rotorstudy.measurement.records import records_dataset

sys.path.insert(0, str(Path(__file__).parents[1] / "measured"))
from machine import STEADY, records, section, write, write_rig
from test_quality import original, with_gap


@pytest.fixture(scope="module")
def record():
    return records(speeds=[STEADY])[0]


def swapped_wires():
    """The wires of left and right exchanged, each in the unit of the other."""
    record = original()
    return {
        "disc 1 left": record["disc 1 right"] * 1e-3 * -7874.0,
        "disc 1 right": record["disc 1 left"] / 7874.0 * -1e3,
    }


FAULTS = {"gaps": lambda: with_gap(2000), "swapped probes": swapped_wires, "too few revolutions": dict}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_record_with_an_error_is_not_diagnosed(fault, record, tmp_path, capsys):
    rig = write_rig(tmp_path / "rig.yaml", keyphasor=section()["keyphasor"] | {"polarity": "positive"})
    path = write("csv", tmp_path, record, name="run", **FAULTS[fault]())
    if fault == "too few revolutions":
        path.write_text("".join(path.read_text().splitlines(keepends=True)[:300]))
    undiagnosed(capsys, tmp_path, rig, path, "run.csv", fault)


def test_the_same_record_without_a_fault_is_accepted(record, tmp_path):
    """The negative control of the faults above."""
    rig = write_rig(tmp_path / "rig.yaml", keyphasor=section()["keyphasor"] | {"polarity": "positive"})
    spectrum, _, findings = measured_spectrum([write("csv", tmp_path, record, name="run")], rig)
    assert findings == [] and np.allclose(spectrum.speed, STEADY, rtol=1e-3)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("csv", "the file is empty"),
        ("mat", "not a readable MATLAB file"),
        ("uff", "no data set 58"),
        ("nc", "not a readable NetCDF file"),
    ],
)
def test_an_empty_or_truncated_file_is_refused(kind, words, record, tmp_path, capsys):
    rig, empty, cut = write_rig(tmp_path / "rig.yaml"), tmp_path / f"empty.{kind}", tmp_path / f"cut.{kind}"
    empty.write_bytes(b"")
    undiagnosed(capsys, tmp_path, rig, empty, f"empty.{kind}", words)
    if kind == "nc":
        whole = tmp_path / "whole.nc"
        records_dataset([record]).to_netcdf(whole)
    else:
        whole = write(kind, tmp_path, record, name="whole")
    content = whole.read_bytes()
    cut.write_bytes(content[: content.index(b"\n") + 1] if kind == "csv" else content[: int(0.6 * len(content))])
    undiagnosed(capsys, tmp_path, rig, cut, f"cut.{kind}", *(["empty or incomplete"] if kind == "csv" else []))


def test_a_last_row_cut_short_is_refused_and_can_be_removed(record, tmp_path):
    rig, path = write_rig(tmp_path / "rig.yaml"), write("csv", tmp_path, record, name="run")
    whole = measured_spectrum([path], rig)[0]
    text = path.read_text()
    path.write_text(text[: text[:-400].rindex(",")])
    refused(lambda: measured_spectrum([path], rig), "the file is cut off: remove its last line")
    path.write_text(path.read_text()[: path.read_text().rindex("\n") + 1])
    cut = measured_spectrum([path], rig)[0]
    assert np.abs(cut.amplitude - whole.amplitude).max() < 0.01 * np.abs(whole.amplitude).max()


def simulated(path, sensors, speed):
    """The file of a record of the rig."""
    records_dataset(records(speeds=[speed])).sel(node=sensors).to_netcdf(path)
    return path


def plain_rig(path, **changes):
    """The rig for records in the project's own axes."""
    write_rig(path)
    rig = {key: value for key, value in yaml.safe_load(path.read_text()).items() if key != "sensors"}
    path.write_text(yaml.safe_dump({**rig, "measurement": {"harmonics": [0, 1, -1]}, **changes}))
    return path


def test_sensors_that_do_not_fit_are_refused(tmp_path, capsys):
    both, one = simulated(tmp_path / "both.nc", [2, 4], 80.0), simulated(tmp_path / "one.nc", [2], 100.0)
    rig = plain_rig(tmp_path / "rig.yaml")
    assert measured_spectrum([both], rig)[0].sensors == (2, 4)
    with pytest.raises(RotorstudyError, match=r"one.nc, 954.93 rpm \(100 rad/s\) has nodes \[2\].*same probes"):
        measured_spectrum([both, one], rig)
    undiagnosed(capsys, tmp_path, plain_rig(tmp_path / "a.yaml", sensors=[2, 3]), both, "node 3", "leave it out")
    probes = [{"channel": name, "node": 3, "angle_deg": angle} for name, angle in (("x", 0.0), ("y", 90.0))]
    elsewhere = plain_rig(tmp_path / "b.yaml", measurement={"probes": probes})
    undiagnosed(capsys, tmp_path, elsewhere, both, "no probe", "nodes 2, 4")
