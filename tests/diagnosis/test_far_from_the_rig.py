"""Records of another machine are told; a large fault of the machine itself is no reason to doubt the records."""

import numpy as np
from machines import all_but, jeffcott_rig, readings

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis.verdict.findings import CONTRADICTED
from rotorstudy.diagnosis.verdict.investigate import investigate

SPEEDS, HARMONICS = np.array([400.0, 550.0, 650.0, 800.0]), np.array([0, 1, -1, 2, -2])
RIG = jeffcott_rig(2e-5, 0.7)
CONSIDERED = ("unbalance", "bow", "static_preload", "probe_gain", "phase_reference")
SETTINGS = {"most_causes": 1, "candidates_per_round": 10, "leave_out": all_but(*CONSIDERED)}


def verdict_on(truth):
    shown = measured_response(build_model(truth), SPEEDS, HARMONICS)
    spectrum = readings(shown, SPEEDS, HARMONICS, (1,), 1e-3 * np.abs(shown).max(), 1)
    return investigate(spectrum, build_model(RIG), settings=SETTINGS).verdict


def test_an_unbalance_left_from_an_example_is_named_where_nothing_else_explains_the_records(monkeypatch):
    monkeypatch.setitem(SETTINGS, "leave_out", all_but("static_preload"))
    mine = {"kind": "unbalance", "eccentricity_m": 9e-5, "eccentricity_phase_rad": -2.0}
    verdict = verdict_on({**RIG, "effects": [RIG["effects"][0], mine]})
    assert verdict.verdict == "unknown"
    assert "check them first: eccentricity (by" in verdict.summary
    # negative control: records of the rig itself move nothing
    assert "check them first" not in verdict_on(RIG).summary


def is_told(verdict):
    return "far from the rig" in {finding.name for finding in verdict.findings}


def test_a_large_fault_that_the_library_does_not_have_is_not_called_another_machine():
    """Negative control: it strains the values of the rig as much, but they do not explain it."""
    anisotropy = {"support_anisotropy_N_per_m": 2e5, "support_anisotropy_phase_rad": 1.0}
    fault = {"kind": "support_anisotropy", "node": 1, **anisotropy}
    verdict = verdict_on({**RIG, "effects": [*RIG["effects"], fault]})
    assert verdict.verdict == "unknown" and not is_told(verdict), verdict.summary
    assert max(abs(row.moved_sigma) for row in verdict.base_parameters) > CONTRADICTED


def test_a_large_cause_that_brings_the_values_back_is_no_reason_to_doubt_the_records():
    bow = {"kind": "bow", "node": 1, "bow_m": 2e-3, "bow_phase_rad": 1.0}
    verdict = verdict_on({**RIG, "effects": [*RIG["effects"], bow]})
    assert [cause.effect for cause in verdict.causes] == ["bow"] and not is_told(verdict)
