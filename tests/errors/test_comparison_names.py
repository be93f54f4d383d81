"""Mistakes in the configuration of a comparison: one line with the place, the near miss, and what is allowed."""

import pytest
import yaml

from rotorstudy.errors import RotorstudyError
from rotorstudy.studies.comparison.config import load_comparison
from rotorstudy.studies.config import load_study

CONFIG = "workflow/config/compare.yaml"
STUDIES, REPLAYS = ("chapter_2", "chapter_4", "chapter_6"), ("chapter_3", "chapter_5")


def set_at(part, path, to):
    for key in path[:-1]:
        part = part[key]
    if to is None:
        del part[path[-1]]
    else:
        part[path[-1]] = to


def loaded(root, folder, source, path=(), to=None):
    given = yaml.safe_load((root / source).read_text())
    if path:
        set_at(given, path, to)
    (folder / "given.yaml").write_text(yaml.safe_dump(given, sort_keys=False))
    if source != CONFIG:
        return load_study(folder / "given.yaml")
    config = load_comparison(folder / "given.yaml")
    config.check(STUDIES, REPLAYS)
    return config


def test_the_comparison_itself_is_right(request, tmp_path):
    assert loaded(request.config.rootpath, tmp_path, CONFIG).trials == 100


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("trials",), -6, ["trials = -6", "greater than or equal to 2"]),
        (("levels_percent",), [], ["levels_percent = []", "at least 1"]),
        (("levels_percent",), [0, -1], ["levels_percent.1 = -1", "greater than or equal to 0"]),
        (("faults",), {}, ["faults = {}", "at least 1"]),
        (("faults", "whole revolutions", "rvolutions"), 5.0, ["did you mean 'faults.whole revolutions.revolutions'"]),
        (("faults", "1 % outliers", "outlier_share"), 0.9, ["outlier_share = 0.9", "less than 0.5"]),
        (("rotors", "2-DOF", "study"), "chaptr_2", ["'chaptr_2'", "rotor '2-DOF'", "did you mean 'chapter_2'"]),
        (("rotors", "2-DOF", "replay"), "chapter_3", ["give either 'study' or 'replay'"]),
        (("rotors", "2-DOF", "speeds_rad_s"), None, ["rotors.2-DOF", "a study needs speeds_rad_s"]),
        (("rotors", "2-DOF", "speed_rad_s"), [1.0], ["did you mean 'rotors.2-DOF.speeds_rad_s'"]),
        (("rotors", "2-DOF", "harmonics"), [0, 1, 1], ["rotor '2-DOF'", "each once"]),
        (("faults", "1 % outliers", "levels_percent"), [3.0],
         ["fault '1 % outliers'", "must be some of [0.0, 0.5, 1.0, 2.0, 5.0]"]),
    ],
)  # fmt: skip
def test_a_wrong_comparison_is_refused(request, tmp_path, path, to, words):
    with pytest.raises(RotorstudyError) as caught:
        loaded(request.config.rootpath, tmp_path, CONFIG, path, to)
    said = str(caught.value)
    assert "\n" not in said and all(word in said for word in words), said


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("estimators",), [], ["estimators = []", "at least 1"]),
        (("monte_carlo", "rigs", "physical", "estimators"), [], ["monte_carlo.rigs.physical.estimators", "at least 1"]),
        (("monte_carlo", "trials"), -5, ["monte_carlo.trials = -5", "greater than or equal to 2"]),
        (("record", "sampels"), 5, ["'record.sampels'", "did you mean 'record.samples'"]),
        (("cases", "all", "last_rad"), 5, ["last_rad"]),
    ],
)
def test_a_study_without_estimators_or_trials_is_refused(request, tmp_path, path, to, words):
    given = yaml.safe_load((request.config.rootpath / "workflow/config/chapter_2.yaml").read_text())
    if path[0] == "cases":
        path = ("cases", next(iter(given["cases"])), path[-1])
    with pytest.raises(RotorstudyError) as caught:
        loaded(request.config.rootpath, tmp_path, "workflow/config/chapter_2.yaml", path, to)
    said = str(caught.value)
    assert "\n" not in said and all(word in said for word in words), said
