"""Sealing and scoring, with stand-ins whose score is known."""

import json
import shutil
from html import escape

import numpy as np
import pandas as pd
import pytest
from one_line_errors import refused
from scipy.stats import binom

from rotorstudy.blind.criteria import AT_A_GLANCE, OWN, judge, printed, sentences, statement
from rotorstudy.blind.run import answer_case, answer_chunk, check_seal, gather_chunks, run_blind, salt_of, seal, summary
from rotorstudy.blind.scoring import score, score_case, share_bounds
from rotorstudy.measurement.findings import told
from rotorstudy.presentation.blind_page import criteria_page, write_pages
from rotorstudy.presentation.captions import BLIND_FIGURES

from .conftest import accuser, cause, mute, only, oracle


def scored(truths, who):
    """Rows and criteria, by key, of one who answers."""
    rows = score(truths, [who(truth) for truth in truths])
    return rows, judge(rows).set_index("key", drop=False)


def test_one_who_knows_reaches_every_criterion(truths):
    rows, criteria = scored(truths, oracle)
    assert rows[~rows.group.isin(["clean", "outside"])].alone.all()
    shares = criteria[(criteria.kind == "share") & (criteria.cases > 0) & criteria.needed.str.startswith(">=")]
    assert len(shares) >= 10 and (shares.reached == 1).all(), shares.reached
    assert not (criteria.status == "not reached").any()
    assert criteria.reached[["calibration", "wrong_name"]].tolist() == [0, 0] and criteria.reached["intervals"] == 1


def test_one_who_is_mute_finds_nothing_and_accuses_nobody(truths):
    rows, criteria = scored(truths, mute)
    assert not rows.in_set.any()
    assert criteria.reached[["clean_called_clean", "chain_not_rotor"]].tolist() == [1, 1]
    assert criteria.reached[["in_set", "outside_unknown"]].tolist() == [0, 0]
    assert criteria.status["in_set"] == "not reached"
    assert criteria.status[["intervals", "calibration"]].tolist() == ["no cases"] * 2


def test_one_who_accuses_always_is_found_out(truths):
    _, criteria = scored(truths, accuser)
    assert criteria.reached[["clean_called_clean", "chain_not_rotor", "outside_unknown"]].tolist() == [0, 0, 0]
    assert criteria.reached["wrong_name"] == 1 and criteria.reached["calibration"] > 0.8
    assert "answered base motion" in criteria.reasons["clean_called_clean"]


def test_a_crack_is_judged_by_place_angle_and_flexibility(truths):
    truth = next(one for one in truths if one["kind"] == "form" and one["families"] == "crack_form")
    truth = truth | {"true": [truth["true"][0] | {"across_rad_per_N_m": 1.1e-6}]}

    def row(interval=None, **changes):
        stated = {"position_m": (0.31, 0.01), "angle_rad": (0.5, 0.01), "flexibility_rad_per_N_m": (1e-6, 7e-8)}
        named, stated = cause(truth["true"][0]), stated | changes
        named["parameters"] = {name: {"value": value, "std": std} for name, (value, std) in stated.items()}
        named["parameters"]["flexibility_rad_per_N_m"]["interval_95"] = interval
        verdict = {"verdict": "cause", "causes": [named]}
        return score_case(truth, {"verdict": verdict, "held_out": None, "seconds": 1.0})

    found = row()
    assert found["alone"] and found["place_error"] == pytest.approx(0.01)
    assert found["angle_error_deg"] == pytest.approx(np.rad2deg(0.1))
    assert found["flexibility_error"] == pytest.approx(1 / 1.1 - 1) and found["flexibility_held"] == 1
    assert row(flexibility_rad_per_N_m=(1e-6, 4e-8))["flexibility_held"] == 0
    assert [row(ends)["flexibility_held"] for ends in ([9e-7, 1.05e-6], [1.05e-6, 1.2e-6])] == [0, 1]
    assert not row(position_m=(0.4, 0.01))["alone"]


@pytest.mark.parametrize(("probed", "node", "right"), [(1, None, True), (2, None, False), (2, 1, True), (1, 9, False)])
def test_refused_records_are_right_by_the_node_or_of_all_where_one_is_probed(truths, probed, node, right):
    reversed_there = {"fault": "reversed", "true": [{"family": "reversed", "node": 1}], "probed_nodes": probed}
    truth = next(one for one in truths if one["known"] and len(one["true"]) == 1) | reversed_there
    name, where = ("swapped probes", f"record.nc, node {node}") if node else ("sense of rotation", "record.nc")
    error = str(told(name, where, ratio=3.0, remedy=""))
    answer = {"verdict": {"verdict": "refused", "error": error}, "held_out": None, "seconds": 1.0}
    assert score_case(truth, answer)["alone"] == right


def test_a_missed_criterion_changes_what_is_said(truths):
    """Not a colour alone: the statement, the terminal, the first lines of the page and the file."""
    said = {}
    for who in (oracle, mute, accuser):
        rows, criteria = scored(truths, who)
        missed = criteria.what[criteria.status == "not reached"]
        assert bool(len(missed)) == (who is not oracle)
        assert list(summary(rows, criteria).criterion_status.values) == list(criteria.status)
        text = printed(criteria)
        assert text.startswith(f"{statement(criteria)}\n") and f"{len(missed)} not reached" in text
        assert "nan" not in text and text.count("have no cases") == 1
        figures = {"answers": {"title": "Answers", "source": "data:,", "caption": ""}}
        page = criteria_page(criteria, "simulated", figures)
        assert all(f"<p>{sentence}</p>" in page[: page.index("<h2>")] for sentence in sentences(criteria))
        first = page[: page.index("<h2>How to read")]
        assert statement(criteria) in first
        assert {what for what in criteria.what if f"<li>{escape(what)}:" in first} == set(missed)
        said[who] = statement(criteria), *missed, *sentences(criteria)
    assert len(set(said.values())) == 3


def test_the_published_records_stand_beside_the_own(truths):
    """A refused record and a pair do not count; small effects do not either."""
    found = [
        ("", True, 0.0, "nothing", False, False, False), ("bow", True, 9.0, "cause", True, True, False),
        ("bow", True, 9.0, "ambiguous", False, True, False), ("bow", True, 1.0, "nothing", False, False, False),
        ("bow+rub", True, 9.0, "cause", False, False, True), ("bow", False, 9.0, "cause", False, False, True),
        ("bow", True, 9.0, "refused", False, False, False),
    ]  # fmt: skip
    columns = ["families", "known", "size", "verdict", "alone", "in_set", "wrong"]
    rows = pd.DataFrame(found, columns=columns).assign(
        named="", probability=np.nan, first_right=False, angle_right=True, sizes=0, covered=0, gain=np.nan
    )
    there = judge(rows, "other forms")
    at_a_glance = there.set_index("key").loc[list(AT_A_GLANCE)]
    assert list(at_a_glance.found) == [1, 1, 2, 0, 0] and list(at_a_glance.cases) == [1, 2, 2, 2, 2]
    said = sentences(pd.concat([scored(truths, oracle)[1], there]))
    assert len(said) == 5 and OWN in said[1] and "1 of 2 cases of other forms (1 to 99 %)" in said[1]


def test_fewer_than_six_ratios_bound_no_median(truths):
    rows, _ = scored(truths, oracle)
    large = rows[(rows["size"] >= 3) & rows.gain_true.notna()].head(5)
    median = judge(large).set_index("key").loc["gain"]
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
    refused(lambda: check_seal({**truth, "mass_kg": truth["mass_kg"] * (1 + 1e-9)}, salt, sealed, "case 0"), "altered")
    refused(lambda: check_seal(truth, salt_of(1, 1), sealed, "case 0"), "altered")


def test_pages_and_figures_of_a_run(truths, tmp_path):
    rows, criteria = scored(truths, oracle)
    data = summary(rows, criteria).assign_attrs(cases=len(rows), seed=0)
    write_pages(data, criteria, rows, tmp_path)
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == set(BLIND_FIGURES)
    for name in BLIND_FIGURES:
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 3000
    assert "clean records called clean" in (tmp_path / "criteria.html").read_text()
    table = pd.read_csv(tmp_path / "criteria.csv")
    assert list(table.key) == list(data.criterion.values) == list(criteria.key)


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
    assert judge(pd.DataFrame([row])).set_index("key").reached["without_verdict"] == 1


def test_a_refusal_names_the_record_and_not_the_folder_where_it_was_drawn(drawn, tmp_path):
    _, folder = drawn[0]
    shutil.copy(folder / "rig.yaml", tmp_path)
    (tmp_path / "record.nc").write_text("no record")
    verdict = answer_case(tmp_path)["verdict"]
    assert verdict["verdict"] == "refused"
    assert "record.nc" in verdict["error"] and str(tmp_path) not in verdict["error"]


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
        refused(lambda: gather_chunks(config, tmp_path / "wrong", seals, answers[::-1]), "sealed")


def test_a_run_does_not_depend_on_the_cores(whole, tmp_path):
    config, folder, first, _ = whole
    second, _, _ = run_blind(config, tmp_path, cores=2, answer=guessing)
    assert first.drop_vars("case_seconds").identical(second.drop_vars("case_seconds"))
    assert first.attrs["seed"] == 4
    assert json.loads((folder / "seals.json").read_text())["sha256"][0]
    assert sorted(path.name for path in (folder / "records" / "case_0").iterdir()) == ["record.nc", "rig.yaml"]
