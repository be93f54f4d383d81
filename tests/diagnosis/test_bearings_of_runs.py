"""Bearings in several runs: their numbers are fitted and compared, their coefficients may differ from run to run."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from machines import all_but, disc, faulty, rig_of, shaft, spectrum_of, unbalance
from test_runs import SPEEDS, write_table

from rotorstudy import build_model, measured_response, registry
from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.runs.joint import identify_runs
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings

HARMONICS, NOISE = np.array([1, -1]), 2e-8
CLEARANCE, VISCOSITY = "bearings[left].radial_clearance_m", "bearings[left].viscosity_Pa_s"
FILM = {"kind": "short_journal", "node": 1, "label": "left", **registry().plugins["bearing"]["short_journal"].example}
SPRING = {"kind": "linear", "node": 5, "label": "right", "bearing_stiffness_N_per_m": 2e7,
          "bearing_damping_N_s_per_m": 2e4}  # fmt: skip
KNOWN = {"default": 0.0, "rotor": 0, "eccentricity": 0.3, VISCOSITY: 0.2}
RIG = rig_of(
    shaft(0.8, 4, disc(3, 60.0, 0.6, 0.3), outer_diameter_m=0.05), [FILM, SPRING], unbalance(3, 1.0, 0.4, mass_kg=1e-3),
    sensors=[1, 3], measurement={"harmonics": [1, -1], "table_noise_m": NOISE},
    diagnosis={"nuisance": {}, "model_error": 0.0, "model_floor": 0.0, "uncertainty": KNOWN}
)  # fmt: skip
TRIAL = unbalance(3, 0.5, 1.0, mass_kg=1e-3, label="trial")


def machine(**changes):
    """The machine of the rig with other numbers of its film: radial_clearance_m=1.05 is 5 % more of it."""
    left = {**FILM, **{key: FILM[key] * factor for key, factor in changes.items()}}
    return build_model({**RIG, "bearings": [left, SPRING]})


def spectrum(model, seed):
    return spectrum_of(model, SPEEDS, HARMONICS, NOISE, seed)


def test_runs_give_the_viscosity_of_a_film(tmp_path):
    true = machine(viscosity_Pa_s=1.15)
    write_table(tmp_path / "baseline.csv", true, 1)
    write_table(tmp_path / "trial.csv", faulty(true, TRIAL), 2)
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(RIG))
    added = {"node": 3, "unbalance_g_mm": 500.0, "angle_deg": float(np.rad2deg(1.0))}
    runs = [{"name": "baseline", "records": ["baseline.csv"]},
            {"name": "trial", "records": ["trial.csv"], "unbalances": [added]}]  # fmt: skip
    (tmp_path / "runs.yaml").write_text(yaml.safe_dump({"runs": runs}))
    value, std = identify_runs(tmp_path / "runs.yaml", tmp_path / "rig.yaml").joint.posterior.by_name[VISCOSITY]
    assert std < 0.02
    assert abs(value - 0.15) < 3.3 * std  # p = 0.001


@pytest.mark.parametrize(("parameter", "kind"), [("bearing_stiffness", "nothing"), ("bearing_damping", "cause")])
def test_a_bearing_that_differs_from_run_to_run_is_no_change(parameter, kind):
    """The right support is 20 % stiffer in the later run, which is a change unless runs differ by as much."""
    spring = {**SPRING, "bearing_stiffness_N_per_m": 1.2 * SPRING["bearing_stiffness_N_per_m"]}
    later = build_model({**RIG, "bearings": [FILM, spring]})
    settings = Settings(
        nuisance={}, hold_out_rad_s=[], uncertainty={"default": 0.1, CLEARANCE: 0.02}, leave_out=all_but("unbalance"),
        run_to_run=[f"{parameter}[right]"], repeatability=1e-4,
    )  # fmt: skip
    found = compare(spectrum(machine(), 3), spectrum(later, 4), build_model(RIG), settings=settings)
    verdict = found.diagnosis.verdict
    assert CLEARANCE in found.diagnosis.best.names
    assert (verdict.verdict == "nothing") == (kind == "nothing")


def test_the_earlier_state_keeps_a_bearing_that_differs_from_run_to_run():
    model = machine()
    settings = Settings(nuisance={}, uncertainty={"default": 0.1}, run_to_run=["bearing_stiffness[right]"])
    whole, prior = base_model(replace(model, before=frozenset(model.names)), settings)
    change = "bearing_stiffness[right, change]"
    assert set(whole.names) - set(whole.earlier.names) == {change}
    assert prior.by_name[change] == (0.0, pytest.approx(np.sqrt(2) * 0.1 * SPRING["bearing_stiffness_N_per_m"]))
    theta = whole.filled([change], [0.0])
    assert not measured_response(whole, SPEEDS, HARMONICS, theta).any()
    stiffer = {**SPRING, "bearing_stiffness_N_per_m": SPRING["bearing_stiffness_N_per_m"] + 1e6}
    later = build_model({**RIG, "bearings": [FILM, stiffer]})
    expected = measured_response(later, SPEEDS, HARMONICS) - measured_response(model, SPEEDS, HARMONICS)
    found = measured_response(whole, SPEEDS, HARMONICS, whole.filled([change], [1e6]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
