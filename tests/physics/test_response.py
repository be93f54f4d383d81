"""The harmonic response against closed forms, and of speeds taken in parts."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, jeffcott
from random_rotor import four_coordinates

from rotorstudy import harmonic_response, measured_response_and_jacobian
from rotorstudy.response import harmonic

M, K, C_E, C_H, DK, E, G = 2.0, 7.6e5, 100.0, 20.0, 2.5e5, 5e-6 * np.exp(1j * np.pi / 6), 9.81


def switching_series(order):
    """s_k of sigma = 1/2 + (2/pi)(cos - cos3 / 3 + ...), written down independently of the plugin."""
    series = {0: 0.5}
    for i, k in enumerate(range(1, order + 1, 2)):
        series[k] = series[-k] = (-1) ** i / (np.pi * k)
    return series


def closed_form(w, n):
    """Eqs. (2.24) to (2.26)."""
    s = switching_series(99)
    p = (s.get(n, 0) + s.get(n - 2, 0)) / 2
    force = p * DK * M * G / K + (M * E * w**2 if n == 1 else 0) + (1j * w * C_H * M * G / K if n == 0 else 0)
    return force / (K - M * (n * w) ** 2 + 1j * n * w * C_E + 1j * (n - 1) * w * C_H)


@pytest.mark.parametrize("w", [88.0, 308.0])
def test_weight_dominant_rotor_has_the_closed_form(w):
    found = harmonic_response(jeffcott(), [w], HARMONICS)[0, :, 0]
    assert found == pytest.approx([closed_form(w, n) for n in HARMONICS], rel=1e-12)  # round-off


def test_displacement_counts_from_the_static_line_of_the_uncracked_rotor():
    still = jeffcott(stiffness_loss=0.0)
    theta = still.theta * 0
    assert np.abs(harmonic_response(still, [88.0], [0], theta)).max() < 1e-20
    loose = replace(still, structure=replace(still.structure, stiffness=np.zeros((1, 1))))
    assert loose.structure.static_deflection == 0  # not supported: no static line, all counts from zero


def test_speeds_taken_in_parts_give_the_same(monkeypatch):
    machine, speeds, harmonics = four_coordinates(1), np.linspace(50.0, 150.0, 7), range(-4, 5)
    whole = measured_response_and_jacobian(machine, speeds, harmonics)
    monkeypatch.setattr(harmonic, "NUMBERS_AT_ONCE", 10.0)
    parts = measured_response_and_jacobian(machine, speeds, harmonics)
    for one, other in zip(whole, parts, strict=True):
        assert one == pytest.approx(other, rel=1e-12)
