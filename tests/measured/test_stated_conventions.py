"""Conventions that the rig file states: the zero of displacement, node labels, and the sense of phases in tables."""

import numpy as np
import pytest
import yaml
from machines import jeffcott_rig
from one_line_errors import refused, run

from rotorstudy import load_rig, measured_response, measured_spectrum, read_measurement, simulate_records
from rotorstudy.measurement.netcdf_files import measurement_dataset
from rotorstudy.measurement.records import records_dataset
from rotorstudy.store import save

HARMONICS = [0, 1, -1]
RIG = jeffcott_rig(5e-6, 0.7)
SAG = 2.0 * 9.81 / 7.6e5


def rig_file(folder, **stated):
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump({**RIG, "measurement": {"harmonics": HARMONICS, **stated}}))
    return path


def foreign_file(folder, label=1, shift=0.0):
    """Records with phase marks that no attribute declares as the project's own; x counts from `shift`."""
    folder.mkdir(exist_ok=True)
    model = load_rig(rig_file(folder))
    made = simulate_records(model, [100.0], [0, 1], np.arange(4000) / 2000)
    data = records_dataset(made).drop_vars("reference")
    data.displacement.loc[{"direction": "x"}] += shift
    data = data.assign_coords(node=[label])
    data.to_netcdf(folder / "foreign.nc")
    return folder / "foreign.nc", measured_response(model, [100.0], HARMONICS)[0, :, 0]


def test_displacements_from_the_unloaded_line(tmp_path):
    """The readings stay as they are; where the rig says so, the model shows the static deflection m g / k too."""
    path, true = foreign_file(tmp_path / "a", shift=SAG)
    for zero, shown in (("unloaded_line", SAG), ("at_rest", 0.0)):
        found = read_measurement(path, rig_file(tmp_path, displacement_zero=zero))
        assert found.spectrum.amplitude[0, :, 0] == pytest.approx(true + SAG * np.array([1, 0, 0]), abs=1e-11)
        expected = measured_response(found.rig, [100.0], HARMONICS)[0, :, 0]
        assert expected == pytest.approx(true + shown * np.array([1, 0, 0]), abs=1e-11)
        save(measurement_dataset(found), tmp_path / "spectrum.nc")
        _, again, _ = measured_spectrum([tmp_path / "spectrum.nc"], rig_file(tmp_path))
        assert measured_response(again, [100.0], HARMONICS)[0, :, 0] == pytest.approx(expected, abs=1e-15)


def test_a_spectrum_is_of_the_conventions_it_was_imported_by(tmp_path):
    """A section that was corrected since changes the records: the spectrum has to be imported again."""
    path, _ = foreign_file(tmp_path / "a")
    spectrum = tmp_path / "spectrum.nc"
    run("import", path, "--rig", rig_file(tmp_path), "--out", spectrum)
    for changes in ({"rotation": "against_angles"}, {"gravity_angle_deg": 90.0}, {"harmonics": [1, -1]}):
        wrong = rig_file(tmp_path, **changes)
        refused(lambda: measured_spectrum(spectrum, wrong), match=r"another section 'measurement:'.*import the records")
    measured_spectrum(spectrum, rig_file(tmp_path))
    slow = rig_file(tmp_path, slow_roll_below_rpm=10.0)  # is taken off a spectrum too
    refused(lambda: measured_spectrum(spectrum, slow), "no speed is below it")
    (tmp_path / "bare.yaml").write_text(yaml.safe_dump(RIG))  # in axes of the project, whatever was said of the files
    measured_spectrum(spectrum, tmp_path / "bare.yaml")


@pytest.mark.parametrize("label", [0, 0.0])
def test_node_labels_that_count_from_zero(tmp_path, label):
    """Also as real numbers, as MATLAB writes coordinates."""
    path, true = foreign_file(tmp_path / "a", label=label)
    found = read_measurement(path, rig_file(tmp_path, node_of_label={0: 1}))
    assert found.spectrum.sensors == (1,) and found.spectrum.amplitude[0, :, 0] == pytest.approx(true, abs=1e-11)
    refused(lambda: read_measurement(path, rig_file(tmp_path)), "unknown node '0'")
    other = rig_file(tmp_path, node_of_label={7: 1})
    refused(lambda: read_measurement(path, other), match=r"node label '0'.*node_of_label")


def test_phases_of_a_table_as_lags(tmp_path):
    """A table of lags is that of leads with the sign of all phases changed, but for the direction of the mean."""
    rows = [(0, 1.0, 0.5), (1, 4.0, 0.7), (-1, 2.0, -1.1)]
    found = {}
    for phase, sign in (("lead", 1), ("lag", -1)):
        lines = [f"100.0,1,{n},{size}e-6,{(sign if n else 1) * angle}" for n, size, angle in rows]
        table = tmp_path / f"{phase}.csv"
        table.write_text("\n".join(["speed_rad_per_s,node,harmonic,amplitude_m,phase_rad", *lines]))
        found[phase] = read_measurement(table, rig_file(tmp_path, table_phase=phase)).spectrum
    assert found["lag"].amplitude == pytest.approx(found["lead"].amplitude, rel=1e-12)
    assert found["lead"].amplitude[0, 1, 0] == pytest.approx(4e-6 * np.exp(0.7j), rel=1e-12)


def test_the_node_of_a_table_is_stated_once(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("speed_Hz,node,harmonic,amplitude_m,phase_rad\n9,1,1,4e-6,0\n9,1,-1,4e-7,0\n9,1,0,0,0")
    for node in (1, None):
        read_measurement(table, rig_file(tmp_path, table_node=node))
    other = rig_file(tmp_path, table_node=2)
    refused(lambda: read_measurement(table, other), match=r"column 'node'.*'table_node: 2'")


@pytest.mark.parametrize(("named", "told"), [("foriegn.nc", True), ("foreign.nc", False), ("another_run.csv", False)])
def test_a_misspelt_file_of_a_stated_speed_is_named(named, told, tmp_path):
    """But not one that is spelt right, nor one of another record, which is not given now."""
    path, _ = foreign_file(tmp_path / "a")
    found = read_measurement(path, rig_file(tmp_path, speeds_rpm={named: 955.0})).findings
    said = [one.text for one in found if one.name == "speed not used"]
    assert len(said) == told and all("'foriegn.nc'" in text and "speeds_rpm" in text for text in said)
