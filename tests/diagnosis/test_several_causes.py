"""Several causes are compared each in the place of every other one."""

from test_search import TWO_DISCS, hidden, measured

from rotorstudy.diagnosis.search.moves import exchanges, removals
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.search.search import begin, search
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model

TRUE = {"added_mass, node 3", "shaft_damping"}
WRONG = {"static_preload, node 3", "shaft_damping"}
LIBRARY = ("added_mass", "shaft_damping", "static_preload")


def begun():
    """A search by some effects, not carried out."""
    others = [name for name, plugin in registry().plugins["effect"].items() if plugin.candidate and name not in LIBRARY]
    settings = Settings(uncertainty={"default": 0.02}, model_error=0.0, model_floor=0.0, leave_out=others)
    model = build_model(TWO_DISCS)
    terms = hidden(model, "added_mass", node=3, added_mass_kg=0.3), hidden(model, "shaft_damping", shaft_damping_s=2e-5)
    return begin(model, with_model_error(measured(model, *terms, noise=2e-8), settings), settings)


def test_the_search_finds_both():
    assert search(begun()).best.named == TRUE


def test_a_wrong_cause_is_exchanged_for_the_true_one():
    work = begun()
    wrong = work.explain([c for c in work.candidates if c.cause in WRONG], {})
    best = max(exchanges(work, wrong), key=lambda one: one.log_odds)
    assert {c.cause for c in best.causes} == TRUE
    found = work.explain(best.causes, best.values)
    assert odds_of(found) > odds_of(wrong) + 5
    assert {frozenset(c.cause for c in one.causes) for one in removals(found)} == {frozenset({one}) for one in TRUE}
