"""A fault in a stretch of elements is placed to one element, also where only some stretches are candidates."""

from types import SimpleNamespace

import numpy as np
import pytest
from machines import all_but, disc, rig_of, shaft, spectrum_of, springs, unbalance

from rotorstudy import build_model, make_term
from rotorstudy.diagnosis.search import moves
from rotorstudy.diagnosis.search import search as search_module
from rotorstudy.diagnosis.search.search import begin, search
from rotorstudy.diagnosis.search.stretches import next_places
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.prediction import with_model_error

ELEMENTS, PART = 20, 3  # of which the stretches of candidates consist
HARMONICS, SPEEDS = np.array([0, 1, -1, 2, -2]), np.array([120.0, 200.0, 280.0, 360.0, 440.0])
FINE = rig_of(
    shaft(0.6, ELEMENTS, disc(10)), springs({1: "left", ELEMENTS + 1: "right"}), unbalance(10, 1e-5, 0.8),
    sensors=[6, 16]
)  # fmt: skip


def stretch(kind, element, last_element):
    return {"kind": kind, "element": element, "last_element": last_element}


def begun(*effects, **hidden):
    """A Search for one of some effects in the records of a hidden one, not carried out."""
    model, known = build_model(FINE), Settings(uncertainty={"default": 0.02}, most_causes=1)
    settings = known.model_copy(update={"leave_out": all_but(*effects)})
    terms = [make_term("effect", {"label": "hidden", **hidden}, model.structure, model.sensors)] if hidden else []
    found = spectrum_of(model.plus(*terms), SPEEDS, HARMONICS, 1e-8, 1)
    return begin(model, with_model_error(found, settings), settings)


@pytest.mark.parametrize("ends", [(8, 10), (6, 8), (5, 8)])
def test_an_asymmetry_is_named_in_its_own_elements(ends):
    (found,) = search(begun("shaft_asymmetry", **stretch("shaft_asymmetry", *ends), shaft_asymmetry=0.05)).best.causes
    assert tuple(found.where.values()) == ends


def test_by_candidates_alone_it_is_in_other_elements(monkeypatch):
    """Negative control of the test above."""
    monkeypatch.setattr(moves, "between_candidates", lambda *_: [])
    for module in (moves, search_module):
        monkeypatch.setattr(module, "may_lie_between", lambda *_: False)
    (found,) = search(begun("shaft_asymmetry", **stretch("shaft_asymmetry", 8, 10), shaft_asymmetry=0.05)).best.causes
    assert found.where != {"element": 8, "last_element": 10}


def test_next_stretches_are_made_if_they_are_no_candidates_and_lie_within_the_shaft():
    work = begun("shaft_asymmetry", "bow")
    bow = next(c for c in work.candidates if c.cause == "bow, element 1, last_element 3")
    current = SimpleNamespace(causes=(bow,), fit=SimpleNamespace(values=dict.fromkeys(bow.names, 1e-3)))
    ends = [tuple(moved[0].where.values()) for moved, _ in moves.shifts(work, current)]
    assert ends == [(1, 2), (1, 4), (2,), (2, 3), (2, 4)]


@pytest.mark.parametrize(("effect", "is_a_place"), [("bow", True), ("shaft_asymmetry", False)])
def test_a_stretch_grows_to_the_whole_shaft_only_as_a_candidate(effect, is_a_place):
    """An asymmetry of the whole shaft is at no elements."""
    work = begun(effect)
    near = next(c for c in work.candidates if c.where == {"element": 1, "last_element": 18})
    made = next_places(work, next_places(work, near)[("element", 1), ("last_element", 19)])
    assert ((("element", 1), ("last_element", ELEMENTS)) in made) == is_a_place


def test_elements_without_stretches_and_nodes_move_to_the_next_candidates():
    every = [{"element": 5}, {"element": 15}, {"node": 2}, {"node": 7, "number": 1}, {"node": 9}, {"number": 1}]
    made = [SimpleNamespace(effect="some", variant={}, where=where) for where in every]
    work = SimpleNamespace(candidates=made)
    found = [[c.where for c in next_places(work, cause).values()] for cause in made]
    assert found == [[{"element": 15}], [{"element": 5}], [{"node": 9}], [], [{"node": 2}], []]


def test_a_stretch_between_candidates_has_a_share_of_the_odds_of_one():
    """Also as a further part of a fault, whichever part comes first."""
    work = begun("bow")
    one, other = (next(c for c in work.candidates if c.where == {"element": n, "last_element": n + 2}) for n in (4, 13))
    made = next_places(work, one)[("element", 5), ("last_element", 7)]
    assert work.prior_odds.of(made) == pytest.approx(work.prior_odds.of(one) / PART**2)
    odds = work.prior_odds.log_odds
    assert odds((made, other)) == pytest.approx(odds((other, made)))
    assert odds((made, other)) == pytest.approx(odds((one, other)) - 2 * np.log(PART))
