"""Several runs of one machine, fitted together: shared parameters, known trial masses, and what is each run's own."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
import yaml
from machines import disc, faulty, rig_of, shaft, spectrum_of, springs, unbalance, write_harmonics
from one_line_errors import refused

from rotorstudy import build_model, measured_spectrum, read_rig
from rotorstudy.diagnosis.runs import contradicting
from rotorstudy.diagnosis.runs import joint as diagnosis_joint
from rotorstudy.diagnosis.runs.contradicting import _moved_far
from rotorstudy.diagnosis.runs.joint import identify_runs, shared_names, unbalance_term
from rotorstudy.diagnosis.runs.run_file import AddedUnbalance
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.joint import fit_runs
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.measurement.corrections import check_slow_roll

SPEEDS = np.array([80.0, 120.0, 150.0])
KNOWN = {"default": 0.2, "rotor": 0, "rotor.youngs_modulus_Pa": 0.1, "eccentricity": 10.0}
RIG = rig_of(
    shaft(0.56, 8, *(disc(node, 0.8, 5.8e-4, 3.3e-4) for node in (3, 7)), outer_diameter_m=0.01),
    springs({1: "left", 9: "right"}, 2e5, 50.0),
    *(unbalance(node, 0.0, label=f"disc {i}", mass_kg=1e-3) for i, node in ((1, 3), (2, 7))), sensors=[2, 8],
    measurement={"harmonics": [1, -1], "table_noise_m": 2e-8, "node_of_label": {"disc 1": 3, "2": 2, "8": 8}},
    diagnosis={"nuisance": {}, "model_error": 0.0, "model_floor": 0.0, "uncertainty": KNOWN}
)  # fmt: skip
MODULUS, STIFFNESSES = "rotor.youngs_modulus_Pa", ["bearing_stiffness[left]", "bearing_stiffness[right]"]
TRUE = {MODULUS: -0.08} | dict(zip(STIFFNESSES, (2.3e5, 1.8e5), strict=True))
UNKNOWN = [f"eccentricity[added 1]_{part} @ unknown" for part in ("real", "imag")]


def machine(trial):
    """The true machine, with residual unbalances of 20 and 10 g mm, and a trial mass (g mm, degrees) on disc 1."""
    rotor = RIG["rotor"] | {"youngs_modulus_Pa": 2.1e11 * (1 + TRUE[MODULUS])}
    bearings = springs({1: "left"}, TRUE[STIFFNESSES[0]], 50.0) + springs({9: "right"}, TRUE[STIFFNESSES[1]], 50.0)
    left = unbalance(3, 0.02, 1.0, label="disc 1", mass_kg=1e-3), unbalance(7, 0.01, -2.0, label="disc 2", mass_kg=1e-3)
    model, (size, angle) = build_model(RIG | {"rotor": rotor, "bearings": bearings, "effects": [*left]}), trial
    return faulty(model, unbalance(3, size * 1e-3, np.deg2rad(angle), mass_kg=1e-3, label="trial"))


def rig_known_to(uncertainty, **settings):
    """The rig of which some numbers are known better or worse, and further settings."""
    return RIG | {"diagnosis": RIG["diagnosis"] | {"uncertainty": KNOWN | uncertainty} | settings}


def square_off(joint, names, true):
    """Square of the distance of parameters from their true values, by their covariance: chi-square of as many."""
    theta, covariance = joint.of(names)
    return (theta - true) @ np.linalg.solve(covariance, theta - true)


def off_in_stiffness(joint):
    return square_off(joint, STIFFNESSES, [TRUE[name] for name in STIFFNESSES])


def off_in_mass(joint):
    """Of the run with an unknown mass of 25 g mm at -40 degrees."""
    return square_off(joint, UNKNOWN, 0.025 * np.array([np.cos(np.deg2rad(-40)), np.sin(np.deg2rad(-40))]))


LIKELY = 13.8  # chi-square of two, p = 0.001


def write_table(path, model, seed):
    write_harmonics(path, spectrum_of(model, SPEEDS, [1, -1], 2e-8, seed))


RUNS = {  # trial mass, and what is stated of it
    "baseline": ((0.0, 0), {}),
    "trial": ((60.0, 90), {"unbalances": [{"node": "disc 1", "unbalance_g_mm": 60.0, "angle_deg": 90.0}]}),
    "unknown": ((25.0, -40), {"unbalances": [{"node": "disc 1"}]}),
}


def write_runs(path, *names):
    """Write the rig, the records of some of RUNS, and their list, into a folder."""
    (path / "rig.yaml").write_text(yaml.safe_dump(RIG))
    for seed, name in enumerate(names):
        write_table(path / f"{name}.csv", machine(RUNS[name][0]), seed)
    runs = [{"name": name, "records": [f"{name}.csv"], **RUNS[name][1]} for name in names]
    (path / "runs.yaml").write_text(yaml.safe_dump({"runs": runs}))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Rig, records of a baseline, a trial run and a run with an unknown mass, and the list of these runs."""
    return write_runs(tmp_path_factory.mktemp("runs"), *RUNS)


def first_runs(folder, count=2):
    return yaml.safe_load((folder / "runs.yaml").read_text())["runs"][:count]


def identified(folder, name, runs=None, rig=None):
    """What is found of other runs than those of the folder, or by another rig; name : of their files."""
    paths = [folder / "runs.yaml", folder / "rig.yaml"]
    for i, given in enumerate((runs and {"runs": runs}, rig)):
        if given:
            paths[i] = folder / f"{name}_{i}.yaml"
            paths[i].write_text(yaml.safe_dump(given))
    return identify_runs(*paths)


@pytest.fixture(scope="module")
def found(folder):
    """The three runs, fitted together."""
    return identify_runs(folder / "runs.yaml", folder / "rig.yaml")


def test_a_trial_mass_gives_the_machine_and_the_unknown_mass_of_another_run(found):
    found = found.joint
    assert off_in_mass(found) < LIKELY and off_in_stiffness(found) < LIKELY
    theta, _ = found.of(UNKNOWN)
    assert abs(theta @ [1, 1j] - 0.025 * np.exp(1j * np.deg2rad(-40))) < 5e-4  # half a g mm
    for cost, rows in found.misfits.values():
        assert cost < rows + 4 * np.sqrt(2 * rows)


def test_without_the_trial_mass_the_size_is_not_known(folder, found):
    """The negative control: residual unbalance and stiffness trade off unless something known is added."""
    baseline, _, unknown = first_runs(folder, 3)
    without = identified(folder, "two", [baseline, unknown])
    narrow, wide = (one.joint.posterior.by_name[UNKNOWN[0]][1] for one in (found, without))
    assert wide > 1.5 * narrow


def test_one_run_is_the_fit_of_its_spectrum(folder):
    rig = rig_known_to({MODULUS: 0}, model_error=0.1)  # that of the modulus, so that none is added
    found = identified(folder, "one", first_runs(folder, 1), rig).joint
    settings, held = read_settings(rig, "held"), read_rig(folder / "one_1.yaml")
    spectrum, model, _ = measured_spectrum([folder / "baseline.csv"], held)
    whole, prior = base_model(model, settings)
    alone = fit(whole, with_model_error(spectrum, settings), prior)
    np.testing.assert_allclose(found.posterior.free, alone.free, rtol=1e-12)
    assert found.posterior.evidence == pytest.approx(alone.evidence, rel=1e-12)


@pytest.mark.parametrize("suffix", [".nc", ".json"])
def test_the_command_writes_its_result(folder, found, suffix, monkeypatch, command):
    monkeypatch.setattr("rotorstudy.diagnosis.runs.joint.identify_runs", lambda *_: found)
    out = folder / f"identified{suffix}"
    arguments = ["identify", "--runs", str(folder / "runs.yaml"), "--rig", str(folder / "rig.yaml")]
    said = json.loads(command(*arguments, "--out", out, "--json").out)
    rows = {row["name"]: row for row in said["estimates"]}
    read = xr.load_dataset(out) if suffix == ".nc" else xr.Dataset.from_dict(json.loads(out.read_text()))
    for name in [*shared_names(found.joint), UNKNOWN[0]]:
        one = read.sel(parameter=name)
        value, std = found.joint.posterior.by_name[name]
        assert float(one.estimate) == pytest.approx(value, rel=1e-12) and rows[name]["unit"] == str(one.unit.item())
        assert rows[name]["interval_95"] == pytest.approx([value - 1.96 * std, value + 1.96 * std], rel=1e-4)
        assert float(one.covariance.sel(other=name)) == pytest.approx(std**2, rel=1e-12)
        assert str(one.own_of_run.item()) == ("unknown" if "@" in name else "")
    assert read.misfit.sizes == {"run": 3} and read.attrs["rotorstudy_version"]


def test_the_updated_rig_carries_the_covariance(folder, found, command, monkeypatch):
    """And the command prints unbalances in g mm at an angle."""
    monkeypatch.setattr("rotorstudy.diagnosis.runs.joint.identify_runs", lambda *_: found)
    arguments = ["identify", "--runs", str(folder / "runs.yaml"), "--rig", str(folder / "rig.yaml")]
    said = command(*arguments, "--rig-out", folder / "updated.yaml").out
    assert "run 'trial'" in said and "eccentricity" not in said
    (line,) = [one for one in said.splitlines() if "added 1" in one]  # 25 g mm at -40 degrees
    size, angle = float(line.split("unknown")[1].split()[0]), float(line.split(" at ")[1].split()[0])
    assert abs(size - 25) < 0.5 and abs(angle - 320) < 1
    found = found.joint
    updated = read_rig(folder / "updated.yaml")
    _, prior = base_model(updated.model, read_settings(updated.given, "updated"))
    names = [name for name in shared_names(found) if not name.startswith("rotor")]
    theta, covariance = found.of(names)
    np.testing.assert_allclose(prior.part(names).mean, theta, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(prior.part(names).covariance, covariance, rtol=1e-5, atol=1e-12)


def test_a_parameter_of_its_own_differs_between_runs(folder):
    found = identified(folder, "own", [one | {"own": ["bearing_damping"]} for one in first_runs(folder)])
    assert "bearing_damping[left]" not in shared_names(found.joint)
    assert "bearing_damping[left] @ trial" in found.joint.prior.names
    assert found.rig["bearings"][0]["bearing_damping_N_s_per_m"] == 50.0  # the next run has its own again


def findings_of(*given):
    return identified(*given).findings


@pytest.mark.usefixtures("begun_once")
@pytest.mark.parametrize("scale", [{}, {"std_g_mm": 0.5}])
def test_a_mass_on_the_wrong_side_of_the_disc_is_told(folder, found, scale):
    """With what the records show instead; as it was, nothing is told. A mass that was weighed may be wrong too."""
    assert not {"known mass contradicted", "not explained"} & {one.name for one in found.findings}
    runs = first_runs(folder)
    runs[1]["unbalances"][0] |= {"angle_deg": 270.0} | scale
    (told,) = [one for one in findings_of(folder, "contradicting", runs) if one.name == "known mass contradicted"]
    assert told.where == "run 'trial'" and "60 g mm at 270 ° is stated" in told.text
    shown = told.text.split("show ")[1]
    assert abs(float(shown.split()[0]) - 60) < 2 and abs(float(shown.split(" at ")[1].split()[0]) - 90) < 2


def test_parameters_that_run_away_are_fitted_again_and_named(folder, found, monkeypatch):
    """A trial mass stated in the wrong unit, and an unbalance that is said to be known."""
    rig = rig_known_to({"eccentricity": 0.1})
    runs = first_runs(folder)
    runs[1]["unbalances"][0]["unbalance_g_mm"] = 6e4
    assert _moved_far(found.joint) == []  # negative control
    found = identified(folder, "wrong_unit", runs, rig)
    for least in ("DOUBTFUL", "IMPLAUSIBLE", "DRAWS"):  # negative control: the fit that runs away
        monkeypatch.setattr(f"rotorstudy.inference.fit.{least}", 0)
    direct = identified(folder, "wrong_unit", runs, rig)
    gentle, rough = (one.joint.posterior.misfit + one.joint.posterior.penalty for one in (found, direct))
    assert gentle < 0.99 * rough
    (told,) = _moved_far(found.joint)
    assert told.name == "far from the rig" and "eccentricity[disc" in told.text


@pytest.mark.usefixtures("begun_once")
def test_a_rig_with_a_larger_error_than_stated_says_so_and_widens_the_intervals(folder, found, monkeypatch):
    """The modulus is 8 % too high and held. Negative controls: the rig without that error, and no larger one."""
    rig = rig_known_to({"default": 0.02, MODULUS: 0})
    result = identified(folder, "stiff", rig=rig)
    assert {"not explained", "larger model error"} <= {one.name for one in result.findings}
    assert off_in_mass(result.joint) < 3**2
    assert "larger model error" not in {one.name for one in found.findings}
    monkeypatch.setattr(contradicting, "is_implausible", lambda *_: False)
    assert off_in_mass(identified(folder, "stiff", rig=rig).joint) > 5**2


def test_a_number_of_the_rotor_keeps_its_sign_while_it_is_fitted(folder, monkeypatch):
    """A first step that would make the modulus negative does not stop the fit."""
    steps = []

    def overshooting(runs, shared, start=None):
        found = fit_runs(runs, shared, start)
        if not steps:
            found.posterior.free[found.prior.names.index(MODULUS)] = -3.0
        steps.append(found)
        return found

    monkeypatch.setattr(diagnosis_joint, "fit_runs", overshooting)
    found = identify_runs(folder / "runs.yaml", folder / "rig.yaml")
    value, _ = found.joint.posterior.by_name[MODULUS]
    assert len(steps) > 1 and abs(value - TRUE[MODULUS]) < 0.01


def test_a_slow_roll_above_the_first_critical_speed_is_told(folder):
    """The runs are below it; with supports a thousand times softer their speeds are above."""
    runs = first_runs(folder, 1)
    runs[0]["slow_roll"] = True
    name = "slow roll above a critical speed"
    assert name not in [one.name for one in findings_of(folder, "slow", runs)]
    soft = springs({1: "left", 9: "right"}, 2e2, 5e-2)
    found = check_slow_roll(SPEEDS, build_model(RIG | {"bearings": soft}), "run 'slow'")
    assert [one.name for one in found] == [name] and "150 rad/s" in found[0].text


@pytest.mark.usefixtures("begun_once")
def test_a_run_of_another_machine_is_told(folder):
    """A support half as stiff in one of three runs; two runs alone cannot tell which of them it is."""
    softer = springs({1: "left"}, 0.5 * TRUE[STIFFNESSES[0]], 50.0) + RIG["bearings"][1:]
    pushed = [unbalance(3, 0.005, -1.0, label="disc 1", mass_kg=1e-3), *RIG["effects"][1:]]
    write_table(folder / "other.csv", build_model(RIG | {"bearings": softer, "effects": pushed}), 7)
    write_table(folder / "again.csv", machine((0.0, 0)), 8)
    runs = [{"name": name, "records": [f"{name}.csv"]} for name in ("baseline", "other", "again")]
    (told,) = [one for one in findings_of(folder, "machines", runs) if one.name == "another machine"]
    assert told.where == "run 'other'"
    assert "not explained" in [one.name for one in findings_of(folder, "two_machines", runs[:2])]


@pytest.mark.parametrize(("agree", "where"), [("ab", "run 'c'"), ("c", "run 'a', run 'b'")])
def test_runs_of_which_any_may_be_of_another_machine_are_all_named(agree, where, monkeypatch):
    """agree : the runs without which the others do not agree."""
    runs = [SimpleNamespace(name=name) for name in "abc"]
    monkeypatch.setattr(contradicting, "_refitted", lambda rest, _: rest)
    monkeypatch.setattr(contradicting, "_unexplained", lambda rest, _: not set(agree) <= {one.name for one in rest})
    found = contradicting._other_machines(SimpleNamespace(runs=runs), None, 1e-3)
    assert found.where == where and ("do not tell" in found.text) == (agree == "c")
    monkeypatch.setattr(contradicting, "_unexplained", lambda rest, _: True)
    assert contradicting._other_machines(SimpleNamespace(runs=runs), None, 1e-3) is None  # negative control


def test_a_label_of_a_node_that_no_rig_lists_is_named(folder):
    rig = yaml.safe_load((folder / "rig.yaml").read_text())
    del rig["measurement"]["node_of_label"]
    refused(lambda: identified(folder, "unlabelled", rig=rig), "unknown node label 'disc 1'")


def test_a_label_of_two_discs_is_no_place_of_an_unbalance():
    discs = [disc(node, label=label) for node, label in ((2, "wheel"), (3, "wheel"), (4, "hub"))]
    model = build_model(rig_of(shaft(1.0, 4, *discs), springs({1: "left", 5: "right"})))

    def placed(label):
        return unbalance_term(AddedUnbalance(node=label), model, Conventions(), "added", "plane")

    refused(lambda: placed("wheel"), "the label 'wheel' at nodes 2 and 3; give the number of a node")
    assert placed("hub").options["node"] == 4


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nam": "x"}, "unknown key 'nam'"),
        ({"own": ["nothing"]}, "unknown uncertain parameter 'nothing'"),
        ({"unbalances": [{"node": "disc 3"}]}, "unknown node label 'disc 3'"),
        ({"records": []}, "records"),
        ({"records": ["trial.csv"]}, "runs 'baseline' and 'trial' have the same records"),
        ({"name": "trial"}, "two runs are named 'trial'"),
        ({"unbalances": {"node": 3}}, "must be a list"),
        ({"unbalances": [{"node": 3, "unbalance_g_mm": 30.0}]}, "unbalance_g_mm without angle_deg"),
    ],
)
def test_bad_runs_are_told_in_one_line(folder, change, said):
    runs = first_runs(folder)
    runs[0] |= change
    refused(lambda: identified(folder, "bad", runs), said)


@pytest.mark.usefixtures("undrawn")
def test_a_bow_that_the_rig_does_not_state_does_not_move_the_bearings(folder, monkeypatch):
    """Nor does an unstated unbalance. Negative control: the fit without such forces."""
    item = unbalance(5, 0.02, mass_kg=1e-3, label="unstated")
    bow = {"kind": "bow", "node": 5, "bow_m": 1e-5, "bow_phase_rad": 0.5}
    for seed, (name, trial) in enumerate((("bent", (0.0, 0)), ("bent_trial", (60.0, 90)))):
        write_table(folder / f"{name}.csv", faulty(machine(trial), item, bow), seed)
    runs = first_runs(folder)
    for run, name in zip(runs, ("bent", "bent_trial"), strict=True):
        run["records"] = [f"{name}.csv"]

    found = identified(folder, "bent", runs)
    assert "unstated unbalance or bow" in [one.name for one in found.findings]
    assert off_in_stiffness(found.joint) < LIKELY
    assert not [name for name in shared_names(found.joint) if "bent shaft" in name]
    monkeypatch.setattr(contradicting, "is_implausible", lambda *_: False)
    assert off_in_stiffness(identified(folder, "bent", runs).joint) > 30
