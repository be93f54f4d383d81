"""Motion from rest: the exact solution of a time-invariant model against direct integration."""

import numpy as np
import pytest
from machines import OFFSET_DISC, springs
from one_line_errors import refused
from scipy.linalg import expm

from rotorstudy import build_model, time_response
from rotorstudy.response.integration import transient_response
from rotorstudy.response.stability import state_matrix

DAMPINGS = [
    {"kind": "external_damping", "external_damping_N_s_per_m": 27.0},
    {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
    {"kind": "unbalance", "eccentricity_m": 3e-5, "eccentricity_phase_rad": 0.5},
]
LOSS = {"stiffness_loss_22_N_per_m": 1.7e5, "stiffness_loss_44_N_m": 1.7e3}
CRACKED = {"rotor": OFFSET_DISC, "effects": DAMPINGS, "cracks": [{"kind": "switching", **LOSS}]}
RIGS = {"gyroscopic": CRACKED, "anisotropic": CRACKED | {"bearings": springs([1], (1e5, 3e5), (10.0, 30.0))}}


@pytest.mark.parametrize("name", RIGS)
def test_exact_motion_is_that_of_integration(name):
    model, time = build_model(RIGS[name]), np.linspace(0, 0.3, 400)
    exact, integrated = (response(model, 300.0, time) for response in (transient_response, time_response))
    assert np.abs(exact - integrated).max() < 1e-8 * np.abs(integrated).max()  # the integrator's tolerance is 1e-10


@pytest.mark.parametrize("name", RIGS)
def test_motion_from_a_start_is_that_from_rest_and_the_free_motion(name):
    model, time, generator = build_model(RIGS[name]), np.linspace(0, 0.3, 400), np.random.default_rng(3)
    start = [scale * (generator.normal(size=2) + 1j * generator.normal(size=2)) for scale in (1e-5, 1e-3)]
    state = state_matrix(model, [300.0])[0]  # of the gyroscopic rig without entries on conj(z)
    both = start if len(state) == 4 else [np.append(part, part.conj()) for part in start]
    free = (expm(time[:, None, None] * state) @ np.concatenate(both))[:, :2]
    moved = time_response(model, 300.0, time, start=start) - time_response(model, 300.0, time)
    assert np.abs(moved - free).max() < 1e-8 * np.abs(free).max()


def test_a_crack_that_moves_with_the_shaft_has_no_exact_solution():
    rig = {**CRACKED, "cracks": [{"kind": "switching", "weight_dominance": False, **LOSS}]}
    refused(lambda: transient_response(build_model(rig), 300.0, np.linspace(0, 1, 10)), "time-varying")
