"""Cracks at any angle about the shaft against motions stepped in time in real x and y."""

from dataclasses import replace

import numpy as np
import pytest
from cracked_rotor import cracked_jeffcott, cracked_shaft
from machines import disc, jeffcott_rig, point, rig_of, shaft, springs, unbalance
from scipy.integrate import solve_ivp

from rotorstudy import build_model, measured_response
from rotorstudy.response.statics import static_deflection

MASS, STIFFNESS, DAMPING, LOSS, PUSH = 2.0, 7.6e5, 120.0, 0.1 * 7.6e5, 2e-5 * np.exp(0.8j)
ORDERS = [0, 1, -1, 2, -2, 3, -3, 4, 5]


def jeffcott(**effect):
    """A Jeffcott rotor; effect : of the crack, without its stiffness loss, or of something else."""
    if effect.get("kind", "").startswith("breathing_crack"):
        effect = {"stiffness_loss_N_per_m": LOSS, **effect}
    known = {"rotor": point(MASS, STIFFNESS), "external": DAMPING}
    return build_model(jeffcott_rig(abs(PUSH) / MASS, np.angle(PUSH), *([effect] if effect else []), **known))


def stepped_jeffcott(speeds, opening, angle, **more):
    """Harmonics (speed, harmonic) of the same rotor by the independent simulator."""
    return cracked_jeffcott(speeds, ORDERS, MASS, STIFFNESS, DAMPING, PUSH, LOSS, angle, opening, **more)


@pytest.mark.parametrize("weight_only", [False, True])
@pytest.mark.parametrize(
    "opening, degrees", [("switching", 60), ("breathing", 200), ("power_cosine", -35), ("open", 110)]
)
def test_a_crack_at_any_angle_moves_the_rotor_as_stepped_in_time(opening, degrees, weight_only):
    angle, speed = np.deg2rad(degrees), 200.0
    kind = "breathing_crack_weight" if weight_only else "breathing_crack"
    own = jeffcott(kind=kind, crack=opening, crack_angle_rad=float(angle))
    (seen,) = stepped_jeffcott([speed], opening, angle, weight_only=weight_only)
    shown = measured_response(own, [speed], ORDERS)[0, :, 0]
    effect = np.abs(shown - measured_response(jeffcott(), [speed], ORDERS)[0, :, 0]).max()
    assert np.abs(shown - seen).max() < 1e-3 * effect
    unturned = jeffcott(kind=kind, crack=opening)
    assert np.abs(measured_response(unturned, [speed], ORDERS)[0, :, 0] - seen).max() > 0.1 * effect


@pytest.mark.parametrize("opening", ["switching", "breathing"])
@pytest.mark.parametrize("speed", [400.0, 900.0])
def test_a_crack_opened_by_the_deflection_moves_the_rotor_as_stepped_in_time(speed, opening):
    """Below and above the critical speed, with more vibration than sag; by the weight it moves otherwise (control)."""
    push, angle, turns = 12 * abs(PUSH), 0.6, 160
    share = {"switching": lambda r: r.real > 0, "breathing": lambda r: (1 + np.cos(np.angle(r))) / 2}[opening]

    def acceleration(t, state):
        (x, y), velocity = state[:2], state[2] + 1j * state[3]
        turned = np.exp(1j * (speed * t + angle))
        r = (x + 1j * y) / turned
        force = LOSS * share(r) * r.real * turned + push * speed**2 * np.exp(1j * speed * t)
        found = (force - STIFFNESS * (x + 1j * y) - DAMPING * velocity) / MASS + 9.80665
        return [velocity.real, velocity.imag, found.real, found.imag]

    period = 2 * np.pi / speed
    times = (turns + np.arange(512) / 512) * period
    stepped = solve_ivp(acceleration, [0, times[-1]], np.zeros(4), t_eval=times, rtol=1e-8, atol=1e-13).y
    series = np.fft.fft(stepped[0] + 1j * stepped[1]) / 512

    def off(opened_by):
        crack = {"crack": opening, "opened_by": opened_by, "crack_angle_rad": angle, "stiffness_loss_N_per_m": LOSS}
        known = {"rotor": point(MASS, STIFFNESS), "external": DAMPING}
        model = build_model(jeffcott_rig(push / MASS, 0.0, {"kind": "breathing_crack", **crack}, **known))
        shown = measured_response(model, [speed], ORDERS)[0, 1:, 0]  # 0X counts from the sag
        return np.abs(shown - series[ORDERS[1:]]).max()

    assert off("deflection") < 1e-3 * off("weight")


SHAFT_SPEEDS = [70.0, 120.0]
BETWEEN = {"discs": {2: (2.0, 0.0048, 0.0024), 4: (1.5, 0.003, 0.0015)},
           "bearings": {1: (1e6, 8e5, 600.0), 5: (1.2e6, 9e5, 600.0)},
           "unbalances": {2: 2e-5 * np.exp(0.8j), 4: 1e-5 * np.exp(0.3j)}}  # fmt: skip
OVERHUNG = {"discs": {5: (2.0, 0.0048, 0.0024)}, "unbalances": {5: 1e-6 * np.exp(0.8j)},
            "bearings": {1: (1e6, 8e5, 600.0), 3: (1.2e6, 9e5, 600.0)}}  # fmt: skip


def finite_elements(machine, crack=None):
    """The same shaft for the package; crack : options of the effect."""
    discs = [disc(n, *sizes) for n, sizes in machine["discs"].items()]
    bearings = [springs([n], (kx, ky), (c, c))[0] for n, (kx, ky, c) in machine["bearings"].items()]
    sizes = machine["unbalances"].items()
    pushed = [unbalance(n, float(abs(u)), float(np.angle(u)), label=str(n), mass_kg=1.0) for n, u in sizes]
    cracks = [{"kind": "breathing_crack", **crack}] if crack else []
    lossy = {"kind": "shaft_damping", "shaft_damping_s": 1e-4}
    return build_model(rig_of(shaft(0.6, 4, *discs), bearings, lossy, *pushed, *cracks))


def moved_by_a_crack(machine, crack):
    """Harmonics at all nodes that a crack of the package adds to those without it."""
    with_crack, without = (measured_response(finite_elements(machine, c), SHAFT_SPEEDS, ORDERS) for c in (crack, None))
    return with_crack, np.abs(with_crack - without).max()


@pytest.mark.parametrize("degrees", [60, 200])
def test_a_crack_in_an_element_moves_the_rotor_as_stepped_in_time(degrees):
    """The tolerance is the error of 256 steps a turn."""
    angle = float(np.deg2rad(degrees))
    seen = cracked_shaft(SHAFT_SPEEDS, ORDERS, **BETWEEN, element=2, loss=0.15, angle=angle, opening="breathing")
    crack = {"crack": "breathing", "crack_angle_rad": angle, "element": 2, "stiffness_loss": 0.15}
    shown, effect = moved_by_a_crack(BETWEEN, crack)
    assert np.abs(shown - seen).max() < 1e-2 * effect


@pytest.mark.parametrize("machine, element", [(OVERHUNG, 4), (BETWEEN, 2)], ids=["overhung", "between"])
def test_a_crack_opens_where_the_weight_stretches_the_shaft(machine, element):
    """The integrated crack opens by the curvature of the moving shaft, which the weight dominates here."""
    small = {**machine, "unbalances": {node: 0.05 * u for node, u in machine["unbalances"].items()}}
    seen = cracked_shaft(SHAFT_SPEEDS, ORDERS, **small, element=element, loss=0.05, angle=1.0, opening=None)
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
