"""Damping of the turning shaft in proportion to its stiffness: viscous and hysteretic."""

import numpy as np
import pytest
from machines import point, shaft
from one_line_errors import refused

from rotorstudy import build_model, eigenvalues, harmonic_response, make_term
from rotorstudy.model.entries import apply_entries

PLAIN, SHAFT = point(), shaft(0.6, 3)
UNBALANCE = {"kind": "unbalance", "eccentricity_m": 1e-5}
HARMONICS = np.array([0, 1, 2, 3, -1, -2])
SPEED = 200.0


def column(item, structure, amplitude):
    """(harmonic, dof) force of the unit amplitude."""
    (unknown,) = make_term("effect", item, structure, structure.nodes).unknowns
    return apply_entries(unknown.entries, amplitude[None], [SPEED], HARMONICS)[0]


def test_hysteretic_is_the_viscous_one_of_the_same_loss_at_each_harmonic():
    """beta (n - 1) w = eta sign(n - 1): equal where |n - 1| w beta = eta, silent at +1X, in step at 0X."""
    shaft = build_model({"rotor": SHAFT}).structure
    random = np.random.default_rng(2)
    amplitude = random.standard_normal((len(HARMONICS), 8)) + 1j * random.standard_normal((len(HARMONICS), 8))
    hysteretic = column({"kind": "hysteretic_damping"}, shaft, amplitude)
    viscous = column({"kind": "shaft_damping"}, shaft, amplitude)
    for n, by_loss, by_rate in zip(HARMONICS, hysteretic, viscous, strict=True):
        assert by_loss * abs(n - 1) * SPEED == pytest.approx(by_rate, rel=1e-9, abs=1e-9 * np.abs(viscous).max())
    assert np.abs(hysteretic[1]).max() == 0 and np.abs(hysteretic[2] * SPEED * 2 - viscous[2]).max() > 1.0


def test_hysteretic_damping_exists_in_frequency_only():
    model = build_model({"rotor": PLAIN, "effects": [{"kind": "hysteretic_damping", "loss_factor": 0.01}, UNBALANCE]})
    assert np.isfinite(harmonic_response(model, [150.0], HARMONICS)).all()
    refused(lambda: eigenvalues(model, [150.0]), "'loss_factor' makes the model time-varying or frequency-dependent")
