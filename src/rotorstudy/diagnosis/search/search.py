"""The search for causes: from the best explanations so far to others, by one cause more or another.

Every explanation is fitted with an error of the form of its causes (`form.py`) and judged by its posterior odds, which
are all that counts. The search tries the moves from the best explanation, and its faults at the next places along the
shaft, until nothing leads to a better one.
"""

import logging
from collections import Counter
from dataclasses import replace
from itertools import chain, zip_longest

import numpy as np

from rotorstudy.diagnosis.search.candidates import candidates, place_key, with_vibration
from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS, Search
from rotorstudy.diagnosis.search.form_fit import WITHIN
from rotorstudy.diagnosis.search.free_force import free_forces
from rotorstudy.diagnosis.search.impossible import grows, is_impossible
from rotorstudy.diagnosis.search.moves import loading_films, moves_from, pairs, shifts, single_causes
from rotorstudy.diagnosis.search.odds import Explanation, kind_of, odds_of
from rotorstudy.diagnosis.search.run_to_run import of_change
from rotorstudy.diagnosis.search.shown_forces import with_vibrations
from rotorstudy.diagnosis.search.stretches import may_lie_between
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prior import Prior, prior_of, with_usual
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import with_numbers

log = logging.getLogger(__name__)

REACH = 10.0  # log odds below the best, beyond which an explanation cannot change a probability
ROUNDS = 12  # of moves, at most
ALONE = 5  # single faults beside which a second one is sought, if none of them explains the records
BETTER = 10.0  # log odds that the same effects must gain before moves are tried from them again
OF_AN_EFFECT = 2  # proposals of the same effects and laws that are fitted from one explanation


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
    base = fit(whole, spectrum, prior, from_afar=model.before is None)  # of a change that was done before
    begun = Search(model, whole, spectrum, settings, prior, base, [])
    forces = free_forces(begun)
    if nearer := _nearer_without_causes(base, spectrum, forces):
        log.info("the rig alone explains more from the values with a force at one place")
        forces = [one._replace(log_odds=one.log_odds + base.evidence - nearer.evidence) for one in forces]
        base = nearer
    model = with_vibrations(model, base, spectrum)
    every, failures = candidates(model, settings)
    found, places = {frozenset(): Explanation((), base, 0.0)}, {place_key(c): c for c in reversed(every)}
    more = {"free_forces": tuple(forces), "failures": failures, "found": found, "at_places": places}
    return replace(begun, rig=model, base=base, candidates=every, **more)


def _nearer_without_causes(base, spectrum, forces):
    """A Fit without causes from the values of the rig with the best free force; None if it explains hardly more.

    The fit from the stated values may end at another minimum, and almost any cause then explains what it leaves.
    """
    best = next((one.fitted for one in forces if one.fitted is not None), None)
    if best is None:
        return None
    start = np.array([best.values.get(name, value) for name, value in base.values.items()])
    try:
        found = fit(base.model, spectrum, base.prior, start=start)
    except NoSteadyState:
        return None
    return found if found.cost < base.cost - 2 * LEAST_LOG_ODDS else None


def search(begun: Search) -> Search:
    """A search carried out: explanations of a spectrum by up to `most_causes` faults.

    begun   : as `begin` returns it
    returns : Search without explanations that are impossible. A broken plugin raises nothing: see `Search.broken`.
              After Ctrl-C it has what was found so far.
    """
    work = replace(begun, unstable=grows(begun.base, begun.spectrum.speed), starts={}, rests={})
    work.screened.extend(work.screen(work.base, work.candidates))
    log.info("searching %d candidates", len(work.candidates))
    tried, possible, shifted = [], {frozenset()}, set()
    try:
        while len(tried) < ROUNDS:
            drop_impossible(work, possible)
            if current := _due(work, [one for some in tried for one in some]):
                tried.append(current)
                _fit_moves(work, current, possible)
                if len(tried) == 1 and work.is_doubtful:  # before two causes are tried
                    _fit_best(work, [loading_films(work), pairs(work)], possible)
            elif not _shift(work, shifted, possible):
                break
    except KeyboardInterrupt as stop:
        if not is_asked_to_stop(stop):
            raise
        work = replace(work, stopped=True)
    drop_impossible(work, possible)
    if work.best.causes and not work.stopped:
        possible.discard(work.best.kind)
        work.explain(work.best.causes, work.best.fit.values)  # with the steps that its first fit did not have
        drop_impossible(work, possible)
    return work


def with_one_cause(work: Search) -> list[Explanation]:
    """The best explanations by one cause, of a Search in which nothing was searched yet."""
    for groups in single_causes(work):
        _fit_best(work, groups)
    return [one for one in work.explanations if one.causes]


def is_asked_to_stop(error):
    """Whether an exception is that of Ctrl-C, after which what was found is kept, and not of a termination."""
    return type(error) is KeyboardInterrupt


def _due(work, tried):
    """The explanations from which moves are tried next: the rig alone at first, then the best one unless it was tried.

    One that cannot be true may lead to one that can, if it is better than those. If the best one is a single fault and
    the records reject it, they are the best single fault of each effect: of two faults a third one often explains more
    than either alone, and is then beside neither of them.
    """
    if not tried:
        return [work.nothing]
    every = sorted([*work.explanations, *work.impossible.values()], key=odds_of, reverse=True)
    least = [] if work.base.is_rejected(work.settings.significance) else [0.0]
    least = max([*least, *(odds_of(one) for one in work.explanations if one.causes)], default=-np.inf)
    best = next((one for one in every if one.causes and odds_of(one) >= least and _is_new(work, one, tried)), None)
    if best is None or len(best.faults) != 1 or not work.is_doubtful:
        return [best] if best else []
    alone = {}
    for one in every:
        if one is best or (len(one.faults) == 1 and _is_new(work, one, tried) and odds_of(one) > 0):
            alone.setdefault(frozenset(c.effect for c in one.causes), one)
    return [*alone.values()][:ALONE]


def _is_new(work, explanation, tried):
    """Whether moves were tried from the same effects and laws not at all, or only where these were far less likely.

    One that cannot be true does not stand for one that can.
    """
    alike = [one for one in tried if _laws(one) == _laws(explanation)]
    alike = [one for one in alike if (one.kind in work.impossible) == (explanation.kind in work.impossible)]
    return all(odds_of(explanation) > odds_of(one) + BETTER for one in alike)


def _laws(explanation):
    """The effects with their alternatives: with another law the same effect moves the rotor otherwise."""
    return sorted((c.effect, *c.variant.items()) for c in explanation.causes)


def _fit_best(work, groups, possible=None):
    """Fit the most promising proposals of some lists by turns, as promises of different lists do not compare.

    groups : lists of Proposals;  possible : as of `drop_impossible`, if what cannot be true is dropped
    """
    chosen, often = {}, Counter()
    for one in filter(None, chain.from_iterable(zip_longest(*(_near(work, proposals) for proposals in groups)))):
        effects = frozenset((c.effect, *c.variant.values()) for c in one.causes)
        kind = kind_of(one.causes)  # fits from other places and sizes of the same side mostly end alike
        if kind not in chosen and often[effects] < OF_AN_EFFECT:
            often[effects] += 1
            chosen[kind] = one
    for one in [*chosen.values()][: work.settings.candidates_per_round]:
        before = max(map(odds_of, work.explanations))
        if work.was_tried(work.starts, one.causes):
            continue
        if len({c.fault for c in one.causes}) == 1 and one.log_odds < _least(work):
            continue  # of two faults one may gain more than is promised, as the shape of the other one changes
        found = work.explain(one.causes, one.values)
        if found and possible is not None and odds_of(found) > before:
            drop_impossible(work, possible)  # before others are measured by it
    for proposals in groups:
        _note_unfitted(work, proposals)


def _fit_moves(work, current, possible):
    """Fit the most promising proposals from explanations with causes, or those of one cause from the rig alone."""
    for one in current:
        log.info("trying moves from %s (log odds %.1f)", " and ".join(one.named) or "the rig", odds_of(one))
    if not current[0].causes:
        for groups in single_causes(work):
            _fit_best(work, groups, possible)
    else:
        _fit_best(work, [group for one in current for group in moves_from(work, one)], possible)


def _shift(work, shifted, possible):
    """Fit the best explanation with each fault at its next places, until no fit is better.

    A single fault was judged at all its places, unless it is in a stretch of elements and not all are candidates.

    shifted : kinds that were fitted so, to which more are added;  possible : as of `drop_impossible`
    returns : whether another place is better
    """
    first = best = work.best
    before = None
    while best is not before and (
        len(work.prior_odds.together(best.causes)) > 1 or any(may_lie_between(work, c) for c in best.causes)
    ):
        log.info("trying the next places along the shaft of %s", " and ".join(best.named))
        shifted.add(best.kind)
        for causes, values in shifts(work, best):
            if kind_of(causes) not in shifted:
                shifted.add(kind_of(causes))
                work.explain(causes, values)
        drop_impossible(work, possible)
        before, best = best, work.best
    return best is not first


def _note_unfitted(work, proposals):
    """Keep how likely causes are that were not fitted, relative to the same faults at a place that was.

    What linear columns promise too much, they promise alike at such places.
    """
    tried, fitted = {e.named for e in (*work.explanations, *work.impossible.values())}, {}
    for one in sorted((one for one in proposals if np.isfinite(one.log_odds)), key=lambda one: -one.log_odds):
        named, faults = frozenset(c.cause for c in one.causes), tuple(sorted(c.fault for c in one.causes))
        if named in tried:
            fitted.setdefault(faults, (named, one.log_odds))
        elif faults in fitted:
            like, promised = fitted[faults]
            work.unfitted[named] = like, one.log_odds - promised


def _near(work, proposals):
    """The Proposals from one explanation that may lead near the best, the most promising first."""
    ranked = sorted(proposals, key=lambda one: -one.log_odds)
    least = _least(work, max((one.log_odds for one in ranked if np.isfinite(one.log_odds)), default=np.inf))
    return [one for one in ranked if one.log_odds >= least]


def _least(work, promised=-np.inf):
    """Log odds that a proposal must promise to lead near the best known explanation, or near the best of proposals.

    A promise includes the largest error of form. So a rejected explanation, fitted with a smaller one, is no measure.
    """
    known = max(map(odds_of, work.explanations))
    return (min(known, promised) if work.is_doubtful else known) - WITHIN


def drop_impossible(work: Search, possible: set[frozenset]) -> None:
    """Drop explanations that cannot be true, until the best ones can.

    possible : kinds that were examined, to which more are added
    """
    while True:
        least = odds_of(work.best) - REACH
        near = {key: e for key, e in work.found.items() if key not in possible and odds_of(e) >= least}
        impossible = [key for key, e in near.items() if work.tried(e.causes, _is_impossible, work, e, otherwise=True)]
        for key in impossible:
            work.impossible[key] = work.found.pop(key)
        possible |= near.keys() - set(impossible)
        if not impossible:
            return


def _is_impossible(work, explanation):
    return is_impossible(replace(work, spectrum=explanation.spectrum), explanation)
