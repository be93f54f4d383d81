"""Alternatives to an explanation: other causes in the place of each, the same ones elsewhere, and pairs."""

import numpy as np

from rotorstudy.diagnosis.search.contained import are_distinct, is_allowed
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.search.screening import TIE, screen, screen_each, screen_pairs
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, scan
from rotorstudy.diagnosis.search.shapes import refine
from rotorstudy.diagnosis.search.trials import (
    CLOSE,
    LEFT_BY_SHAPE,
    REACH,
    Option,
    best_of_each_shape,
    fit_closest,
    may_be_left,
)

INACCURACY = 0.01  # of what a cause explains: added to REACH, as columns at the best motion are not exact
OF_CONTACTS = 0.03  # the same of a force that follows from the motion in time, and with it changes more
ALTERNATIVES = 12  # most alternatives to each cause that are fitted in a round
ROUNDS = 3  # of alternatives, each at the motion of the best of the last one
REFINED = 3  # most explanations of a round whose shape is refined
PAIRS = 6  # pairs fitted in a round
PAIRS_OF_A_CAUSE = 2  # of these, with the same cause; else a single good cause with any other would take all of them


def with_alternatives(work, current):
    """The best explanation after all others within reach of it were fitted, each in its best shape.

    All candidates in the place of each cause, and all pairs if the explanation is rejected, are judged at its motion.
    """
    for number in range(ROUNDS):
        tried = exchanged(work, current)
        if number == 0:
            tried += [e for cause in current.causes for e in _elsewhere(work, current, cause)]
        if work.is_rejected_as_stated(current):
            tried += _pairs(work, current)
        shaped = _worth_refining(work, current, tried)
        best = max([*tried, *(refine(work, e) for e in shaped)], key=odds_of, default=current)
        if odds_of(best) <= odds_of(current):
            break
        current = best
    return current


def exchanged(work, current):
    """Explanations with another cause in the place of each, of those within reach at the motion of the current one."""
    return [e for cause in current.causes for e in _instead_of(work, current, cause)]


def _worth_refining(work, current, tried):
    """The explanations tried whose shape is refined: if the best one leaves no more than noise, of those near it."""
    best = max([current, *tried], key=odds_of)
    near = max(CLOSE, LEFT_BY_SHAPE * (work.base.cost - best.fit.cost))
    shaped = best_of_each_shape(e for e in tried if e.causes[-1].shape)
    if best.fit.cost < len(best.fit.residual):
        shaped = [e for e in shaped if e.fit.cost < best.fit.cost + near]
    return shaped[:REFINED]


def _instead_of(work, current, cause):
    """Explanations with another cause instead of one, of those within reach."""
    rest = tuple(c for c in current.causes if c is not cause)
    chosen = [c for c in work.candidates if is_allowed(work, (*rest, c)) and c.cause != cause.cause]
    projected, usable = work.project(current.fit, [*chosen, cause], cause.names)
    odds = dict(zip((c.label for c in usable), screen_each(projected, usable), strict=True))

    def judged(one):
        return odds[one.label].evidence + work.prior_odds.log_odds((*rest, one))

    if cause.label not in odds:
        return []
    least, best = judged(cause) - REACH - current.fit.excess, {}
    for one in sorted((c for c in usable if c is not cause), key=judged, reverse=True):
        inaccuracy = OF_CONTACTS if any(u.force for u in one.term.unknowns) else INACCURACY
        if judged(one) >= least - inaccuracy * odds[cause.label].explained and len(best) < ALTERNATIVES:
            best.setdefault(one.cause, one)
    theta = current.fit.values
    options = [Option((*rest, c), theta | dict(zip(c.names, odds[c.label].start, strict=True))) for c in best.values()]
    return fit_closest(work, options)


def at_the_same_place(work, current):
    """The best explanation after one other cause, in its best shape, was tried for all causes at a place.

    Shapes are hardly seen under the error that is allowed to causes at first, and two causes without one may make up
    for a shape. A cause of the whole rotor, but a crack, is exchanged for those at any place. Contacts are not tried,
    as their multiples of 1X show.
    """
    places = {}
    for cause in current.causes:
        places.setdefault(cause.where.get("node", cause.cause), []).append(cause)
    tried = [e for causes in places.values() for e in _scanned_instead(work, current, causes, _may_be_there)]
    best = max(tried, key=odds_of, default=current)
    return refine(work, best, again=False) if odds_of(best) >= odds_of(current) - REACH else current


def one_instead_of_all(work, current, node):
    """Explanations by one cause that acts at a node, in its best shape, instead of all causes of an explanation.

    At the motion of that explanation, whose causes may imitate the one that made it.
    """
    tried = _scanned_instead(work, current, list(current.causes), lambda _, other: other.where.get("node") == node)
    return [refine(work, e) for e in sorted(tried, key=odds_of, reverse=True)[:REFINED]]


def _may_be_there(cause, other):
    """Whether another cause may be taken for one by its place alone."""
    if any(u.force for u in other.term.unknowns):
        return False
    return cause.where.get("node") == other.where.get("node") if cause.where else not cause.shape and bool(other.where)


def _elsewhere(work, current, cause):
    """Explanations with the effect of a cause at its other places, each in the best shape that a scan finds there."""
    return _scanned_instead(work, current, [cause], lambda one, other: one.effect == other.effect)


def _scanned_instead(work, current, causes, may_be):
    """Explanations with another cause instead of some, each in the best shape that a scan finds.

    may_be : function(cause, other) whether another one is considered for the first of them
    """
    names = {c.cause for c in causes}
    rest = tuple(c for c in current.causes if c.cause not in names)
    chosen = {
        c.cause: c
        for c in work.candidates
        if c.cause not in names and can_be_scanned(c) and may_be(causes[0], c) and is_allowed(work, (*rest, c))
    }
    if not chosen:
        return []
    held = work.held(rest, current.fit.values)
    if not held:
        return []
    most_left = may_be_left(current, held.cost)
    found = scan(work, held, list(chosen.values()), refined=len(chosen), most_left=most_left)
    theta = current.fit.values
    least = max((s.evidence - LEFT_BY_SHAPE * s.explained for _, s in found), default=0.0) - REACH
    options = [
        Option((*rest, one), theta | dict(zip(one.names, screened.start, strict=True)))
        for one, screened in found
        if screened.evidence >= least
    ]
    return fit_closest(work, options)


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
    return fit_closest(work, options)


def _can_be_paired(work, first, second):
    """Whether two candidates (first, second) may be causes together; two contacts at once take too long to fit."""
    contacts = [[bool(c.shape) and any(u.force for u in c.term.unknowns) for c in part] for part in (first, second)]
    each = [{c.cause: c for c in part} for part in (first, second)]
    of_two = are_distinct if work.settings.most_causes > 1 else lambda *both: is_allowed(work, both)
    allowed = np.array([[of_two(a, b) for b in each[1].values()] for a in each[0].values()])
    number = [{name: i for i, name in enumerate(known)} for known in each]
    place = [[at[c.cause] for c in part] for at, part in zip(number, (first, second), strict=True)]
    return ~np.outer(*contacts) & allowed[np.ix_(*place)]
