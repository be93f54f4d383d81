"""Two discs whose unbalances look alike: their sum is stated with its interval, and that the split is not known."""

import json

import numpy as np
import pytest
from machines import disc, shaft, spectrum_of, springs, unbalance
from scipy.stats import chi2

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model, make_term

NOISE, HARMONICS = 5e-7, np.array([1, -1])
DISCS = [disc(node, 0.8, 5.8e-4, 3.3e-4, label=label) for node, label in ((3, "disc 1"), (7, "disc 2"))]
RIG = {
    "rotor": shaft(0.56, 8, *DISCS, outer_diameter_m=0.01),
    "bearings": springs({1: "left", 9: "right"}, 1e6, 50.0),
    "sensors": [2, 8],
}
BELOW, BEYOND = np.array([80.0, 90.0, 100.0]), np.array([80.0, 300.0, 600.0])  # rad/s; the first critical speed is 150
ADDED = {3: 4e-5, 7: -1e-5j}  # kg m: 40 and 10 g mm


@pytest.fixture(scope="module")
def settings():
    others = [name for name in registry().plugins["effect"] if name != "unbalance"]
    return Settings(uncertainty={"default": 0.02}, nuisance={}, leave_out=others, hold_out_rad_s=[])


def loaded(added):
    """The model of the rig with unbalances {node: kg m}."""
    model = build_model(RIG)
    for node, load in added.items():
        item = unbalance(node, abs(load), float(np.angle(load)), mass_kg=1.0, label=f"at {node}")
        model = model.plus(make_term("effect", item, model.structure, model.sensors))
    return model


def verdict_on(speeds, settings, added=ADDED, seed=1):
    spectrum = spectrum_of(loaded(added), speeds, HARMONICS, NOISE, seed)
    return investigate(spectrum, build_model(RIG), settings=settings).verdict


def test_the_sum_is_known_and_the_split_is_not(settings):
    verdict = verdict_on(BELOW, settings)
    found = verdict.resultant
    assert [one.label for one in found.discs] == ["disc 1", "disc 2"]
    true = sum(w * ADDED[one.where["node"]] for w, one in zip(found.weights, found.discs, strict=True))
    off = found.size.value * np.exp(1j * found.angle.value) / true - 1
    square = (off.real / (found.size.std / found.size.value)) ** 2 + (off.imag / found.angle.std) ** 2
    assert square < chi2.ppf(0.999, 2)
    assert min(found.std_of_each) > 2 * found.size.std
    assert "how it is split between them is not known" in verdict.summary
    written = json.loads(verdict.model_dump_json())["resultant"]
    assert written["size"]["unit"] == "kg m" and len(written["std_of_each"]) == 2


def test_speeds_beyond_the_critical_ones_tell_the_discs_apart(settings):
    """The negative control."""
    verdict = verdict_on(BEYOND, settings)
    assert verdict.resultant is None
    assert "split" not in verdict.summary


def test_nothing_is_said_of_a_sum_where_nothing_is_missing(settings):
    assert verdict_on(BELOW, settings, added={}).resultant is None
