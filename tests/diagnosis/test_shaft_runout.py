"""Runout in every plane and harmonic is one cause."""

import numpy as np
import pytest
from machines import disc, readings, rig_of, shaft, springs

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis.verdict.investigate import diagnose

SPEEDS, HARMONICS, NODES = np.linspace(60.0, 380.0, 8), np.array([1, -1, 2, -2]), (1, 5)
RIG = rig_of(shaft(1.0, 4, disc(3, 20.0, 0.1, 0.05), outer_diameter_m=0.05), springs(NODES, 2e7, 2e3),
             {"kind": "unbalance", "node": 3, "unbalance_g_mm": 200.0}, sensors=[*NODES])  # fmt: skip


@pytest.mark.parametrize("planes", [2, 1])
def test_runout_of_all_planes_is_one_cause_and_that_of_one_plane_another(planes):
    model, rng = build_model(RIG), np.random.default_rng(8)
    runout = 5e-6 * (rng.normal(size=(4, 2)) + 1j * rng.normal(size=(4, 2))) * (np.arange(2) < planes)
    shown = measured_response(model, SPEEDS, HARMONICS) + runout
    data = readings(shown, SPEEDS, HARMONICS, NODES, 2e-8, rng)
    slow = ["transverse_crack", "rub", "looseness", "seal", "bow", "parallel_misalignment", "angular_misalignment"]
    verdict = diagnose(data, model, settings={"uncertainty": {"default": 0.05}, "leave_out": slow})
    assert verdict.verdict == "cause"
    assert {cause.effect for cause in verdict.causes} == {"shaft_runout" if planes == 2 else "runout"}
    if planes == 2:
        found = verdict.causes[0].parameters["runout_1X_at_node_5"]
        assert abs(found.value - abs(runout[0, 1])) < 5e-7
