"""The probability that none of the stated causes is the true one: what it depends on, and what follows from it."""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from test_search import TWO_DISCS

from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.causes import corrects_model
from rotorstudy.diagnosis.verdict.outside import FEATURES, outside_probability, with_outside
from rotorstudy.diagnosis.verdict.result import Cause, Verdict
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.model.rig import build_model

BENCHMARK = Path(__file__).parents[2] / "benchmarks/outside.py"
CAUSE = {
    "effect": "unbalance",
    "where": {"node": 2},
    "parameters": {"eccentricity": {"value": 1e-5, "std": 1e-7, "unit": "m", "part": "magnitude"}},
    "posterior_probability": 0.999,
}


def verdict(**changed):
    """A verdict in which nothing speaks against its one cause."""
    return Verdict(
        verdict="cause", causes=[CAUSE], ambiguous_with=[], separating_measurement=[], not_considered=[],
        broken_plugins=[], unexplained=[], residual_p_value={"before": 0.0, "after": 1.0}, residual_share=0.0,
        cause_error=0.0, log_posterior_odds=100.0, parameter_p_value=1.0, detection_limit=[], gain=None,
        base_parameters=[], identifiability={"dead": [], "known_by_prior_alone": [], "traded_off": []}, candidates=1,
        settings=Settings(),
    ).model_copy(update=changed)  # fmt: skip


@pytest.fixture(scope="module")
def benchmark():
    spec = importlib.util.spec_from_file_location("learn_outside", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_speaks_against_a_cause_makes_another_one_more_probable():
    """Of every feature by itself; one that was not found to matter changes nothing."""
    least = outside_probability(verdict())
    assert 0 < least < 0.1
    two = (*verdict().causes, *verdict().causes)
    for worse in ({"residual_share": 0.3}, {"parameter_p_value": 1e-9}, {"cause_error": 0.03}, {"causes": two}):
        assert outside_probability(verdict(**worse)) >= least
    every = {"residual_share": 0.3, "parameter_p_value": 1e-9, "cause_error": 0.03, "causes": two}
    assert outside_probability(verdict(**every)) > 2 * least


def test_several_causes_are_more_probable_where_one_force_does_not_explain_the_records():
    """What was tested counts only then."""
    two = verdict(causes=(*verdict().causes, *verdict().causes))
    assert outside_probability(two, unlike_one_force=True) < outside_probability(two)
    assert with_outside(two).outside_probability == outside_probability(two)


def test_what_is_not_certain_is_said():
    """Only where it matters: beside a cause that nothing speaks against, the probability of another is small."""
    text = "the true cause is none of these"
    assert text not in summary(verdict(outside_probability=0.02))
    assert f"with a probability of 20 % {text}" in summary(verdict(outside_probability=0.2))


@pytest.mark.parametrize(("couplings", "kind"), [(0, "cause"), (1, "cause"), (2, "unknown")])
def test_two_couplings_imitate_what_the_library_lacks_and_are_no_cause(couplings, kind):
    """One cause of many amplitudes, as a coupling has, is still a cause."""
    force = {"value": 1.0, "std": 0.1, "unit": "N", "part": "magnitude"}
    coupling = Cause(
        effect="parallel_misalignment", where={"node": 1}, posterior_probability=0.999,
        parameters={f"misalignment_force_{n}X": force for n in range(17)},
    )  # fmt: skip
    found = with_outside(verdict(causes=(coupling,) * couplings or verdict().causes))
    assert found.verdict == kind
    assert ("an effect that the library lacks" in summary(found)) == (kind == "unknown")


def test_a_verdict_without_causes_stays_as_it_is():
    for kind in ("nothing", "unknown"):
        assert with_outside(verdict(verdict=kind, causes=())).outside_probability == 0


@pytest.mark.parametrize("beside", ["stiffness_error", "base_motion, harmonic 1", "gyroscopic_error"])
def test_an_effect_without_a_place_beside_a_fault_may_only_correct_its_form(beside):
    """Not by itself, nor does a fault of a part of the shaft that extends over the whole of it."""
    model = build_model(TWO_DISCS)
    every, _ = candidates(model, Settings())
    by_name = {cause.cause: cause for cause in every}

    def corrects(*names):
        causes = tuple(by_name[name] for name in names)
        return corrects_model(SimpleNamespace(causes=causes, fit=SimpleNamespace(model=model)), every)

    assert corrects("unbalance, node 3", beside)
    assert not corrects(beside)
    assert not corrects("unbalance, node 3", "shaft_asymmetry")
    assert not corrects("unbalance, node 3", "transverse_crack")


def table(missed, feature, kind="rub"):
    """Verdicts of which some miss the truth, as the library lacks it, with one feature that varies."""
    values = {name: feature if name == "residual_share" else np.zeros(len(feature)) for name in FEATURES}
    return pd.DataFrame({"library": np.where(missed, "without", "with"), "kind": kind, "in_set": ~missed, **values})


@pytest.mark.parametrize("tells", [True, False])
def test_what_tells_right_from_wrong_is_learned_and_what_does_not_is_not(benchmark, tells):
    random = np.random.default_rng(3)
    missed = np.tile([False, True], 1000)
    feature = random.normal(3.0 * missed if tells else 0.0, 1.0, 2000)
    found = benchmark.learned(table(missed, feature), 0.3, 0.0)
    probability = 1 / (1 + np.exp(-found["intercept"] - found["coefficients"]["residual_share"] * np.array([0.0, 3.0])))
    if tells:
        assert probability[0] < 0.1 and probability[1] > 0.5
    else:
        assert probability == pytest.approx(0.3, abs=0.1)


def test_the_share_of_pairs_is_that_stated_and_not_that_of_the_records(benchmark):
    """As many pairs as single faults were drawn; a fault outside the library always looks like a pair."""
    missed = np.tile([False, False, True], 500)
    pair = np.tile([False, True, True], 500)
    rows = table(missed, pair.astype(float)).assign(kind=np.where(pair & ~missed, "pair", "rub"))
    for share in (0.1, 0.5):
        found = benchmark.learned(rows, 0.1, share)
        odds = found["intercept"] + found["coefficients"]["residual_share"]
        assert odds == pytest.approx(np.log(0.1 / (0.9 * share)), abs=0.3)


def test_cases_without_causes_count_as_drawn(benchmark):
    """Where half of the faults outside the library are called unknown as nothing fits, the others are half as many."""
    missed = np.tile([False, True], 1000)
    rows = table(missed, np.zeros(2000))
    whole = benchmark.learned(rows, 0.3, 0.0)["intercept"]
    rows.loc[missed & (np.arange(2000) % 4 == 1), list(FEATURES)] = np.nan
    half = benchmark.learned(rows, 0.3, 0.0)["intercept"]
    assert half - whole == pytest.approx(np.log(0.5), abs=0.05)
