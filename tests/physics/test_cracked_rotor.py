"""Cracks at any angle about the shaft against motions integrated in real x and y."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from cracked_rotor import OPENINGS, Shaft
from machines import disc, shaft, springs, unbalance
from scipy.integrate import solve_ivp

from rotorstudy import build_model, measured_response
from rotorstudy.response.statics import static_deflection

MASS, STIFFNESS, DAMPING, LOSS, PUSH = 2.0, 7.6e5, 120.0, 0.1 * 7.6e5, 2e-5 * np.exp(0.8j)
ORDERS = [0, 1, -1, 2, -2, 3, -3, 4, 5]


def jeffcott(**effect):
    """A Jeffcott rotor; effect : of the crack, without its stiffness loss, or of something else."""
    if effect.get("kind", "").startswith("breathing_crack"):
        effect = {"stiffness_loss_N_per_m": LOSS, **effect}
    return build_model({
        "rotor": {"kind": "jeffcott", "mass_kg": MASS, "stiffness_N_per_m": STIFFNESS},
        "effects": [
            {"kind": "external_damping", "external_damping_N_s_per_m": DAMPING},
            {"kind": "unbalance", "eccentricity_m": abs(PUSH) / MASS, "eccentricity_phase_rad": np.angle(PUSH)},
            *([effect] if effect else []),
        ],
    })  # fmt: skip


def integrated_jeffcott(speed, opening, angle, weight_only=False, samples=64, across=0.0):
    """Harmonics of x + j y of m r'' + c r' + k r = m g + m e w^2 + dk sigma xi (xi . r), about the rest.

    across : share of the loss along xi that is lost across it, too.
    The motion that repeats is found from the motions of one turn from every unit start.
    """
    rest = MASS * 9.81 / STIFFNESS

    def slope(turn, state, loaded):
        state = state.reshape(4, -1)
        position, velocity = state[:2], state[2:]
        xi = np.array([np.cos(turn + angle), np.sin(turn + angle)])
        seen = np.outer([rest, 0.0], loaded) if weight_only else position
        push = PUSH * speed**2 * np.exp(1j * turn)
        load = np.outer([push.real + MASS * 9.81, push.imag], loaded)
        yielding = (1 - across) * np.outer(xi, xi @ seen) + across * seen
        force = load + LOSS * OPENINGS[opening](turn + angle) * yielding
        acceleration = (force - DAMPING * velocity - STIFFNESS * position) / MASS
        return np.concatenate([velocity, acceleration]).ravel() / speed

    # a switching crack jumps where cos(turn + angle) = 0: integrate from jump to jump
    edges = np.concatenate([[0.0], np.sort((np.pi / 2 * np.array([1, 3]) - angle) % (2 * np.pi)), [2 * np.pi]])
    sampled = 2 * np.pi * np.arange(samples) / samples

    def one_turn(state, loaded):
        seen = []
        for start, end in pairwise(edges):
            inside = sampled[(sampled >= start) & (sampled < end)]
            on_this_side = np.clip(np.append(inside, end), start + 1e-12, end - 1e-12)
            found = solve_ivp(
                slope, (start + 1e-12, end - 1e-12), state.ravel(), method="DOP853", rtol=1e-10, atol=1e-14,
                t_eval=on_this_side, args=(loaded,),
            ).y  # fmt: skip
            seen.append(found[:, :-1])
            state = found[:, -1]
        return state.reshape(4, -1), np.concatenate(seen, axis=1)

    after, _ = one_turn(np.eye(4, 5), np.eye(5)[-1])
    begin = np.linalg.solve(np.eye(4) - after[:, :4], after[:, 4])
    _, seen = one_turn(begin, np.ones(1))
    return np.fft.fft(seen[0] + 1j * seen[1] - rest) / samples


@pytest.mark.parametrize("weight_only", [False, True])
@pytest.mark.parametrize(
    "opening, degrees", [("switching", 60), ("breathing", 200), ("power_cosine", -35), ("open", 110)]
)
def test_a_crack_at_any_angle_moves_the_rotor_as_integrated(opening, degrees, weight_only):
    """Harmonics above those carried, and of 64 samples folded, are below 1e-4 of the effect even for a jump."""
    angle, speed = np.deg2rad(degrees), 200.0
    kind = "breathing_crack_weight" if weight_only else "breathing_crack"
    own = jeffcott(kind=kind, crack=opening, crack_angle_rad=float(angle))
    seen = integrated_jeffcott(speed, opening, angle, weight_only)[ORDERS]
    shown = measured_response(own, [speed], ORDERS)[0, :, 0]
    effect = np.abs(shown - measured_response(jeffcott(), [speed], ORDERS)[0, :, 0]).max()
    assert np.abs(shown - seen).max() < 1e-3 * effect
    unturned = jeffcott(kind=kind, crack=opening)
    assert np.abs(measured_response(unturned, [speed], ORDERS)[0, :, 0] - seen).max() > 0.1 * effect


def test_a_full_turn_changes_nothing_and_no_angle_is_the_phase_mark():
    without, turned, none = (
        measured_response(jeffcott(kind="breathing_crack", **given), [200.0], ORDERS)
        for given in ({}, {"crack_angle_rad": float(2 * np.pi)}, {"crack_angle_rad": 0.0})
    )
    assert (without == none).all()
    assert np.allclose(without, turned, rtol=1e-10, atol=0)


SHAFT_SPEEDS = [70.0, 120.0]  # low enough for the slowest mode to decay to 1e-3 in 50 turns
BETWEEN = {
    "discs": {2: (2.0, 0.0048, 0.0024), 4: (1.5, 0.003, 0.0015)},
    "bearings": {1: (1e6, 8e5, 600.0), 5: (1.2e6, 9e5, 600.0)},
    "unbalance": {2: 2e-5 * np.exp(0.8j), 4: 1e-5 * np.exp(0.3j)},
}
OVERHUNG = {
    "discs": {5: (2.0, 0.0048, 0.0024)},
    "bearings": {1: (1e6, 8e5, 600.0), 3: (1.2e6, 9e5, 600.0)},
    "unbalance": {5: 1e-6 * np.exp(0.8j)},
}


def finite_elements(machine, crack=None):
    """The same shaft as `Shaft(0.15, 4, 0.02, ..., beta=1e-4)`; crack : options of the effect."""
    discs = [disc(n, *sizes) for n, sizes in machine["discs"].items()]
    return build_model(
        {
            "rotor": shaft(0.6, 4, *discs, theory="euler_bernoulli", shaft_inertia="translation"),
            "bearings": [springs([n], (kx, ky), (c, c))[0] for n, (kx, ky, c) in machine["bearings"].items()],
            "effects": [
                {"kind": "shaft_damping", "shaft_damping_s": 1e-4},
                *(
                    unbalance(n, float(abs(u)), float(np.angle(u)), label=str(n), mass_kg=1.0)
                    for n, u in machine["unbalance"].items()
                ),
                *([{"kind": "breathing_crack", **crack}] if crack else []),
            ],
        }
    )


def moved_by_a_crack(machine, crack):
    """Harmonics at all nodes that a crack of the package adds to those without it."""
    with_crack, without = (measured_response(finite_elements(machine, c), SHAFT_SPEEDS, ORDERS) for c in (crack, None))
    return with_crack, np.abs(with_crack - without).max()


@pytest.mark.parametrize("degrees", [60, 200])
def test_a_crack_in_an_element_moves_the_rotor_as_integrated(degrees):
    """The tolerance is the period error of 256 steps a turn, 1e-3 at 5X, and what is left of the start."""
    angle = float(np.deg2rad(degrees))
    seen = Shaft(0.15, 4, 0.02, **BETWEEN, crack=(2, 0.15, angle, "breathing"), beta=1e-4)
    seen = seen.harmonics(SHAFT_SPEEDS, ORDERS, steps=256)
    crack = {"crack": "breathing", "crack_angle_rad": angle, "element": 2, "stiffness_loss": 0.15}
    shown, effect = moved_by_a_crack(BETWEEN, crack)
    assert np.abs(shown - seen).max() < 1e-2 * effect


@pytest.mark.parametrize("machine, element", [(OVERHUNG, 4), (BETWEEN, 2)], ids=["overhung", "between"])
def test_a_crack_opens_where_the_weight_stretches_the_shaft(machine, element):
    """The integrated crack opens by the curvature of the moving shaft, which the weight dominates here."""
    small = {**machine, "unbalance": {node: 0.05 * u for node, u in machine["unbalance"].items()}}
    seen = Shaft(0.15, 4, 0.02, **small, crack=(element, 0.05, 1.0, "curvature"), beta=1e-4)
    seen = seen.harmonics(SHAFT_SPEEDS, ORDERS, steps=256)
    crack = {"crack": "switching", "crack_angle_rad": 1.0, "element": element, "stiffness_loss": 0.05}
    shown, effect = moved_by_a_crack(small, crack)
    assert np.abs(shown - seen).max() < 1e-2 * effect
    other_side, _ = moved_by_a_crack(small, {**crack, "crack_angle_rad": 1.0 + np.pi})
    assert np.abs(other_side - seen).max() > 0.5 * effect


def test_the_side_that_the_weight_stretches_is_that_of_the_deflection_on_the_bearings():
    for machine, sides in ((BETWEEN, [1, 1, 1, 1]), (OVERHUNG, [-1, -1, -1, -1])):
        model = finite_elements(machine)
        deflection = static_deflection(model, np.array([100.0]), model.theta).value[0]
        found = [model.structure.tension_side(element) for element in (1, 2, 3, 4)]
        bent = [model.structure.curvature_at(element) @ deflection for element in (1, 2, 3, 4)]
        assert found == [int(-np.sign(one.real)) for one in bent] == sides
        assert model.structure.tension_side(None) == 1


def test_a_crack_without_a_known_bending_opens_below():
    model = finite_elements(OVERHUNG)
    weightless = replace(model.structure, static_load=np.zeros(len(model.structure.dofs)))
    one_bearing = replace(model.structure, bearing_nodes=(3,))
    assert weightless.tension_side(4) == one_bearing.tension_side(4) == jeffcott().structure.tension_side(None) == 1
