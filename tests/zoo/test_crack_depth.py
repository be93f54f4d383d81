"""Depth of a crack: its loss of stiffness against a published table, closed forms and a shaft with a hinge."""

import numpy as np
import pytest
from cracked_jeffcott import JEFFCOTT, SHAFT, crack
from machines import OFFSET_DISC
from one_line_errors import refused

from rotorstudy import build_model, harmonic_response, registry
from rotorstudy.blind.machines.machine import Disc, PointRotor
from rotorstudy.model.cracks import compliance, stiffness_loss

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


def test_strip_integration_of_a_shallow_crack_in_closed_form():
    """Depth a << R: stress intensity factor 1.122, edge of a parabola: c55 = 64 1.122^2 (4 / 15) sqrt(2) a^2.5 / pi."""
    for deep, off in ((1e-4, 2e-3), (1e-5, 2e-4)):
        xi, _ = compliance(STRIPS, deep / 2, diameter_m=2.0, youngs_modulus_Pa=1.0, poissons_ratio=0.0)
        assert xi == pytest.approx(64 * 1.122**2 * 4 / 15 * np.sqrt(2) * deep**2.5 / np.pi, rel=off)


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
