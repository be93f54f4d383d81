"""Which part of a rig takes away what it does not explain: one that was changed, and none where a force was added."""

import numpy as np
import pytest
import yaml
from machines import disc, film, readings, shaft, spectrum_of, springs, write_harmonics

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis.runs.joint import identify_runs
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.wide_ranges import wide_ranges

SPEEDS, HARMONICS, NOISE = np.linspace(90.0, 400.0, 8), np.array([1, -1]), 1e-8
RIG = {
    "rotor": shaft(1.0, 4, disc(3, 40.0, 0.3, 0.15), outer_diameter_m=0.08),
    "bearings": [film(0.08, 0.03, 8e-5, 0.02, node=node, label=str(node)) for node in (1, 5)],
    "foundation": [{**one, "mass_kg": 60.0} for one in springs({1: "pedestal 1", 5: "pedestal 5"}, 4e6, 3e3)],
    "effects": [{"kind": "unbalance", "node": 3, "unbalance_kg_m": 4e-4}],
    "sensors": [1, 3, 5],
}  # fmt: skip
SETTINGS = Settings(uncertainty={"default": 0.02, "rotor": 0.0, "bearings": 0.01}, nuisance={}, model_error=1e-3)


def changed(section, **numbers):
    return RIG | {section: [RIG[section][0] | numbers, *RIG[section][1:]]}


@pytest.mark.usefixtures("begun_once")
@pytest.mark.parametrize(
    ("true", "words"),
    [
        (changed("bearings", radial_clearance_m=1.1e-4), "check the bearings first (bearings[1].radial_clearance_m"),
        (changed("foundation", bearing_stiffness_N_per_m=2e6), "check the foundation first (bearing_stiffness[pedest"),
        (RIG | {"effects": [*RIG["effects"], {"kind": "runout", "node": 1, "harmonic": 1, "runout_1X_m": 2e-5}]},
         "check a runout first"),
        (RIG | {"effects": [*RIG["effects"], {"kind": "unbalance", "node": 5, "label": "2", "unbalance_kg_m": 2e-3}]},
         "none of these alone"),
    ],
)  # fmt: skip
def test_a_part_that_is_other_than_stated_is_told(true, words):
    shown = measured_response(build_model(true), SPEEDS, HARMONICS)
    spectrum = readings(shown, SPEEDS, HARMONICS, (1, 3, 5), NOISE, 3).with_error((1e-3 * np.abs(shown)) ** 2)
    assert words in wide_ranges(build_model(RIG), spectrum, SETTINGS)


def test_a_rig_without_such_parts_says_nothing():
    rig = {**RIG, "bearings": springs([1], 1e7, 1e3), "foundation": [], "sensors": [3]}
    model = build_model(rig)
    assert wide_ranges(model, spectrum_of(model, SPEEDS, HARMONICS, NOISE), SETTINGS) == ""


def test_a_run_up_finds_a_foundation_of_which_nothing_is_known(tmp_path):
    """Twice as stiff, and two thirds as heavy, in the rig as in truth; films 5 % uncertain, an unknown unbalance."""
    speeds, noise = np.linspace(60.0, 420.0, 40), 2e-7
    model = build_model(changed("foundation", bearing_stiffness_N_per_m=2e6, mass_kg=90.0))
    write_harmonics(tmp_path / "up.csv", spectrum_of(model, speeds, [1, -1], noise, 1))
    free = ("bearing_stiffness", "bearing_damping", "bearing_mass_scale", "eccentricity")
    uncertainty = {"default": 0.1, "rotor": 0.0, "bearings": 0.05, "bearing_scale": 0.0} | dict.fromkeys(free, 1.0)
    rig = RIG | {"measurement": {"harmonics": [1, -1], "table_noise_m": noise},
                 "diagnosis": {"uncertainty": uncertainty, "nuisance": {}, "model_error": 0.01}}  # fmt: skip
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    (tmp_path / "runs.yaml").write_text(yaml.safe_dump({"runs": [{"name": "up", "records": ["up.csv"]}]}))
    found = identify_runs(tmp_path / "runs.yaml", tmp_path / "rig.yaml")
    for name, true in (("bearing_stiffness", 2e6), ("bearing_mass_scale", 1.5)):
        value, std = found.joint.posterior.by_name[f"{name}[pedestal 1]"]
        assert abs(value - true) < 3 * std < 0.1 * true
