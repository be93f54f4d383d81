"""Sealing and scoring, with stand-ins whose score is known."""

import json
from html import escape

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from rotorstudy.blind.chunks import answer_chunk, gather_chunks
from rotorstudy.blind.criteria import Criterion, attributes, judge, printed, statement, tally
from rotorstudy.blind.glance import ANSWERS, INDEPENDENT, OWN, independent_answers, own_answers, sentences
from rotorstudy.blind.run import run_blind
from rotorstudy.blind.scoring import same_cause, score, share_bounds
from rotorstudy.blind.sealing import check_seal, salt_of, seal
from rotorstudy.blind.summary import summary
from rotorstudy.errors import RotorstudyError
from rotorstudy.presentation.blind_page import criteria_page, write_pages
from rotorstudy.presentation.captions import BLIND_FIGURES

from .conftest import accuser, mute, oracle


def scored(cases, who):
    rows = score([case.truth for case in cases], [who(case) for case in cases])
    return rows, {c.key: c for c in judge(rows)}


def test_one_who_knows_reaches_every_criterion(cases):
    rows, criteria = scored(cases, oracle)
    assert rows[rows.known].right.all()
    shares = [c for c in criteria.values() if c.kind == "share" and c.cases and c.needed and c.needed[1] == 1]
    assert len(shares) >= 6 and all(c.reached == 1 for c in shares)
    assert not tally(criteria.values())["not reached"]
    assert criteria["calibration"].reached == 0
    assert criteria["intervals"].reached == 1


def test_one_who_is_mute_finds_nothing_and_accuses_nobody(cases):
    rows, criteria = scored(cases, mute)
    assert not rows.right.any()
    assert criteria["clean_called_clean"].reached == 1
    assert criteria["right_large"].reached == 0 and criteria["right_large"].status == "not reached"
    assert criteria["chain_not_rotor"].reached == 1
    assert criteria["intervals"].status == "no cases" and criteria["calibration"].status == "no cases"


def test_one_who_accuses_always_is_found_out(cases):
    _, criteria = scored(cases, accuser)
    assert criteria["clean_called_clean"].reached == 0
    assert criteria["chain_not_rotor"].reached == 0
    assert criteria["calibration"].reached > 0.8
    assert any("answered unbalance" in reason for reason in criteria["clean_called_clean"].reasons)


def test_a_missed_criterion_changes_what_is_said(cases):
    """Not a colour alone: the statement, the terminal, the first lines of the page and the attributes of the file."""
    said = {}
    for who in (oracle, mute, accuser):
        rows, criteria = scored(cases, who)
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
        answers = own_answers(rows)
        page = criteria_page(answers, criteria, "simulated", [("Answers", "data:,", "")])
        assert all(f"<p>{sentence}</p>" in page[: page.index("<h2>")] for sentence in sentences(answers))
        first = page.index("<h2>How to read")
        assert page.index(statement(criteria)) < first
        for c in criteria:
            assert (f"<li>{escape(c.what)}:" in page[:first]) == (c.status in ("not reached", "undecided")), c
        said[who] = statement(criteria), attrs["missed_criteria"], *sentences(answers)
    assert len(set(said.values())) == 3


def test_the_counts_at_a_glance_are_those_of_who_answers(cases):
    counts = {who: own_answers(scored(cases, who)[0]).set_index("answer").found for who in (oracle, mute, accuser)}
    single = own_answers(scored(cases, mute)[0]).set_index("answer").cases["alone"]
    assert list(counts[oracle].index) == list(ANSWERS) and single > 0
    assert counts[oracle]["alone"] == counts[oracle]["in_set"] == single
    assert counts[mute].drop("clean").sum() == 0 and counts[mute]["clean"] > 0
    assert counts[accuser]["clean"] == 0 and counts[accuser]["wrong"] > 0 and counts[oracle]["wrong"] == 0


def test_the_independent_records_stand_beside_the_own(cases):
    """A refused record and a pair do not count; small effects do not either."""
    rows = pd.DataFrame(
        [
            ("healthy", True, 0.0, "nothing", False, False, False),
            ("bow", True, 9.0, "cause", True, True, False),
            ("bow", True, 9.0, "ambiguous", False, True, False),
            ("bow", True, 1.0, "nothing", False, False, False),
            ("pair", True, 9.0, "cause", False, False, True),
            ("bow", True, 9.0, "refused", False, False, False),
        ],
        columns=["kind", "known", "size", "verdict", "alone", "in_set", "wrong"],
    )
    there = independent_answers(rows)
    assert list(there.found) == [1, 1, 2, 0, 0] and list(there.cases) == [1, 2, 2, 2, 2]
    said = sentences(pd.concat([own_answers(scored(cases, oracle)[0]), there]))
    assert len(said) == 5 and OWN in said[1] and f"1 of 2 cases of {INDEPENDENT} (1 to 99 %)" in said[1]


def test_criteria_have_one_key_each_and_say_what_they_need(cases):
    _, criteria = scored(cases, oracle)
    assert len(criteria) == len(judge(score([c.truth for c in cases], [oracle(c) for c in cases])))
    needed = {c.needed_text for c in criteria.values()}
    assert needed == {"", ">= 0.99", ">= 0.95", ">= 0.9", ">= 0.85", ">= 0.8", "<= 0.1", "<= 0.05", "<= 0.01",
                      "0.93 to 0.97"}  # fmt: skip
    assert not Criterion("a", "a", "share", None, 0.5, 0, 1, 1, 2, "for information").within


def test_fewer_than_six_ratios_bound_no_median(cases):
    rows, _ = scored(cases, oracle)
    large = rows[rows.known & (rows["size"] >= 3)].head(5)
    median = {c.key: c for c in judge(large)}["gain"]
    assert (median.cases, median.low, median.high, median.status) == (5, 0.0, np.inf, "undecided")


def test_place_counts_where_there_is_more_than_one():
    true = {"effect": "bow", "where": {"node": 3}, "places": 5}
    assert same_cause(true, {"effect": "bow", "where": {"node": 3}})
    assert not same_cause(true, {"effect": "bow", "where": {"node": 2}})
    assert not same_cause(true, {"effect": "bow", "where": {}})
    assert same_cause({**true, "places": 1}, {"effect": "bow", "where": {}})


def test_bounds_hold_the_truth_at_least_as_often_as_they_say():
    for share in (0.02, 0.5, 0.97):
        weight = binom.pmf(np.arange(31), 30, share)
        inside = [low <= share <= high for low, high in (share_bounds(k, 30) for k in range(31))]
        assert weight @ inside >= 0.95
    assert share_bounds(0, 0) == (0, 1)


def test_an_altered_truth_is_noticed(cases):
    truth, salt = cases[0].truth, salt_of(1, 0)
    sealed = seal(truth, salt)
    check_seal(truth, salt, sealed, "case 0")
    with pytest.raises(RotorstudyError, match="altered"):
        check_seal({**truth, "noise_percent": truth["noise_percent"] + 1e-9}, salt, sealed, "case 0")
    with pytest.raises(RotorstudyError, match="altered"):
        check_seal(truth, salt_of(1, 1), sealed, "case 0")


def test_pages_and_figures_of_a_run(cases, tmp_path):
    rows, criteria = scored(cases, oracle)
    criteria = list(criteria.values())
    data = summary(rows, criteria).assign_attrs(cases=len(rows), seed=0)
    write_pages(data, criteria, rows, tmp_path)
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == set(BLIND_FIGURES)
    for name in BLIND_FIGURES:
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 3000
    assert "clean records called clean" in (tmp_path / "criteria.html").read_text()
    table = pd.read_csv(tmp_path / "criteria.csv")
    assert list(table.key) == list(data.criterion.values) == [c.key for c in criteria]


def silent(spectrum, model, stated):
    return {"verdict": "nothing", "causes": []}, None


def guessing(spectrum, model, stated):
    """An answer that depends on the record, with predictions at a held-out speed."""
    shown = spectrum.amplitude[:1]
    cause = {"effect": "unbalance", "where": {}, "probability": float(abs(shown[0, 0, 0]) % 1)}
    verdict = {"verdict": "nothing", "causes": [], "note": cause}
    return verdict, {"speed": spectrum.speed[:1].tolist(), "before": shown, "after": 0.5 * shown}


@pytest.mark.parametrize("chunks", [1, 4])
def test_a_run_in_chunks_is_the_run(config, tmp_path, chunks):
    config = config.model_copy(update={"cases": 5, "seed": 4, "records": 1})
    whole, _, rows = run_blind(config, tmp_path / "whole", answer=guessing)
    seals, answers = ([tmp_path / f"{name}_{i}.json" for i in range(chunks)] for name in ("seals", "answers"))
    for i in range(chunks):
        answer_chunk(config, i, chunks, seals[i], answers[i], tmp_path / "parts", answer=guessing)
    gathered, _, same = gather_chunks(config, tmp_path / "parts", seals, answers)
    assert gathered.drop_vars("case_seconds").identical(whole.drop_vars("case_seconds"))
    pd.testing.assert_frame_equal(rows.drop(columns="seconds"), same.drop(columns="seconds"))
    assert np.isfinite(rows.gain).any()
    for name in ("seals.json", "truths.json"):
        assert (tmp_path / "parts" / name).read_text() == (tmp_path / "whole" / name).read_text()
    if chunks > 1:  # out of order
        with pytest.raises(RotorstudyError, match="sealed"):
            gather_chunks(config, tmp_path / "wrong", seals, answers[::-1])


def test_a_run_does_not_depend_on_the_cores(config, tmp_path):
    small = config.model_copy(update={"records": 1})
    first, _, _ = run_blind(small, tmp_path / "one", cases=6, seed=4, cores=1, answer=silent)
    second, _, _ = run_blind(small, tmp_path / "two", cases=6, seed=4, cores=2, answer=silent)
    assert first.drop_vars("case_seconds").identical(second.drop_vars("case_seconds"))
    assert first.attrs["seed"] == 4
    assert json.loads((tmp_path / "one" / "seals.json").read_text())["sha256"][0]
    assert len(list((tmp_path / "one" / "records").glob("case_*/record_*.nc"))) >= 5
