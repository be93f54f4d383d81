"""The search for causes: screen all candidates and pairs, fit the promising ones, compare them, add, swap, drop."""

import logging
from dataclasses import replace
from itertools import permutations
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from rotorstudy.diagnosis.candidates import Candidate, candidates, with_vibration
from rotorstudy.diagnosis.contained import is_contained
from rotorstudy.diagnosis.explanations import Search
from rotorstudy.diagnosis.impossible import is_impossible
from rotorstudy.diagnosis.odds import Explanation, faults_of, odds_of
from rotorstudy.diagnosis.parts import faults_of_several_parts
from rotorstudy.diagnosis.screening import TIE, Screened, screen, screen_each, screen_pairs
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.shape_scan import can_be_scanned, is_sought_everywhere, scan
from rotorstudy.diagnosis.shapes import refine, refine_in_turn
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_cause_error
from rotorstudy.inference.prior import Prior, prior_of, with_rotor
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rotor_numbers import with_rotor_numbers

log = logging.getLogger(__name__)

FITTED_FULLY = 4  # least number of explanations per round that are fitted to convergence
CLOSE = 15.0  # excess over the lowest cost of a round (likelihood ratio e^-7.5) beyond which a fit is not finished
STRAINED = 3.0  # mean square distance of the base parameters from their priors, beyond which they imitate a cause
WORTH_FITTING = 0.1  # of what the best candidate explains when linearised, which is inaccurate for large effects
WORTH_REFINING = 0.05  # of the same, by the best of some hundred shapes; refined, it explains up to a few times as much
REACH = 10.0  # log odds below the best, at its motion, beyond which an alternative cannot change a probability
INACCURACY = 0.01  # of what a cause explains: added to REACH, as columns at the best motion are not exact
ALTERNATIVES = 12  # most alternatives to each cause that are fitted in a round
ROUNDS = 3  # of alternatives, each at the motion of the best of the last one
STEPPED = 4  # explanations by causes whose shape was scanned, of which it is refined by steps, the best or not
REFINED = 3  # most explanations of a round whose shape is refined
LEFT_BY_SHAPE = 0.05  # of what a cause explains, left if its shape is half a step of those tried away from the true one
NOT_SCREENED = Screened(0.0, -np.inf, np.zeros(0), np.zeros(0))
PAIRS = 6  # pairs fitted in a round
PAIRS_OF_A_CAUSE = 2  # of these, with the same cause; else a single good cause with any other would take all of them


class Option(NamedTuple):
    """A set of causes worth a fit, with values of parameters by name to start from."""

    causes: tuple[Candidate, ...]
    start: dict[str, float]


def base_model(model: Model, settings: Settings) -> tuple[Model, Prior]:
    """The model with its nuisance terms, and the Prior of the parameters that are free in every fit.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    settings : Settings

    Returns
    -------
    Model
    Prior

    Raises
    ------
    RotorstudyError
        If an amplitude has no value.
    """
    terms = []
    for kind in settings.nuisance:
        places = registry().get("effect", kind, "nuisance").places(model.structure, model.sensors)
        terms += [
            make_term("effect", {"kind": kind, **place, "label": f"calibration {i}"}, model.structure, model.sensors)
            for i, place in enumerate(places)
        ]
    known = {unknown.name: (0.0, settings.nuisance[term.kind]) for term in terms for unknown in term.unknowns}
    uncertainty = with_rotor(settings.uncertainty, model.structure)
    model = with_rotor_numbers(model, (name for name, share in uncertainty.items() if share))
    whole, prior = model.plus(*terms), prior_of(model, uncertainty).plus(Prior.independent(known))
    return (whole, prior) if model.before is None else _of_change(whole, prior, settings)


def _of_change(whole, prior, settings):
    """The model of a change between two states, and its Prior.

    What the states share cancels. A parameter that differs from run to run changes by the difference of two draws, with
    twice its variance; as effects are linear in it, the earlier state can be taken to be without it.
    """
    moving = {name for parameter in settings.run_to_run for name in whole.amplitudes_of(parameter)}
    moves = np.array([name in moving for name in prior.names], bool)
    twice = np.where(moves, np.sqrt(2), 1.0)
    changed = Prior(prior.names, np.where(moves, 0.0, prior.mean), prior.covariance * np.outer(twice, twice))
    return replace(whole, before=frozenset(whole.names) - moving), changed


def search(model: Model, spectrum: Spectrum, settings: Settings) -> Search:
    """Explanations of a spectrum by up to `most_causes` faults, found by adding, swapping and dropping causes.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    spectrum : Spectrum
        Its covariance with the model error.
    settings : Settings

    Returns
    -------
    Search
        Its spectrum has the error of the causes too.

    Raises
    ------
    RotorstudyError
        If the base model cannot be fitted. A broken plugin of the library raises nothing: see `Search.broken`.
    """
    model = with_vibration(model, spectrum) if model.before is None else model
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    stated = fit(whole, spectrum, prior, steps=0)
    imitates = base.penalty > STRAINED * len(prior.names)  # the parameters of the base take over what is missing
    missing = spectrum.amplitude - predicted(whole, spectrum, stated.theta if imitates else base.theta)
    widened = with_cause_error(spectrum, missing, settings.cause_error)
    base = fit(whole, widened, prior, start=base.theta)
    every, failures = candidates(model, settings)
    log.info("searching %d candidates", len(every))
    work = Search(model, whole, spectrum, widened, settings, prior, base, every, failures=failures,
                  cause_error=settings.cause_error)  # fmt: skip
    work.screened.extend(work.screen(base, every))
    work.found[frozenset()] = Explanation((), base, 0.0)
    best = _added(work, work.found[frozenset()], [base, fit(whole, widened, prior, steps=0)] if imitates else None)
    log.info("fitting the best of %d explanations again", len(work.found))
    settled = _settled(work, spectrum, missing, best)
    _added(settled, max(settled.explanations, key=odds_of))
    _drop_impossible(settled)
    return settled


def _drop_impossible(work):
    """Drop explanations that cannot be true, until the best ones can."""
    while True:
        least = odds_of(work.best) - REACH
        within = [e for e in work.explanations if e.causes and odds_of(e) >= least]
        impossible = [e for e in within if is_impossible(work, e)]
        for one in impossible:
            del work.found[frozenset(c.label for c in one.causes)]
        if not impossible:
            return


def _added(work, current, fits=None):
    """The best explanation after causes were added to one as long as that increases its odds.

    fits : as for `with_one_more`
    """
    while True:
        tried, before = with_one_more(work, current, fits), current.fit.cost
        scanned = _scanned(tried, before)
        tried = [refine(work, e, again=False) if id(e) in scanned else e for e in tried]
        better = max((refine(work, e) for e in _to_refine(tried, before)), key=odds_of, default=current)
        if odds_of(better) <= odds_of(current):
            return current
        log.info("comparing alternatives to %s", " and ".join(better.named))
        current, fits = _with_alternatives(work, better), None
        if len(current.causes) > 1:
            current = _drop(work, refine_in_turn(work, current))


def _settled(work, spectrum, missing, best):
    """The search with the error of the causes that the best explanation turned out to have, at most the one assumed.

    Everything within reach is fitted again with that error. Where the assumed one is needed, nothing changes.
    """
    off = spectrum.amplitude - predicted(best.fit.model, spectrum, best.fit.theta)

    def excess(error):
        whitened = with_cause_error(spectrum, missing, error).whitened(off)
        return whitened @ whitened + best.fit.penalty - len(whitened)

    if not best.causes:
        return work
    error = 0.0
    if work.is_rejected_as_stated(best):
        if excess(work.cause_error) >= 0:
            return work
        error = brentq(excess, 0.0, work.cause_error, xtol=1e-3 * work.cause_error)
    narrower = with_cause_error(spectrum, missing, error)
    base = fit(work.model, narrower, work.prior, start=work.base.theta)
    again = replace(work, spectrum=narrower, base=base, found={}, cause_error=error)
    again.found[frozenset()] = Explanation((), base, 0.0)
    for rank, known in enumerate(sorted(work.explanations, key=odds_of, reverse=True)):
        if known.causes and (rank < FITTED_FULLY or odds_of(known) >= odds_of(best) - REACH):
            found = again.explain(known.causes, [known.fit.theta])
            if found:
                refine_in_turn(again, found)
    return again


def _is_allowed(work, causes):
    """Whether causes are no more faults than allowed, each named once and none a special case of another."""
    if len(faults_of(causes)) > work.settings.most_causes or len({c.cause for c in causes}) < len(causes):
        return False
    return _are_distinct(*causes)


def _are_distinct(*causes):
    """Whether no cause is a special case of another."""
    return not any(is_contained(one, other) for one, other in permutations(causes, 2))


def with_one_more(work, current, fits=None):
    """Explanations with one more cause, of the candidates worth a fit.

    fits : list of Fit of the current explanation at which candidates are screened, by default its own
    """
    chosen = [c for c in work.candidates if _is_allowed(work, (*current.causes, c))]
    if not chosen:
        return []
    fits = fits or [current.fit]
    screenings = [work.screened if f is work.base else work.screen(f, chosen) for f in fits]
    if current.fit.cost > len(current.fit.residual):  # more than noise is left
        chosen, screenings = _with_scanned(work, chosen, screenings, fits)
    promising = _promising(work, chosen, screenings, work.settings.candidates_per_round)
    theta = dict(zip(current.fit.model.names, current.fit.theta, strict=True))
    options = [
        Option((*current.causes, chosen[i]), theta | dict(zip(chosen[i].names, one.start, strict=True)))
        for i, one in promising.items()
    ]
    several = [
        Option((*current.causes, *parts), start)
        for fitted in fits
        for parts, start in faults_of_several_parts(work, fitted, chosen)
    ]
    return [*_fit_closest(work, options, from_stated=True, before=current.fit.cost), *_fit_closest(work, several)]


def _with_scanned(work, chosen, screenings, fits):
    """Candidates and their screenings, each with those added whose shape a scan at one of the fits has found."""
    first = list({(c.cause, *c.variant.values()): c for c in reversed(chosen)}.values())
    for number, fitted in enumerate(fits):
        best = max((one.explained for one in screenings[number]), default=0.0)
        scanned = scan(work, fitted, first, least=WORTH_REFINING * best)
        work.scanned.extend(one.cause for one in scanned)
        chosen = [*chosen, *(one.cause for one in scanned)]
        screenings = [
            [*rows, *(one.screened if i == number else NOT_SCREENED for one in scanned)]
            for i, rows in enumerate(screenings)
        ]
    return chosen, screenings


def _promising(work, chosen, screenings, most):
    """Candidates worth a fit, {index: Screened}: the best of the screenings in turn, each cause in its best shape.

    A crack that was scanned counts in each alternative, as its columns say little about how it opens.
    """
    lists, of_scans = [], {id(cause) for cause in work.scanned if is_sought_everywhere(cause)}
    names = [c.label if id(c) in of_scans else c.cause for c in chosen]
    for screened in screenings:
        odds = [one.evidence + np.log(work.prior_odds.of(cause)) for one, cause in zip(screened, chosen, strict=True)]
        order, seen = sorted(range(len(chosen)), key=lambda i: -odds[i]), set()
        order = [i for i in order if not (names[i] in seen or seen.add(names[i]))]
        best = max((one.explained for one in screened), default=0.0)
        worth = [max(WORTH_FITTING * best, 0.5 * work.prior_odds.even_odds_gain(chosen[i])) for i in order]
        lists.append([(i, screened[i]) for i, low in zip(order, worth, strict=True) if screened[i].explained >= low])
    found = {}
    for rank in range(max(map(len, lists), default=0)):
        for one in lists:
            if rank < len(one) and len(found) < most * len(lists):
                found.setdefault(*one[rank])
    return found


def _fit_closest(work, options, from_stated=False, before=0.0):
    """Explanations by options whose cost after a trial fit is close to the lowest, and by cracks that explain much.

    from_stated : whether the trial starts from the stated values, but for causes whose shape was scanned
    before      : cost of the explanation that the options extend
    """
    looked = []
    for causes, start in options:
        start = work.start(causes, start)
        fitted = work.trial_fit(causes, None if from_stated and not can_be_scanned(causes[-1]) else start)
        looked += [(fitted.cost, len(looked), causes, [fitted.theta, start])] if fitted else []
    tried = []
    for rank, (cost, _, causes, starts) in enumerate(sorted(looked, key=lambda one: one[:2])):
        is_crack = is_sought_everywhere(causes[-1]) and _explains_much(cost, min(looked)[0], before)
        if rank < FITTED_FULLY or cost <= min(looked)[0] + CLOSE or is_crack:
            tried.append(work.explain(causes, starts))
    return [e for e in tried if e]


def _explains_much(cost, least, before):
    """Whether a cost has come down by half as much as the least one, from what it was before."""
    return cost <= 0.5 * (least + before)


def _scanned(tried, before):
    """The best explanations (by id) whose last cause was scanned: steps from there may gain more than from elsewhere.

    before : cost of the explanation that they extend
    """
    least = min((e.fit.cost for e in tried), default=0.0)
    found = [e for e in tried if can_be_scanned(e.causes[-1]) and _explains_much(e.fit.cost, least, before)]
    return {id(e) for e in sorted(found, key=odds_of, reverse=True)[:STEPPED]}


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


def _with_alternatives(work, current):
    """The best explanation after all others within reach of it were fitted, each in its best shape.

    All candidates in the place of each cause, and all pairs if the explanation is rejected, are judged at its motion.
    """
    for number in range(ROUNDS):
        tried = [e for cause in current.causes for e in _instead_of(work, current, cause)]
        if number == 0:
            tried += [e for cause in current.causes for e in _elsewhere(work, current, cause)]
        if work.is_rejected_as_stated(current):
            tried += _pairs(work, current)
        shaped = sorted((e for e in tried if e.causes[-1].shape), key=odds_of, reverse=True)[:REFINED]
        best = max([*tried, *(refine(work, e) for e in shaped)], key=odds_of, default=current)
        if odds_of(best) <= odds_of(current):
            break
        current = best
    return current


def _instead_of(work, current, cause):
    """Explanations with another cause instead of one, of those within reach."""
    rest = tuple(c for c in current.causes if c is not cause)
    chosen = [c for c in work.candidates if _is_allowed(work, (*rest, c)) and c.cause != cause.cause]
    projected, usable = work.project(current.fit, [*chosen, cause], cause.names)
    odds = dict(zip((c.label for c in usable), screen_each(projected, usable), strict=True))

    def judged(one):
        return odds[one.label].evidence + work.prior_odds.log_odds((*rest, one))

    if cause.label not in odds:
        return []
    inaccuracy = INACCURACY * odds[cause.label].explained + current.fit.excess
    least, best = judged(cause) - REACH - inaccuracy, {}
    for one in sorted((c for c in usable if c is not cause), key=judged, reverse=True):
        if judged(one) >= least and len(best) < ALTERNATIVES:
            best.setdefault(one.cause, one)
    theta = dict(zip(current.fit.model.names, current.fit.theta, strict=True))
    options = [Option((*rest, c), theta | dict(zip(c.names, odds[c.label].start, strict=True))) for c in best.values()]
    return _fit_closest(work, options)


def _elsewhere(work, current, cause):
    """Explanations with the effect of a cause at its other places, each in the best shape that a scan finds there."""
    rest = tuple(c for c in current.causes if c is not cause)
    chosen = {
        c.cause: c
        for c in work.candidates
        if c.effect == cause.effect and c.cause != cause.cause and _is_allowed(work, (*rest, c))
    }
    if not can_be_scanned(cause) or not chosen:
        return []
    found = scan(work, work.held(rest, current.fit), list(chosen.values()), refined=len(chosen))
    theta = dict(zip(current.fit.model.names, current.fit.theta, strict=True))
    least = max((s.evidence - LEFT_BY_SHAPE * s.explained for _, s in found), default=0.0) - REACH
    options = [
        Option((*rest, one), theta | dict(zip(one.names, screened.start, strict=True)))
        for one, screened in found
        if screened.evidence >= least
    ]
    return _fit_closest(work, options)


def _pairs(work, current):
    """Explanations by two causes that explain most together, at the motion of an explanation.

    Of what was scanned, the shape found counts instead of those of a coarse grid.
    """
    scanned = {(c.cause, *c.variant.values()): c for c in reversed(work.scanned)}
    others = [c for c in work.candidates if (c.cause, *c.variant.values()) not in scanned]
    chosen = [*others, *scanned.values()]
    projected, usable = work.project(current.fit, chosen, tuple(n for c in current.causes for n in c.names))
    alone = {c.label: one.evidence for c, one in zip(usable, screen_each(projected, usable), strict=True)}
    first = list({c.cause: c for c in sorted(usable, key=lambda c: alone[c.label])}.values())  # each in its best shape
    second = [c for c in usable if not c.fixed]
    gain = 0.5 * screen_pairs(projected, first, second)
    prior = {c.label: np.log(work.prior_odds.of(c)) for c in usable}
    gain += np.array([prior[c.label] for c in first])[:, None] + np.array([prior[c.label] for c in second])
    gain = np.where(_can_be_paired(work, first, second), np.round(gain, TIE), -np.inf)
    causes = [np.array([c.cause for c in part], object) for part in (first, second)]
    options, often = [], {}
    while len(options) < PAIRS and gain.max(initial=-np.inf) > -np.inf:
        i, j = np.unravel_index(gain.argmax(), gain.shape)
        both = tuple(sorted((first[i], second[j]), key=lambda c: bool(c.shape)))  # the shape of the last is refined
        start = screen(projected, *both).start
        start = projected.theta | dict(zip([n for c in both for n in c.names], start, strict=True))
        options.append(Option(both, start))
        for one, other in ((first[i].cause, second[j].cause), (second[j].cause, first[i].cause)):
            often[one] = often.get(one, 0) + 1
            taken = often[one] == PAIRS_OF_A_CAUSE
            gain[np.ix_(causes[0] == one, (causes[1] == other) | taken)] = -np.inf
            gain[np.ix_((causes[0] == other) | taken, causes[1] == one)] = -np.inf
    return _fit_closest(work, options)


def _can_be_paired(work, first, second):
    """Whether two candidates (first, second) may be causes together; two contacts at once take too long to fit."""
    contacts = [[bool(c.shape) and any(u.force for u in c.term.unknowns) for c in part] for part in (first, second)]
    each = [list({c.cause: c for c in part}.values()) for part in (first, second)]
    of_two = _are_distinct if work.settings.most_causes > 1 else lambda *both: _is_allowed(work, both)
    allowed = np.array([[of_two(a, b) for b in each[1]] for a in each[0]])
    place = [
        [[c.cause for c in known].index(c.cause) for c in part]
        for known, part in zip(each, (first, second), strict=True)
    ]
    return ~np.outer(*contacts) & allowed[np.ix_(*place)]


def _drop(work, current):
    """The explanation without those causes that it does better without."""
    for cause in current.causes:
        less = work.explain(tuple(c for c in current.causes if c.label != cause.label))
        if less and odds_of(less) > odds_of(current):
            return _drop(work, less)
    return current
