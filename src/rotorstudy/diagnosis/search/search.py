"""The search for causes: screen all candidates and pairs, fit the promising ones, compare them, add, swap, drop."""

import logging
from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.alternatives import at_the_same_place, with_alternatives
from rotorstudy.diagnosis.search.candidates import candidates, with_vibration
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.formulas import with_formulas
from rotorstudy.diagnosis.search.impossible import grows, is_impossible
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.one_more import with_one_more
from rotorstudy.diagnosis.search.run_to_run import of_change
from rotorstudy.diagnosis.search.several_causes import without_error
from rotorstudy.diagnosis.search.shape_scan import is_sought_everywhere
from rotorstudy.diagnosis.search.shapes import refine, refine_in_turn
from rotorstudy.diagnosis.search.trials import (
    CLOSE,
    FITTED_FULLY,
    LEFT_BY_SHAPE,
    REACH,
    best_of_each_shape,
    explains_much,
    law_and_side,
)
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_cause_error
from rotorstudy.inference.prior import Prior, prior_of, with_usual
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import with_numbers

log = logging.getLogger(__name__)

STRAINED = 3.0  # mean square distance of the base parameters from their priors, beyond which they imitate a cause
STEPPED = 6  # explanations by a crack whose shape is refined by steps, the best or not


def base_model(model: Model, settings: Settings) -> tuple[Model, Prior]:
    """The model with its nuisance terms, and the Prior of the parameters that are free in every fit.

    model  : with a value for every amplitude
    raises : RotorstudyError if an amplitude has no value
    """
    terms = []
    for kind in settings.nuisance:
        places = registry().get("effect", kind, "nuisance").places(model.structure, model.sensors)
        for place in places:
            label = " ".join(["calibration", *(f"{key} {value}" for key, value in place.items())])
            terms.append(make_term("effect", {"kind": kind, **place, "label": label}, model.structure, model.sensors))
    known = {unknown.name: (0.0, settings.nuisance[term.kind]) for term in terms for unknown in term.unknowns}
    uncertainty = with_usual(settings.uncertainty, model)
    model = with_numbers(model, (name for name, share in uncertainty.items() if share))
    whole, prior = model.plus(*terms), prior_of(model, uncertainty).plus(Prior.independent(known))
    return (whole, prior) if model.before is None else of_change(whole, prior, settings)


def begin(model: Model, spectrum: Spectrum, settings: Settings) -> Search:
    """The fit without causes, and the candidates of a search.

    model    : with a value for every amplitude
    spectrum : its covariance with the model error
    returns  : Search in which nothing was searched yet
    raises   : RotorstudyError if the base model cannot be fitted
    """
    model = with_vibration(model, spectrum) if model.before is None else model
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior, from_afar=True)
    every, failures = candidates(model, settings)
    return Search(
        model,
        whole,
        spectrum,
        spectrum,
        settings,
        prior,
        base,
        every,
        failures=failures,
        found={frozenset(): Explanation((), base, 0.0)},
    )


def unsearched(begun: Search) -> Search:
    """A Search that ends without causes; of the candidates it says only how large they would have to be."""
    screened = begun.screen(begun.base, begun.candidates)
    stable = np.zeros(len(begun.spectrum.speed), bool)  # values fitted to records read wrongly say nothing of the rig
    return replace(begun, screened=screened, unstable=stable)


def search(begun: Search) -> Search:
    """Explanations of a spectrum by up to `most_causes` faults, found by adding, swapping and dropping causes.

    begun   : as `begin` returns it
    returns : Search whose spectrum has the error of the causes too
    raises  : RotorstudyError if the base model cannot be fitted. A broken plugin of the library raises nothing: see
              `Search.broken`.
    """
    whole, prior, spectrum, settings, base = begun.model, begun.prior, begun.spectrum, begun.settings, begun.base
    stated = fit(whole, spectrum, prior, steps=0)
    imitates = base.penalty > STRAINED * len(prior.names)  # the parameters of the base take over what is missing
    missing = spectrum.amplitude - predicted(whole, spectrum, stated.theta if imitates else base.theta)
    widened = with_cause_error(spectrum, missing, settings.cause_error)
    base = fit(whole, widened, prior, start=base.theta)
    log.info("searching %d candidates", len(begun.candidates))
    work = replace(
        begun,
        spectrum=widened,
        base=base,
        found={frozenset(): Explanation((), base, 0.0)},
        cause_error=settings.cause_error,
    )
    try:
        settled = _settled(work, missing, imitates)
    except KeyboardInterrupt as stop:
        if not is_asked_to_stop(stop):
            raise
        settled = replace(work, stopped=True)
    settled = replace(settled, unstable=grows(settled.base, spectrum.speed))
    drop_impossible(settled)
    return settled


def is_asked_to_stop(error):
    """Whether an exception is that of Ctrl-C, after which what was found is kept, and not of a termination."""
    return type(error) is KeyboardInterrupt


def _settled(work, missing, imitates):
    """The Search at its end: with the least error of the causes that its best explanation needs."""
    whole, prior, widened, base = work.model, work.prior, work.spectrum, work.base
    work.screened.extend(work.screen(base, work.candidates))
    best = _added(work, work.found[frozenset()], [base, fit(whole, widened, prior, steps=0)] if imitates else None)
    best = with_formulas(work, best)
    log.info("fitting the best of %d explanations again", len(work.found))
    settled = settled_with_least_error(work, work.stated, missing, best)
    first = max(settled.explanations, key=odds_of)
    if not (settled is work and first is best):  # to which nothing was found that could be added
        first = _added(settled, first)
        formula = with_formulas(settled, first)
        if formula is not first:
            _added(settled, formula)
    if settled is not work and settled.best.causes:
        at_the_same_place(settled, settled.best)
    exact = without_error(settled)
    if exact is not settled:
        settled = exact
        _added(settled, max(settled.explanations, key=odds_of))  # parts of its faults
    return settled


def drop_impossible(work):
    """Drop explanations that cannot be true, until the best ones can."""
    possible = set()
    while True:
        least = odds_of(work.best) - REACH
        counted = {id(e) for e, _ in work.posterior()}  # of each set of causes its best shape
        known = {key: e for key, e in work.found.items() if e.causes and key not in possible and id(e) in counted}
        within = {key: e for key, e in known.items() if odds_of(e) >= least}
        impossible = [key for key, e in within.items() if is_impossible(work, e)]
        for key in impossible:
            del work.found[key]
        if not impossible:
            return
        possible |= within.keys() - set(impossible)


def _added(work, current, fits=None):
    """The best explanation after causes were added to one as long as that increases its odds.

    fits : as for `with_one_more`
    """
    while True:
        tried, before = with_one_more(work, current, fits), current.fit.cost
        cracks = _cracks(tried, before)
        tried = [refine(work, e, again=False) if id(e) in cracks else e for e in tried]
        better = max((refine(work, e) for e in _to_refine(tried, before)), key=odds_of, default=current)
        if odds_of(better) <= odds_of(current):
            return current
        log.info("comparing alternatives to %s", " and ".join(better.named))
        current, fits = with_alternatives(work, better), None
        if len(current.causes) > 1:
            current = _drop(work, refine_in_turn(work, current))


def settled_with_least_error(work, spectrum, missing, best):
    """The search with the least error of the causes that one of the best explanations turned out to have.

    Under a larger one another may seem better. Everything within reach is fitted again with that error, of explanations
    that differ little in shape the best one. Where all need the assumed error, nothing changes.
    """
    if not best.causes:
        return work
    known = [e for e in best_of_each_shape(work.explanations) if e.causes]
    near = [e for e in known[:FITTED_FULLY] if odds_of(e) >= odds_of(best) - REACH]
    simple = [e for e in near if len(e.faults) <= len(best.faults)]  # several may explain whatever one leaves
    error = np.inf
    for explanation in [best, *(e for e in simple if e is not best)]:
        error = min(error, _error_needed(work, spectrum, missing, explanation))
        if error == 0:
            break
    if error == np.inf:
        return work
    narrower = with_cause_error(spectrum, missing, error)
    base = fit(work.model, narrower, work.prior, start=work.base.theta)
    again = replace(work, spectrum=narrower, base=base, found={}, equations={}, cause_error=error)
    again.found[frozenset()] = Explanation((), base, 0.0)
    first = sorted(map(odds_of, work.explanations), reverse=True)[:FITTED_FULLY]
    least = min(odds_of(best) - REACH, first[-1])
    for one in known:
        if odds_of(one) >= least:
            found = again.explain(one.causes, [one.fit.theta])
            if found and odds_of(found) >= max(map(odds_of, again.explanations)) - REACH:
                refine_in_turn(again, found, again=False)  # its shapes were tried in the search
    return again


def _error_needed(work, spectrum, missing, explanation):
    """The least error of the causes with which an explanation leaves no more than noise; inf if more than assumed."""
    from scipy.optimize import brentq

    off = spectrum.amplitude - predicted(explanation.fit.model, spectrum, explanation.fit.theta)

    def excess(error):
        whitened = with_cause_error(spectrum, missing, error).whitened(off)
        return whitened @ whitened + explanation.fit.penalty - len(whitened)

    if not work.is_rejected_as_stated(explanation):
        return 0.0
    if excess(work.cause_error) >= 0:
        return np.inf
    return brentq(excess, 0.0, work.cause_error, xtol=1e-3 * work.cause_error)


def _cracks(tried, before):
    """The best explanations (by id) by a crack of each law in each quadrant: steps of its shape may gain much.

    before : cost of the explanation that they extend
    """
    least, best = min((e.fit.cost for e in tried), default=0.0), {}
    for e in sorted(tried, key=odds_of, reverse=True):
        crack = e.causes[-1]
        if is_sought_everywhere(crack) and explains_much(e.fit.cost, least, before):
            best.setdefault(law_and_side(crack), e)
    return {id(e) for e in list(best.values())[:STEPPED]}


def _to_refine(tried, before):
    """The best explanation, and others whose cost may come near its own in a better shape of their last cause.

    before : cost of the explanation that they extend
    """
    if not tried:
        return []
    best = max(tried, key=odds_of)
    shaped = sorted((e for e in tried if e.causes[-1].shape and e is not best), key=odds_of, reverse=True)
    reach = max(CLOSE, LEFT_BY_SHAPE * (before - best.fit.cost))
    near = [e for e in shaped if e.fit.cost < best.fit.cost + reach]
    if not near and best.fit.cost > len(best.fit.residual):
        near = shaped[:1]
    return [best, *near]


def _drop(work, current):
    """The explanation without those causes that it does better without."""
    for cause in current.causes:
        less = work.explain(tuple(c for c in current.causes if c.label != cause.label))
        if less and odds_of(less) > odds_of(current):
            return _drop(work, less)
    return current
