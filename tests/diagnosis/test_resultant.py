"""Two discs whose unbalances look alike: their sum is stated with its interval, and that the split is not known."""

import json

import numpy as np
import pytest
from machines import shaft, spectrum_of
from scipy.stats import chi2

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model, make_term

NOISE, HARMONICS = 5e-7, np.array([1, -1])
DISC = {"mass_kg": 0.8, "polar_moment_kg_m2": 5.8e-4, "diametral_moment_kg_m2": 3.3e-4}
SUPPORT = {"kind": "linear", "bearing_stiffness_N_per_m": 1e6, "bearing_damping_N_s_per_m": 50.0}
RIG = {
    "rotor": shaft(
        0.56, 8, {"node": 3, "label": "disc 1", **DISC}, {"node": 7, "label": "disc 2", **DISC}, outer_diameter_m=0.01
    ),
    "bearings": [{**SUPPORT, "node": 1, "label": "left"}, {**SUPPORT, "node": 9, "label": "right"}],
    "sensors": [2, 8],
}
BELOW, BEYOND = np.array([80.0, 90.0, 100.0]), np.array([80.0, 300.0, 600.0])  # rad/s; the first critical speed is 150
ADDED = {3: 4e-5, 7: -1e-5j}  # kg m: 40 and 10 g mm


@pytest.fixture(scope="module")
def settings():
    others = [name for name in registry().plugins["effect"] if name != "unbalance"]
    return Settings(uncertainty={"default": 0.02}, nuisance={}, leave_out=others, hold_out_rad_s=[])


def verdict_on(speeds, settings, added=ADDED, seed=1):
    base = build_model(RIG)
    model = base
    for node, unbalance in added.items():
        item = {"kind": "unbalance", "node": node, "mass_kg": 1.0, "label": f"at {node}",
                "eccentricity_m": abs(unbalance), "eccentricity_phase_rad": float(np.angle(unbalance))}  # fmt: skip
        model = model.plus(make_term("effect", item, model.structure, model.sensors))
    return investigate(spectrum_of(model, speeds, HARMONICS, NOISE, seed), base, settings=settings).verdict


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
