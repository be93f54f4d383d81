"""Several causes are compared without an error of their form, each in the place of every other one."""

from test_search import TWO_DISCS, hidden, measured

from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.several_causes import without_error
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_cause_error
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model

TRUE = {"added_mass, node 3", "shaft_damping"}
LIBRARY = ("added_mass", "shaft_damping", "static_preload")


def search_with_error(library, causes, share=0.4):
    """A search by some effects that knows only an explanation by some causes, and has an error of them."""
    others = [name for name, plugin in registry().plugins["effect"].items() if plugin.candidate and name not in library]
    known = {"uncertainty": {"default": 0.02}, "model_error": 0.0, "model_floor": 0.0}
    settings = Settings(**known, leave_out=others, cause_error=0.45)
    model = build_model(TWO_DISCS)
    terms = hidden(model, "added_mass", node=3, added_mass_kg=0.3), hidden(model, "shaft_damping", shaft_damping_s=2e-5)
    spectrum = measured(model, *terms, noise=2e-8)
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    missing = spectrum.amplitude - predicted(whole, spectrum, base.theta)
    widened = with_cause_error(spectrum, missing, share)
    base = fit(whole, widened, prior, start=base.theta)
    every, _ = candidates(model, settings)
    work = Search(model, whole, spectrum, widened, settings, prior, base, every, cause_error=share)
    work.screened.extend(work.screen(base, every))
    work.found[frozenset()] = Explanation((), base, 0.0)
    work.explain(tuple(c for c in every if c.cause in causes))
    return work


def test_a_wrong_cause_is_exchanged_for_the_true_one():
    found = without_error(search_with_error(LIBRARY, {"static_preload, node 3", "shaft_damping"}))
    assert found.best.named == TRUE
    assert found.cause_error == 0
    assert found.best.fit.cost < 1.3 * len(found.best.fit.residual)


def test_where_no_causes_explain_the_records_the_search_stays_as_it_was():
    work = search_with_error(LIBRARY[1:], {"static_preload, node 3", "shaft_damping"})
    assert without_error(work) is work


def test_a_single_cause_keeps_its_error():
    work = search_with_error(LIBRARY, {"added_mass, node 3"})
    assert without_error(work) is work
