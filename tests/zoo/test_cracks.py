"""Cracks: their opening functions by published factors, closed forms and Fourier series; their loss by their depth."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from machines import OFFSET_DISC, jeffcott_rig, point
from one_line_errors import refused

from rotorstudy import build_model, harmonic_response, make_term, registry
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.blind.machines.machine import Disc, PointRotor
from rotorstudy.errors import PluginError
from rotorstudy.model.cracks import compliance, crack_series, participation_factors, stiffness_loss
from rotorstudy.model.kinds import Crack

CRACKS = registry().plugins["crack"]
JEFFCOTT = point()
HARMONICS = [0, 1, 2, 3, 4, -1, -2, -3]
SHAFT = {"diameter_m": 0.02, "span_m": 0.45}


def rig(*cracks, unbalance_phase_rad=0.3, rotor=JEFFCOTT):
    return build_model(jeffcott_rig(2e-5, unbalance_phase_rad, cracks=list(cracks), rotor=rotor))


def crack(kind, loss=1.2e5, **options):
    given = {**CRACKS[kind].example, "weight_dominance": False, **options}
    return {"kind": kind, "stiffness_loss_N_per_m": loss, **given}


def test_cosine_to_the_second_power_is_breathing_and_its_coefficients_are_binomials():
    angle = np.linspace(-7, 7, 200)
    power, cosine = CRACKS["power_cosine"], CRACKS["breathing"]
    assert np.abs(power.function(angle, 2, 0.3) - cosine.function(angle, 0.3)).max() < 1e-15
    assert np.abs(power.function(angle, 4, 0.3) - cosine.function(angle, 0.3)).max() > 0.1
    for exponent in (2, 4, 10):
        half = exponent // 2
        found = crack_series(power, 9, {"exponent": exponent, "eta_share": 0.3})
        assert set(found) == set(range(-half, half + 1))
        for k, coefficient in found.items():
            expected = np.array([1, 0.3, 0]) * comb(exponent, half + k) / 2**exponent
            assert np.abs(coefficient - expected).max() < 1e-14


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
    plugin = CRACKS["switching"]
    by_hand, found = (crack_series(one, 9) for one in (plugin, replace(plugin, series=None)))
    assert set(found) == set(by_hand)
    assert max(np.abs(found[k] - by_hand[k]).max() for k in found) < 2e-4


def test_an_option_that_every_crack_has_is_refused(monkeypatch):
    monkeypatch.setitem(CRACKS, "wrong", Crack("wrong", lambda angle, node=1.0: 0 * angle, source="none"))
    with pytest.raises(PluginError, match="option 'node' is reserved for all cracks"):
        make_term("crack", {"kind": "wrong"}, bench_structure(), (1,))


STRIPS = registry().get("depth", "strip_integration")
# (a / R, c44, c45, c55) of the table PAPADOPOULOS.csv of ROSS, in (1 - nu^2) / (E R^3); c44 there counts half the crack
TABULATED = [
    (0.01, 1.37749e-07, 4.24397e-06, 9.57316e-05), (0.1, 0.000425851, 0.00399911, 0.0277722),
    (0.25, 0.0103483, 0.0577909, 0.243694), (0.5, 0.12323, 0.436694, 1.22153), (0.8, 0.827564, 1.97266, 3.97355),
]  # fmt: skip


@pytest.mark.parametrize(("deep", "c44", "c45", "c55"), TABULATED)
def test_strip_integration_is_the_published_table(deep, c44, c45, c55):
    """With the moment along the front the half in tension is open (Darpe): its coupling is half of c45."""
    given = {"diameter_m": 2.0, "youngs_modulus_Pa": 1.0, "poissons_ratio": 0.0}
    xi, eta = compliance(STRIPS, deep / 2, **given)
    assert xi == pytest.approx(c55, rel=5e-6)
    assert eta == pytest.approx(2 * c44, rel=5e-6)
    half_open = STRIPS.partly_open(deep / 2, np.pi / 2, **given)
    assert half_open == pytest.approx(c45 / 2 + 1j * c44, rel=1e-5)


def test_loss_of_stiffness_is_that_of_a_shaft_with_a_hinge():
    """At mid-span, by the independent simulator, whose disc is beside the hinge."""
    young, span, diameter = 2.1e11, SHAFT["span_m"], SHAFT["diameter_m"]
    rotor = PointRotor(span / 2, span / 2, diameter, young, Disc(0, 2.0, 1e-3, 1e-3), 0.0, 0.0)
    selection, stiffness = rotor.hinge(span / 2)
    k = rotor.plane_stiffness[0, 0]
    losses = stiffness_loss(STRIPS, 0.35, k, span, diameter_m=diameter)
    for c, loss in zip(compliance(STRIPS, 0.35, diameter_m=diameter), losses, strict=True):
        assert loss == pytest.approx(selection[0, 0] ** 2 * c / (1 + stiffness * c), rel=1e-9)
        assert loss > 1e-3 * k


def test_depth_in_a_rig_is_the_loss_it_means():
    depth = {"kind": "strip_integration", "depth_ratio": 0.3, **SHAFT}
    item = {"kind": "breathing", "depth": depth}
    model = build_model({"rotor": JEFFCOTT, "cracks": [item]})
    loss = stiffness_loss(STRIPS, 0.3, 7.6e5, SHAFT["span_m"], diameter_m=SHAFT["diameter_m"])
    assert model.theta == [loss.xi] and 0.02 * 7.6e5 < loss.xi < 0.2 * 7.6e5
    same = crack("breathing", loss.xi, eta_share=loss.eta / loss.xi, weight_dominance=True)
    means = build_model({"rotor": JEFFCOTT, "cracks": [same]})
    assert np.array_equal(*(harmonic_response(m, [90.0], [0, 1, 2]) for m in (model, means)))
    stated = build_model({"rotor": JEFFCOTT, "cracks": [{**item, "eta_share": 0.0}]})
    assert not np.array_equal(*(harmonic_response(m, [90.0], [0, 1, 2]) for m in (model, stated)))


def test_depth_sets_the_geometry_of_a_crack_that_has_one():
    depth = {"kind": "strip_integration", "depth_ratio": 0.4, **SHAFT}
    cracks = [{"kind": "section_geometry", "depth": depth, **more} for more in ({}, {"depth_ratio": 0.4})]
    one, other = (build_model({"rotor": JEFFCOTT, "cracks": [c]}) for c in cracks)
    assert np.array_equal(harmonic_response(one, [90.0], [2]), harmonic_response(other, [90.0], [2]))


DEPTH = {"kind": "strip_integration", "depth_ratio": 0.3, **SHAFT}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"depth": {**DEPTH, "depth_ratio": 0.6}}, ["depth_ratio = 0.6", "cracks[0]", "from 0 to 0.5"]),
        ({"depth": {**DEPTH, "depth_ratio": -0.1}}, ["depth_ratio = -0.1", "from 0 to 0.5"]),
        ({"stiffness_loss_N_per_m": 2e4}, ["stiffness_loss_N_per_m = 20000.0", "its depth gives", "one of the two"]),
        ({"kind": "section_geometry", "depth_ratio": 0.1}, ["depth_ratio = 0.1", "its depth gives 0.3"]),
        ({"depth": {**DEPTH, "span_m": 0.7}}, ["span_m = 0.7", "48 E I / L^3", "7.6e+05"]),
        ({"depth": {**DEPTH, "span": 0.7}}, ["unknown key 'span'", "did you mean 'span_m'"]),
        ({"depth": {**DEPTH, "kind": "strip_integral"}}, ["unknown depth", "did you mean 'strip_integration'"]),
        ({"depth": {**DEPTH, "span_m": "0.4"}}, ["span_m = '0.4'", "without quotes"]),
        ({"depth": 0.3}, ["depth = 0.3", "'kind'"]),
        ({"depth": {k: v for k, v in DEPTH.items() if k != "diameter_m"}}, ["'diameter_m' is missing"]),
        ({"eta_share": 1.5}, ["eta_share = 1.5", "less than or equal to 1"]),
        ({"kind": "power_cosine", "exponent": 3}, ["exponent = 3", "multiple of 2"]),
        ({"angle_rad": "up"}, ["angle_rad = 'up'", "number"]),
    ],
)
def test_what_is_wrong_with_a_crack_item_is_said(changes, words):
    item = {"kind": "breathing", "depth": DEPTH, **changes}
    refused(lambda: build_model({"rotor": JEFFCOTT, "cracks": [item]}), *words)


def test_depth_on_a_rotor_with_more_coordinates_is_refused():
    cracks = [{"kind": "open", "depth": DEPTH}]
    refused(lambda: build_model({"rotor": OFFSET_DISC, "cracks": cracks}), "stiffness_loss_22")
