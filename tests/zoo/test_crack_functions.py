"""Opening functions of cracks: published factors, closed forms, their Fourier series, and turned phase marks."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from cracked_jeffcott import CRACKS, HARMONICS, crack, rig

from rotorstudy import harmonic_response, make_term
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.errors import PluginError
from rotorstudy.model.cracks import crack_series, participation_factors
from rotorstudy.model.kinds import Crack


def test_cosine_to_the_second_power_is_breathing_and_its_mean_is_a_binomial():
    angle = np.linspace(-7, 7, 200)
    power, cosine = CRACKS["power_cosine"], CRACKS["breathing"]
    assert np.abs(power.function(angle, 2, 0.3) - cosine.function(angle, 0.3)).max() < 1e-15
    assert np.abs(power.function(angle, 4, 0.3) - cosine.function(angle, 0.3)).max() > 0.1
    for exponent in (2, 4, 10):
        assert power.series(20, exponent)[0][0] == comb(exponent, exponent // 2) / 2**exponent


def test_participation_factors_in_closed_form():
    """(1 + cos a) / 2 cos a e^{ja}; an open crack; one as soft in eta as in xi does not shift harmonics by two."""
    n = [-2, -1, 0, 1, 2, 3, 4]
    assert np.allclose(participation_factors(CRACKS["breathing"], n), np.array([0, 1, 2, 2, 2, 1, 0]) / 8, atol=1e-15)
    assert np.allclose(participation_factors(CRACKS["open"], n, None, {"eta_share": 0.2}), [0, 0, 0.6, 0, 0.4, 0, 0])
    even = participation_factors(CRACKS["breathing"], n, None, {"eta_share": 1.0})
    assert np.allclose(even, [0, 0.25, 0.5, 0.25, 0, 0, 0])


def test_participation_factors_of_the_thesis():
    orders = [0, 1, 2, 3, 5, 7, -1, -3, -5]
    printed = [0.25, 0.31830, 0.25, 0.10610, -0.02122, 0.00909, 0.10610, -0.02122, 0.00909]
    found, other = (participation_factors(CRACKS[name], orders) for name in ("switching", "breathing"))
    assert np.abs(found - printed).max() < 1e-5  # some are cut, not rounded
    assert np.abs(other - printed).max() > 0.01


def test_switching_cut_short_is_its_first_terms():
    angle = np.linspace(0, 7, 300)
    options = {"terms": 3}
    given = np.abs(CRACKS["switching"].function(angle, **options))
    closed = 0.5 + 2 / np.pi * (np.cos(angle) - np.cos(3 * angle) / 3 + np.cos(5 * angle) / 5)
    assert np.abs(given - np.abs(closed)).max() < 1e-14
    assert max(crack_series(CRACKS["switching"], 15, options)) == 5
    assert max(crack_series(CRACKS["switching"], 15)) == 15
    whole, cut, low = (
        harmonic_response(rig(crack("switching", **more)), [120.0], HARMONICS)[0, :, 0]
        for more in ({}, {"terms": 3}, {"order": 5})
    )
    assert np.array_equal(cut, low)  # the option of the plugin and that of the engine mean one thing
    assert np.abs(cut / whole - 1).max() > 1e-4


def overshoot(terms):
    return CRACKS["switching"].function(np.linspace(0, np.pi, 20001), terms).max() - 1


def test_switching_cut_short_overshoots_as_said():
    assert overshoot(1) == pytest.approx(2 / np.pi - 0.5)
    assert overshoot(200) == pytest.approx(0.0895, abs=2e-4)  # Gibbs


@pytest.mark.parametrize("depth_ratio", [0.05, 0.15, 0.25, 0.4, 0.5])
def test_section_geometry_has_the_angles_and_moments_in_closed_form(depth_ratio):
    """Closed forms: area moments of the open section, angles where it begins and ends to shut."""
    mu, function = 2 * depth_ratio, CRACKS["section_geometry"].function
    root = np.sqrt(mu * (2 - mu))
    area = np.pi - np.arccos(1 - mu) + (1 - mu) * root
    down = 2 * root**3 / (3 * area)
    in_xi = np.pi / 8 + ((1 - mu) * (2 * mu**2 - 4 * mu + 1) * root + np.arcsin(1 - mu)) / 4 - area * down**2
    segment = (3 * np.arccos(1 - mu) - (1 - mu) * (3 + 2 * root**2) * root) / 12  # of the eta moment
    share = segment / (np.pi / 4 - in_xi)
    assert np.abs(function(0.0, depth_ratio) - [1, share, 0]).max() < 1e-9
    begins, ends = np.arctan((down + 1 - mu) / root), np.pi / 2 + np.arccos(1 - mu)
    inside, just = function(np.linspace(0, begins, 20), depth_ratio), function(begins + 0.05, depth_ratio)
    assert np.abs(inside - inside[:, :1]).max() < 1e-9 and just[0] < 1 - 1e-4
    assert np.abs(function(np.linspace(ends, np.pi, 20), depth_ratio)).max() < 1e-9
    assert function(ends - 0.1, depth_ratio)[0] > 1e-8


def test_section_geometry_by_counting_small_squares():
    """Neutral axis, moments and product of a half-shut crack, by brute force on a fine grid."""
    depth_ratio, angle, count = 0.3, 1.4, 2001
    grid = (np.arange(count) + 0.5) / count * 2 - 1
    xi, eta = np.meshgrid(grid, grid, indexing="ij")
    disc, cell = xi**2 + eta**2 < 1, (2 / count) ** 2
    below = xi * np.cos(angle) - eta * np.sin(angle)

    def moments(carries):
        area = carries.sum() * cell
        first = [np.sum(part[carries]) * cell for part in (xi, eta)]
        pairs = [(xi, xi, 0, 0), (eta, eta, 1, 1), (xi, eta, 0, 1)]
        return np.array([np.sum((a * b)[carries]) * cell - first[i] * first[j] / area for a, b, i, j in pairs])

    neutral, crack_area = 0.0, disc & (xi > 1 - 2 * depth_ratio)
    for _ in range(60):
        carries = disc & ~(crack_area & (below > neutral))
        neutral = below[carries].mean()
    fully = moments(disc) - moments(disc & ~crack_area)
    expected = (moments(disc) - moments(carries)) / fully[0]
    found = CRACKS["section_geometry"].function(angle, depth_ratio)
    assert np.abs(found - expected).max() < 2e-3 and np.abs(expected).min() > 0.05


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


def test_a_series_by_fourier_transform_is_as_good_as_said():
    for name, off in (("switching", 2e-4), ("breathing", 1e-14), ("power_cosine", 1e-14)):
        plugin = CRACKS[name]
        by_hand = crack_series(plugin, 9, plugin.example)
        found = crack_series(replace(plugin, series=None), 9, plugin.example)
        assert set(found) == set(by_hand)
        assert max(np.abs(found[k] - by_hand[k]).max() for k in found) < off


def test_an_option_that_every_crack_has_is_refused(monkeypatch):
    monkeypatch.setitem(CRACKS, "wrong", Crack("wrong", lambda angle, node=1.0: 0 * angle, source="none"))
    with pytest.raises(PluginError, match="option 'node' is reserved for all cracks"):
        make_term("crack", {"kind": "wrong"}, bench_structure(), (1,))
