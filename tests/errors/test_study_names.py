"""Names and numbers of a configuration that are wrong on their own or together: refused before anything runs."""

import copy

import pytest
import yaml
from one_line_errors import refused

from rotorstudy.studies.config import load_study
from thesis.config import check_replay, load_replay


def changed(part, path, to):
    part = copy.deepcopy(part)
    inner = part
    for key in path[:-1]:
        inner = inner[key]
    if to is None:
        del inner[path[-1]]
    else:
        inner[path[-1]] = to
    return part


def check(root, folder, source, path=(), to=None):
    given = yaml.safe_load((root / "workflow" / "config" / f"{source}.yaml").read_text())
    (folder / "given.yaml").write_text(yaml.safe_dump(changed(given, path, to) if path else given, sort_keys=False))
    if "slow_roll" in given:
        check_replay(load_replay(folder / "given.yaml"), root / "workflow" / "reference")
    else:
        study = load_study(folder / "given.yaml")
        study.check_rigs()
        study.check_shown(2)


@pytest.mark.parametrize("source", ["chapter_2", "chapter_3", "chapter_4", "chapter_5"])
def test_what_is_given_is_right(request, tmp_path, source):
    check(request.config.rootpath, tmp_path, source)


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("figures", "figure_5_4", "case"), None, ["figure_5_4", "'record'", "'case:'"]),
        (("figures", "figure_5_12", "group"), None, ["figure_5_12", "'model'", "'group:'"]),
        (("figures", "figure_5_12", "case"), "3 Hz", ["figure_5_12", "slow roll"]),
        (("figures", "physical_checks", "group"), None, ["physical_checks", "'checks'", "'group:'"]),
        (("figures",), {"figure_5_14": {"kind": "crack force"}}, ["'crack force'", "'model'"]),
        (("data_sets",), ["regression", "fftt"], ["unknown data set 'fftt'", "did you mean 'fft'"]),
        (("data_sets",), ["regression"], ["data_sets", "'fft'"]),
        (("estimators",), ["least_squares"], ["estimators", "'maximum_likelihood'"]),
        (("groups", "15 to 20 Hz"), [], ["15 to 20 Hz", "at least 1"]),
        (("groups",), {}, ["groups", "at least 1"]),
        (("groups", "15 to 20 Hz"), ["3 Hz", "15 Hz"], ["slow roll '3 Hz'", "zero after subtraction"]),
        (("groups",), {"all": ["15 Hz", "20 Hz"]}, ["unknown group", "all"]),
        (("tables",), ["5.2", "5.3", "5.44"], ["unknown printed table '5.44'", "replay chapter_5"]),
        (("estimates_table",), "5.55", ["unknown printed table '5.55'"]),
        (("estimates_table",), "5.6", ["Table 5.6"]),
        (("sheets", "7.1"), {"title": "a", "note": "b", "across": ["case"]}, ["unknown printed table '7.1'"]),
        (("tables",), ["5.2", "5.3"], ["print no amplitude of 0X", "'20 Hz'"]),
        (("harmonics",), [0, 1, 2, 9], ["print no amplitude of 9X"]),
    ],
    ids=lambda part: ".".join(part) if isinstance(part, tuple) else "",
)
def test_a_wrong_replay_is_refused(request, tmp_path, path, to, words):
    refused(lambda: check(request.config.rootpath, tmp_path, "chapter_5", path, to), *words)


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("record", "kinds", "incomplete cycles", "dropped_samples"), 65536, ["'incomplete cycles'", "65536", "fewer"]),
        (("shown_speeds_rad_s",), [100.0], ["shown_speeds_rad_s", "lists 1", "give 2"]),
        (("shown_speeds_rad_s",), [100.0, 200.0, 300.0], ["shown_speeds_rad_s", "lists 3", "give 2"]),
        (
            ("extra_measurements", "far"),
            {"tilts": [7]},
            ["study chapter_4, extra_measurements, 'far': unknown tilt", "7"],
        ),
        (("extra_measurements", "far"), {"stations_m": [0.5]}, ["extra_measurements, 'far':", "0.5 m", "0.36 m"]),
        (("extra_measurements", "far"), {"harmonics": []}, ["extra_measurements, 'far': harmonics []"]),
        (
            ("extra_measurements", "far"),
            {"speeds": {"first_rad_s": 9.0, "last_rad_s": 1.0}},
            ["extra_measurements, 'far': speeds"],
        ),
    ],
    ids=lambda part: ".".join(part) if isinstance(part, tuple) else "",
)
def test_a_wrong_study_is_refused(request, tmp_path, path, to, words):
    refused(lambda: check(request.config.rootpath, tmp_path, "chapter_4", path, to), *words)
