"""An unbalance at several discs is one fault of a change: tried together, and resolved into static part and couple."""

import numpy as np
import pytest
from machines import spectrum_of
from test_resultant import HARMONICS, NOISE, RIG, loaded

from rotorstudy.diagnosis.runs.compare import compare, of_changes
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.odds import PriorOdds
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model

SPEEDS, LOAD = np.array([105.0, 126.0]), 3e-4  # rad/s, below the first critical speed; kg m
TRIED = ("unbalance", "couple_unbalance")


def stated(loads, **given):
    """Faults of the best explanation of what two states differ by, each by its nodes."""
    base, random = build_model(RIG), np.random.default_rng(3)
    states = [spectrum_of(one, SPEEDS, HARMONICS, NOISE, random) for one in (base, loaded(loads))]
    others = [name for name in registry().plugins["effect"] if name not in TRIED]
    known = {"uncertainty": {"default": 0.02}, "nuisance": {}, "leave_out": others, "hold_out_rad_s": [], **given}
    found = compare(*states, base, settings=Settings(**known)).diagnosis.search
    return [
        (parts[0].effect, {c.where.get("node") for c in parts})
        for parts in found.prior_odds.together(found.best.causes)
    ]


def test_two_discs_loaded_oppositely_are_one_unbalance():
    assert stated({3: LOAD, 7: -LOAD}) == [("unbalance", {3, 7})]


def test_one_loaded_disc_is_not_split():
    """The negative control."""
    assert stated({3: LOAD}) == [("unbalance", {3})]


def test_rates_of_the_user_come_first():
    assert of_changes(Settings()).base_rates["unbalance"] == registry().get("effect", "unbalance").change_rate > 1
    assert of_changes(Settings(base_rates={"unbalance": 2.0})).base_rates["unbalance"] == 2.0


@pytest.mark.parametrize(("nodes", "faults"), [((3, 7), 1), ((3, 8), 2)])
def test_only_discs_share_an_unbalance(nodes, faults):
    model, settings = build_model(RIG), of_changes(Settings())
    every, _ = candidates(model, settings)
    causes = tuple(c for c in every if c.effect == "unbalance" and c.where["node"] in nodes)
    odds = PriorOdds(every, settings, model.structure)
    assert list(odds.of_effect) == list(dict.fromkeys(one.effect for one in every))  # not that of a set, which varies
    assert len(odds.together(causes)) == faults
    assert (odds.log_odds(causes) > sum(np.log(odds.of(c)) for c in causes)) == (faults == 1)
