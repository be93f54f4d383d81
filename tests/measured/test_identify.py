"""`rotorstudy identify` on every kind of file of one machine: the same estimates, whatever the format."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from machine import GRAVITY, MARK, SENSOR, records, section, write, write_rig

from rotorstudy import load_spectrum, registry
from rotorstudy.commands.line import main
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.records import records_dataset
from rotorstudy.store import save

UNKNOWNS = ["internal_damping", "stiffness_loss_22", "eccentricity[1]"]


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Folder with the records of one machine in every format, and its rig file."""
    folder = tmp_path_factory.mktemp("machine")
    made = records()
    for record in made:
        for kind in ("csv", "mat"):
            write(kind, folder, record)
    save(records_dataset(made).assign_attrs(rotorstudy_version="0"), folder / "records.nc")
    write_rig(folder / "rig.yaml")
    underscored = [{**probe, "channel": probe["channel"].replace(" ", "_")} for probe in section()["probes"]]
    write_rig(folder / "mat.yaml", probes=underscored)
    arguments = ["import", *map(str, sorted(folder.glob("*.csv"))), "--rig", str(folder / "rig.yaml")]
    assert main([*arguments, "--out", str(folder / "spectrum.nc")]) == 0
    return folder


def estimates(machine, files, rig="rig.yaml", unknowns=UNKNOWNS, options=()):
    """Estimate and standard deviation (parameter,) that the command writes."""
    out = machine / "estimates.nc"
    out.unlink(missing_ok=True)
    arguments = [*map(str, files), "--rig", str(machine / rig), "--unknowns", *unknowns, *options]
    assert main(["identify", *arguments, "--out", str(out)]) == 0
    with xr.open_dataset(out) as found:
        return found.estimate.values, found.standard_deviation.values


def close_to(found, expected, share):
    """Within a share of the standard deviations."""
    return np.all(np.abs(found[0] - expected[0]) < share * expected[1])


@pytest.fixture(scope="module")
def by_csv(machine):
    return estimates(machine, sorted(machine.glob("*.csv")))


def test_the_estimates_are_those_of_the_machine(by_csv):
    true = np.array([10.0, 5000.0, 2.5e-5, 0.785398])  # examples/chapter_6_rotor.yaml
    assert close_to((true, None), by_csv, 5)


def test_matlab_and_uff_give_what_csv_gives(machine, by_csv):
    """The same samples, to all their digits."""
    found = estimates(machine, sorted(machine.glob("*.mat")), "mat.yaml")
    assert found[0] == pytest.approx(by_csv[0], rel=1e-9) and found[1] == pytest.approx(by_csv[1], rel=1e-9)
    pytest.importorskip("pyuff")
    files = [write("uff", machine, record) for record in records()]
    found = estimates(machine, files)
    assert found[0] == pytest.approx(by_csv[0], rel=1e-9) and found[1] == pytest.approx(by_csv[1], rel=1e-9)


def test_an_imported_spectrum_gives_what_its_records_give(machine, by_csv):
    found = estimates(machine, [machine / "spectrum.nc"])
    assert found[0] == pytest.approx(by_csv[0], rel=1e-9) and found[1] == pytest.approx(by_csv[1], rel=1e-9)


@pytest.mark.parametrize("sensors", [[99], [True], [2, 2], "abc", []])
def test_impossible_sensors_are_refused_beside_an_imported_spectrum_too(machine, tmp_path, capsys, sensors):
    rig = yaml.safe_load((machine / "rig.yaml").read_text(encoding="utf-8"))
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump({**rig, "sensors": sensors}), encoding="utf-8")
    assert main(["identify", str(machine / "spectrum.nc"), "--rig", str(tmp_path / "rig.yaml")]) == 1
    assert "error: sensors" in capsys.readouterr().err


def test_the_projects_own_records_give_nearly_what_csv_gives(machine, by_csv):
    """The same samples, but the mark passes at another angle, so its instants are rounded otherwise."""
    found = estimates(machine, [machine / "records.nc"])
    assert close_to(found, by_csv, 0.1)
    assert found[1] == pytest.approx(by_csv[1], rel=0.02)


def test_a_table_of_harmonics_gives_what_the_spectrum_gives(machine, by_csv):
    """With all digits. Least squares does not weigh by the covariance, so its estimates are the same; those of maximum
    likelihood differ as the noise stated for the table, white, differs from the covariance of the blocks."""
    spectrum = load_spectrum(machine / "spectrum.nc")
    mark = GRAVITY - SENSOR + MARK  # as in test_formats: the table is in the user's plane
    rows = [
        {
            "speed_rad_per_s": repr(float(speed)),
            "node": node,
            "harmonic": -n,
            "amplitude_m": repr(float(abs(seen))),
            "phase_rad": repr(float(np.angle(seen))),
        }
        for i, speed in enumerate(spectrum.speed)
        for k, n in enumerate(spectrum.harmonics)
        for s, node in enumerate(spectrum.sensors)
        for seen in [np.conj(spectrum.amplitude[i, k, s] * np.exp(1j * n * mark)) * np.exp(1j * GRAVITY)]
    ]
    pd.DataFrame(rows).to_csv(machine / "table.csv", index=False)
    linear = {"unknowns": ["eccentricity[1]", "eccentricity[2]"], "options": ["--estimator", "least_squares"]}
    table, expected = (estimates(machine, [machine / name], **linear)[0] for name in ("table.csv", "spectrum.nc"))
    assert table == pytest.approx(expected, rel=1e-9)
    noise = float(np.sqrt(np.median(np.diagonal(spectrum.covariance, axis1=-2, axis2=-1))))
    write_rig(machine / "table.yaml", table_noise_m=noise)
    found = estimates(machine, [machine / "table.csv"], "table.yaml")
    (machine / "table.csv").unlink()
    assert close_to(found, by_csv, 1)
    assert found[1] == pytest.approx(by_csv[1], rel=0.5)


def test_a_wrong_convention_gives_other_estimates(machine, by_csv):
    """Negative control: gravity turned by ten degrees is seen in every format's estimates."""
    write_rig(machine / "wrong.yaml", gravity_angle_deg=190.0)
    found = estimates(machine, sorted(machine.glob("run_*.csv")), "wrong.yaml")
    assert not close_to(found, by_csv, 5)


def test_a_spectrum_method_needs_records(machine, capsys):
    arguments = ["--rig", str(machine / "rig.yaml"), "--unknowns", "external_damping", "--spectrum", "sine_fit"]
    assert main(["identify", str(machine / "spectrum.nc"), *arguments]) == 1
    assert "spectrum 'sine_fit' needs records in time" in capsys.readouterr().err
    assert main(["identify", str(machine / "spectrum.nc"), str(machine / "run_60.csv"), *arguments[:-2]]) == 1
    assert "give it alone" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["regression", "order_tracking", "sine_fit"])
def test_a_spectrum_method_sees_the_phase_of_the_marks(machine, name):
    """Clean records carry their phase to any method: harmonics are those of the default, within stated errors."""
    files = sorted(machine.glob("run_*.csv"))
    imported, _, _ = measured_spectrum(files, machine / "rig.yaml")
    found, _, _ = measured_spectrum(files, machine / "rig.yaml", registry().get("spectrum", name))
    variance = np.diagonal(found.covariance, axis1=-2, axis2=-1).reshape(*found.covariance.shape[:2], 2, -1).sum(axis=2)
    std = np.swapaxes(np.sqrt(variance), 1, 2)
    assert np.all(np.abs(found.amplitude - imported.amplitude) < 5 * std)
    assert np.median(std / np.abs(imported.amplitude).max()) < 0.01
