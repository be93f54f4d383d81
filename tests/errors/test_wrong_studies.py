"""Mistakes in a study, a replay or a comparison: refused in one line before anything runs."""

import pytest
import yaml
from one_line_errors import DROP, changed, refused

from rotorstudy.studies.comparison.config import load_comparison
from rotorstudy.studies.config import load_study
from thesis.config import check_replay, load_replay

STUDIES, REPLAYS = ("chapter_2", "chapter_4", "chapter_6"), ("chapter_3", "chapter_5")
SLOWEST = ("cases", "Single speed 88")


def given(root, source):
    return yaml.safe_load((root / "workflow" / "config" / f"{source}.yaml").read_text())


@pytest.fixture
def check(request, tmp_path):
    """Load a configuration of the project with one change, as the workflow does."""

    def check(source, path=(), to=None):
        root, file = request.config.rootpath, tmp_path / "study.yaml"
        right = given(root, source)
        file.write_text(yaml.safe_dump(changed(right, path, to) if path else right, sort_keys=False))
        if source == "compare":
            found = load_comparison(file)
            found.check(STUDIES, REPLAYS)
        elif source in REPLAYS:
            found = load_replay(file)
            check_replay(found, root / "workflow" / "reference")
        else:
            found = load_study(file)
            found.check_rigs()
            if source in ("chapter_2", "chapter_4"):
                found.check_shown(2)
        return found

    return check


@pytest.mark.parametrize("source", [*STUDIES, *REPLAYS, "compare"])
def test_what_is_given_is_right(request, check, source):
    assert check(source).title == given(request.config.rootpath, source)["title"]


FAR = "extra_measurements", "far"
WRONG = {
    "chapter_2": [
        (("unknown",), ["a"], ["unknown key 'unknown'", "did you mean 'unknowns'", "study.yaml"]),
        (("monte_carlo", "trials"), 0, ["monte_carlo.trials = 0", "greater than or equal to 2"]),
        (("monte_carlo", "trails"), 1000, ["trails", "study.yaml"]),
        (("record", "samples"), "many", ["record.samples = 'many'"]),
        (("record", "sampels"), 5, ["'record.sampels'", "did you mean 'record.samples'"]),
        (("monte_carlo", "seed"), DROP, ["monte_carlo.seed", "missing"]),
        (("monte_carlo", "rigs", "thesis", "models"), ["white"], ["'white'", "white in time"]),
        (("monte_carlo", "rigs", "physical", "estimators"), [], ["monte_carlo.rigs.physical.estimators", "at least 1"]),
        (("monte_carlo", "levels_percent"), [-1.0], ["levels_percent", "-1", "greater than"]),
        (("estimators",), [], ["estimators = []", "at least 1"]),
        (("estimators",), ["least_sqares"], ["unknown estimator", "did you mean 'least_squares'"]),
        (("unknowns",), ["internl_damping"], ["unknown parameter", "did you mean 'internal_damping'"]),
        (("unknowns",), ["external_damping", "external_damping"], ["external_damping is given twice"]),
        (("unknowns",), [], ["unknowns"]),
        ((*SLOWEST, "last_rad"), 5, ["last_rad"]),
        (("cases",), {"down": {"first_rad_s": 199.0, "last_rad_s": 50.0}}, ["no speed", "199", "50"]),
        (("cases",), {}, ["cases"]),
        (("cases", "Single-speed 88"), {"first_rad_s": 88.0, "last_rad_s": 88.0}, ["Single", "the same file"]),
        (("harmonics",), [0, 1, 1, 2], ["harmonics", "1"]),
        (("harmonics",), [], ["harmonics"]),
        (("shown_speeds_rad_s",), [-88.0], ["shown_speeds_rad_s", "-88", "greater than 0"]),
        (("shown_speeds_rad_s",), [], ["shown_speeds_rad_s"]),
        (("bias", "keys"), ["mas_kg"], ["mas_kg", "mass_kg"]),
        (("bias", "percent"), [-100.0], ["percent", "-100"]),  # a rotor without mass
        (("rigs",), {}, ["no rig"]),
    ],
    "chapter_3": [
        (("slow_rol",), "3 Hz", ["unknown key 'slow_rol'", "did you mean 'slow_roll'"]),
        (("duration_s",), -1.0, ["duration_s = -1.0", "greater than 0"]),
    ],
    "chapter_5": [
        (("figures", "figure_5_4", "case"), DROP, ["figure_5_4", "'record'", "'case:'"]),
        (("figures", "figure_5_12", "group"), DROP, ["figure_5_12", "'model'", "'group:'"]),
        (("figures", "figure_5_12", "case"), "3 Hz", ["figure_5_12", "slow roll"]),
        (("figures", "physical_checks", "group"), DROP, ["physical_checks", "'checks'", "'group:'"]),
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
    "chapter_4": [
        (("record", "kinds", "incomplete cycles", "dropped_samples"), 65536, ["'incomplete cycles'", "65536", "fewer"]),
        (("shown_speeds_rad_s",), [100.0], ["shown_speeds_rad_s", "lists 1", "give 2"]),
        (("shown_speeds_rad_s",), [100.0, 200.0, 300.0], ["shown_speeds_rad_s", "lists 3", "give 2"]),
        (FAR, {"tilts": [7]}, ["study chapter_4, extra_measurements, 'far': unknown tilt", "7"]),
        (FAR, {"stations_m": [0.5]}, ["extra_measurements, 'far':", "0.5 m", "0.36 m"]),
        (FAR, {"harmonics": []}, ["extra_measurements, 'far': harmonics []"]),
        (FAR, {"speeds": {"first_rad_s": 9.0, "last_rad_s": 1.0}}, ["extra_measurements, 'far': speeds"]),
    ],
    "compare": [
        (("trials",), -6, ["trials = -6", "greater than or equal to 2"]),
        (("levels_percent",), [], ["levels_percent = []", "at least 1"]),
        (("levels_percent",), [0, -1], ["levels_percent[1] = -1", "greater than or equal to 0"]),
        (("faults",), {}, ["faults = {}", "at least 1"]),
        (("faults", "whole revolutions", "rvolutions"), 5.0, ["did you mean 'faults.whole revolutions.revolutions'"]),
        (("faults", "1 % outliers", "outlier_share"), 0.9, ["outlier_share = 0.9", "less than 0.5"]),
        (("rotors", "2-DOF", "study"), "chaptr_2", ["'chaptr_2'", "rotor '2-DOF'", "did you mean 'chapter_2'"]),
        (("rotors", "2-DOF", "replay"), "chapter_3", ["give either 'study' or 'replay'"]),
        (("rotors", "2-DOF", "speeds_rad_s"), DROP, ["rotors.2-DOF", "a study needs speeds_rad_s"]),
        (("rotors", "2-DOF", "speed_rad_s"), [1.0], ["did you mean 'rotors.2-DOF.speeds_rad_s'"]),
        (("rotors", "2-DOF", "harmonics"), [0, 1, 1], ["rotor '2-DOF'", "each once"]),
        (("faults", "1 % outliers", "levels_percent"), [3.0], ["fault '1 % outliers'", "some of [0.0, 0.5, 1.0, 2.0,"]),
    ],
}


@pytest.mark.parametrize(
    ("source", "path", "to", "words"),
    [(source, *row) for source, rows in WRONG.items() for row in rows],
    ids=lambda part: ".".join(map(str, part)) if isinstance(part, tuple) else "",
)
def test_a_mistake_is_refused(check, source, path, to, words):
    refused(lambda: check(source, path, to), *words)


def test_the_last_speed_of_a_case_is_never_above_the_one_asked_for(check):
    """A step that does not divide the range must not end beyond it; it would be a speed nobody asked for."""
    range_ = {"first_rad_s": 50.0, "last_rad_s": 196.0, "step_rad_s": 20.0}
    speeds = check("chapter_2", ("cases",), {"case": range_}).cases["case"].speeds
    assert speeds[0] == 50.0 and speeds[-1] <= 196.0 and len(speeds) == 8
    range_["last_rad_s"] = 204.0  # nearer to 210 than to 190
    assert check("chapter_2", ("cases",), {"case": range_}).cases["case"].speeds[-1] <= 204.0


def test_a_study_based_on_another_states_only_what_differs(request, tmp_path):
    base = request.config.rootpath / "workflow" / "config" / "chapter_2.yaml"
    whole, path = load_study(base), tmp_path / "small.yaml"
    path.write_text(f"based_on: {base}\nmonte_carlo: {{trials: 7}}\ncases: {{Single speed 308: null}}\n")
    small = load_study(path)
    assert small.monte_carlo == whole.monte_carlo.model_copy(update={"trials": 7})
    assert list(small.cases) == [case for case in whole.cases if case != "Single speed 308"]
    assert small.rigs == whole.rigs
    path.write_text(f"based_on: {base}\ncases: {{Single speed 380: null}}\n")
    refused(lambda: load_study(path), "small.yaml", "unknown key to leave out", "did you mean 'Single speed 308'")
    path.write_text("based_on: [chapter_2.yaml]\n")
    refused(lambda: load_study(path), "based_on: ['chapter_2.yaml'] is not the name of a file")
    path.write_text("based_on: none.yaml\n")
    refused(lambda: load_study(path), "none.yaml", "does not exist")
