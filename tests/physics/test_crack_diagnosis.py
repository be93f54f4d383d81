"""Cracks of rotors stepped in time in real x and y are named, with their element, angle and breathing function."""

from dataclasses import replace

import numpy as np
import pytest
from cracked_rotor import cracked_shaft
from machines import SLOW, readings
from test_cracked_rotor import BETWEEN, LOSS, ORDERS, finite_elements, jeffcott, stepped_jeffcott

from rotorstudy import measured_response
from rotorstudy.diagnosis.verdict.investigate import investigate

pytestmark = pytest.mark.usefixtures("right_conventions", "begun_once")

NOISE = 4e-3  # of the rms vibration at 1X
SPEEDS = np.array([90.0, 140.0, 180.0, 230.0, 280.0, 350.0, 420.0])
STATED = {"uncertainty": {"default": 0.02}, "most_causes": 1, "candidates_per_round": 2}
LEFT_OUT = sorted({*SLOW} - {"breathing_crack", "transverse_crack"})


def noisy(motion, speeds, sensors):
    std = NOISE * np.sqrt(np.mean(np.abs(motion[:, ORDERS.index(1)]) ** 2))
    return readings(motion, speeds, ORDERS, sensors, std / np.sqrt(2), 1)


def verdict_of(motion, speeds, model, left_out=LEFT_OUT):
    """On noisy motion (speed, harmonic, sensor) of all nodes of a model."""
    data = noisy(motion, speeds, tuple(model.structure.nodes))
    return investigate(data, model, settings={**STATED, "leave_out": left_out}).verdict


def verdict_of_jeffcott(opening, angle, **more):
    return verdict_of(stepped_jeffcott(SPEEDS, opening, angle, **more)[..., None], SPEEDS, jeffcott())


def apart(angle, other, period=2 * np.pi):
    """Distance of two angles, rad."""
    return abs((angle - other + period / 2) % period - period / 2)


def check(verdict, where, opening, angle, loss):
    assert verdict.verdict == "cause"
    (cause,) = verdict.causes
    assert (cause.effect, cause.where, cause.variant["crack"]) == ("breathing_crack", where, opening)
    found, size = cause.parameters["crack_angle_rad"], cause.parameters["stiffness_loss"]
    off = apart(found.value, angle, np.pi if opening == "open" else 2 * np.pi)  # a notch has two sides
    assert off < 4 * found.std < np.deg2rad(10)
    assert abs(size.value - loss) < 4 * size.std < 0.1 * loss


@pytest.mark.parametrize(
    ("opening", "degrees"), [("switching", 60), ("breathing", 200), ("power_cosine", 60), ("open", 200)]
)
def test_a_crack_of_a_jeffcott_rotor_is_named(opening, degrees):
    angle = np.deg2rad(degrees)
    check(verdict_of_jeffcott(opening, angle), {}, opening, angle, LOSS)


def test_an_open_crack_is_found_where_it_yields_most():
    """Two losses along its edge and across could change places with a quarter turn; an isotropic one cannot."""
    across, angle = 0.3, np.deg2rad(200)
    verdict = verdict_of_jeffcott("open", angle, across=across)
    (cause,) = verdict.causes
    check(verdict, {}, "open", angle, (1 - across) * LOSS)
    alike = cause.parameters["stiffness_loss_isotropic"]
    assert abs(alike.value - across * LOSS) < 4 * alike.std < 0.1 * LOSS


def test_a_crack_in_an_element_is_named():
    element, opening, angle = 3, "switching", float(np.deg2rad(200))
    speeds = np.array([80.0, 130.0, 170.0, 220.0, 260.0, 380.0, 430.0])
    motion = cracked_shaft(speeds, ORDERS, **BETWEEN, element=element, loss=0.15, angle=angle, opening=opening)
    model = finite_elements(BETWEEN)
    other = replace(model.structure, section_at=None, is_solid=False)  # else: transverse crack
    verdict = verdict_of(motion, speeds, replace(model, structure=other))
    check(verdict, {"element": element}, opening, angle, 0.15)


def test_without_a_crack_none_is_named():
    assert verdict_of_jeffcott("none", 0.0).verdict == "nothing"


def test_records_of_a_growing_motion_name_no_turning_stiffness():
    """The periodic solution of an asymmetric shaft between its critical speeds exists, but no record can be of it."""
    natural, model = np.sqrt(7.6e5 / 2.0), {"shaft_asymmetry": 0.1, "shaft_asymmetry_phase_rad": 0.3}
    alike = [*LEFT_OUT, "breathing_crack", "parallel_misalignment"]  # at the only node
    for third, kind in ((0.85, "cause"), (0.99, "unknown")):
        speeds = natural * np.array([0.5, 0.7, third, 1.1, 1.2, 1.3, 1.5])
        true = jeffcott(kind="shaft_asymmetry", **model)
        verdict = verdict_of(measured_response(true, speeds, ORDERS), speeds, jeffcott(), alike)
        assert verdict.verdict == kind
        assert ("shaft_asymmetry" in {cause.effect for cause in verdict.causes}) == (kind == "cause")
