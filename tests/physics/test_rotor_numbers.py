"""The numbers of a rotor as parameters: their table against rotors that are built anew with other numbers."""

import numpy as np
import pytest
from machines import disc, jeffcott_rig, point, shaft, spectrum_of, springs, unbalance
from one_line_errors import refused

from rotorstudy import Problem, build_model, make_term, registry, time_response
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.model.estimated_rig import rig_with_estimate
from rotorstudy.model.rig_numbers import rig_with_changes, with_numbers
from rotorstudy.model.variation import Matrices, Variation
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.measured import measured_response, measured_response_and_jacobian
from rotorstudy.response.stability import eigenvalues, growth_of_free_motion
from rotorstudy.response.statics import static_deflection

SPEEDS, HARMONICS = [60.0, 140.0, 260.0], [0, 1, -1, 2, -2]
STRETCHES = [{"length_m": 0.25, "count": 3}, {"length_m": 0.35, "count": 4, "outer_diameter_m": 0.022}]
SHAFT = {"kind": "finite_element", "elements": STRETCHES, "outer_diameter_m": 0.02}
SHAFT["discs"] = [disc(3), disc(6, 1.5, 0.0030, 0.0015)]
# effects that do not take a matrix of the rotor into their own table
EFFECTS = [
    {"kind": "external_damping", "node": 4, "external_damping_N_s_per_m": 80.0},
    unbalance(3, 1e-5, 0.4, mass_kg=2.0),
]
BEARINGS = springs((1, 8), (8e5, 5e5), (300.0, 250.0))
SPRINGS = [
    {"kind": "support_stiffness", "node": node, "label": str(node), "support_stiffness_N_per_m": 6e5} for node in (1, 8)
]
CRACK = [{"kind": "switching", "node": 4, "stiffness_loss_22_N_per_m": 3e4, "stiffness_loss_44_N_m": 0.0}]
PINNED = {**SHAFT, "pinned_nodes": [1, 8]}
MOVING = [{**CRACK[0], "weight_dominance": False}]
SUPPORTS = {
    "bearings": {"rotor": SHAFT, "bearings": BEARINGS, "cracks": CRACK, "effects": EFFECTS},
    "rigid supports": {"rotor": PINNED, "cracks": CRACK, "effects": EFFECTS},
    "springs of effects": {"rotor": SHAFT, "effects": [*EFFECTS, *SPRINGS]},
    "periodic crack": {"rotor": PINNED, "cracks": MOVING, "effects": EFFECTS},
}
NUMBERS = ("rotor.youngs_modulus_Pa", "rotor.discs[0]", "rotor.outer_diameter_m", "rotor.elements[1].length_m")


def changed(rig, name, change):
    return build_model(rig_with_changes(rig, build_model(rig), {name: change}))


@pytest.mark.parametrize("sensors", [[3, 6], [2, 3, 4, 5, 6, 7]], ids=["two sensors", "six sensors"])
@pytest.mark.parametrize("supports", SUPPORTS)
def test_the_derivatives_are_those_of_rotors_that_are_built_with_other_numbers(supports, sensors):
    rig = {**SUPPORTS[supports], "sensors": sensors}
    model = with_numbers(build_model(rig), NUMBERS)
    found = measured_response_and_jacobian(model, SPEEDS, HARMONICS, order=5)
    assert found.response == pytest.approx(measured_response(build_model(rig), SPEEDS, HARMONICS, order=5), rel=1e-9)
    step = 1e-5
    for name in NUMBERS:
        above, below = (measured_response(changed(rig, name, s), SPEEDS, HARMONICS, order=5) for s in (step, -step))
        difference = (above - below) / (2 * step)
        column = found.jacobian[..., model.names.index(name)]
        # differences of the response: truncation step^2 times the third power of the resonance magnification
        assert np.abs(column - difference).max() < 1e-5 * np.abs(difference).max(), name
        assert np.abs(difference).max() > 1e-3 * np.abs(found.response).max()


@pytest.mark.parametrize("supports", SUPPORTS)
def test_large_changes_are_those_of_a_rotor_that_is_built_with_other_numbers(supports):
    rig = {**SUPPORTS[supports], "sensors": [3, 6]}
    model = with_numbers(build_model(rig), NUMBERS)
    theta = model.theta.copy()
    theta[model.position(NUMBERS)] = changes = [0.1, -0.2, 0.25, -0.15]
    true = build_model(rig_with_changes(rig, model, dict(zip(NUMBERS, changes, strict=True))))
    shown = measured_response(model, SPEEDS, HARMONICS, theta, order=5)
    expected = measured_response(true, SPEEDS, HARMONICS, order=5)
    assert np.abs(shown - expected).max() < 1e-9 * np.abs(expected).max()
    at = static_deflection(model, SPEEDS, theta[: len(model.rotor_unknowns)]).value
    expected = static_deflection(true, SPEEDS, true.theta[: len(true.rotor_unknowns)]).value
    assert np.abs(at - expected).max() <= 1e-9 * np.abs(expected).max()
    column = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta, order=5).jacobian[..., -1]
    step = np.zeros_like(theta)
    step[model.names.index(NUMBERS[-1])] = 1e-6
    above, below = (measured_response(model, SPEEDS, HARMONICS, theta + s * step, order=5) for s in (1, -1))
    difference = (above - below) / 2e-6
    assert model.names[-1] == NUMBERS[-1]
    assert np.abs(column - difference).max() < 1e-5 * np.abs(difference).max()


def test_free_and_transient_motions_are_those_of_a_rotor_that_is_built_with_other_numbers():
    rig = SUPPORTS["rigid supports"] | {"cracks": []}
    model = with_numbers(build_model(rig), NUMBERS)
    theta = model.theta.copy()
    theta[model.position(NUMBERS)] = changes = [0.1, -0.2, 0.25, -0.15]
    nominal = build_model(rig)
    true = build_model(rig_with_changes(rig, nominal, dict(zip(NUMBERS, changes, strict=True))))
    found, expected, stated = eigenvalues(model, SPEEDS, theta), eigenvalues(true, SPEEDS), eigenvalues(nominal, SPEEDS)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(stated - expected).max() > 0.05 * np.abs(expected).max()
    time, still = np.linspace(0, 2e-3, 5), np.zeros(len(model.structure.dofs))
    start = [still + 1e-6, still]
    moved, expected, stated = (
        time_response(one, SPEEDS[1], time, given, start=start)
        for one, given in ((model, theta), (true, None), (nominal, None))
    )
    assert np.abs(moved - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(stated - expected).max() > 0.05 * np.abs(expected).max()


def test_a_turning_stiffness_grows_at_the_speeds_of_the_rotor_that_is_built_with_other_numbers():
    asymmetry = {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.05, "shaft_asymmetry_phase_rad": 0.3}
    model = with_numbers(build_model(jeffcott_rig(None, None, asymmetry, external=20.0)), ["rotor.stiffness_N_per_m"])
    theta = model.theta.copy()
    theta[model.position(["rotor.stiffness_N_per_m"])] = 0.05
    rotors = (point(2.0, stiffness) for stiffness in (1.05 * 7.6e5, 7.6e5))
    true, nominal = (build_model(jeffcott_rig(None, external=20.0, rotor=rotor)) for rotor in rotors)
    # the asymmetry takes its pattern from the nominal stiffness: 0.05 of it
    turning = {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.05 / 1.05, "shaft_asymmetry_phase_rad": 0.3}
    true = true.plus(make_term("effect", turning, true.structure, true.sensors))
    nominal = nominal.plus(make_term("effect", asymmetry, nominal.structure, nominal.sensors))
    speeds = np.sqrt(7.6e5 / 2.0) * np.array([1.0, 1.024, 1.05])
    found, expected, stated = (
        periodic_growth_rate(one, speeds, given) for one, given in ((model, theta), (true, None), (nominal, None))
    )
    assert found == pytest.approx(expected, abs=1e-6)
    assert (np.sign(expected) != np.sign(stated)).any()


def test_numbers_that_enter_linearly_build_no_rotor_again():
    model = build_model(SUPPORTS["bearings"])
    for names, linear in ((NUMBERS[:2], True), (NUMBERS, False)):
        (term,) = (term for term in with_numbers(model, names).terms if term.variation)
        assert term.variation.is_linear == linear
        change = np.full(len(names), 0.03)
        found, true = term.variation.at(change), term.variation.build(tuple(change))
        for one, other in zip(found, true, strict=True):
            assert np.abs(one - other).max() <= 1e-9 * np.abs(other).max()


def test_many_trials_are_each_their_own():
    model = with_numbers(build_model({**SUPPORTS["bearings"], "sensors": [3, 6]}), NUMBERS)
    theta = np.tile(model.theta, (3, 1))
    theta[:, model.position(NUMBERS)] = np.random.default_rng(1).normal(0, 0.01, (3, 4))
    together = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta)
    for i in range(3):
        alone = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta[i])
        assert np.abs(together.response[i] - alone.response).max() < 1e-12 * np.abs(alone.response).max()
        assert together.jacobian[i] == pytest.approx(alone.jacobian, rel=1e-9, abs=1e-18)


def test_a_new_rotor_keeps_what_was_not_changed_and_has_the_new_numbers():
    rig = {**SUPPORTS["bearings"], "sensors": [3, 6]}
    model = with_numbers(build_model(rig), NUMBERS[:2])
    found = rig_with_estimate(rig, model, NUMBERS[:2], np.array([0.1, -0.2]), np.diag([0.011, 0.004]) ** 2)
    assert found["rotor"]["youngs_modulus_Pa"] == pytest.approx(1.1 * 2.1e11)  # a default before
    assert found["rotor"]["discs"][0]["mass_kg"] == pytest.approx(1.6)
    assert found["rotor"]["discs"][0]["polar_moment_kg_m2"] == pytest.approx(0.8 * 0.0048)
    assert found["rotor"]["discs"][1] == rig["rotor"]["discs"][1]
    assert found["rotor"]["elements"] == rig["rotor"]["elements"]
    assert found["prior"]["standard_deviations"] == pytest.approx([0.01, 0.005])  # relative to the new value
    again = build_model(found)
    assert again.uncertainty.names == NUMBERS[:2]
    assert again.theta[again.position(NUMBERS[:2])] == pytest.approx([0, 0])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rotor.youngs_modulus", "did you mean 'rotor.youngs_modulus_Pa'"),
        ("rotor.discs[7].mass_kg", r"did you mean 'rotor.discs\[1\].mass_kg'"),
        ("rotor.inner_diameter_m", "unknown number of the rotor"),  # zero: a share of it is nothing
        ("rotor.theory", "unknown number of the rotor"),
    ],
)
def test_a_number_that_the_rotor_does_not_have_is_refused(name, words):
    refused(lambda: with_numbers(build_model(SUPPORTS["bearings"]), [name]), match=words)


def test_a_number_that_the_rotor_does_not_depend_on_is_refused():
    model = with_numbers(build_model({"rotor": point()}), ["rotor.gravity_m_per_s2"])  # the weight
    assert model.names == ("rotor.gravity_m_per_s2",)
    stiff = {"kind": "offset_disc", **registry().plugins["rotor"]["offset_disc"].example}
    for key in ("a_m", "b_m", "diameter_m"):
        stiff.pop(key)
    stiff |= {"k22_N_per_m": 3.5e5, "k24_N": 2e4, "k44_N_m": 1.7e4}
    refused(lambda: with_numbers(build_model({"rotor": stiff}), ["rotor.youngs_modulus_Pa"]), "does not depend on it")


def test_estimators_of_the_equations_refuse_the_numbers_of_the_rotor():
    rig = {**SUPPORTS["bearings"], "sensors": [1, 2, 3, 4, 5, 6, 7, 8]}
    model = with_numbers(build_model(rig), NUMBERS[:1])
    with pytest.raises(RotorstudyError, match="maximum_likelihood"):
        Problem(model, spectrum_of(model, SPEEDS, HARMONICS, 1e-8), NUMBERS[:1]).equations()


def test_numbers_that_make_no_rotor_leave_no_steady_state():
    """A fit may try a modulus below zero: the root in its shear is no number, which is nobody's warning."""
    rotor = Variation(lambda change: Matrices(*(np.sqrt([1 + change[0]]) for _ in range(4))), 1)
    assert rotor.at(np.array([3.0])).mass == pytest.approx(2.0)
    with pytest.raises(NoSteadyState, match="no rotor with these numbers: its matrices are not finite"):
        rotor.at(np.array([-2.0]))


@pytest.mark.parametrize("crack", [[], [{"kind": "transverse_crack", "position_m": 0.6, "flexibility_factor": 1.0}]])
@pytest.mark.parametrize("count", [20, 40])  # of all coordinates, and of few shapes
def test_a_motion_grows_where_a_fit_makes_a_mass_negative(count, crack):
    middle = count // 2 + 1
    rotor = shaft(1.5, count, disc(middle, 15.0, 0.2, 0.1), outer_diameter_m=0.04)
    rig = {"rotor": rotor, "bearings": springs([1, count + 1], 2e7, 500.0), "sensors": [middle]}
    model = with_numbers(build_model({**rig, "effects": [unbalance(middle, 1e-5), *crack]}), ["rotor.discs[0].mass_kg"])
    theta = np.where(np.array(model.names) == "rotor.discs[0].mass_kg", -10.0, model.theta)
    assert (growth_of_free_motion(model, [100.0, 200.0], theta) > 0).all()
    assert (growth_of_free_motion(model, [100.0, 200.0]) < 0).all()  # the negative control
