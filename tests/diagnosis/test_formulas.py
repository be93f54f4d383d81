"""A crack by a published formula, which opens by its angle, is tried where the laws of the physics are rejected."""

import numpy as np
import pytest
from test_deep_crack import HARMONICS, RIG, SPEED

from rotorstudy.diagnosis.search.candidates import candidate, candidates, with_vibration
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.formulas import with_formulas
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import BEYOND, predicted, with_model_error
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_items import make_term
from rotorstudy.response.measured import measured_response

TRUTH = {"position_m": 0.3, "depth_ratio": 0.25, "angle_rad": 0.3}


def cracked(model, breathing):
    """The model with the crack by some law."""
    item = {"kind": "transverse_crack", "label": "hidden", **TRUTH, "breathing": breathing, "flexibility_factor": 1.0}
    return model.plus(make_term("effect", item, model.structure, model.sensors))


def explained_by_physics(breathing):
    """A Search of records of a crack of some law, and its explanation by a gradual one in the true shape."""
    model = build_model(RIG)
    settings = Settings(leave_out=[name for name in registry().plugins["effect"] if name != "transverse_crack"])
    shown = measured_response(cracked(model, breathing), SPEED, HARMONICS, order=7)
    covariance = independent_covariance(np.full(shown.shape, 1e-16))
    spectrum = with_model_error(Spectrum(shown, SPEED, HARMONICS, tuple(model.sensors), covariance), settings)
    model = with_vibration(model, spectrum)
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    work = Search(model, whole, spectrum, spectrum, settings, prior, base, candidates(model, settings)[0])
    work.found[frozenset()] = Explanation((), base, 0.0)
    crack = candidate(model, "transverse_crack", {}, TRUTH, "gradual", variant={"breathing": "gradual"})
    return work, work.explain((crack,))


def test_a_crack_by_a_formula_is_found_from_one_that_is_rejected():
    work, gradual = explained_by_physics("cosine")
    (found,) = with_formulas(work, gradual).causes
    assert found.variant == {"breathing": "cosine"}
    assert found.shape == pytest.approx(TRUTH, rel=0.05, abs=0.02)


def test_no_formula_is_tried_where_the_physics_explains_the_records():
    work, gradual = explained_by_physics("gradual")
    known = len(work.found)
    assert with_formulas(work, gradual) is gradual
    assert len(work.found) == known


def test_enough_harmonics_are_carried_for_a_crack_that_switches():
    model, speed = cracked(build_model(RIG), "switching"), np.array([200.0, 300.0, 400.0])
    true, few = (measured_response(model, speed, HARMONICS, order=order) for order in (40, max(HARMONICS) + BEYOND))
    covariance = independent_covariance(np.full(true.shape, 1e-30))
    spectrum = with_model_error(Spectrum(true, speed, HARMONICS, tuple(model.sensors), covariance), Settings())
    shown = predicted(model, spectrum, np.concatenate([term.theta for term in model.terms]))
    off, with_few = (np.std(spectrum.whitened(one - true)) for one in (shown, few))
    assert off < with_few / 2
