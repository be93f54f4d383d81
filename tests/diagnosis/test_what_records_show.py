"""What records say about causes that fit: whether a contact opens, two are one fault, and how sure a law is."""

import numpy as np
from machines import all_but
from test_loose_stiff_support import HARMONICS, MODEL, SPEEDS, shown, vibration

from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.impossible import AFFINE, is_impossible, is_unseen
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.response.alternating import affine_error
from rotorstudy.response.neighbourhood import carried_motion

OTHERS = all_but("looseness", "unbalance", "runout", "static_preload", "bow")
LIFT = {"lift_m": 0.2 * vibration(MODEL, 1), "direction_rad": 0.5, "play_m": 1.5 * vibration(MODEL, 1)}
LIFT["gap_spread_m"] = 0.025 * vibration(MODEL, 1)


def cause(effect, where, shape=None):
    return candidate(MODEL, effect, where, shape or {})


def explained(true, *causes):
    """The Search, on records of some causes with their amplitudes, and its explanation by others."""
    model = MODEL.plus(*(one.term for one, _ in true))
    spectrum = shown(model, np.concatenate([MODEL.theta, *(values for _, values in true)]))
    work = begin(MODEL, spectrum, Settings(uncertainty={"default": 0.02}, leave_out=OTHERS))
    work = work.__class__(**{**work.__dict__, "unstable": np.zeros(len(SPEEDS), bool)})
    return work, work.explain(causes, {})


def test_a_contact_that_opens_is_seen():
    work, found = explained([(cause("looseness", {"node": 1}, LIFT), [6e7])], cause("looseness", {"node": 1}, LIFT))
    assert not is_unseen(work, found)
    assert not is_impossible(work, found)


def test_a_contact_that_hardly_closes_is_a_stiffness():
    """It closes for so short a time that a force which is a thousandth off is not seen among the noise."""
    hardly = cause("looseness", {"node": 1}, LIFT | {"lift_m": -0.965 * vibration(MODEL, 1), "play_m": 1e-3})
    work, found = explained([(hardly, [2e7])], hardly)
    force = hardly.term.parameters[0].force
    motion = carried_motion(found.fit.model, SPEEDS, HARMONICS, found.fit.theta)
    orders = np.arange(motion.amplitude.shape[1]) - motion.amplitude.shape[1] // 2
    assert affine_error(force, motion.amplitude, SPEEDS, orders, motion.deflection) > AFFINE
    assert is_unseen(work, found)
    assert is_impossible(work, found)
