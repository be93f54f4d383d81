"""What could hide: the sizes of feared faults that are seen, on a rotor on which they are then hidden."""

from types import SimpleNamespace

import numpy as np
import pytest
from machines import all_but, faulty, film, spectrum_of
from test_search import TWO_DISCS

from rotorstudy import build_model, harmonic_response, registry
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.hidden import CLOSE, _smallest, what_could_hide, with_hidden
from rotorstudy.diagnosis.verdict.investigate import investigate

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS, NOISE = np.array([120.0, 200.0, 280.0, 360.0]), np.array([1, -1, 2, -2, 3]), 2e-8
MODEL = build_model(TWO_DISCS)
FEARED = {name: plugin for name, plugin in registry().plugins["effect"].items() if plugin.feared}


def records(model, seed):
    return spectrum_of(model, SPEEDS, HARMONICS, NOISE, seed)


def settings(*effects):
    """That try some effects alone."""
    left = all_but(*effects)
    known = {"uncertainty": {"default": 0.02}, "nuisance": {}, "model_error": 0.0, "model_floor": 0.0}
    return Settings(**known, leave_out=left, most_causes=1, candidates_per_round=2)


@pytest.fixture(scope="module")
def rows():
    begun = begin(MODEL, records(MODEL, 1), settings(*FEARED))
    return list(what_could_hide(begun))


def test_every_feared_fault_has_a_size_or_a_measurement(rows):
    named = {row.effect for row in rows}
    assert named == {*FEARED} - {"bearing_change"}  # this rotor has no film
    assert all((row.size is None) == bool(row.measure) for row in rows)
    depth = {row.where["element"]: row.size for row in rows if row.effect == "transverse_crack"}
    assert set(depth) == {1, 2, 3, 4} and depth[2] < depth[1]  # the bending moment is larger between the discs


@pytest.mark.usefixtures("usual_form", "few_shapes")
@pytest.mark.parametrize(
    "effect",
    ["angular_misalignment", "looseness", "parallel_misalignment", "rub", "support_clearance", "transverse_crack"],
)
def test_a_fault_of_twice_its_limit_is_found_and_a_far_smaller_one_is_not(rows, effect):
    """At the place where it is seen best; a ring or a clearance of 0.8 of the orbit there, at the median speed."""
    best = min((row for row in rows if row.effect == effect and row.size), key=lambda row: row.size)
    orbit = np.median(np.linalg.norm(harmonic_response(MODEL, SPEEDS, HARMONICS), axis=1), axis=0)
    place = MODEL.structure.index(best.where.get("node", 1))

    def verdict(share, seed):
        size = share * best.size
        values = {
            "angular_misalignment": {"harmonics": [2], "misalignment_moment_2X_N_m": size},
            "support_clearance": {"clearance_m": 0.8 * orbit[place], "stiffness_lost_in_clearance_N_per_m": size},
            "parallel_misalignment": {"harmonics": [2], "misalignment_force_2X_N": size},
            "transverse_crack": {"angle_rad": 0.4, "depth_ratio": max(size, 1e-3), "flexibility_factor": 1.0},
            "looseness": {"lift_m": 0.0, "stiffness_lost_in_lift_N_per_m": size},
            "rub": {"clearance_m": 0.8 * orbit[place], "rub_stiffness_N_per_m": size},
        }[effect]
        middle = {"position_m": 0.15 * best.where["element"] - 0.075} if "element" in best.where else best.where
        true = faulty(MODEL, {"kind": effect, **middle, **values})
        return investigate(records(true, seed), MODEL, settings=settings(effect))

    assert verdict(2.0, 5).verdict.verdict != "nothing"
    found = verdict(0.2, 5)
    assert found.verdict.verdict == "nothing"
    if effect == "transverse_crack":
        said = with_hidden(found).verdict.summary
        assert "Transverse crack is seen with 95 % probability above " in said and "of the diameter (in element" in said


def test_a_fault_that_cannot_be_seen_at_any_size_is_said_so():
    few = records(MODEL, 2)
    few = few.at_speeds([0]).at_harmonics([1, -1]).with_error(np.full((1, 2, 3), 1e-10))
    blind = with_hidden(investigate(few, MODEL, settings=settings("transverse_crack")))
    said = blind.verdict.summary
    assert "Transverse crack is not observable with these probes and speeds in elements 1 to 4: " in said


def test_of_records_of_the_mean_alone_it_is_said_too():
    """Without a vibration, the ring of a rub lies by its usual size."""
    mean = spectrum_of(MODEL, SPEEDS, np.array([0, 1]), NOISE, 3).at_harmonics([0])
    assert {row.effect for row in what_could_hide(begin(MODEL, mean, settings("rub", "static_preload")))} == {"rub"}


@pytest.mark.usefixtures("undrawn")
def test_a_clearance_of_twice_its_limit_is_found_and_one_that_other_films_imitate_is_not():
    """The limit allows for values of the films within their uncertainty; that with known films does not hold then."""
    films = [film(0.03, 0.012, 4e-5, 0.02, node=node, label=name) for node, name in ((1, "left"), (5, "right"))]
    model = build_model(TWO_DISCS | {"bearings": films, "sensors": [1, 5]})
    place = {"node": 1, "number": "radial_clearance_m"}

    def known_to(share):
        numbers = dict.fromkeys(("bearings[left].radial_clearance_m", "bearings[right].radial_clearance_m"), share)
        stated = {"default": 0.02, "bearing_scale": 0.0, "bearings.viscosity_Pa_s": share, **numbers}
        return settings("bearing_change").model_copy(update={"uncertainty": stated, "model_error": 0.01})

    def limit(share):
        rows = what_could_hide(begin(model, records(model, 1), known_to(share)))
        return next(row.size for row in rows if row.where == place)

    def verdict(size):
        true = faulty(model, {"kind": "bearing_change", **place, "bearing_change": size})
        return investigate(records(true, 5), model, settings=known_to(0.1)).verdict.verdict

    uncertain, known = limit(0.1), limit(0.001)
    assert 2.5 * known < uncertain
    assert verdict(2 * uncertain) != "nothing"
    assert verdict(2 * known) == "nothing"


@pytest.mark.parametrize("start", [1.0, 3.0, 100.0])
def test_the_smallest_size_is_found_from_one_that_is_not_seen_at_all(start):
    """A contact that is not reached changes nothing."""
    size, _ = _smallest(lambda size: max(0.0, size - 2), 3.0, (start, 1.0), 100.0, SimpleNamespace(force=None))
    assert 5.0 <= size <= 2 + 3 * CLOSE
