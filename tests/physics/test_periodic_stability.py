"""Growth of the free motion of rotors whose stiffness turns with the shaft: closed form, and integrated turns."""

import numpy as np
import pytest
from cracked_rotor import OPENINGS
from machines import disc, free_motion, jeffcott_rig, point, shaft, springs, unbalance
from scipy.integrate import solve_ivp
from shaft_with_a_crack import crack, rotor

from rotorstudy import build_model, check_stable, simulate_records
from rotorstudy.errors import NoSteadyState
from rotorstudy.response import few_shapes, floquet
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.stability import growth_rate

MASS, STIFFNESS = 2.0, 7.6e5
NATURAL = np.sqrt(STIFFNESS / MASS)
STEP_ERROR = 5e-4  # of the largest growth, of 256 midpoints a revolution at about the natural frequency


def jeffcott(*effects, damping=0.0):
    return build_model(jeffcott_rig(None, None, *effects, external=damping, rotor=point(MASS, STIFFNESS)))


def asymmetric(share, damping=0.0):
    effect = {"kind": "shaft_asymmetry", "shaft_asymmetry": share, "shaft_asymmetry_phase_rad": 0.3}
    return jeffcott(effect, damping=damping)


def growth_in_turning_axes(share, speed, damping):
    """r = z e^{-jwt}: m (r'' + 2 j w r' - w^2 r) + c (r' + j w r) + k r + share k conj(r) = 0 has constant terms."""
    w, c = speed, damping / MASS
    k = np.diag([(1 + share) * NATURAL**2 - w**2, (1 - share) * NATURAL**2 - w**2]) + c * w * np.array(
        [[0, -1], [1, 0]]
    )
    g = c * np.eye(2) + 2 * w * np.array([[0, -1], [1, 0]])
    return np.linalg.eigvals(free_motion(np.eye(2), g, k)).real.max()


def test_an_asymmetric_shaft_grows_between_its_critical_speeds_as_in_closed_form():
    """Without damping s^2 = sqrt(4 w^2 wn^2 + e^2 wn^4) - (w^2 + wn^2), positive for wn sqrt(1 -+ e) alone."""
    share, speeds = 0.1, NATURAL * np.array([0.97, 1.0, 1.03])
    square = np.sqrt(4 * speeds**2 * NATURAL**2 + share**2 * NATURAL**4) - speeds**2 - NATURAL**2
    growth = periodic_growth_rate(asymmetric(share), speeds)
    assert growth == pytest.approx(np.sqrt(square), abs=STEP_ERROR * max(np.sqrt(square)))
    for speed in NATURAL * np.sqrt([1 - share, 1 + share]):
        inside, outside = (1 + 2e-3, 1 - 2e-3) if speed < NATURAL else (1 - 2e-3, 1 + 2e-3)
        with pytest.raises(NoSteadyState, match=r"grows by [\d.]+ 1/s"):
            check_stable(asymmetric(share), [speed * inside])
        check_stable(asymmetric(share), [speed * outside])


@pytest.mark.parametrize("slower", [10, 30])
def test_slow_growth_far_below_the_natural_frequency_is_not_lost_to_the_steps(slower):
    """Driven by a negative damping of 5e-4 of the critical one; it was decay when 256 implicit steps damped it."""
    damping, speed = -2 * 5e-4 * MASS * NATURAL, NATURAL / slower
    expected = growth_in_turning_axes(0.1, speed, damping)
    assert periodic_growth_rate(asymmetric(0.1, damping), [speed]) == pytest.approx([expected], rel=1e-4)


@pytest.mark.parametrize("damping", [20.0, 100.0])
def test_damping_slows_the_growth_of_an_asymmetric_shaft_as_in_turning_axes(damping):
    speeds = NATURAL * np.array([0.6, 0.97, 1.0, 1.04, 1.3])
    expected = [growth_in_turning_axes(0.1, w, damping) for w in speeds]
    found = periodic_growth_rate(asymmetric(0.1, damping), speeds)
    assert found == pytest.approx(expected, abs=STEP_ERROR * max(np.abs(expected)))
    assert found.min() < 0 < found.max()


@pytest.mark.parametrize(
    ("opening", "ratio"), [("breathing", 1.8), ("breathing", 0.97), ("switching", 1.8), ("switching", 0.6)]
)
def test_a_breathing_crack_grows_as_its_integrated_turn(opening, ratio):
    """The multipliers of four free motions in real x and y, integrated through one turn."""
    loss, speed, damping = 0.3 * STIFFNESS, ratio * NATURAL, 5.0
    crack = {"kind": "breathing_crack", "crack": opening, "crack_angle_rad": 0.0, "stiffness_loss_N_per_m": loss}

    def slope(turn, state):
        xi = np.array([np.cos(turn), np.sin(turn)])
        position, velocity = state.reshape(2, 2, 4)
        force = loss * OPENINGS[opening](turn) * np.outer(xi, xi @ position)
        acceleration = (force - damping * velocity - STIFFNESS * position) / MASS
        return np.concatenate([velocity, acceleration]).ravel() / speed

    state = np.eye(4).ravel()
    for start, end in ((0, 0.5), (0.5, 1.5), (1.5, 2)):  # times pi: where a switching crack jumps
        shrunk = 1e-12
        turns = (np.pi * start + shrunk, np.pi * end - shrunk)
        state = solve_ivp(slope, turns, state, method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
    expected = np.log(np.abs(np.linalg.eigvals(state.reshape(4, 4))).max()) * speed / (2 * np.pi)
    found = periodic_growth_rate(jeffcott(crack, damping=damping), [speed])[0]
    assert found == pytest.approx(expected, abs=1e-5 * NATURAL)
    assert (found > 0) == (expected > 0)


DRAG = {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": 30.0}
SHAFT = {  # whose modes above the lowest are hardly damped
    "rotor": shaft(1.2, 4, disc(2, 2.0, 8e-3, 4e-3)),
    "bearings": springs((1, 5), (2e5, 1.5e5), (2.0, 1.5)),
    "effects": [DRAG],
}


@pytest.mark.parametrize("speed", [5.0, 40.0, 300.0])
def test_slow_decay_of_modes_far_above_the_speed_is_that_of_the_eigenvalues(speed):
    """Of the 20 modes, at 200 to 60,000 rad/s, a high one decays most slowly."""
    model = build_model(SHAFT)
    expected = growth_rate(model, [speed])
    assert periodic_growth_rate(model, [speed]) == pytest.approx(expected, rel=1e-5)
    assert -5 < expected[0] < 0


@pytest.mark.parametrize("speed", [300.0, 800.0])
def test_modes_far_above_the_speed_follow_a_cracked_shaft_statically(speed, monkeypatch):
    """As when their motion is integrated too, in finer steps; without the crack the decay is another one."""
    crack = {"kind": "transverse_crack", "position_m": 0.7, "depth_ratio": 0.35, "angle_rad": 0.0}
    crack["flexibility_factor"] = 1.0
    model = build_model({**SHAFT, "effects": [DRAG, crack]})
    found = periodic_growth_rate(model, [speed])[0]
    monkeypatch.setattr(floquet, "FAST", np.inf)
    monkeypatch.setattr(floquet, "TURN_STEPS", 2048)
    assert found == pytest.approx(periodic_growth_rate(model, [speed])[0], rel=1e-5)
    assert abs(found - growth_rate(build_model(SHAFT), [speed])[0]) > 1e-4 * abs(found)


def cracked(crack):
    effect = {"kind": "breathing_crack", "crack": crack, "stiffness_loss_N_per_m": 0.2 * STIFFNESS}
    return jeffcott(effect, damping=20.0)


@pytest.mark.parametrize(("model", "folds"), [(asymmetric(0.1, 20.0), 2), (cracked("switching"), 1)])
def test_coefficients_that_repeat_twice_in_a_revolution_are_integrated_over_half_of_it(monkeypatch, model, folds):
    """Over the half of a revolution in which they do not repeat the growth would be another one."""
    speeds = NATURAL * np.array([0.3, 0.95])
    found = periodic_growth_rate(model, speeds)
    assert floquet._folds(model) == folds
    monkeypatch.setattr(floquet, "_folds", lambda _: 1)
    assert periodic_growth_rate(model, speeds) == pytest.approx(found, rel=1e-9)
    monkeypatch.setattr(floquet, "_folds", lambda _: 2)
    differs = periodic_growth_rate(model, speeds) != pytest.approx(found, rel=1e-3)
    assert differs == (folds == 1)


TWICE = 820.0  # rad/s, about twice the natural frequency of the cracked shaft, where its stiffness pumps a whirl
LIGHT = {"density": 1e-3, "bearings": False, "theory": "euler_bernoulli"}
BALANCED = unbalance(2, 2e-5, 0.7 + np.pi, label="against", mass_kg=2.0)  # fmt: skip


def opened(damping, *effects, **law):
    drag = {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": damping}
    return rotor(2, drag, crack(0.28, 0.5, angle_rad=0.0, **law), *effects, **LIGHT)


def test_without_vibration_it_grows_as_if_the_weight_opened_it():
    """By the slopes of the force along the steady state; the crack relieves the shaft, so not quite as by weight."""
    by_motion, by_weight = (
        periodic_growth_rate(opened(1.0, BALANCED, **law), [TWICE, 700.0]) for law in ({}, {"opened_by": "weight"})
    )
    assert by_weight[0] > 5
    assert by_motion[0] == pytest.approx(by_weight[0], rel=0.1)
    assert -0.05 < by_motion[1] <= 0  # the tilts of the shaft, at 1e7 rad/s, are not damped


def test_no_record_is_simulated_where_a_whirl_grows():
    """A periodic motion exists there, but the rotor leaves it; enough damping holds it."""
    time = np.arange(64) / 1000
    with pytest.raises(NoSteadyState, match=r"820 rad/s\), where a free motion grows by [\d.]+ 1/s") as said:
        simulate_records(opened(1.0), [TWICE], [0, 1, 2], time)
    assert "\n" not in str(said.value)
    check_stable(opened(1.0), [700.0])
    assert len(simulate_records(opened(100.0), [TWICE], [0, 1, 2], time)) == 1


def test_on_a_fine_mesh_few_shapes_do(monkeypatch):
    """The lowest modes and the static shapes of the forces grow as all coordinates do; two modes alone do not."""
    drag = {"kind": "external_damping", "node": 4, "external_damping_N_s_per_m": 1.0}
    model = rotor(6, drag, crack(0.28, 0.5, angle_rad=0.0))
    speeds = [300.0, 560.0]
    every = periodic_growth_rate(model, speeds)
    monkeypatch.setattr(few_shapes, "MODES", 6)
    assert few_shapes.shapes(model, model.theta).shape[1] < len(model.structure.dofs)
    assert periodic_growth_rate(model, speeds) == pytest.approx(every, rel=2e-3)
    monkeypatch.setattr(floquet, "shapes", lambda model, theta: np.linalg.eigh(model.structure.stiffness)[1][:, :2])
    assert np.abs(periodic_growth_rate(model, speeds) - every).max() > 0.01 * np.abs(every).max()
