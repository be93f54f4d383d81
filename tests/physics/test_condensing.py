"""Coordinates that nothing acts on and nobody measures are condensed: exactly, or not at all."""

import numpy as np
import pytest
from machines import disc, shaft, unbalance

from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import harmonic_response, harmonic_response_and_jacobian
from rotorstudy.response.measured import measured_response, measured_response_and_jacobian

HARMONICS = [0, 1, 2, 3, -1, -2, -3]


def cracked(**crack):
    rotor = shaft(0.6, 8, disc(3), pinned_nodes=[1, 9])
    effects = [
        {"kind": "external_damping", "node": 5, "external_damping_N_s_per_m": 50.0},
        {"kind": "internal_damping", "node": 5, "internal_damping_N_s_per_m": 10.0},
        unbalance(3, 1e-5, 0.3, mass_kg=2.0),
    ]
    cracks = [{"kind": "breathing", "node": 5, "stiffness_loss_22_N_per_m": 5e3, "stiffness_loss_44_N_m": 0.0, **crack}]
    return build_model({"rotor": rotor, "effects": effects, "cracks": cracks, "sensors": [3, 5]})


@pytest.mark.parametrize("crack", [{}, {"weight_dominance": False}])
def test_measured_response_is_the_one_of_all_coordinates(crack):
    model, speeds = cracked(**crack), np.linspace(40, 400, 5)
    assert len(model.involved) < len(model.structure.dofs) / 2
    found, change = measured_response_and_jacobian(model, speeds, HARMONICS)
    whole, whole_change = harmonic_response_and_jacobian(model, speeds, HARMONICS)
    assert np.abs(found - whole[..., model.measured]).max() < 1e-10 * np.abs(whole).max()
    scale = np.abs(whole_change).max(axis=(0, 1, 2))
    assert (np.abs(change - whole_change[..., model.measured, :]).max(axis=(0, 1, 2)) < 1e-9 * scale).all()


def test_where_the_condensed_part_resonates_on_its_own_all_coordinates_are_solved(monkeypatch):
    """At that speed the condensed matrix is infinite, the response is not."""
    from scipy.linalg import eigvals

    model = cracked()
    gone = np.setdiff1d(np.arange(len(model.structure.dofs)), model.involved)
    part = np.ix_(gone, gone)
    stiffness, mass, gyroscopic = (getattr(model.structure, name)[part] for name in ("stiffness", "mass", "gyroscopic"))
    square = eigvals(stiffness, mass - gyroscopic)  # K - w^2 (M - G) is singular there, at 1X
    speed = np.sqrt(min(w.real for w in square if w.real > 0 and abs(w.imag) < 1e-6 * abs(w)))
    whole = harmonic_response(model, [speed], [1])[..., model.measured]

    def error():
        return np.abs(measured_response(model, [speed], [1]) - whole).max() / np.abs(whole).max()

    assert error() < 1e-10
    monkeypatch.setattr("rotorstudy.response.solving.CONDENSED_AT_MOST", np.inf)
    assert error() > 1e-10
