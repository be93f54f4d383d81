"""The numbers of bearings as parameters: every bearing plugin against bearings built anew, and films in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from machines import disc, shaft, unbalance
from one_line_errors import refused

from rotorstudy import build_model, eigenvalues, harmonic_response, registry, time_response
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings, check_names
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.prior import prior_of
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.estimated_rig import rig_with_estimate, rig_with_values
from rotorstudy.model.rig_numbers import changeable_numbers, numbers, with_numbers
from rotorstudy.response.measured import measured_response, measured_response_and_jacobian

SPEEDS, HARMONICS = [60.0, 140.0, 260.0], [0, 1, -1, 2]
ROTOR = shaft(0.8, 4, disc(3, 60.0, 0.6, 0.3), outer_diameter_m=0.05)
JOURNAL = {"kind": "short_journal", **registry().plugins["bearing"]["short_journal"].example}
UNBALANCE = unbalance(3, 2e-5, 0.4)


def rig_on(item):
    own = {"kind": "linear", "node": 5, "bearing_stiffness_N_per_m": 2e7, "bearing_damping_N_s_per_m": 2e4}
    return {"rotor": ROTOR, "bearings": [{**item, "node": 1, "label": "left"}, own], "effects": [UNBALANCE]}


def film_rig():
    return rig_on(JOURNAL) | {"sensors": [1, 3]}


def examples():
    for name, plugin in registry().plugins["bearing"].items():
        item = {"kind": name, **plugin.example}
        if name == "squeeze_film":
            item["centring_stiffness_N_per_m"] = 1e7
        model = build_model({"rotor": ROTOR, "bearings": [{**item, "node": 1, "label": "left"}]})
        own = [number for number in numbers(model) if number.startswith("bearings")]
        yield from (pytest.param(item, number, id=f"{name} {number}") for number in own)


@pytest.mark.parametrize(("item", "name"), list(examples()))
def test_a_bearing_with_another_number_is_the_one_built_with_it(item, name):
    rig = rig_on(item)
    model = with_numbers(build_model(rig), [name])
    (place,) = model.position([name])
    theta = model.theta + 0.07 * np.eye(len(model.theta))[place]
    found = measured_response_and_jacobian(model, SPEEDS, HARMONICS, theta)
    built = measured_response(build_model(rig_with_values(rig, model, {name: 0.07})), SPEEDS, HARMONICS)
    assert np.abs(found.response - built).max() <= 1e-12 * np.abs(built).max()
    # another route to the derivative: the response itself, with a step ten times larger. Both are zero for the speeds
    # of a table with equal values, and for one beyond those tried
    step = 3e-4 * np.eye(len(theta))[place]
    up, down = (measured_response(model, SPEEDS, HARMONICS, theta + sign * step) for sign in (1, -1))
    slope = (up - down) / 6e-4
    assert np.abs(found.jacobian[..., place] - slope).max() <= 1e-4 * np.abs(slope).max()


def slope_of(item, number, order):
    """Derivative of the stiffness (order 0) or the damping (1) of a bearing by the relative change of a number."""
    name = f"bearings[left].{number}"
    model = with_numbers(build_model(rig_on(item)), [name])
    (term,) = (term for term in model.terms if term.is_bearing_number)
    return part(replace(term, values={name: 1.0}), order)


def part(term, order, speed=150.0):
    narrow = replace(term, parameters=tuple(
        replace(p, entries=tuple(replace(e, matrix=np.asarray(e.matrix)[:1, :1]) for e in p.entries))
        for p in term.parameters
    ))  # fmt: skip
    found = dynamic_stiffness(narrow, [speed], [1])[0, 0]
    return found.imag / speed if order else found.real


@pytest.mark.parametrize("order", [0, 1])
def test_slopes_of_a_film_are_those_of_similar_films(order):
    """K = W/c k(s), C = W/(c w) d(s) with s = mu w D L^3 / (8 W c^2): derivatives by c and W follow from that by mu."""
    whole = part(build_model(rig_on(JOURNAL)).terms[0], order)
    oil = slope_of(JOURNAL, "viscosity_Pa_s", order)
    size = np.abs(whole).max()
    assert np.abs(slope_of(JOURNAL, "radial_clearance_m", order) + whole + 2 * oil).max() < 1e-7 * size
    assert np.abs(slope_of(JOURNAL, "load_N", order) - whole + oil).max() < 1e-7 * size
    faster, slower = (part(build_model(rig_on(JOURNAL)).terms[0], order, 150.0 * (1 + h)) for h in (1e-4, -1e-4))
    by_speed = (faster - slower) / 2e-4 + order * whole
    assert np.abs(oil - by_speed).max() < 1e-6 * size


def test_the_damping_of_a_squeeze_film_falls_with_the_cube_of_its_clearance():
    item = {"kind": "squeeze_film", **registry().plugins["bearing"]["squeeze_film"].example}
    item["centring_stiffness_N_per_m"] = 0.0
    whole = part(build_model(rig_on(item)).terms[0], 1)
    assert slope_of(item, "radial_clearance_m", 1) == pytest.approx(-3 * whole, rel=1e-7)


def test_no_clearance_becomes_zero_or_negative():
    model = with_numbers(build_model(film_rig()), ["bearings.radial_clearance_m"])
    theta = model.theta.copy()
    for change in (-1.0, -1.5):
        theta[model.position(["bearings.radial_clearance_m"])] = change
        with pytest.raises(NoSteadyState, match="zero or negative"):
            measured_response(model, SPEEDS, HARMONICS, theta)
    long = with_numbers(build_model(film_rig()), ["bearings.length_m"])
    with pytest.raises(NoSteadyState, match="no bearing with these numbers: short_journal: length_m / diameter_m"):
        measured_response(long, SPEEDS, HARMONICS, long.theta + 3.0 * (np.array(long.names) == "bearings.length_m"))


def test_all_roads_see_the_same_bearing():
    rig = film_rig()
    model = with_numbers(build_model(rig), ["bearings[left].viscosity_Pa_s"])
    theta = model.theta + 0.3 * (np.array(model.names) == "bearings[left].viscosity_Pa_s")
    built = build_model(rig_with_values(rig, model, {"bearings[left].viscosity_Pa_s": 0.3}))
    for road in (
        lambda model, theta: eigenvalues(model, SPEEDS, theta),
        lambda model, theta: harmonic_response(model, SPEEDS, HARMONICS, theta),
        lambda model, theta: time_response(model, 140.0, np.linspace(0, 5e-4, 3), theta),
    ):
        found, true = road(model, theta), road(built, built.theta)
        assert np.abs(found - true).max() <= 1e-9 * np.abs(true).max()
    trials = measured_response(model, SPEEDS, HARMONICS, np.stack([model.theta, theta]))
    assert np.array_equal(trials[1], measured_response(model, SPEEDS, HARMONICS, theta))


def test_a_change_without_a_node_is_that_of_all_bearings_with_the_number():
    """Of their oil; that of one bearing is another one (negative control)."""
    two = [{**JOURNAL, "node": node, "label": f"{node}"} for node in (1, 5)]
    thinner = [{**one, "viscosity_Pa_s": 0.7 * one["viscosity_Pa_s"]} for one in two]
    true = harmonic_response(build_model(film_rig() | {"bearings": thinner}), SPEEDS, HARMONICS)

    def off(**where):
        change = {"kind": "bearing_change", "number": "viscosity_Pa_s", "bearing_change": -0.3, **where}
        found = build_model(film_rig() | {"bearings": two, "effects": [UNBALANCE, change]})
        return np.abs(harmonic_response(found, SPEEDS, HARMONICS) - true).max() / np.abs(true).max()

    assert off() < 1e-12 and off(node=1) > 1e-3
    places = changeable_numbers(build_model(film_rig() | {"bearings": two}).structure)
    assert {"number": "viscosity_Pa_s"} in places and {"number": "viscosity_Pa_s", "node": 5} in places
    assert {"number": "viscosity_Pa_s"} not in changeable_numbers(build_model(film_rig()).structure)  # of one film


def test_a_rig_with_an_estimate_has_the_new_numbers():
    rig, names = film_rig(), ("bearings[left].radial_clearance_m", "bearings.viscosity_Pa_s")
    model = with_numbers(build_model(rig), names)
    found = rig_with_estimate(rig, model, names, np.array([0.1, -0.2]), np.diag([0.011, 0.004]) ** 2)
    assert found["bearings"][0]["radial_clearance_m"] == pytest.approx(1.1e-4)
    assert found["bearings"][0]["viscosity_Pa_s"] == pytest.approx(0.08)
    assert found["bearings"][1] == rig["bearings"][1]
    assert found["prior"]["standard_deviations"] == pytest.approx([0.01, 0.005])
    assert build_model(found).uncertainty.names == names


def test_uncertainty_is_stated_by_name():
    rig = film_rig()
    stated = {"default": 0.0, "bearings[left].load_N": 0.2}
    model = with_numbers(build_model(rig), stated)
    check_names(Settings(uncertainty=stated), build_model(rig), "rig.yaml, diagnosis")
    assert prior_of(model, stated).by_name == {"bearings[left].load_N": (0.0, 0.2)}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bearings[left].clearance_m", r"did you mean 'bearings\[left\].radial_clearance_m'"),
        ("bearings[right].load_N", r"did you mean 'bearings\[left\].load_N'"),
        ("bearings[1].load_N", "unknown number of the bearings"),  # a linear bearing
    ],
)
def test_a_number_that_no_bearing_has_is_refused(name, words):
    refused(lambda: with_numbers(build_model(film_rig()), [name]), match=words)


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
    _, film = base_model(build_model(film_rig()), Settings())  # negative control: its plugin states none
    assert not any(name.startswith("bearings") for name in film.names)
