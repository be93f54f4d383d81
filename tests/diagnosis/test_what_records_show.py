"""What records say about causes that fit: whether a contact opens, two are one fault, and how sure a law is."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_loose_stiff_support import HARMONICS, MODEL, SPEEDS, shown, vibration

from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.contact_evidence import is_unseen
from rotorstudy.diagnosis.search.impossible import AFFINE, is_impossible
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.evidence import parameter_p_value
from rotorstudy.diagnosis.verdict.form_error import with_form_error
from rotorstudy.diagnosis.verdict.one_direction import log_odds_of_one_direction
from rotorstudy.diagnosis.verdict.one_fault import act_at, with_one_fault
from rotorstudy.model.registry import registry
from rotorstudy.response.alternating import affine_error
from rotorstudy.response.neighbourhood import carried_motion

USED = ("looseness", "unbalance", "runout", "static_preload", "bow")
OTHERS = [name for name, one in registry().plugins["effect"].items() if one.candidate and name not in USED]
LIFT = {"lift_m": 0.2 * vibration(MODEL, 1), "direction_rad": 0.5, "play_m": 1.5 * vibration(MODEL, 1)}


def cause(effect, where, shape=None):
    return candidate(MODEL, effect, where, shape or {})


def explained(true, *causes):
    """The Search, on records of some causes with their amplitudes, and its explanation by others."""
    model = MODEL.plus(*(one.term for one, _ in true))
    spectrum = shown(model, np.concatenate([MODEL.theta, *(values for _, values in true)]))
    work = begin(MODEL, spectrum, Settings(uncertainty={"default": 0.02}, leave_out=OTHERS))
    work = work.__class__(**{**work.__dict__, "unstable": np.zeros(len(SPEEDS), bool)})
    return work, work.explain(causes)


def test_a_contact_that_opens_is_seen():
    work, found = explained([(cause("looseness", {"node": 1}, LIFT), [6e7])], cause("looseness", {"node": 1}, LIFT))
    assert not is_unseen(work, found)
    assert not is_impossible(work, found)


def test_a_contact_that_hardly_closes_is_a_stiffness():
    """It closes for so short a time that a force which is a thousandth off is not seen among the noise."""
    hardly = cause("looseness", {"node": 1}, LIFT | {"lift_m": -0.965 * vibration(MODEL, 1), "play_m": 1e-3})
    work, found = explained([(hardly, [6e7])], hardly)
    force = hardly.term.parameters[0].force
    motion = carried_motion(found.fit.model, SPEEDS, HARMONICS, found.fit.theta)
    orders = np.arange(motion.amplitude.shape[1]) - motion.amplitude.shape[1] // 2
    assert affine_error(force, motion.amplitude, SPEEDS, orders, motion.deflection) > AFFINE
    assert is_unseen(work, found)
    assert is_impossible(work, found)


@pytest.mark.parametrize(("true", "is_one"), [
    ([("bow", {"node": 2}, [3e-5, 1e-5])], True),
    ([("unbalance", {"node": 2}, [3e-5, 1e-5]), ("runout", {"node": 2, "harmonic": 1}, [-1e-5, 3e-5])], False),
])  # fmt: skip
def test_an_unbalance_and_a_runout_in_one_direction_are_a_bend(true, is_one):
    true = [(cause(effect, where), values) for effect, where, values in true]
    both = cause("unbalance", {"node": 2}), cause("runout", {"node": 2, "harmonic": 1})
    _, found = explained(true, *both)
    odds = log_odds_of_one_direction(found)
    assert odds > 2 if is_one else odds == 0


def of_causes(found, *effects):
    """Standard deviations of the amplitudes of some causes, and those of shapes."""
    some = [one for one in found.causes if one.effect in effects]
    at = [found.fit.names.index(name) for one in some for name in one.names]
    return np.sqrt(np.diag(found.fit.covariance))[at], [std for one in some for std in one.shape_std.values()]


def test_intervals_of_two_causes_allow_for_an_error_of_a_law():
    loose, mass = cause("looseness", {"node": 1}, LIFT), cause("unbalance", {"node": 2})
    true = [(loose, [6e7]), (mass, [2e-5, 1e-5])]
    work, found = explained(true, loose, mass)
    wider = with_form_error(work, found)
    (before, shape_before), (after, shape_after) = (of_causes(e, "looseness", "unbalance") for e in (found, wider))
    assert (after > before).all()
    assert np.greater(shape_after, shape_before).all()
    assert wider.fit.theta is found.fit.theta


def test_intervals_of_a_single_cause_and_of_forces_without_a_law_stay():
    loose = cause("looseness", {"node": 1}, LIFT)
    work, found = explained([(loose, [6e7])], loose)
    assert with_form_error(work, found) is found
    both = cause("unbalance", {"node": 2}), cause("static_preload", {"node": 2})
    work, found = explained(list(zip(both, ([2e-5, 1e-5], [3.0, 4.0]), strict=True)), *both)
    assert with_form_error(work, found) is found


@pytest.mark.parametrize(("further", "count"), [(0.0, 1), (1.0, 2)])
def test_a_small_cause_beside_a_law_is_its_error_and_a_large_one_is_not(further, count):
    """A constant force of one newton at the loose support; one force there explains both cases."""
    loose, force = cause("looseness", {"node": 1}, LIFT), cause("static_preload", {"node": 1})
    work, _ = explained([(loose, [6e7]), (force, [further, 0.0])], loose, force)
    assert len(with_one_fault(work, [1]).best.faults) == count


def test_a_cause_acts_at_its_node_and_at_the_ends_of_its_element():
    node, whole = cause("unbalance", {"node": 2}), cause("bow", {"element": 1, "last_element": 2})
    assert [act_at([node], at, MODEL.structure) for at in (1, 2, 3)] == [False, True, False]
    assert all(act_at([whole], at, MODEL.structure) for at in (1, 2, 3))
    assert not act_at([node, whole], 1, MODEL.structure)
    assert not act_at([cause("base_motion", {"harmonic": 1})], 1, MODEL.structure)


@pytest.mark.parametrize(("off", "is_rejected"), [([8.0], True), ([1.5] * 20, False), ([3.0] * 40, True), ([], False)])
def test_one_parameter_that_is_far_off_counts_among_many(off, is_rejected):
    """As much as many that are off a little; the sum of squares of 80 is usual with one of them at eight."""
    names = tuple(f"p {i}" for i in range(80))
    values = dict.fromkeys(names, 0.0) | dict(zip(names, off, strict=False))
    fitted = SimpleNamespace(names=names, values=values, penalty=sum(x**2 for x in values.values()))
    assert (parameter_p_value(fitted, dict.fromkeys(names, (0.0, 1.0))) < Settings().significance) == is_rejected
