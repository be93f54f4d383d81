"""The study of transverse cracks: detection limits and bounds from derivatives, against their definitions."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from one_line_errors import refused
from scipy.stats import chi2

from rotorstudy import measured_response
from rotorstudy.studies.crack_study.config import load_crack_study
from rotorstudy.studies.crack_study.sensitivity import SHAPE, Machine, bounds, explained_away, visibility
from rotorstudy.studies.crack_study.stages import needed_visibility, smallest
from rotorstudy.yaml_file import read_study

CONFIG = Path(__file__).parents[2] / "workflow/config/test/chapter_7.yaml"


@pytest.fixture(scope="module")
def machine():
    study = load_crack_study(CONFIG)
    return Machine(study, study.main)


def test_derivatives_by_the_shape_are_differences(machine):
    """Those of a crack at the same motion, with its feedback, agree with records of two cracks side by side."""
    crack = machine.crack(0.15, 0.2, 0.4)
    columns = machine.columns(crack)[:, -len(SHAPE) :]
    for i, (name, step) in enumerate({"position_m": 1e-5, "depth_ratio": 1e-5, "angle_rad": 1e-4}.items()):
        up, down = (machine.change(**{**crack.shape, name: crack.shape[name] + h}) for h in (step, -step))
        difference = (up - down) / (2 * step)
        # one-sided differences of 1e-4 of the range, and interpolation of the law of opening
        assert np.abs(columns[:, i] - difference).max() < 0.02 * np.abs(difference).max()


def test_detection_has_the_stated_power():
    """Simulated: the test statistic of a change that is just large enough, with noise of one."""
    needed, random = needed_visibility(1e-3, 0.95), np.random.default_rng(1)
    draws = random.standard_normal((20000, 3)) + np.array([needed, 0, 0])
    found = np.mean(np.sum(draws**2, axis=1) > chi2.isf(1e-3, 3))
    assert found == pytest.approx(0.95, abs=0.01)  # six standard deviations of the share


def test_what_the_rig_can_explain_is_not_visible():
    random = np.random.default_rng(2)
    columns, weak = random.standard_normal((40, 3)), np.eye(3) * 1e-6
    basis = explained_away(columns, weak)
    assert visibility(columns @ [1.0, -2.0, 0.5], basis) < 1e-4
    assert visibility(random.standard_normal(40), basis) > 3
    held = explained_away(columns, np.eye(3) * 1e6)  # known exactly: then it does not explain anything
    assert visibility(columns[:, 0], held) == pytest.approx(np.linalg.norm(columns[:, 0]), rel=1e-6)


def test_the_smallest_crack_follows_the_power_of_its_depth():
    depths = [0.02, 0.1, 0.5]
    seen = 5e3 * np.array(depths) ** 2.5
    assert smallest(depths, seen[None], 10.0)[0] == pytest.approx((10.0 / 5e3) ** 0.4, rel=1e-9)
    assert np.isnan(smallest(depths, seen[None], 1e6)[0])


def test_bounds_are_those_of_linear_least_squares():
    columns = np.random.default_rng(3).standard_normal((30, 5))
    expected = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))[-3:]
    assert bounds(columns, np.eye(2) * 1e-9, [1e9] * 3) == pytest.approx(expected, rel=1e-6)


def test_the_change_by_a_crack_is_that_of_the_rig(machine):
    effect = machine.study.crack.effect(0.15, 0.2, 0.4)
    model = machine.rotor.model(effect)
    shown = measured_response(model, machine.speed, machine.harmonics) - machine.healthy
    assert machine.change(0.15, 0.2, 0.4) == pytest.approx(machine.raw.whitened(shown))
    assert np.isnan(machine.change(0.1125, 0.2, 0.4)).all()  # at a disc


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("usual_noise_percent", 7, "usual_noise_percent"),
        ("reference", {"position_m": 0.9, "depth_ratio": 0.2, "angle_rad": 0.0}, "not on the shaft"),
        ("reference", {"position_m": 0.1125, "depth_ratio": 0.2, "angle_rad": 0.0}, "disc"),
        ("power", 0.1, "power"),
    ],
)
def test_a_wrong_configuration_is_refused_in_one_line(key, value, words, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(read_study(CONFIG) | {key: value}))
    refused(lambda: load_crack_study(path), words)
