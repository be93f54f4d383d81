"""Sealing and scoring, with stand-ins whose score is known."""

import json
from html import escape

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from rotorstudy import RotorstudyError, registry
from rotorstudy.blind.config import KINDS
from rotorstudy.blind.criteria import attributes, judge, printed, statement, tally
from rotorstudy.blind.glance import ANSWERS, OWN, PUBLISHED, answers_of, sentences
from rotorstudy.blind.run import answer_case, answer_chunk, check_seal, gather_chunks, run_blind, salt_of, seal
from rotorstudy.blind.scoring import score, score_case, share_bounds
from rotorstudy.blind.summary import summary
from rotorstudy.model.depth import compliance
from rotorstudy.presentation.blind_page import criteria_page, write_pages
from rotorstudy.presentation.captions import BLIND_FIGURES

from .conftest import accuser, cause, mute, oracle


def only(kind):
    return {name: float(name == kind) for name in KINDS}


def scored(truths, who):
    rows = score(truths, [who(truth) for truth in truths])
    return rows, {c.key: c for c in judge(rows)}


def test_one_who_knows_reaches_every_criterion(truths):
    rows, criteria = scored(truths, oracle)
    assert rows[~rows.group.isin(["clean", "outside"])].alone.all()
    shares = [c for c in criteria.values() if c.kind == "share" and c.cases and c.needed and c.needed[1] == 1]
    assert len(shares) >= 10 and all(c.reached == 1 for c in shares), [c.key for c in shares if c.reached < 1]
    assert not tally(criteria.values())["not reached"]
    assert criteria["calibration"].reached == 0
    assert criteria["intervals"].reached == 1 and criteria["wrong_name"].reached == 0


def test_one_who_is_mute_finds_nothing_and_accuses_nobody(truths):
    rows, criteria = scored(truths, mute)
    assert not rows.in_set.any()
    assert criteria["clean_called_clean"].reached == 1
    assert criteria["in_set"].reached == 0 and criteria["in_set"].status == "not reached"
    assert criteria["outside_unknown"].reached == 0
    assert criteria["chain_not_rotor"].reached == 1
    assert criteria["intervals"].status == "no cases" and criteria["calibration"].status == "no cases"


def test_one_who_accuses_always_is_found_out(truths):
    _, criteria = scored(truths, accuser)
    assert criteria["clean_called_clean"].reached == 0
    assert criteria["chain_not_rotor"].reached == 0
    assert criteria["wrong_name"].reached == 1 and criteria["outside_named"].reached == 1
    assert criteria["calibration"].reached > 0.8
    assert any("answered base motion" in reason for reason in criteria["clean_called_clean"].reasons)


def test_a_crack_is_judged_by_place_angle_and_flexibility(truths):
    truth = next(one for one in truths if one["kind"] == "form" and one["families"] == "crack_form")
    plugin = registry().get("depth", "elasticity")
    across = compliance(plugin, 0.2, diameter_m=0.02, youngs_modulus_Pa=2.1e11)[0]
    truth = truth | {"true": [truth["true"][0] | {"across_rad_per_N_m": 1.1 * across}]}

    def row(**changes):
        stated = {"position_m": (0.31, 0.01), "depth_ratio": (0.2, 0.002), "angle_rad": (0.5, 0.01),
                  "flexibility_factor": (1.0, 0.05)} | changes  # fmt: skip
        named = cause(truth["true"][0])
        named["parameters"] = {name: {"value": value, "std": std} for name, (value, std) in stated.items()}
        verdict = {"verdict": "cause", "causes": [named]}
        return score_case(truth, {"verdict": verdict, "held_out": None, "seconds": 1.0})

    found = row()
    assert found["alone"] and found["place_error"] == pytest.approx(0.01)
    assert found["angle_error_deg"] == pytest.approx(np.rad2deg(0.1))
    assert found["flexibility_error"] == pytest.approx(1 / 1.1 - 1) and found["flexibility_held"] == 1
    assert row(flexibility_factor=(1.0, 0.01))["flexibility_held"] == 0
    assert row(flexibility_factor=(1.0, 0.01), depth_ratio=(0.2, 0.01))["flexibility_held"] == 1
    assert not row(position_m=(0.4, 0.01))["alone"]


def test_a_missed_criterion_changes_what_is_said(truths):
    """Not a colour alone: the statement, the terminal, the first lines of the page and the attributes of the file."""
    said = {}
    for who in (oracle, mute, accuser):
        rows, criteria = scored(truths, who)
        criteria = list(criteria.values())
        missed = [c.key for c in criteria if c.status == "not reached"]
        assert bool(missed) == (who is not oracle)
        attrs = attributes(criteria)
        data = summary(rows, criteria).assign_attrs(cases=len(rows), seed=0)
        assert {key: data.attrs[key] for key in attrs} == attrs
        assert attrs["missed_criteria"] == ", ".join(missed) and attrs["criteria_not_reached"] == len(missed)
        text = printed(criteria)
        assert text.startswith(f"{statement(criteria)}\n") and f"{len(missed)} not reached" in text
        assert "nan" not in text and text.count("have no cases") == 1
        answers = answers_of(rows)
        page = criteria_page(answers, {"this run": criteria}, "simulated", [("Answers", "data:,", "")])
        assert all(f"<p>{sentence}</p>" in page[: page.index("<h2>")] for sentence in sentences(answers))
        first = page.index("<h2>How to read")
        assert page.index(statement(criteria)) < first
        for c in criteria:
            assert (f"<li>{escape(c.what)}:" in page[:first]) == (c.status == "not reached"), c
        said[who] = statement(criteria), attrs["missed_criteria"], *sentences(answers)
    assert len(set(said.values())) == 3


def test_the_counts_at_a_glance_are_those_of_who_answers(truths):
    counts = {who: answers_of(scored(truths, who)[0]).set_index("answer").found for who in (oracle, mute, accuser)}
    single = answers_of(scored(truths, mute)[0]).set_index("answer").cases["alone"]
    assert list(counts[oracle].index) == list(ANSWERS) and single > 0
    assert counts[oracle]["alone"] == counts[oracle]["in_set"] <= single  # some records are refused
    assert counts[mute].drop("clean").sum() == 0 and counts[mute]["clean"] > 0
    assert counts[accuser]["clean"] == 0 and counts[accuser]["wrong"] > 0 and counts[oracle]["wrong"] == 0


def test_the_published_records_stand_beside_the_own(truths):
    """A refused record and a pair do not count; small effects do not either."""
    rows = pd.DataFrame(
        [
            ("", True, 0.0, "nothing", False, False, False),
            ("bow", True, 9.0, "cause", True, True, False),
            ("bow", True, 9.0, "ambiguous", False, True, False),
            ("bow", True, 1.0, "nothing", False, False, False),
            ("bow+rub", True, 9.0, "cause", False, False, True),
            ("bow", False, 9.0, "cause", False, False, True),
            ("bow", True, 9.0, "refused", False, False, False),
        ],
        columns=["families", "known", "size", "verdict", "alone", "in_set", "wrong"],
    )
    there = answers_of(rows, PUBLISHED)
    assert list(there.found) == [1, 1, 2, 0, 0] and list(there.cases) == [1, 2, 2, 2, 2]
    said = sentences(pd.concat([answers_of(scored(truths, oracle)[0]), there]))
    assert len(said) == 5 and OWN in said[1] and f"1 of 2 cases of {PUBLISHED} (1 to 99 %)" in said[1]


def test_criteria_have_one_key_each_and_say_what_they_need(truths):
    _, criteria = scored(truths, oracle)
    assert len(criteria) == len(judge(score(truths, [oracle(truth) for truth in truths])))
    needed = {c.needed_text for c in criteria.values()}
    assert needed == {"", ">= 0.99", ">= 0.95", ">= 0.85", ">= 0.8", "<= 0.1", "<= 0.05", "<= 0.01", "<= 0.003",
                      "0.93 to 0.97", "0.9 to 0.97"}  # fmt: skip


def test_fewer_than_six_ratios_bound_no_median(truths):
    rows, _ = scored(truths, oracle)
    large = rows[(rows["size"] >= 3) & rows.gain_true.notna()].head(5)
    median = {c.key: c for c in judge(large)}["gain"]
    assert (median.cases, median.low, median.high, median.status) == (5, 0.0, np.inf, "undecided")


def test_bounds_hold_the_truth_at_least_as_often_as_they_say():
    for share in (0.02, 0.5, 0.97):
        weight = binom.pmf(np.arange(31), 30, share)
        inside = [low <= share <= high for low, high in (share_bounds(k, 30) for k in range(31))]
        assert weight @ inside >= 0.95
    assert share_bounds(0, 0) == (0, 1)


def test_an_altered_truth_is_noticed(truths):
    truth, salt = truths[0], salt_of(1, 0)
    sealed = seal(truth, salt)
    check_seal(truth, salt, sealed, "case 0")
    with pytest.raises(RotorstudyError, match="altered"):
        check_seal({**truth, "mass_kg": truth["mass_kg"] * (1 + 1e-9)}, salt, sealed, "case 0")
    with pytest.raises(RotorstudyError, match="altered"):
        check_seal(truth, salt_of(1, 1), sealed, "case 0")


def test_pages_and_figures_of_a_run(truths, tmp_path):
    rows, criteria = scored(truths, oracle)
    criteria = list(criteria.values())
    data = summary(rows, criteria).assign_attrs(cases=len(rows), seed=0)
    write_pages(data, criteria, rows, tmp_path)
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == set(BLIND_FIGURES)
    for name in BLIND_FIGURES:
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 3000
    assert "clean records called clean" in (tmp_path / "criteria.html").read_text()
    table = pd.read_csv(tmp_path / "criteria.csv")
    assert list(table.key) == list(data.criterion.values) == [c.key for c in criteria]


def guessing(spectrum, model, settings, findings):
    """An answer that depends on the record, with predictions at a held-out speed."""
    shown = spectrum.amplitude[:1]
    verdict = {"verdict": "nothing", "causes": [], "note": float(abs(shown[0, 0, 0]) % 1)}
    return verdict, {"speed": spectrum.speed[:1].tolist(), "before": shown, "after": 0.5 * shown}


def failing(spectrum, model, settings, findings):
    raise IndexError("no such cause")


def test_a_diagnosis_that_ends_in_an_error_is_counted(drawn):
    truth, folder = next(one for one in drawn if one[0]["true"] and one[0]["size"])
    answer = answer_case(folder, answer=failing)
    assert (
        answer["verdict"]["verdict"] == "failed"
        and "IndexError: no such cause (test_scoring.py" in answer["verdict"]["error"]
    )
    row = score_case(truth, answer)
    assert row["wrong"] and not row["alone"]
    assert {c.key: c for c in judge(pd.DataFrame([row]))}["without_verdict"].reached == 1


@pytest.fixture(scope="module")
def whole(config, tmp_path_factory):
    """A run of four clean cases: its configuration, folder, result and rows."""
    folder = tmp_path_factory.mktemp("whole")
    config = config.model_copy(update={"cases": 4, "seed": 4, "records": 1, "shares": only("clean")})
    return config, folder, *run_blind(config, folder, cores=1, answer=guessing)[::2]


@pytest.mark.parametrize("chunks", [1, 4])
def test_a_run_in_chunks_is_the_run(whole, tmp_path, chunks):
    config, folder, data, rows = whole
    seals, answers = ([tmp_path / f"{name}_{i}.json" for i in range(chunks)] for name in ("seals", "answers"))
    for i in range(chunks):
        answer_chunk(config, i, chunks, seals[i], answers[i], tmp_path / "parts", answer=guessing)
    gathered, _, same = gather_chunks(config, tmp_path / "parts", seals, answers)
    assert gathered.drop_vars("case_seconds").identical(data.drop_vars("case_seconds"))
    pd.testing.assert_frame_equal(rows.drop(columns="seconds"), same.drop(columns="seconds"))
    assert np.isfinite(rows.gain_true).any()
    for name in ("seals.json", "truths.json"):
        assert (tmp_path / "parts" / name).read_text() == (folder / name).read_text()
    if chunks > 1:  # out of order
        with pytest.raises(RotorstudyError, match="sealed"):
            gather_chunks(config, tmp_path / "wrong", seals, answers[::-1])


def test_a_run_does_not_depend_on_the_cores(whole, tmp_path):
    config, folder, first, _ = whole
    second, _, _ = run_blind(config, tmp_path, cores=2, answer=guessing)
    assert first.drop_vars("case_seconds").identical(second.drop_vars("case_seconds"))
    assert first.attrs["seed"] == 4
    assert json.loads((folder / "seals.json").read_text())["sha256"][0]
    assert sorted(path.name for path in (folder / "records" / "case_0").iterdir()) == ["record.nc", "rig.yaml"]
