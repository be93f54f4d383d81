"""Mistakes in a study that would not stop it, but leave a case empty, overwrite a file, or stop a job hours later."""

import copy

import pytest
import yaml

from rotorstudy import RotorstudyError
from rotorstudy.studies.config import load_study


@pytest.fixture(scope="module")
def right(request):
    return yaml.safe_load((request.config.rootpath / "workflow" / "config" / "chapter_2.yaml").read_text())


def checked(study, folder):
    path = folder / "study.yaml"
    path.write_text(yaml.safe_dump(study, sort_keys=False))
    found = load_study(path)
    found.check_rigs()
    return found


def changed(study, *path, to):
    study = copy.deepcopy(study)
    part = study
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = to
    return study


def test_the_study_itself_is_right(right, tmp_path):
    assert checked(right, tmp_path).harmonics == right["harmonics"]


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("cases",), {"down": {"first_rad_s": 199.0, "last_rad_s": 50.0}}, ["199", "50"]),  # no speed at all
        (("cases",), {}, ["cases"]),
        (("harmonics",), [0, 1, 1, 2], ["harmonics", "1"]),
        (("harmonics",), [], ["harmonics"]),
        (("unknowns",), ["external_damping", "external_damping"], ["external_damping"]),
        (("unknowns",), [], ["unknowns"]),
        (("shown_speeds_rad_s",), [-88.0], ["shown_speeds_rad_s", "-88", "greater than 0"]),
        (("shown_speeds_rad_s",), [], ["shown_speeds_rad_s"]),
        (("monte_carlo", "levels_percent"), [-1.0], ["levels_percent", "-1", "greater than"]),
        (("bias", "keys"), ["mas_kg"], ["mas_kg", "mass_kg"]),
        (("bias", "percent"), [-100.0], ["percent", "-100"]),  # a rotor without mass
        (("rigs",), {}, ["no rig"]),
    ],
    ids=lambda part: ".".join(part) if isinstance(part, tuple) else "",
)
def test_a_wrong_study_is_refused_before_anything_runs(right, tmp_path, path, to, words):
    with pytest.raises(RotorstudyError) as caught:
        checked(changed(right, *path, to=to), tmp_path)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_two_cases_that_would_write_the_same_file_are_refused(right, tmp_path):
    speeds = {"first_rad_s": 88.0, "last_rad_s": 88.0}
    with pytest.raises(RotorstudyError, match=r"Single.speed"):
        checked(changed(right, "cases", to={"Single speed": speeds, "Single-speed": speeds}), tmp_path)


def test_the_last_speed_of_a_case_is_never_above_the_one_asked_for(right, tmp_path):
    """A step that does not divide the range must not end beyond it; it would be a speed nobody asked for."""
    range_ = {"first_rad_s": 50.0, "last_rad_s": 196.0, "step_rad_s": 20.0}
    speeds = checked(changed(right, "cases", to={"case": range_}), tmp_path).cases["case"].speeds
    assert speeds[0] == 50.0 and speeds[-1] <= 196.0 and len(speeds) == 8
    range_["last_rad_s"] = 204.0  # nearer to 210 than to 190
    assert checked(changed(right, "cases", to={"case": range_}), tmp_path).cases["case"].speeds[-1] <= 204.0
