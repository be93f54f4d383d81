"""A loose support that is stiff: the shaft moves there by far less than at the disc, and lifts by as little."""

import numpy as np
import pytest
from machines import all_but, disc, shaft, spectrum_of, springs

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.candidates import candidate, shape_ranges, with_vibration
from rotorstudy.model.rig import build_model
from rotorstudy.response.neighbourhood import carried_motion

SPEEDS, HARMONICS = np.array([100.0, 140.0, 170.0, 200.0, 230.0]), np.array([0, 1, -1, 2, -2, 3, -3])
MODEL = build_model(
    {
        "rotor": shaft(0.6, 2, disc(2)),
        "bearings": springs((1, 3), 1e8, 1e3),
        "effects": [{"kind": "unbalance", "node": 2, "eccentricity_m": 2e-5}],
        "sensors": [1, 2, 3],
    }
)
OTHERS = all_but("looseness")


def vibration(model, node):
    """Largest |1X| at a node, m."""
    motion = carried_motion(model, SPEEDS, HARMONICS)
    return float(np.abs(motion.amplitude[..., model.structure.index(node)]).max())


def test_shapes_are_sought_as_far_as_the_place_moves():
    structure = with_vibration(MODEL, shown(MODEL, MODEL.theta)).structure
    size = {node: shape_ranges("looseness", structure, node)["lift_m"].high for node in (1, 2)}
    assert 1 / 3 < size[1] / size[2] / (vibration(MODEL, 1) / vibration(MODEL, 2)) < 3  # each by a force of its own
    assert size[1] < 0.1 * size[2]  # so that the test below is one of a stiff support


def shown(model, theta):
    return spectrum_of(model, SPEEDS, HARMONICS, 1e-3 * vibration(MODEL, 1), theta=theta)


def test_a_stiff_support_that_lifts_by_a_little_is_found():
    lift, along, play = 0.2 * vibration(MODEL, 1), 0.5, 1.5 * vibration(MODEL, 1)
    shape = {"lift_m": lift, "direction_rad": along, "play_m": play}
    cause = candidate(MODEL, "looseness", {"node": 1}, shape)
    loose = MODEL.plus(cause.term)
    spectrum = shown(loose, np.append(MODEL.theta, 6e7))
    found = investigate(spectrum, MODEL, settings={"uncertainty": {"default": 0.02}, "leave_out": OTHERS}).verdict
    assert found.verdict == "cause"
    (named,) = found.causes
    assert named.where == {"node": 1}
    assert named.parameters["lift_m"].value == pytest.approx(lift, rel=0.1)
    assert named.parameters["play_m"].value == pytest.approx(play, rel=0.1)
    assert named.parameters["direction_rad"].value == pytest.approx(along, abs=0.05)
