"""Two discs whose unbalances look alike: their sum is known and the split is not; of a change they are one fault."""

import json

import numpy as np
import pytest
from machines import all_but, disc, faulty, rig_of, shaft, spectrum_of, springs, unbalance
from scipy.stats import chi2

from rotorstudy import build_model, registry
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.runs.compare import compare, of_changes
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.odds import Explanation, PriorOdds
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings

pytestmark = pytest.mark.usefixtures("right_conventions")

NOISE, HARMONICS = 5e-7, np.array([1, -1])
DISCS = [disc(node, 0.8, 5.8e-4, 3.3e-4, label=label) for node, label in ((3, "disc 1"), (7, "disc 2"))]
RIG = rig_of(shaft(0.56, 8, *DISCS, outer_diameter_m=0.01), springs({1: "left", 9: "right"}, 1e6, 50.0), sensors=[2, 8])
BELOW, BEYOND = np.array([80.0, 90.0, 100.0]), np.array([80.0, 300.0, 600.0])  # rad/s; the first critical speed is 150
ADDED = {3: 4e-5, 7: -1e-5j}  # kg m: 40 and 10 g mm
SETTINGS = Settings(uncertainty={"default": 0.02}, nuisance={}, leave_out=all_but("unbalance"), hold_out_rad_s=[])


def loaded(added):
    """The model of the rig with unbalances {node: kg m}."""
    items = (unbalance(n, abs(z), float(np.angle(z)), mass_kg=1.0, label=f"at {n}") for n, z in added.items())
    return faulty(build_model(RIG), *items)


def verdict_on(speeds, added=ADDED):
    spectrum = spectrum_of(loaded(added), speeds, HARMONICS, NOISE, 1)
    return investigate(spectrum, build_model(RIG), settings=SETTINGS).verdict


def test_the_sum_is_known_and_the_split_is_not():
    verdict = verdict_on(BELOW)
    found = verdict.resultant
    assert [one.label for one in found.discs] == ["disc 1", "disc 2"]
    true = sum(w * ADDED[one.where["node"]] for w, one in zip(found.weights, found.discs, strict=True))
    off = found.size.value * np.exp(1j * found.angle.value) / true - 1
    square = (off.real / (found.size.std / found.size.value)) ** 2 + (off.imag / found.angle.std) ** 2
    assert square < chi2.ppf(0.999, 2)
    assert min(found.std_of_each) > 2 * found.size.std
    assert "how it is split between them is not known" in verdict.summary
    written = json.loads(verdict.model_dump_json())["resultant"]
    assert written["size"]["unit"] == "kg m" and len(written["std_of_each"]) == 2


def test_neither_speeds_beyond_the_critical_ones_nor_records_that_miss_nothing_need_a_sum():
    """The negative control."""
    verdict = verdict_on(BEYOND)
    assert verdict.resultant is None
    assert "split" not in verdict.summary
    assert verdict_on(BELOW, added={}).resultant is None


OF_STATES, LOAD = np.array([105.0, 126.0]), 3e-4  # rad/s, below the first critical speed; kg m


def stated(loads):
    """Faults of the best explanation of what two states differ by, each by its nodes."""
    base, random = build_model(RIG), np.random.default_rng(3)
    states = [spectrum_of(one, OF_STATES, HARMONICS, NOISE, random) for one in (base, loaded(loads))]
    settings = SETTINGS.model_copy(update={"leave_out": all_but("unbalance", "couple_unbalance")})
    found = compare(*states, base, settings=settings).diagnosis.search
    return [
        (parts[0].effect, {c.where.get("node") for c in parts})
        for parts in found.prior_odds.together(found.best.causes)
    ]


def test_two_discs_loaded_oppositely_are_one_unbalance_and_one_is_not_split():
    assert stated({3: LOAD, 7: -LOAD}) == [("unbalance", {3, 7})]
    assert stated({3: LOAD}) == [("unbalance", {3})]


def test_rates_of_the_user_come_first():
    assert of_changes(Settings()).base_rates["unbalance"] == registry().get("effect", "unbalance").change_rate > 1
    assert of_changes(Settings(base_rates={"unbalance": 2.0})).base_rates["unbalance"] == 2.0


@pytest.mark.parametrize(
    ("apart", "rates", "is_excluded"), [(5, {}, False), (9, {}, True), (5, {"unbalance": 21}, True)]
)
def test_a_frequent_cause_excludes_another_only_by_the_records(apart, rates, is_excluded):
    """An unbalance is taken to be twenty times as frequent as a bow: by a factor of e^3, unless the user says so."""
    settings = of_changes(Settings(base_rates=rates))
    work = begin(build_model(RIG), spectrum_of(build_model(RIG), BELOW, HARMONICS, NOISE, 1), settings)
    both = [next(c for c in work.candidates if c.effect == name) for name in ("unbalance", "bow")]
    for cause, odds in zip(both, (1000 + apart, 1000), strict=True):
        work.found[cause.cause] = Explanation((cause,), work.base, odds)
    assert work.posterior()[0][0].causes == (both[0],) and work.posterior()[0][1] > 0.99
    assert [e.causes for e, _ in work.credible(0.99)] == [(c,) for c in both[: 1 if is_excluded else 2]]


@pytest.mark.parametrize(("nodes", "faults"), [((3, 7), 1), ((3, 8), 2)])
def test_only_discs_share_an_unbalance(nodes, faults):
    model, settings = build_model(RIG), of_changes(Settings())
    every, _ = candidates(model, settings)
    causes = tuple(c for c in every if c.effect == "unbalance" and c.where["node"] in nodes)
    odds = PriorOdds(every, settings, model.structure)
    assert list(odds.of_effect) == list(dict.fromkeys(one.effect for one in every))  # not that of a set, which varies
    assert len(odds.together(causes)) == faults
    assert (odds.log_odds(causes) > sum(np.log(odds.of(c)) for c in causes)) == (faults == 1)
