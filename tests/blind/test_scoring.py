"""Sealing and scoring, with stand-ins whose score is known."""

import json

import numpy as np
import pytest
from scipy.stats import binom

from rotorstudy.blind.criteria import reached
from rotorstudy.blind.run import run_blind
from rotorstudy.blind.scoring import binomial_bounds, same_cause, score, summary
from rotorstudy.blind.sealing import check_seal, salt_of, seal
from rotorstudy.errors import RotorstudyError
from rotorstudy.presentation.blind_figures import FIGURES
from rotorstudy.presentation.blind_page import write_pages

from .conftest import accuser, mute, oracle


def scored(cases, who):
    rows = score([case.truth for case in cases], [who(case) for case in cases])
    return rows, reached(rows).set_index("what")


def test_one_who_knows_reaches_every_bar(cases):
    rows, criteria = scored(cases, oracle)
    assert rows[rows.known].right.all()
    shares = criteria[criteria.needed.str.startswith(">=") & (criteria.cases > 0)]
    assert (shares.reached == 1).all() and not (criteria.status == "not reached").any()
    assert criteria.reached["calibration error of the stated confidence"] == 0
    assert criteria.reached["95 % intervals that hold the truth"] == 1


def test_one_who_is_mute_finds_nothing_and_accuses_nobody(cases):
    rows, criteria = scored(cases, mute)
    assert not rows.right.any()
    assert criteria.reached["clean records called clean"] == 1
    assert criteria.reached["right cause and place at s >= 3"] == 0
    assert criteria.status["right cause and place at s >= 3"] == "not reached"
    assert criteria.reached["chain errors not named as rotor effects"] == 1


def test_one_who_accuses_always_is_found_out(cases):
    _, criteria = scored(cases, accuser)
    assert criteria.reached["clean records called clean"] == 0
    assert criteria.reached["chain errors not named as rotor effects"] == 0
    assert criteria.reached["calibration error of the stated confidence"] > 0.8
    assert "answered unbalance" in criteria.why["clean records called clean"]


def test_place_counts_where_there_is_more_than_one():
    true = {"effect": "bow", "where": {"node": 3}, "places": 5}
    assert same_cause(true, {"effect": "bow", "where": {"node": 3}})
    assert not same_cause(true, {"effect": "bow", "where": {"node": 2}})
    assert not same_cause(true, {"effect": "bow", "where": {}})
    assert same_cause({**true, "places": 1}, {"effect": "bow", "where": {}})


def test_bounds_hold_the_truth_at_least_as_often_as_they_say():
    for share in (0.02, 0.5, 0.97):
        weight = binom.pmf(np.arange(31), 30, share)
        inside = [low <= share <= high for low, high in (binomial_bounds(k, 30) for k in range(31))]
        assert weight @ inside >= 0.95
    assert binomial_bounds(0, 0) == (0, 1)


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
    data = summary(rows, criteria.reset_index()).assign_attrs(cases=len(rows), seed=0)
    write_pages(data, criteria.reset_index(), rows, tmp_path)
    for name in FIGURES:
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 3000
    assert "clean records called clean" in (tmp_path / "criteria.html").read_text()


def silent(spectrum, model, stated):
    return {"verdict": "nothing", "causes": []}, None


def test_a_run_does_not_depend_on_the_cores(config, tmp_path):
    small = config.model_copy(update={"records": 1})
    first, _, _ = run_blind(small, tmp_path / "one", cases=6, seed=4, cores=1, answer=silent)
    second, _, _ = run_blind(small, tmp_path / "two", cases=6, seed=4, cores=2, answer=silent)
    assert first.drop_vars("case_seconds").identical(second.drop_vars("case_seconds"))
    assert first.attrs["seed"] == 4
    assert json.loads((tmp_path / "one" / "seals.json").read_text())["sha256"][0]
    assert len(list((tmp_path / "one" / "records").glob("case_*/record_*.nc"))) >= 5
