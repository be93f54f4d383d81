"""Cracks at any angle against motions stepped in time in real x and y, from which they are named."""

from dataclasses import replace

import numpy as np
import pytest
from cracked_rotor import cracked_jeffcott, cracked_shaft
from machines import SLOW, disc, jeffcott_rig, point, readings, rig_of, shaft, springs, unbalance
from scipy.integrate import solve_ivp

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis.verdict.investigate import investigate

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


def test_a_crack_without_a_known_bending_opens_below():
    model = finite_elements(OVERHUNG)
    weightless = replace(model.structure, static_load=np.zeros(len(model.structure.dofs)))
    one_bearing = replace(model.structure, bearing_nodes=(3,))
    assert weightless.tension_side(4) == one_bearing.tension_side(4) == 1
    assert model.structure.tension_side(None) == jeffcott().structure.tension_side(None) == 1  # at no element


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
