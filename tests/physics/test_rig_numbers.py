"""The numbers of a rig as parameters: of rotors, every bearing and films, against rigs built with other numbers."""

from dataclasses import replace

import numpy as np
import pytest
from machines import disc, jeffcott_rig, point, shaft, springs, unbalance
from one_line_errors import refused

from rotorstudy import build_model, eigenvalues, harmonic_response, registry, time_response
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings, check_names
from rotorstudy.errors import NoSteadyState
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.estimated_rig import rig_with_estimate, rig_with_values
from rotorstudy.model.rig_numbers import changeable_numbers, numbers, with_numbers
from rotorstudy.model.variation import Matrices, Variation
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.measured import measured_response, measured_response_and_jacobian
from rotorstudy.response.stability import growth_of_free_motion
from rotorstudy.response.statics import static_deflection

SPEEDS, HARMONICS, ORDER = [60.0, 140.0, 260.0], [0, 1, -1, 2, -2], 5
STRETCHES = [{"length_m": 0.25, "count": 3}, {"length_m": 0.35, "count": 4, "outer_diameter_m": 0.022}]
SHAFT = {"kind": "finite_element", "elements": STRETCHES, "outer_diameter_m": 0.02}
SHAFT["discs"] = [disc(3), disc(6, 1.5, 0.0030, 0.0015)]
PINNED = {**SHAFT, "pinned_nodes": [1, 8]}
# effects that do not take a matrix of the rotor into their own table
EFFECTS = [
    {"kind": "external_damping", "node": 4, "external_damping_N_s_per_m": 80.0},
    unbalance(3, 1e-5, 0.4, mass_kg=2.0),
]
SPRINGS = [
    {"kind": "support_stiffness", "node": node, "label": str(node), "support_stiffness_N_per_m": 6e5} for node in (1, 8)
]
CRACK = [{"kind": "switching", "node": 4, "stiffness_loss_22_N_per_m": 3e4, "stiffness_loss_44_N_m": 0.0}]
MOVING = [{**CRACK[0], "weight_dominance": False}]
ON_BEARINGS = {"rotor": SHAFT, "bearings": springs((1, 8), (8e5, 5e5), (300.0, 250.0)), "effects": EFFECTS}
SUPPORTS = {
    "bearings": ON_BEARINGS | {"cracks": CRACK, "sensors": [3, 6]},
    "bearings, six sensors": ON_BEARINGS | {"cracks": CRACK, "sensors": [2, 3, 4, 5, 6, 7]},
    "rigid supports": {"rotor": PINNED, "cracks": CRACK, "effects": EFFECTS, "sensors": [3, 6]},
    "springs of effects": {"rotor": SHAFT, "effects": [*EFFECTS, *SPRINGS], "sensors": [3, 6]},
    "periodic crack": {"rotor": PINNED, "cracks": MOVING, "effects": EFFECTS, "sensors": [3, 6]},
}
NUMBERS = ("rotor.youngs_modulus_Pa", "rotor.discs[0]", "rotor.outer_diameter_m", "rotor.elements[1].length_m")
CHANGES = dict(zip(NUMBERS, [0.1, -0.2, 0.25, -0.15], strict=True))

HEAVY = shaft(0.8, 4, disc(3, 60.0, 0.6, 0.3), outer_diameter_m=0.05)
JOURNAL = {"kind": "short_journal", **registry().plugins["bearing"]["short_journal"].example}
UNBALANCE = unbalance(3, 2e-5, 0.4)


def rig_on(item):
    own = {"kind": "linear", "node": 5, "bearing_stiffness_N_per_m": 2e7, "bearing_damping_N_s_per_m": 2e4}
    return {"rotor": HEAVY, "bearings": [{**item, "node": 1, "label": "left"}, own], "effects": [UNBALANCE]}


FILM = rig_on(JOURNAL) | {"sensors": [1, 3]}
FRAME = {"kind": "foundation_block", "node": 1, "second_node": 5, "label": "frame", "radius_of_gyration_m": 0.3,
         "centre_m": 0.2, "foundation_mass_kg": 200.0, "foundation_stiffness_xx_N_per_m": 3e7,
         "foundation_stiffness_yy_N_per_m": 2e7, "foundation_damping_xx_N_s_per_m": 1e4,
         "foundation_damping_yy_N_s_per_m": 1e4}  # fmt: skip
ON_FRAME = {"rotor": HEAVY, "bearings": springs((1, 5), 2e7, 2e4), "foundation": [FRAME], "effects": [UNBALANCE]}


def cases():
    """Rigs, and changes of their numbers: of rotors together, of every bearing one by one."""
    yield from (pytest.param(rig, CHANGES, id=name) for name, rig in SUPPORTS.items())
    for name, plugin in registry().plugins["bearing"].items():
        item = {"kind": name, **plugin.example}
        if name == "squeeze_film":
            item["centring_stiffness_N_per_m"] = 1e7
        own = [one for one in numbers(build_model(rig_on(item))) if one.startswith("bearings[left]")]
        yield from (pytest.param(rig_on(item), {number: 0.07}, id=f"{name} {number}") for number in own)
    yield pytest.param(ON_FRAME, {"bearings[frame].radius_of_gyration_m": 0.07}, id="foundation")


def off(found, true):
    """Largest difference over the largest value; 0 where both are zero."""
    return np.abs(found - true).max() / (np.abs(true).max() or 1.0)


def with_changes(rig, changes):
    """The model with numbers, its amplitudes with their changes, and the model of a rig with the other numbers."""
    model = with_numbers(build_model(rig), changes)
    theta = model.theta.copy()
    theta[model.position(changes)] = list(changes.values())
    return model, theta, build_model(rig_with_values(rig, model, changes))


@pytest.mark.parametrize(("rig", "changes"), list(cases()))
def test_a_rig_with_other_numbers_is_the_one_built_with_them(rig, changes):
    """Response and static deflection, and derivatives with and without the changes by differences of the response."""
    model, theta, true = with_changes(rig, changes)
    shown = measured_response(true, SPEEDS, HARMONICS, order=ORDER)
    assert off(measured_response(model, SPEEDS, HARMONICS, theta, order=ORDER), shown) < 1e-9
    at, expected = (
        static_deflection(one, SPEEDS, given[: len(one.rotor_unknowns)]).value
        for one, given in ((model, theta), (true, true.theta))
    )
    assert off(at, expected) < 1e-9
    for here in (model.theta, theta):
        found = measured_response_and_jacobian(model, SPEEDS, HARMONICS, here, order=ORDER).jacobian
        for place in model.position(changes):
            step = 3e-5 * np.eye(len(here))[place]
            up, down = (measured_response(model, SPEEDS, HARMONICS, here + s * step, order=ORDER) for s in (1, -1))
            # truncation step^2 times the third power of the resonance magnification. Both are zero for the speeds of
            # a table with equal values, and for one beyond those tried
            assert off(found[..., place], (up - down) / 6e-5) < 1e-5, model.names[place]


def decaying(model, theta=None):
    """Motion in time (time, coordinate) after a push."""
    start = np.full(len(model.structure.dofs), 1e-6)
    return time_response(model, 140.0, np.linspace(0, 2e-3, 5), theta, start=[start, 0 * start])


@pytest.mark.parametrize(
    ("rig", "changes"),
    [(SUPPORTS["rigid supports"] | {"cracks": []}, CHANGES), (FILM, {"bearings[left].viscosity_Pa_s": 0.3})],
    ids=["rotor", "film"],
)
def test_free_and_transient_motions_are_those_of_the_rig_built_with_other_numbers(rig, changes):
    model, theta, true = with_changes(rig, changes)
    for road in (
        lambda one, given: eigenvalues(one, SPEEDS, given),
        lambda one, given: harmonic_response(one, SPEEDS, HARMONICS, given),
        decaying,
    ):
        expected = road(true, None)
        assert off(road(model, theta), expected) < 1e-6
        assert off(road(model, None), expected) > 1e-4  # negative control


def test_a_turning_stiffness_grows_at_the_speeds_of_the_rotor_that_is_built_with_other_numbers():
    def built(stiffness, share):
        turning = {"kind": "shaft_asymmetry", "shaft_asymmetry": share, "shaft_asymmetry_phase_rad": 0.3}
        return build_model(jeffcott_rig(None, None, turning, external=20.0, rotor=point(2.0, stiffness)))

    stated, true = built(7.6e5, 0.05), built(1.05 * 7.6e5, 0.05 / 1.05)  # the asymmetry is a share of what is stated
    model = with_numbers(stated, ["rotor.stiffness_N_per_m"])
    theta = np.where(np.array(model.names) == "rotor.stiffness_N_per_m", 0.05, model.theta)
    speeds = np.sqrt(7.6e5 / 2.0) * np.array([1.0, 1.024, 1.05])
    expected = periodic_growth_rate(true, speeds)
    assert periodic_growth_rate(model, speeds, theta) == pytest.approx(expected, abs=1e-6)
    assert (np.sign(expected) != np.sign(periodic_growth_rate(stated, speeds))).any()


def test_numbers_that_enter_linearly_build_no_rotor_again():
    model = build_model(SUPPORTS["bearings"])
    for names, linear in ((NUMBERS[:2], True), (NUMBERS, False)):
        (term,) = (term for term in with_numbers(model, names).terms if term.variation)
        assert term.variation.is_linear == linear
        change = np.full(len(names), 0.03)
        for one, other in zip(term.variation.at(change), term.variation.build(tuple(change)), strict=True):
            assert off(one, other) <= 1e-9


@pytest.mark.parametrize("rig", [SUPPORTS["bearings"], FILM], ids=["rotor", "film"])
def test_many_trials_are_each_their_own(rig):
    names = NUMBERS if rig is not FILM else ["rotor.youngs_modulus_Pa", "bearings[left].viscosity_Pa_s"]
    model = with_numbers(build_model(rig), names)
    theta = np.tile(model.theta, (3, 1))
    theta[:, model.position(names)] = np.random.default_rng(1).normal(0, 0.01, (3, len(names)))
    together = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta)
    for i in range(3):
        alone = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta[i])
        assert off(together.response[i], alone.response) < 1e-12
        assert together.jacobian[i] == pytest.approx(alone.jacobian, rel=1e-9, abs=1e-18)


def test_the_damping_of_a_squeeze_film_falls_with_the_cube_of_its_clearance():
    item = {"kind": "squeeze_film", **registry().plugins["bearing"]["squeeze_film"].example}
    item["centring_stiffness_N_per_m"], name = 0.0, "bearings[left].radial_clearance_m"
    model = with_numbers(build_model(rig_on(item)), [name])
    (slope,) = (replace(term, values={name: 1.0}) for term in model.terms if term.is_bearing_number)

    def damping(term):
        narrow = replace(term, parameters=tuple(
            replace(p, entries=tuple(replace(e, matrix=np.asarray(e.matrix)[:1, :1]) for e in p.entries))
            for p in term.parameters
        ))  # fmt: skip
        return dynamic_stiffness(narrow, [150.0], [1])[0, 0].imag

    assert damping(slope) == pytest.approx(-3 * damping(model.terms[0]), rel=1e-7)


def test_no_clearance_becomes_zero_or_negative():
    model = with_numbers(build_model(FILM), ["bearings.radial_clearance_m"])
    theta = model.theta.copy()
    for change in (-1.0, -1.5):
        theta[model.position(["bearings.radial_clearance_m"])] = change
        with pytest.raises(NoSteadyState, match="zero or negative"):
            measured_response(model, SPEEDS, HARMONICS, theta)
    long = with_numbers(build_model(FILM), ["bearings.length_m"])
    with pytest.raises(NoSteadyState, match="no bearing with these numbers: short_journal: length_m / diameter_m"):
        measured_response(long, SPEEDS, HARMONICS, long.theta + 3.0 * (np.array(long.names) == "bearings.length_m"))


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


def test_a_change_without_a_node_is_that_of_all_bearings_with_the_number():
    """Of their oil; that of one bearing is another one (negative control). 0X counts from where other journals run."""
    two, moving = [{**JOURNAL, "node": node, "label": f"{node}"} for node in (1, 5)], HARMONICS[1:]
    thinner = [{**one, "viscosity_Pa_s": 0.7 * one["viscosity_Pa_s"]} for one in two]
    true = harmonic_response(build_model(FILM | {"bearings": thinner}), SPEEDS, moving)

    def error(**where):
        change = {"kind": "bearing_change", "number": "viscosity_Pa_s", "bearing_change": -0.3, **where}
        found = build_model(FILM | {"bearings": two, "effects": [UNBALANCE, change]})
        return off(harmonic_response(found, SPEEDS, moving), true)

    assert error() < 1e-12 and error(node=1) > 1e-3
    places = changeable_numbers(build_model(FILM | {"bearings": two}).structure)
    assert {"number": "viscosity_Pa_s"} in places and {"number": "viscosity_Pa_s", "node": 5} in places
    assert {"number": "viscosity_Pa_s"} not in changeable_numbers(build_model(FILM).structure)  # of one film


def test_a_rig_with_an_estimate_keeps_what_was_not_changed_and_has_the_new_numbers():
    rig = ON_BEARINGS | {"bearings": [{**JOURNAL, "node": 1, "label": "left"}, *springs([8], 8e5, 300.0)]}
    names = (*NUMBERS[:2], "bearings[left].radial_clearance_m", "bearings.viscosity_Pa_s")
    model = with_numbers(build_model(rig), names)
    spread = np.diag([0.011, 0.004, 0.011, 0.004]) ** 2
    found = rig_with_estimate(rig, model, names, np.array([0.1, -0.2, 0.1, -0.2]), spread)
    assert found["rotor"]["youngs_modulus_Pa"] == pytest.approx(1.1 * 2.1e11)  # a default before
    assert found["rotor"]["discs"][0]["mass_kg"] == pytest.approx(1.6)
    assert found["rotor"]["discs"][0]["polar_moment_kg_m2"] == pytest.approx(0.8 * 0.0048)
    assert found["rotor"]["discs"][1] == rig["rotor"]["discs"][1]
    assert found["rotor"]["elements"] == rig["rotor"]["elements"]
    assert found["bearings"][0]["radial_clearance_m"] == pytest.approx(1.1e-4)
    assert found["bearings"][0]["viscosity_Pa_s"] == pytest.approx(0.08)
    assert found["bearings"][1] == rig["bearings"][1]
    assert found["prior"]["standard_deviations"] == pytest.approx([0.01, 0.005] * 2)  # relative to the new value
    again = build_model(found)
    assert set(again.uncertainty.names) == {*names}
    assert again.theta[again.position(names)] == pytest.approx(np.zeros(4))


@pytest.mark.parametrize(
    ("rig", "name", "words"),
    [
        (SUPPORTS["bearings"], "rotor.youngs_modulus", "did you mean 'rotor.youngs_modulus_Pa'"),
        (SUPPORTS["bearings"], "rotor.discs[7].mass_kg", "did you mean 'rotor.discs[1].mass_kg'"),
        (SUPPORTS["bearings"], "rotor.inner_diameter_m", "unknown number of the rotor"),  # zero: a share is nothing
        (SUPPORTS["bearings"], "rotor.theory", "unknown number of the rotor"),
        (FILM, "bearings[left].clearance_m", "did you mean 'bearings[left].radial_clearance_m'"),
        (FILM, "bearings[right].load_N", "did you mean 'bearings[left].load_N'"),
        (FILM, "bearings[1].load_N", "unknown number of the bearings"),  # a linear bearing
    ],
)
def test_a_number_that_the_rig_does_not_have_is_refused(rig, name, words):
    refused(lambda: with_numbers(build_model(rig), [name]), words)


def test_a_number_that_the_rotor_does_not_depend_on_is_refused():
    model = with_numbers(build_model({"rotor": point()}), ["rotor.gravity_m_per_s2"])  # the weight
    assert model.names == ("rotor.gravity_m_per_s2",)
    stiff = {"kind": "offset_disc", **registry().plugins["rotor"]["offset_disc"].example}
    for key in ("a_m", "b_m", "diameter_m"):
        stiff.pop(key)
    stiff |= {"k22_N_per_m": 3.5e5, "k24_N": 2e4, "k44_N_m": 1.7e4}
    refused(lambda: with_numbers(build_model({"rotor": stiff}), ["rotor.youngs_modulus_Pa"]), "does not depend on it")


def test_a_load_that_follows_from_the_weight_is_a_number_too():
    rig = rig_on({key: value for key, value in JOURNAL.items() if key != "load_N"})
    plain, name = build_model(rig), "bearings[left].load_N"
    moved = rig_with_values(rig, with_numbers(plain, [name]), {name: 0.1})
    assert moved["bearings"][0]["load_N"] == pytest.approx(1.1 * plain.structure.bearing_load(1))
    assert "load_N" not in rig_with_values(rig, plain, {})["bearings"][0]  # nothing moved: it follows the weight


@pytest.mark.parametrize(
    ("uncertainty", "held", "stated"),
    [
        ({}, (), {"xx": 0.1, "yy": 0.1}),
        ({"bearings": 0.3}, (), {"xx": 0.3, "yy": 0.3}),
        ({"bearings": 0}, ("xx", "yy", "mass"), {}),
        ({"default": 0}, ("xx", "yy", "mass"), {}),
        ({"bearings[left].pedestal_stiffness_N_per_m.xx": 0.2}, (), {"xx": 0.2, "yy": 0.1}),
        ({"bearings.pedestal_stiffness_N_per_m": 0.2}, ("xx", "yy"), {}),  # both together, by the name that is given
    ],
)
def test_a_pedestal_is_uncertain_unless_the_rig_says_otherwise(uncertainty, held, stated):
    rig = rig_on({"kind": "flexible_pedestal", **registry().plugins["bearing"]["flexible_pedestal"].example})
    settings, model = Settings(uncertainty=uncertainty), build_model(rig)
    check_names(settings, model, "rig, diagnosis")
    _, prior = base_model(model, settings)
    of = {key: f"bearings[left].pedestal_stiffness_N_per_m.{key}" for key in ("xx", "yy")}
    of["mass"] = "bearings[left].pedestal_mass_kg"
    assert [name for name in of.values() if name in prior.names] == [of[key] for key in of if key not in held]
    for key, std in stated.items():
        assert prior.by_name[of[key]] == (0.0, std)
    _, film = base_model(build_model(FILM), Settings())  # negative control: its plugin states none
    assert not any(name.startswith("bearings") for name in film.names)
