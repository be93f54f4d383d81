"""What is odd about records that can be used is a named finding of the verdict."""

import json

import numpy as np
import pytest
import yaml
from machines import SLOW, all_but, jeffcott_rig, point, readings
from one_line_errors import RIG

from rotorstudy import build_model, measured_response
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.verdict.findings import CONTRADICTED
from rotorstudy.diagnosis.verdict.investigate import investigate

pytestmark = pytest.mark.usefixtures("unrendered", "unhidden")


def test_warnings_go_into_the_verdict(spectrum, tmp_path, command):
    """A record with few revolutions is used, and the verdict says so."""
    _, rig = spectrum
    rig.write_text(yaml.safe_dump(RIG | ONE_CAUSE))
    short = ["simulate", str(rig), "--speeds", "100", "200", "--noise", "1", "--rate", "2000", "--duration", "0.2"]
    command(*short, "--out", tmp_path / "short.nc")
    assert "few revolutions" in command("diagnose", tmp_path / "short.nc", "--rig", rig, "--out", tmp_path / "out").err
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert verdict["summary"].endswith("Check the records first: few revolutions.")
    assert "few revolutions" in {finding["name"] for finding in verdict["findings"]}
    assert "few revolutions" in (tmp_path / "out" / "index.html").read_text()


QUICK = {"diagnosis": {"leave_out": SLOW, "candidates_per_round": 4}}
ONE_CAUSE = {"diagnosis": {"leave_out": SLOW, "candidates_per_round": 2, "most_causes": 1}}
OTHER = jeffcott_rig(6e-5, -2.0, external=400.0, rotor=point(8.0, 2e5), measurement=RIG["measurement"])


def verdict_on(rig, truth, tmp_path, command, settings=QUICK):
    """The verdict on records simulated with `truth`."""
    (tmp_path / "truth.yaml").write_text(yaml.safe_dump(truth))
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig | settings))
    simulated = ["simulate", str(tmp_path / "truth.yaml"), "--speeds", "100", "200", "300", "--noise", "1"]
    assert main([*simulated, "--rate", "2000", "--out", str(tmp_path / "records.nc")]) == 0
    out = tmp_path / "verdict"
    command("diagnose", tmp_path / "records.nc", "--rig", tmp_path / "rig.yaml", "--out", out)
    return json.loads((out / "verdict.json").read_text())


def test_records_of_another_machine_are_told(tmp_path, command):
    verdict = verdict_on(RIG, OTHER, tmp_path, command, settings={"diagnosis": {"most_causes": 1}})  # whole library
    assert verdict["verdict"] != "nothing"
    assert "far from the rig" in {finding["name"] for finding in verdict["findings"]}
    assert "far from the rig" in verdict["summary"]


def test_a_hidden_effect_is_not_taken_for_another_machine(tmp_path, command):
    asymmetry = {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.02, "shaft_asymmetry_phase_rad": 1.0}
    rig = {**RIG, "measurement": {"harmonics": [0, 1, -1, 2]}}  # without 2X it shows by its square alone, at 0X
    verdict = verdict_on(rig, {**rig, "effects": [*rig["effects"], asymmetry]}, tmp_path, command)
    assert verdict["findings"] == [] and verdict["verdict"] != "nothing"


def test_the_gap_of_the_probes_is_told_and_can_be_given(tmp_path, command):
    """A gap of a millimetre is what most proximity probes show; it must not silently become a preload."""
    gap = {"kind": "sensor_gap", "sensor_gap_m": 1e-3, "sensor_gap_phase_rad": 2.5}
    behind = {**RIG, "effects": [*RIG["effects"], gap]}
    silent = verdict_on(RIG, behind, tmp_path, command, settings=ONE_CAUSE)
    assert "probe gap" in {finding["name"] for finding in silent["findings"]} and "probe gap" in silent["summary"]
    named = {cause["effect"] for cause in silent["causes"]}
    assert ("sensor_gap" in silent["not_considered"]) == ("static_preload" in named)
    near = {**RIG, "effects": [*RIG["effects"], {**gap, "sensor_gap_m": 1.05e-3}]}
    given = verdict_on(near, behind, tmp_path, command)
    assert given["verdict"] == "nothing" and given["findings"] == []


@pytest.mark.parametrize("share", [4.0, 1.2])
def test_a_fault_that_the_uncertainty_of_the_rig_takes_over_is_told(tmp_path, command, share):
    """Negative control: a value that differs by less than it has."""
    unbalance = next(effect for effect in RIG["effects"] if effect["kind"] == "unbalance")
    rest = [effect for effect in RIG["effects"] if effect is not unbalance]
    truth = {**RIG, "effects": [*rest, {**unbalance, "eccentricity_m": share * unbalance["eccentricity_m"]}]}
    wide = {"diagnosis": {**ONE_CAUSE["diagnosis"], "uncertainty": {"eccentricity": 5.0}}}
    verdict = verdict_on(RIG, truth, tmp_path, command, settings=wide)
    assert verdict["verdict"] == "nothing"
    told = [finding["text"] for finding in verdict["findings"] if finding["name"] == "explained by the rig"]
    assert len(told) == (share > 2) and all("instead of" in text for text in told)


SPEEDS, HARMONICS = np.array([400.0, 550.0, 650.0, 800.0]), np.array([0, 1, -1, 2, -2])
PUSHED = jeffcott_rig(2e-5, 0.7)
CONSIDERED = "unbalance", "bow", "static_preload", "probe_gain", "phase_reference"


def verdict_with(*changes, of=PUSHED["effects"], tried=CONSIDERED):
    """The verdict on records of the rig with other effects, and whether they look like those of another machine."""
    shown = measured_response(build_model({**PUSHED, "effects": [*of, *changes]}), SPEEDS, HARMONICS)
    spectrum = readings(shown, SPEEDS, HARMONICS, (1,), 1e-3 * np.abs(shown).max(), 1)
    settings = {"most_causes": 1, "candidates_per_round": 10, "leave_out": all_but(*tried)}
    verdict = investigate(spectrum, build_model(PUSHED), settings=settings).verdict
    return verdict, "far from the rig" in {finding.name for finding in verdict.findings}


def test_an_unbalance_left_from_an_example_is_named_where_nothing_else_explains_the_records():
    """Negative control: records of the rig itself move nothing."""
    mine = {"kind": "unbalance", "eccentricity_m": 9e-5, "eccentricity_phase_rad": -2.0}
    verdict, _ = verdict_with(mine, of=PUSHED["effects"][:1], tried=["static_preload"])
    assert verdict.verdict == "unknown"
    assert "check them first: eccentricity (by" in verdict.summary
    assert "check them first" not in verdict_with(tried=["static_preload"])[0].summary


def test_a_large_fault_that_the_library_does_not_have_is_not_called_another_machine():
    """Negative control: it strains the values of the rig as much, but they do not explain it."""
    anisotropy = {"support_anisotropy_N_per_m": 2e5, "support_anisotropy_phase_rad": 1.0}
    verdict, is_told = verdict_with({"kind": "support_anisotropy", "node": 1, **anisotropy})
    assert verdict.verdict == "unknown" and not is_told, verdict.summary
    assert max(abs(row.moved_sigma) for row in verdict.base_parameters) > CONTRADICTED


def test_a_large_cause_that_brings_the_values_back_is_no_reason_to_doubt_the_records():
    verdict, is_told = verdict_with({"kind": "bow", "node": 1, "bow_m": 2e-3, "bow_phase_rad": 1.0})
    assert [cause.effect for cause in verdict.causes] == ["bow"] and not is_told
