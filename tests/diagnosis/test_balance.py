"""Correction masses against closed forms: a rotor of one mass, and two planes of a rotor with two discs."""

import json
import re
from itertools import product

import numpy as np
import pandas as pd
import pytest
import yaml
from machines import faulty, readings, spectrum_of, unbalance
from one_line_errors import refused
from scipy.stats import norm, rayleigh
from test_runs import RIG, machine, write_runs
from test_runs import SPEEDS as RUN_SPEEDS

from rotorstudy import build_model, measured_response
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.runs.balance import _noise, balance, balance_files
from rotorstudy.diagnosis.runs.balance_holes import _choices, chosen, equal_holes
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.store import load

MASS, STIFFNESS, ECCENTRICITY, NOISE = 2.0, 7.6e5, 5e-6 * np.exp(0.7j), 1e-11
SPEEDS, HARMONICS = np.array([200.0, 300.0]), np.array([1, -1])
EXACT = {"model_error": 0.0, "model_floor": 0.0, "covariance_error": 0.0, "nuisance": {}}


RUNOUT = 8e-6 * np.exp(-1.1j)


def jeffcott(uncertainty=0.0, read=0.0, stated=0.0, speeds=SPEEDS):
    """A rotor of one mass with an uncertain support; read, stated : runout in readings and rig, m;  speeds : rad/s."""
    support = {"kind": "support_stiffness", "support_stiffness_N_per_m": 1e4}
    rotor = {"kind": "jeffcott", "mass_kg": MASS, "stiffness_N_per_m": STIFFNESS - 1e4}
    runout = {"kind": "runout", "runout_1X_m": abs(stated), "runout_1X_phase_rad": np.angle(stated)}
    model = build_model({"rotor": rotor, "effects": [support, runout]})
    shown = np.zeros((len(speeds), 2, 1), complex)
    shown[:, 0, 0] = ECCENTRICITY * MASS * speeds**2 / (STIFFNESS - MASS * speeds**2) + read
    spectrum = readings(shown, speeds, HARMONICS, model.sensors, NOISE / np.sqrt(2))
    known = {"default": uncertainty, "rotor": 0.0, "runout_1X": uncertainty if stated else 0.0}
    settings = Settings(**EXACT, uncertainty=known)
    return balance(spectrum, model, [1], settings, Conventions()), shown


def test_a_rotor_of_one_mass_is_corrected_opposite_its_unbalance():
    found, shown = jeffcott()
    assert found.corrections @ [1, 1j] == pytest.approx(-MASS * ECCENTRICITY, rel=1e-9)
    gain = SPEEDS**2 / (STIFFNESS - MASS * SPEEDS**2)
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(NOISE / np.sqrt(2) / np.linalg.norm(gain), rel=1e-9)
    assert found.before == pytest.approx(np.abs(shown).sum(axis=1), rel=1e-12)
    assert found.after.max() < 5 * NOISE


def test_a_runout_that_the_rig_states_is_not_balanced():
    """Negative control: one that it does not state is."""
    found, _ = jeffcott(read=RUNOUT, stated=RUNOUT)
    assert found.corrections @ [1, 1j] == pytest.approx(-MASS * ECCENTRICITY, rel=1e-9)
    _, vibration = jeffcott()
    assert found.before == pytest.approx(np.abs(vibration).sum(axis=1), rel=1e-12)
    other, _ = jeffcott(read=RUNOUT)
    assert abs(other.corrections @ [1, 1j] + MASS * ECCENTRICITY)[0] > 0.5 * MASS * abs(ECCENTRICITY)


def test_an_uncertain_runout_leaves_vibration_within_the_stated_interval():
    """At one speed it looks like an unbalance: both directions are left. Negative control: several speeds tell."""
    found, _ = jeffcott(uncertainty=0.1, read=RUNOUT, stated=RUNOUT, speeds=SPEEDS[:1])
    assert found.after[:, 0, 0] == pytest.approx(rayleigh.ppf([0.025, 0.5, 0.975]) * 0.1 * abs(RUNOUT), rel=0.15)
    several, _ = jeffcott(uncertainty=0.1, read=RUNOUT, stated=RUNOUT, speeds=np.array([200.0, 300.0, 450.0, 550.0]))
    assert several.after[1].max() < 0.05 * found.after[1].min()


@pytest.mark.parametrize("speed", SPEEDS)
def test_an_uncertain_stiffness_leaves_vibration_within_the_stated_interval(speed):
    """Of the influence m w^2 / (k - m w^2), -1 / (k - m w^2) per N/m. Negative control: two speeds show it."""
    found, shown = jeffcott(uncertainty=0.5, speeds=np.array([speed]))
    left = abs(shown[0, 0, 0]) * 5e3 / (STIFFNESS - MASS * speed**2)
    assert found.after[2, 0, 0] == pytest.approx(norm.ppf(0.9875) * left, rel=0.1)  # the error of 2000 draws is 0.03
    both, _ = jeffcott(uncertainty=0.5)
    assert both.after[1].max() < 0.2 * left


def by_baseline(folder, *planes, holes=None, rig=None):
    """The Balancing by the baseline, by another rig than the updated one if it is given."""
    return balance_files([folder / "baseline.csv"], rig or folder / "updated.yaml", planes, holes)[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A rig updated by a baseline and a trial run, whose unbalances remain unknown to it, and the baseline."""
    path = write_runs(tmp_path_factory.mktemp("balance"), "baseline", "trial")
    options = ["--rig", str(path / "rig.yaml"), "--rig-out", str(path / "updated.yaml")]
    assert main(["identify", "--runs", str(path / "runs.yaml"), *options]) == 0
    return path


def balanced(corrections, nodes):
    """Semi-major axes (speed, sensor) of the true machine with corrections added."""
    sizes = zip(nodes, corrections @ [1, 1j], strict=True)
    model = faulty(machine((0.0, 0)), *(unbalance(n, 1e3 * abs(u), np.angle(u), mass_kg=1e-3) for n, u in sizes))
    return np.abs(measured_response(model, RUN_SPEEDS, [1, -1])).sum(axis=1)


def test_two_planes_of_an_updated_rig_are_balanced_as_predicted(folder):
    found = by_baseline(folder, "disc 1", 7)
    true = -1e-5 * np.array([2 * np.exp(1j), np.exp(-2j)])
    off = found.corrections.ravel() - np.column_stack([true.real, true.imag]).ravel()
    assert off @ np.linalg.solve(found.covariance, off) < 18.5  # chi-square of four, p = 0.001
    left = balanced(found.corrections, [3, 7])
    assert np.all(left < 1.5 * found.after[2]) and left.max() < 0.05 * found.before.max()
    one = by_baseline(folder, "disc 1")
    assert one.after[1].max() > 5 * found.after[2].max()  # negative control: one plane does not suffice
    assert np.all(np.abs(balanced(one.corrections, [3]) - one.after[1]) < 0.5 * (one.after[2] - one.after[0]) + 5e-8)


def test_the_command_prints_masses_and_the_vibration_left(folder, capsys, command):
    arguments = ["balance", str(folder / "baseline.csv"), "--rig", str(folder / "updated.yaml"), "--planes"]
    text = command(*arguments, "disc 1", "7").out
    assert "plane disc 1: " in text and "g mm at 237" in text and "763.9 rpm (80 rad/s), node 2: " in text
    found = by_baseline(folder, "disc 1", 7)
    (said,) = re.findall(r"µm pp: before.*\n  763.9 rpm \(80 rad/s\), node 2: ([\d.]+),", text)
    assert float(said) == pytest.approx(2e6 * found.before[0, 0], rel=0.05)  # two digits of twice the semi-major axis
    assert main([*arguments, "3", "disc 1"]) == 1  # twice the same plane
    assert "trade off" in capsys.readouterr().err
    assert main([*arguments, "7", "--out", str(folder / "found.json")]) == 1 and "NetCDF" in capsys.readouterr().err


def test_angles_are_said_to_be_counted_against_the_rotation(folder, tmp_path, command):
    """Of a mirrored view of the same records, with the phase mark of an unknown error; the masses are the same."""
    rig = yaml.safe_load((folder / "updated.yaml").read_text())
    rig["diagnosis"]["nuisance"] = {"phase_reference": 0.005}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    rig["measurement"] |= {"rotation": "against_angles"}
    (tmp_path / "mirrored.yaml").write_text(yaml.safe_dump(rig))
    table = pd.read_csv(folder / "baseline.csv")
    table[["harmonic", "phase_rad"]] *= -1
    table.to_csv(tmp_path / "mirrored.csv", index=False)
    straight = command("balance", folder / "baseline.csv", "--rig", tmp_path / "rig.yaml", "--planes", "7").out
    mirrored = command("balance", tmp_path / "mirrored.csv", "--rig", tmp_path / "mirrored.yaml", "--planes", "7").out
    assert "line in the sense of rotation" in straight and "line against the sense of rotation" in mirrored
    angles = [float(re.search(r"at ([\d.]+)", text)[1]) for text in (straight, mirrored)]
    assert sum(angles) == pytest.approx(360, abs=0.1) and abs(angles[0] - angles[1]) > 10


def test_a_plane_may_be_named_by_the_label_of_its_disc(folder, tmp_path):
    rig = yaml.safe_load((folder / "updated.yaml").read_text())
    rig["rotor"]["discs"][0]["label"] = "wheel"
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    planes = "wheel", rig["rotor"]["discs"][0]["node"]
    by_label, by_node = (by_baseline(folder, one, rig=tmp_path / "rig.yaml") for one in planes)
    assert np.array_equal(by_label.corrections, by_node.corrections)


def test_records_without_1x_cannot_be_balanced():
    model = build_model(RIG)
    spectrum = readings(np.zeros((1, 1, 2), complex), RUN_SPEEDS[:1], [2], (2, 8), 1.0)
    refused(lambda: balance(spectrum, model, [3], Settings(), Conventions()), "no harmonic 1")


def test_holes_and_weights_leave_least_of_all_that_they_allow(folder):
    """Against the vibration of every choice of one hole a plane, with weights so that a second hole is of no use."""
    holes = equal_holes(6, [12.0, 21.0])
    found, best = (by_baseline(folder, "disc 1", 7, holes=some) for some in (holes, None))
    normal = np.linalg.inv(best.covariance)  # in proportion, as far as the parameters are known

    def left(totals):
        off = np.ravel(totals) - best.corrections.ravel()
        return off @ normal @ off

    for choice, total in zip(found.choices, found.corrections, strict=True):
        assert 0 < len(choice.placed) <= 2
        parts = [size * np.exp(1j * holes.angles[hole]) for hole, size in choice.placed]
        assert total @ [1, 1j] == pytest.approx(sum(parts), rel=1e-9)
    assert left(found.corrections) > 0
    assert np.all(best.after[1].max() <= found.after[1].max()) and found.after[1].max() < found.before.max()


def test_the_choice_of_holes_is_the_best_of_all():
    """Three holes, two weights, two strongly coupled planes: against every combination."""
    rng, holes = np.random.default_rng(1), equal_holes(3, [1.0, 2.5])
    root = rng.normal(size=(4, 4))
    normal, best = root @ root.T + 1e-3 * np.eye(4), 2e-6 * rng.normal(size=4)
    pairs = list(product(_choices(holes), repeat=2))
    off = [np.concatenate([a.total, b.total]) - best for a, b in pairs]
    least = pairs[np.argmin([one @ normal @ one for one in off])]
    assert [choice.placed for choice in chosen(holes, best, normal)] == [choice.placed for choice in least]


def test_a_weight_is_preferred_to_two_of_the_same_sum():
    """Of six holes, one weight is as good as two beside it; the search went round between them without an end."""
    rng = np.random.default_rng(420)
    root, best = rng.normal(size=(6, 6)), 1e-5 * rng.normal(size=6)
    found = chosen(equal_holes(6, [10.0]), best, root @ root.T + 1e-6 * np.eye(6))
    assert [len(choice.placed) for choice in found] == [1, 1, 1]


def test_the_command_takes_holes_and_writes_a_file(folder, command):
    arguments = ["balance", str(folder / "baseline.csv"), "--rig", str(folder / "updated.yaml"), "--planes", "disc 1"]
    out = folder / "balance.nc"
    assert "0 g mm at" in command(*arguments, "--holes", "8", "--weights", "10", "20", "--out", out).out
    data = load(out)
    assert data.correction.dims == ("plane", "part")
    assert data.after.dims == data.next_reading.dims == ("percentile", "speed", "node")
    said = json.loads(command(*arguments, "--holes", "8", "--weights", "10", "20", "--json").out)
    parts = [one["unbalance_kg_m"] * np.exp(1j * one["angle_rad"]) for one in said["in_holes"][0]]
    assert sum(parts) == pytest.approx(complex(*said["correction_kg_m"][0]))
    assert all(one["angle_rad"] == pytest.approx((one["hole"] - 1) * np.pi / 4) for one in said["in_holes"][0])
    assert np.shape(said["next_reading_m"]) == (3, len(said["speeds_rad_s"]), len(said["nodes"]))
    assert said["speeds_rad_s"] == pytest.approx(RUN_SPEEDS) and said["percentiles"] == [2.5, 50.0, 97.5]
    assert "belong together" in command(*arguments, "--holes", "8", status=1).err
    assert "at most" in command(*arguments, "--holes", "100", "--weights", "1", "2", status=1).err


def test_noise_of_single_probes_is_as_large_as_stated():
    """Along a probe the covariance has half the rank of that of an orbit."""
    model = machine((0.0, 0))
    spectrum = spectrum_of(model, RUN_SPEEDS, np.array([1, -1]), 1e-6, 1)
    single = spectrum.along([0.5] * len(spectrum.sensors))
    for one in (spectrum, single):
        drawn = one.whitened(_noise(one, np.random.default_rng(1)))
        assert np.std(drawn) == pytest.approx(1, abs=0.1)
