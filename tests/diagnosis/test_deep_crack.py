"""A deep breathing crack is followed from both sides of the shaft: what explains more at first may be the wrong one."""

import numpy as np
import pytest
from machines import disc, shaft, springs

from rotorstudy.diagnosis.search.candidates import candidates, with_vibration
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.one_more import with_one_more
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.shapes import refine
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_items import make_term
from rotorstudy.response.measured import measured_response

RIG = {
    "rotor": shaft(0.6, 3, disc(2)),
    "bearings": springs({1: "left", 4: "right"}),
    "effects": [{"kind": "unbalance", "node": 2, "eccentricity_m": 1e-5}],
    "sensors": [2, 3],
}
SPEED, HARMONICS = np.array([60.0, 100.0, 140.0]), np.array([0, 1, -1, 2, -2, 3, -3])
TRUTH = {"position_m": 0.3, "depth_ratio": 0.45, "angle_rad": 0.3}


def test_both_sides_are_tried_and_the_true_one_is_reached():
    model = build_model(RIG)
    settings = Settings(leave_out=[name for name in registry().plugins["effect"] if name != "transverse_crack"])
    crack = make_term("effect", {"kind": "transverse_crack", "label": "hidden", **TRUTH,
                                 "flexibility_factor": 1.0}, model.structure, model.sensors)  # fmt: skip
    shown = measured_response(model.plus(crack), SPEED, HARMONICS, order=7)
    covariance = independent_covariance(np.full(shown.shape, 1e-14))
    spectrum = with_model_error(Spectrum(shown, SPEED, HARMONICS, tuple(model.sensors), covariance), settings)
    model = with_vibration(model, spectrum)
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    every, _ = candidates(model, settings)
    work = Search(model, whole, spectrum, spectrum, settings, prior, base, every)
    work.screened.extend(work.screen(base, every))
    work.found[frozenset()] = Explanation((), base, 0.0)
    tried = with_one_more(work, work.found[frozenset()])
    angles = [e.causes[0].shape["angle_rad"] for e in tried]
    assert min(np.cos(np.array(angles) - angles[0])) < 0  # the other side, too
    best = min((refine(work, e, again=False) for e in tried), key=lambda e: e.fit.cost)
    assert best.causes[0].shape == pytest.approx(TRUTH, rel=0.01, abs=0.01)
    assert best.fit.cost < len(base.residual) < 0.1 * base.cost
