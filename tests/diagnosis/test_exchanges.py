"""From a wrong explanation by two causes to the true one: parts tried together, exchanges from the best few."""

from dataclasses import replace

import numpy as np
import pytest
from test_search import TWO_DISCS, hidden, measured

from rotorstudy.diagnosis.search import shapes
from rotorstudy.diagnosis.search.alternatives import at_the_same_place
from rotorstudy.diagnosis.search.beside_a_force import _beside_forces, with_causes_beside_a_force
from rotorstudy.diagnosis.search.candidates import ShapeRange, candidates, shape_ranges, with_shape
from rotorstudy.diagnosis.search.crack_beside import with_others_beside_a_crack
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.parts import faults_with_what_they_bring
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.several_causes import _exchanged_at_motion
from rotorstudy.diagnosis.search.shape_equations import _by_forces, _by_new_responses
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model

MODEL = build_model(TWO_DISCS)
MASS = hidden(MODEL, "added_mass", node=3, added_mass_kg=0.3)
UNBALANCE = hidden(MODEL, "unbalance", node=3, eccentricity_m=2e-5, eccentricity_phase_rad=1.0)
DAMPING = hidden(MODEL, "shaft_damping", shaft_damping_s=2e-5)


def searched(library, *terms):
    """A search by some effects of a spectrum with hidden ones, that knows no explanation yet."""
    others = [name for name, plugin in registry().plugins["effect"].items() if plugin.candidate and name not in library]
    settings = Settings(uncertainty={"default": 0.02}, model_error=0.0, model_floor=0.0, leave_out=others)
    spectrum = measured(MODEL, *terms, noise=2e-8)
    whole, prior = base_model(MODEL, settings)
    base = fit(whole, spectrum, prior)
    every, _ = candidates(MODEL, settings)
    work = Search(MODEL, whole, spectrum, spectrum, settings, prior, base, every)
    work.screened.extend(work.screen(base, every))
    work.found[frozenset()] = Explanation((), base, 0.0)
    return work


def test_a_mass_is_tried_together_with_its_unbalance():
    work = searched(("added_mass", "unbalance"), MASS, UNBALANCE)
    best, *_ = faults_with_what_they_bring(work, work.base, work.candidates)
    assert {cause.cause for cause in best[0]} == {"added_mass, node 3", "unbalance, node 3"}


def test_but_not_where_the_mass_alone_explains_the_records():
    work = searched(("added_mass", "unbalance"), MASS)
    tried = faults_with_what_they_bring(work, work.base, work.candidates)
    assert not any("added_mass, node 3" in {cause.cause for cause in parts} for parts, _ in tried)


@pytest.mark.parametrize(("wrong", "left"), [("static_preload, node 3", True), (None, False)])
def test_a_wrong_cause_beside_a_true_one_is_exchanged_only_if_records_are_left_unexplained(wrong, left):
    work = searched(("added_mass", "shaft_damping", "static_preload"), MASS, DAMPING)
    named = {"shaft_damping", wrong or "added_mass, node 3"}
    first = work.explain(tuple(c for c in work.candidates if c.cause in named))
    before = len(work.found)
    assert _exchanged_at_motion(work, [first]).named == {"added_mass, node 3", "shaft_damping"}
    assert (len(work.found) > before) == left


def test_beside_a_crack_only_the_other_cause_is_exchanged():
    """Without a crack nothing is tried."""
    work = searched(("added_mass", "shaft_damping", "static_preload"), MASS, DAMPING)
    wrong = work.explain(tuple(c for c in work.candidates if c.cause in {"shaft_damping", "static_preload, node 3"}))
    assert with_others_beside_a_crack(work, wrong) == []


def test_a_step_of_a_crack_onto_a_disc_ends_its_refinement(monkeypatch):
    """No crack can be there; the message that says so must not end the search."""
    work = searched(("transverse_crack",), MASS)
    crack = next(c for c in work.candidates if c.variant == {"breathing": "none"})
    shape = {"position_m": 0.1, "depth_ratio": 0.2, "angle_rad": 0.0}
    first = work.explain((with_shape(MODEL, crack, shape, work.settings.prior_width),))
    start, onto = (ShapeRange(0.0, 0.6).fraction(x) for x in (0.1, 0.15))  # disc 1 is at a quarter of 0.6 m

    def step_onto_the_disc(work, causes, fitted, cause):
        count = len(fitted.names)
        return np.eye(count + 3), np.append(np.zeros(count), [onto - start, 0.0, 0.0])

    monkeypatch.setattr(shapes, "shape_equations", step_onto_the_disc)
    monkeypatch.setattr(shapes, "SHARES_OF_STEP", (1.0,))
    better = shapes.refine(work, first, again=False)  # by a fit from the stated values
    assert better.log_posterior_odds >= first.log_posterior_odds
    monkeypatch.setattr(shapes, "_from_stated_values", lambda work, explanation: explanation)
    assert shapes.refine(work, first, again=False) is first


PEDESTAL = {
    "node": 1,
    "natural_frequency_rad_per_s": 900.0,
    "frequency_ratio": 0.8,
    "bearing_time_s": 3e-4,
    "stiffness_loss_at_rest_xx_N_per_m": 3e5,
    "stiffness_loss_at_rest_yy_N_per_m": 2e5,
}
SOFTER = hidden(MODEL, "support_stiffness", node=1, support_stiffness_N_per_m=-3e5)


@pytest.mark.parametrize(
    ("term", "found"),
    [
        (hidden(MODEL, "pedestal_resonance", **PEDESTAL), {"pedestal_resonance, node 1"}),
        (SOFTER, {"support_stiffness, node 1", "external_damping, node 1"}),
    ],
)
def test_two_causes_at_a_support_are_exchanged_for_a_pedestal_only_if_it_is_one(term, found):
    work = searched(("external_damping", "pedestal_resonance", "support_stiffness"), term)
    named = {"support_stiffness, node 1", "external_damping, node 1"}
    first = work.explain(tuple(c for c in work.candidates if c.cause in named))
    assert at_the_same_place(work, first).named == found


@pytest.mark.parametrize(
    ("fraction", "step"), [(0.3, 1e-4), (0.7, -1e-4), (0.49995, -1e-4), (0.50005, 1e-4), (1, -1e-4)]
)
def test_a_derivative_by_a_position_is_taken_within_one_element(fraction, step):
    """Without the node between, it is taken towards the middle of the range."""
    assert ShapeRange(0.0, 0.6, breaks=(0.0, 0.3, 0.6)).step(fraction) == step
    assert ShapeRange(0.0, 0.6).step(fraction) == (1e-4 if fraction < 0.5 else -1e-4)


def test_derivatives_by_a_clearance_from_forces_are_those_of_responses():
    """Negative control: with another amplitude than the fitted one they are others."""
    work = searched(("rub",), hidden(MODEL, "rub", node=3, rub_stiffness_N_per_m=2e4, clearance_m=5e-6))
    found = work.explain((next(c for c in work.candidates if c.where["node"] == 3),))
    (cause,), fitted, ends = found.causes, found.fit, shape_ranges("rub", MODEL.structure, 3)["clearance_m"]
    shape = {"clearance_m": ends.value(ends.fraction(cause.shape["clearance_m"]) + 1e-4)}
    beside = [with_shape(work.rig, cause, shape, work.settings.prior_width)]
    (by_responses,) = _by_new_responses(work, (cause,), fitted, cause, beside)
    larger = replace(fitted, theta=np.where(np.isin(fitted.model.names, cause.names), 1.1, 1.0) * fitted.theta)
    for used, is_close in ((fitted, True), (larger, False)):
        (by_forces,) = _by_forces(work, (cause,), used, cause, beside)
        assert (np.linalg.norm(by_forces - by_responses) < 0.01 * np.linalg.norm(by_responses)) == is_close


EXCHANGED = ("added_mass", "unbalance", "pedestal_resonance", "support_stiffness", "external_damping")


def test_a_mass_with_its_unbalance_is_found_beside_a_force_at_the_node_of_another_fault():
    """Two wrong causes explain most of the records; the true shape of the pedestal and the mass are found together."""
    work = searched(EXCHANGED, MASS, UNBALANCE, hidden(MODEL, "pedestal_resonance", **PEDESTAL))
    named = {"support_stiffness, node 3", "support_stiffness, node 1"}
    wrong = work.explain(tuple(c for c in work.candidates if c.cause in named))
    first = max(_beside_forces(work, wrong), key=lambda one: one.odds)
    assert first.node == 1
    assert {cause.cause for cause in first.parts} == {"added_mass, node 3", "unbalance, node 3"}
    best = max(with_causes_beside_a_force(work, wrong), key=odds_of)
    assert best.named == {"added_mass, node 3", "unbalance, node 3", "pedestal_resonance, node 1"}


def test_beside_a_force_no_mass_is_seen_where_there_is_none():
    work = searched(EXCHANGED, hidden(MODEL, "pedestal_resonance", **PEDESTAL))
    alone = work.explain(tuple(c for c in work.candidates if c.cause == "support_stiffness, node 1"))
    mass = next(c for c in work.candidates if c.cause == "added_mass, node 3")
    (seen,) = [one for one in _beside_forces(work, alone) if one.node == 1 and one.parts == (mass,)]
    assert abs(seen.values[mass.names[0]]) < 0.01  # kg, of 0.3 kg in the other test
