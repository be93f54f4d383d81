"""Vibration of cracked rotors: closed forms, two cracks at once, any position."""

import numpy as np
import pytest
from cracked_jeffcott import CRACKS, HARMONICS, JEFFCOTT, crack, rig

from rotorstudy import build_model, harmonic_response


def test_open_crack_is_the_asymmetric_shaft():
    """In the frame that turns, 2X is a constant load: R_2 in closed form, highest at half of the mean frequency."""
    m, k, loss, share, g = 2.0, 7.6e5, 1.2e5, 0.2, 9.81
    undamped = build_model({"rotor": JEFFCOTT, "cracks": [crack("open", loss, eta_share=share)]})
    mean, half = k - loss * (1 + share) / 2, loss * (1 - share) / 2
    for w in (100.0, 200.0, 250.0, 330.0):
        found = harmonic_response(undamped, [w], [0, 2, 1])[0, :, 0] + [m * g / k, 0, 0]
        matrix = [[mean, -half], [-half, mean - m * (2 * w) ** 2]]  # on R_0 and conj-coupled R_2
        assert np.abs(found[:2] - np.linalg.solve(matrix, [m * g, 0])).max() < 1e-12 * np.abs(found).max()
    speeds = np.arange(280.0, 310.0, 0.02)
    second = np.abs(harmonic_response(rig(crack("open", loss, eta_share=share)), speeds, [2])[:, 0, 0])
    # R_2 is singular where (k_xi k_eta) = mean m (2w)^2: near half the mean frequency
    singular = np.sqrt((mean**2 - half**2) / (mean * m)) / 2
    assert speeds[second.argmax()] == pytest.approx(singular, rel=2e-3)
    assert singular == pytest.approx(np.sqrt(mean / m) / 2, rel=5e-3)


@pytest.mark.parametrize("name", CRACKS)
@pytest.mark.parametrize("dominance", [True, False])
def test_a_turned_phase_mark_turns_the_harmonics_and_nothing_else(name, dominance):
    """All that is on the shaft moved by one angle ahead of the mark is the same motion, earlier: R_n e^{jn angle}."""
    angle, speeds = 0.9, [120.0, 300.0, 700.0]

    def turned(by):
        second = crack("breathing", 5e4, angle_rad=1.0 + by, label="second", weight_dominance=dominance)
        model = rig(crack(name, angle_rad=by, weight_dominance=dominance), second, unbalance_phase_rad=0.3 + by)
        return harmonic_response(model, speeds, HARMONICS)[..., 0]

    first, second = turned(0.0), turned(angle)
    turn = np.exp(1j * angle * np.array(HARMONICS))
    assert np.abs(second - first * turn).max() < 1e-11 * np.abs(first).max()
    assert np.abs(second - first / turn).max() > 1e-2 * np.abs(first).max()


def test_two_cracks_at_one_place_are_one_of_their_sum_and_opposite_notches_are_one_notch():
    one = harmonic_response(rig(crack("switching", 1.2e5)), [200.0], HARMONICS)
    two = harmonic_response(rig(crack("switching", 8e4), crack("switching", 4e4, label="b")), [200.0], HARMONICS)
    assert np.allclose(one, two, rtol=1e-12, atol=1e-20)
    for name, alike in (("open", True), ("breathing", False)):
        here, there = (harmonic_response(rig(crack(name, angle_rad=a)), [200.0], HARMONICS) for a in (0.0, np.pi))
        assert np.allclose(here, there, rtol=1e-9 if alike else 1e-3, atol=1e-18 if alike else 1e-9) == alike


def test_two_notches_across_each_other_make_a_round_shaft():
    cracks = [crack("open", eta_share=0.0, angle_rad=a, label=f"{a:.1f}") for a in (0.4, 0.4 + np.pi / 2)]
    softer = rig(rotor={**JEFFCOTT, "stiffness_N_per_m": 7.6e5 - 1.2e5})
    found, expected = (harmonic_response(model, [200.0], [0, 1, 2, -2])[0, :, 0] for model in (rig(*cracks), softer))
    assert np.abs(found - expected)[1:].max() < 1e-12 * np.abs(expected).max()
