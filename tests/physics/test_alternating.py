"""Rub, looseness, clearance and cubic stiffness: closed forms, the independent simulator, what is known of them."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from machines import errors_of_derivatives, jeffcott_rig, point, point_machine, spectrum_of, stepped
from one_line_errors import refused

from rotorstudy import Entry, NonlinearForce, Problem, build_model, harmonic_response, registry
from rotorstudy.authoring.invariants.base import BrokenInvariant
from rotorstudy.authoring.invariants.bench import bench_structure, typical_term
from rotorstudy.authoring.invariants.effect import check_steady_state
from rotorstudy.blind.machines.contacts import add_one_sided_loss, add_rub, add_stiffening, by_differences
from rotorstudy.blind.machines.effects import add_preload
from rotorstudy.blind.machines.machine import LocalForce
from rotorstudy.errors import PluginError
from rotorstudy.response.alternating import _seen_in_time, nonlinear_columns
from rotorstudy.response.coupling import COUPLED_ORDER
from rotorstudy.response.stability import check_stable, eigenvalues

MASS, STIFFNESS, DAMPING, ECCENTRICITY = 2.0, 7.6e5, 150.0, 2e-5
EVERY = np.arange(-COUPLED_ORDER, COUPLED_ORDER + 1)


def rotor(*effects, gravity=9.81, eccentricity=ECCENTRICITY):
    disc = point(MASS, STIFFNESS, gravity_m_per_s2=gravity)
    return build_model(jeffcott_rig(eccentricity, None, *effects, external=DAMPING, rotor=disc))


RUB = {"kind": "rub", "clearance_m": 3e-5, "friction_ratio": 0.1, "rub_stiffness_N_per_m": 2e5}
LOOSE = {"kind": "looseness", "lift_m": 1e-5, "stiffness_lost_in_lift_N_per_m": 3e5}
CUBIC = {"kind": "cubic_stiffness", "cubic_stiffness_N_per_m3": 2e13}
SQUARE = {**CUBIC, "cubic_stiffness_N_per_m3": 0.0, "quadratic": True, "quadratic_stiffness_N_per_m2": 5e8}
ALONG = {**CUBIC, "axes": True, "cubic_stiffness_0_deg_N_per_m3": 8e12, "cubic_stiffness_45_deg_N_per_m3": -5e12}
STOP = {**RUB, "clearance_m": 1.5e-5, "offset_ratio": 0.7, "contact_angle_rad": 2.0}
ASIDE = {**LOOSE, "direction_rad": -1.1}
BOLTED = {**LOOSE, "direction_rad": 2.0, "lift_m": -3e-6, "play_m": 8e-6}
UNEVEN = {**BOLTED, "gap_spread_m": 4e-6}
CLEARANCE = {"kind": "support_clearance", "clearance_m": 1e-5, "stiffness_lost_in_clearance_N_per_m": 3e5}
WORN = {**CLEARANCE, "rest_ratio": 0.8, "rest_angle_rad": 2.0, "spread_ratio": 0.2}


PRELOAD = {"kind": "static_preload", "static_preload_N": 12.0}  # off the middle of the ring, so that it rubs in part


def lossy(towards, lift, play=np.inf):
    """Adds a stiffness that is lost from some lift from the rest on, for some way."""
    n = np.array([np.cos(towards), np.sin(towards)])
    return lambda machine, rest: add_one_sided_loss(machine, 0, 3e5, towards, play, start=rest @ n + lift)


def scattered(force, spread, along):
    """Adds the mean over normal errors e of a gap, of standard deviation `spread`, of force(x, e) along along(y)."""
    x, points = np.linspace(-1e-4, 1e-4, 4001), np.linspace(-6, 6, 601)
    mean = np.average(force(x[:, None], spread * points), axis=1, weights=np.exp(-(points**2) / 2))

    def add(machine, rest):
        def law(turn, y, v, speed):
            way, direction = along(y - rest)
            return np.interp(way, x, mean)[:, None] * direction

        machine.local.append(LocalForce(np.eye(4)[:, :2], by_differences(law, 1e-4, 1e-4), "contact"))

    return add


def seat(x, error):
    return 3e5 * np.clip(x + 3e-6 + error, 0, 8e-6)


def support(r, error):
    return 3e5 * np.minimum(r, 1e-5 + error)


def lifting(y):
    n = np.array([np.cos(np.pi + 2.0), np.sin(np.pi + 2.0)])
    return y @ n, n


def from_the_centre(y):
    away = y + 0.8e-5 * np.array([np.cos(2.0), np.sin(2.0)])
    r = np.linalg.norm(away, axis=1)
    return r, away / r[:, None]


def ring(clearance, away=0.0, preload=0.0):
    """Adds a ring whose middle lies away from the rest, against 2 rad; its friction is that of fast sliding."""

    def add(machine, rest):
        add_rub(machine, 0, 2e5, clearance, 0.1, 1.0, rest - away * np.array([np.cos(2.0), np.sin(2.0)]))
        add_preload(machine, 0, preload, 0.0)

    return add


@pytest.mark.parametrize(
    ("effects", "add", "w", "tolerance"),
    [
        pytest.param([RUB, PRELOAD], ring(3e-5, preload=12.0), 450.0, 2e-4, id="partial rub"),
        pytest.param([STOP], ring(5e-5, 3.5e-5), 480.0, 2e-4, id="stop on one side"),
        pytest.param([LOOSE], lossy(np.pi, 1e-5), 450.0, 2e-4, id="looseness"),
        pytest.param([ASIDE], lossy(np.pi - 1.1, 1e-5), 450.0, 2e-4, id="looseness aside"),
        pytest.param([BOLTED], lossy(np.pi + 2.0, -3e-6, 8e-6), 450.0, 2e-4, id="looseness held by bolts"),
        pytest.param([UNEVEN], scattered(seat, 4e-6, lifting), 450.0, 2e-4, id="looseness of an uneven seat"),
        pytest.param([WORN], scattered(support, 2e-6, from_the_centre), 450.0, 2e-4, id="support with clearance"),
        pytest.param([CUBIC], lambda machine, rest: add_stiffening(machine, 0, 0.0, 2e13), 300.0, 1e-5, id="cubic"),
    ],
)
def test_steady_state_is_that_of_the_independent_simulator(effects, add, w, tolerance):
    """To the error of 1024 steps a turn."""
    found = harmonic_response(rotor(*effects), [w], EVERY)[0, :, 0]
    linear = harmonic_response(rotor(*effects[1:]), [w], EVERY)[0, :, 0]
    machine, rest = point_machine(MASS, STIFFNESS, DAMPING, MASS * ECCENTRICITY)
    add(machine, rest[:2])
    expected = stepped(machine, [w], EVERY, 1024, rest)[0, :, 0]
    felt = np.abs(expected - linear).max()
    assert felt > 0.01 * np.abs(linear).max()
    assert np.abs(found - expected).max() < tolerance * felt


@pytest.mark.parametrize(
    ("effect", "gravity", "w", "pull", "within"),
    [
        (CUBIC, 0.0, 450.0, lambda r: 2e13 * r**3, (0.0, 1e-3)),
        (SQUARE, 0.0, 450.0, lambda r: 5e8 * r**2, (0.0, 1e-3)),
        (CLEARANCE, 0.0, 100.0, lambda r: -3e5 * r, (0.0, 1e-5)),
        (CLEARANCE, 0.0, 450.0, lambda r: -3e5 * 1e-5, (1e-5, 1e-3)),
        # Choy and Padovan 1987; the ring is about the rest
        (RUB, 9.81, 500.0, lambda r: 2e5 * (1 + 0.1j) * (r - 3e-5), (3e-5, 1e-3)),
    ],
    ids=["cubic", "quadratic", "within the clearance", "beyond the clearance", "full annular rub"],
)
def test_circular_whirl_is_that_of_the_closed_form(effect, gravity, w, pull, within):
    """(k - m w^2 + j w c) r e^{ja} + pull(r) e^{ja} = m e w^2."""
    found = harmonic_response(rotor(effect, gravity=gravity), [w], EVERY)[0, :, 0]
    first = found[EVERY == 1][0]
    r = np.abs(first)
    left = (STIFFNESS - MASS * w**2 + 1j * w * DAMPING) * r + pull(r)
    assert first * left / r == pytest.approx(MASS * ECCENTRICITY * w**2, rel=1e-9)
    assert within[0] < r < within[1] and np.abs(pull(r)) > 0.01 * STIFFNESS * r
    assert np.abs(found[EVERY != 1]).max() < 1e-10 * r


@pytest.mark.parametrize("power", [2, 1])
def test_a_support_that_stiffens_along_an_axis_has_a_potential(power):
    """-(k + a cos 2 phi + b sin 2 phi) |r|^(p + 2) / (p + 2), whose gradient is the force."""
    k, a, b = 3.0, 1.2, -0.8
    effect = registry().get("effect", "cubic_stiffness").function
    forces = [p.force.function for p in effect(bench_structure(), 1, quadratic=True, axes=True)[-3 * (power == 1) :]]

    def potential(x, y):
        r, twice = np.hypot(x, y), 2 * np.arctan2(y, x)
        return -(k + a * np.cos(twice) + b * np.sin(twice)) * r ** (power + 2) / (power + 2)

    x, y = np.random.default_rng(5).normal(size=(2, 50))
    step = 1e-6
    by_x = (potential(x + step, y) - potential(x - step, y)) / (2 * step)
    by_y = (potential(x, y + step) - potential(x, y - step)) / (2 * step)
    found = sum(size * force(x + 1j * y, None, None) for size, force in zip((k, a, b), forces, strict=False))
    assert found == pytest.approx(by_x + 1j * by_y, abs=1e-7)
    assert all(force(np.zeros(1, complex), None, None) == 0 for force in forces)


def test_inside_the_clearance_and_below_the_lift_nothing_happens():
    plain = harmonic_response(rotor(), [150.0], EVERY)
    for effect in (RUB, STOP, LOOSE, ASIDE):
        assert np.abs(harmonic_response(rotor(effect), [150.0], EVERY) - plain).max() < 1e-12 * np.abs(plain).max()
        assert np.abs(harmonic_response(rotor(effect), [480.0], EVERY) - plain).max() > 0.1 * np.abs(plain).max()


@pytest.mark.parametrize("effect", [RUB, LOOSE, CUBIC, ALONG, WORN], ids=lambda e: e["kind"])
def test_derivatives_are_those_of_the_response(effect):
    model = rotor(effect, PRELOAD)
    steps = 1e-4 * np.where(model.theta == 0, ECCENTRICITY, np.abs(model.theta))
    assert errors_of_derivatives(model, [470.0, 485.0], EVERY, steps).max() < 1e-3


@pytest.mark.parametrize("effect", [RUB, LOOSE, CUBIC], ids=lambda e: e["kind"])
def test_it_is_identified_from_the_linear_start(effect):
    true, speeds = rotor(effect, PRELOAD), np.array([420.0, 450.0, 480.0])
    spectrum = spectrum_of(true, speeds, EVERY, 1e-9)
    name = true.names[-3]
    sought = rotor({key: value for key, value in effect.items() if "stiffness" not in key or key == "kind"}, PRELOAD)
    problem = Problem(sought, spectrum, (name, "eccentricity_real", "eccentricity_imag"))
    found = registry().get("estimator", "maximum_likelihood").function(problem)
    assert found.theta == pytest.approx(true.theta[true.position(problem.names)], rel=1e-6, abs=1e-12)
    refused(lambda: registry().get("estimator", "least_squares").function(problem), "multiplies a nonlinear force")


def test_a_column_for_screening_is_the_force_at_the_motion():
    model = rotor(CUBIC, gravity=0.0)
    amplitude = np.zeros((2, len(EVERY), 1), complex)
    amplitude[:, EVERY == 1, 0] = [[3e-5], [4e-5j]]
    (_, force), *_ = model.nonlinear_forces
    column = nonlinear_columns([force], amplitude, np.array([100.0, 200.0]), EVERY, np.zeros(1)).value
    assert column == pytest.approx(-(np.abs(amplitude) ** 2) * amplitude, abs=1e-25)


@pytest.mark.parametrize(("lift", "play", "switches"), [(-1e-3, 2e-3, False), (-1e-3, 1e-4, False), (0.0, None, True)])
def test_a_support_that_never_lifts_off_or_lands_is_linear(lift, play, switches):
    """Always lifted a constant and a stiffness, beyond its play a constant: only the third opens and closes."""
    loose = {"kind": "looseness", "lift_m": lift, "play_m": play, "stiffness_lost_in_lift_N_per_m": 1e4}
    (_, force), *_ = rotor(loose).nonlinear_forces
    amplitude = np.zeros((2, len(EVERY), 1), complex)
    amplitude[:, EVERY == 1, 0] = [[3e-5], [4e-5j]]
    moved, *others = _seen_in_time(force.matrix, amplitude, np.array([100.0, 200.0]), EVERY, np.array([1e-4]))
    given, moved = force.at(moved, *others).ravel(), moved.ravel()
    affine = np.column_stack([np.full(len(moved), 1e-5), moved, moved.conj()])
    left = np.linalg.norm(given - affine @ np.linalg.lstsq(affine, given)[0]) / np.linalg.norm(given)
    assert left > 0.1 if switches else left < 1e-9


def test_a_rotor_that_is_not_linear_has_no_eigenvalues():
    check_stable(rotor(RUB), [100.0])
    refused(lambda: eigenvalues(rotor(RUB), [100.0]), "is nonlinear")


def test_a_steady_state_that_is_none_is_found_out(monkeypatch):
    from rotorstudy.authoring.invariants import effect as invariants

    structure = bench_structure()
    plugin = registry().get("effect", "cubic_stiffness")
    term = typical_term(plugin, structure, {"node": 1})
    check_steady_state(term, structure)
    right = invariants.harmonic_response
    with monkeypatch.context() as patch:
        patch.setattr(invariants, "harmonic_response", lambda *given: 1.01 * right(*given))
        with pytest.raises(BrokenInvariant, match="differ"):
            check_steady_state(term, structure)
    with pytest.raises(BrokenInvariant):
        check_steady_state(replace(term, values={"cubic_stiffness": 0.0}), structure)


@pytest.mark.parametrize(
    "wrong",
    [{"is_complex": True}, {"entries": (Entry(np.eye(1)),)}, {"force": NonlinearForce(np.eye(2), None)}],
    ids=["complex", "with entries", "of another rotor"],
)
def test_a_force_in_time_that_the_engine_would_misread_is_refused(wrong, monkeypatch):
    zoo, good = registry().plugins["effect"], registry().get("effect", "cubic_stiffness")
    plugin = replace(good, name="wrong", function=lambda structure: [replace(*good.function(structure), **wrong)])
    monkeypatch.setitem(zoo, "wrong", plugin)
    with pytest.raises(PluginError, match="multiplies a force in time"):
        rotor({"kind": "wrong"})


def test_the_arguments_of_closures_of_one_function_are_looked_at_once(monkeypatch):
    """A search makes thousands. One of another function that takes too few is refused, whenever it comes."""
    seen, true = [], inspect.signature
    monkeypatch.setattr(inspect, "signature", lambda function: seen.append(function) or true(function))

    def closure(size):
        return lambda z, v, still: size * z

    assert all(NonlinearForce(np.eye(1), closure(size)).takes_its_arguments for size in range(5)) and len(seen) == 1
    assert not NonlinearForce(np.eye(1), closure(1.0), takes_angle=True).takes_its_arguments
    assert not any(NonlinearForce(np.eye(1), lambda z, v: z).takes_its_arguments for _ in range(2))
