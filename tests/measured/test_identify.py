"""`rotorstudy identify` on records and on their imported spectrum: the same estimates, those of the machine."""

import numpy as np
import pytest
import yaml
from machine import records, write, write_rig
from one_line_errors import run

from rotorstudy import measured_spectrum, registry
from rotorstudy.store import load

UNKNOWNS = ["internal_damping", "stiffness_loss_22", "eccentricity[1]"]


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Folder with the records of one machine, their spectrum, and its rig file."""
    folder = tmp_path_factory.mktemp("machine")
    for record in records():
        write("csv", folder, record)
    write_rig(folder / "rig.yaml")
    run("import", *sorted(folder.glob("*.csv")), "--rig", folder / "rig.yaml", "--out", folder / "spectrum.nc")
    return folder


def estimates(machine, files):
    """Estimate and standard deviation (parameter,) that the command writes."""
    out = machine / "estimates.nc"
    out.unlink(missing_ok=True)
    run("identify", *files, "--rig", machine / "rig.yaml", "--unknowns", *UNKNOWNS, "--out", out)
    found = load(out)
    return found.estimate.values, found.standard_deviation.values


def test_the_estimates_are_those_of_the_machine_from_records_and_from_an_imported_spectrum(machine):
    true = np.array([10.0, 5000.0, 2.5e-5, 0.785398])  # examples/chapter_6_rotor.yaml
    found, std = estimates(machine, sorted(machine.glob("*.csv")))
    assert np.all(np.abs(found - true) < 5 * std)
    again, same_std = estimates(machine, [machine / "spectrum.nc"])
    assert again == pytest.approx(found, rel=1e-9) and same_std == pytest.approx(std, rel=1e-9)


@pytest.mark.parametrize("sensors", [[99], [True], [2, 2], "abc", []])
def test_impossible_sensors_are_refused_beside_an_imported_spectrum_too(machine, tmp_path, command, sensors):
    rig = yaml.safe_load((machine / "rig.yaml").read_text(encoding="utf-8"))
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump({**rig, "sensors": sensors}), encoding="utf-8")
    said = command("identify", machine / "spectrum.nc", "--rig", tmp_path / "rig.yaml", status=1).err
    assert "error: sensors" in said


def test_a_spectrum_method_needs_records_and_a_spectrum_is_given_alone(machine, command):
    spectrum, given = machine / "spectrum.nc", ["--rig", machine / "rig.yaml", "--unknowns", "external_damping"]
    said = command("identify", spectrum, *given, "--spectrum", "sine_fit", status=1).err
    assert "spectrum 'sine_fit' needs records in time" in said
    assert "give it alone" in command("identify", spectrum, machine / "run_60.csv", *given, status=1).err


@pytest.mark.parametrize("name", ["regression", "order_tracking", "sine_fit"])
def test_a_spectrum_method_sees_the_phase_of_the_marks(machine, name):
    """Clean records carry their phase to any method: harmonics are those of the default, within stated errors."""
    files = sorted(machine.glob("run_*.csv"))
    imported, _, _ = measured_spectrum(files, machine / "rig.yaml")
    found, _, _ = measured_spectrum(files, machine / "rig.yaml", registry().get("spectrum", name))
    std = np.sqrt(found.variance)
    assert np.all(np.abs(found.amplitude - imported.amplitude) < 5 * std)
    assert np.median(std / np.abs(imported.amplitude).max()) < 0.01
