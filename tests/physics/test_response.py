"""The harmonic response against closed forms and an exact solution of the switching rotor."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from collocation import four_coordinates
from machines import HARMONICS, jeffcott

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


def harmonics_of(signal, count):
    """Harmonics 0..count and -count..-1 of one whole turn, (time, dof) -> {n: (dof,)}."""
    spectrum = np.fft.fft(signal, axis=0) / len(signal)
    return {n: spectrum[n] for n in range(-count, count + 1)}


@pytest.mark.parametrize("w", [88.0, 308.0])
def test_weight_dominant_rotor_has_the_closed_form(w):
    found = harmonic_response(jeffcott(), [w], HARMONICS)[0, :, 0]
    assert found == pytest.approx([closed_form(w, n) for n in HARMONICS], rel=1e-12)  # round-off


def exact_switching(w, samples=4096):
    """Periodic motion of the switching rotor without a series: two half-turns of constant coefficients in turning axes.

    State (xi, eta, xi', eta', cos wt, sin wt) of m zeta'' = ... for zeta = z e^{-jwt}; the weight turns backwards.
    """
    from scipy.linalg import expm

    def system(stiffness_xi):
        a = np.zeros((7, 7))
        a[0, 2] = a[1, 3] = 1.0
        c = C_E + C_H
        a[2, :4] = [w**2 - stiffness_xi / M, C_E * w / M, -c / M, 2 * w]
        a[3, :4] = [-C_E * w / M, w**2 - K / M, -2 * w, -c / M]
        a[2, 4], a[3, 5] = G, -G  # weight along x
        a[2, 6], a[3, 6] = E.real * w**2, E.imag * w**2
        a[4, 5], a[5, 4] = -w, w
        return a

    step = 2 * np.pi / w / samples
    opened, closed = expm(system(K - DK) * step), expm(system(K) * step)
    # open while cos(wt) > 0: a quarter revolution to either side
    quarter = samples // 4
    order = [opened] * quarter + [closed] * (2 * quarter) + [opened] * quarter
    turn = np.eye(7)
    for matrix in order:
        turn = matrix @ turn
    rest = np.array([1.0, 0.0, 1.0])  # cos, sin, one at t = 0
    start = np.linalg.solve(np.eye(4) - turn[:4, :4], turn[:4, 4:] @ rest)
    state, zeta = np.concatenate([start, rest]), []
    for matrix in order:
        zeta.append(state[0] + 1j * state[1])
        state = matrix @ state
    time = np.arange(samples) * step
    return np.array(zeta) * np.exp(1j * w * time) - M * G / K


def test_full_crack_converges_to_the_exact_switching_rotor_as_the_series_grows():
    w = 88.0
    exact = harmonics_of(exact_switching(w)[:, None], 7)
    errors = []
    for order in (7, 15, 31, 63):
        model = jeffcott(weight_dominance=False, order=order)
        found = harmonic_response(model, [w], HARMONICS, order=order + 8)[0, :, 0]
        errors.append(max(abs(found[i] - exact[n][0]) for i, n in enumerate(HARMONICS)) / abs(exact[1][0]))
    assert all(later < earlier for earlier, later in pairwise(errors))
    assert errors[-1] < 2e-4  # series left out beyond 63: of order 1/63^2


def test_internal_damping_is_silent_at_forward_1X_and_pushes_sideways_at_rest():
    strong, weak = (harmonic_response(jeffcott(), [88.0], [0, 1], theta)[0, :, 0] for theta in two_dampings())
    assert strong[1] == pytest.approx(weak[1], rel=1e-12)
    assert strong[0].imag == pytest.approx(10 * weak[0].imag, rel=1e-2)  # c_H w / k is 2 %


def two_dampings():
    model = jeffcott()
    theta = np.array([model.theta, model.theta])
    theta[0, model.names.index("internal_damping")] = 200.0
    return theta


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
