"""One more cause: all candidates screened, shapes scanned, the promising ones fitted."""

import numpy as np

from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.parts import (
    faults_at_several_discs,
    faults_of_several_parts,
    faults_with_what_they_bring,
)
from rotorstudy.diagnosis.search.screening import Screened
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, is_sought_everywhere, scan
from rotorstudy.diagnosis.search.trials import LEFT_BY_SHAPE, Option, closest, fit_closest, labels, may_be_left, trials
from rotorstudy.diagnosis.settings import base_rate
from rotorstudy.model.registry import registry

WORTH_FITTING = 0.1  # of what the best candidate explains when linearised, which is inaccurate for large effects
WORTH_REFINING = 0.05  # of the same, by the best of some hundred shapes; refined, it explains up to a few times as much
INEXACT, EXACT = 0.5, 0.8  # of the gain that gives even odds, from which on a cause may reach it when it is fitted
ORDINARY = 2  # places at which a cause more frequent than usual is fitted, whatever else explains
NOT_SCREENED = Screened(0.0, -np.inf, np.zeros(0), np.zeros(0))


def with_one_more(work, current, fits=None, values=None):
    """Explanations with one more cause, of the candidates worth a fit.

    fits   : list of Fit of the current explanation at which candidates are screened, by default its own
    values : Fit whose values of the parameters all trials start from, by default the stated ones
    """
    chosen = [c for c in work.candidates if is_allowed(work, (*current.causes, c))]
    if not chosen:
        return []
    fits = fits or [current.fit]
    screenings = [work.screened if f is work.base else work.screen(f, chosen) for f in fits]
    known = values or current.fit

    def tried(done=()):
        """Trials of the candidates worth a fit that are not among those done."""
        promising = _promising(work, chosen, screenings, work.settings.candidates_per_round)
        if work.cause_error < work.settings.cause_error and not current.fit.excess:
            promising = _near_even_odds(work, chosen, promising)
        options = [_option(current.causes, known, chosen[i], one) for i, one in promising.items()]
        done = {labels(one.causes) for one in done}
        return trials(work, [one for one in options if labels(one.causes) not in done], from_stated=values is None)

    looked, best, due = [], None, fits if _is_worth_scanning(work, current.fit, chosen) else []
    if due and not current.causes and _may_explain(screenings, fits):
        looked = tried()
        best = _explaining(work, closest(work, looked))
    while due and not best:
        (fitted, *due), number = due, len(fits) - len(due)
        chosen, screenings = _with_scanned(work, chosen, screenings, fitted, number)
        if due and not current.causes:
            looked += tried(looked)
            best = _explaining(work, closest(work, looked))
    looked += tried(looked)
    if due:
        looked += _scanned_at(work, best, chosen)
    several = [
        Option((*current.causes, *parts), start)
        for fitted in fits
        for parts, start in (
            *faults_of_several_parts(work, fitted, chosen),
            *faults_with_what_they_bring(work, fitted, chosen),
        )
    ]
    ordinary = [
        Option((*current.causes, *parts), start)
        for fitted, screened in zip(fits, screenings, strict=True)
        for parts, start in _ordinary(work, fitted, chosen, screened)
    ]
    return [
        *closest(work, looked, before=current.fit.cost),
        *fit_closest(work, several),
        *fit_closest(work, ordinary),
    ]


def _is_worth_scanning(work, fitted, chosen):
    """Whether a cause of some shape may be among what a fit leaves.

    It leaves more than noise; in a comparison, which has few data, so much more that such a cause could have even odds,
    although it explains noise, too: on average as much as it has amplitudes and options of its shape.
    """
    if work.rig.before is None:
        return fitted.excess > 0
    shaped = {c.cause: c for c in chosen if can_be_scanned(c)}.values()
    numbers = [len(c.names) + len(registry().get("effect", c.effect).shape) for c in shaped]
    needed = [work.prior_odds.even_odds_gain(c) for c in shaped]
    return any(fitted.excess > gain - count for gain, count in zip(needed, numbers, strict=True))


def _ordinary(work, fitted, chosen, screened):
    """Causes (each with its parts) more frequent than usual, with a start: at their best places, and at several discs.

    They are fitted even if others, with more amplitudes, explain more of the records.
    """
    found = faults_at_several_discs(work, fitted, chosen)
    theta = fitted.values
    for name in dict.fromkeys(c.effect for c in chosen if base_rate(c.effect, work.settings) > 1):
        places = [i for i, c in enumerate(chosen) if c.effect == name]
        odds = {i: screened[i].evidence + np.log(work.prior_odds.of(chosen[i])) for i in places}
        for i in sorted(places, key=odds.get, reverse=True)[:ORDINARY]:
            found.append(((chosen[i],), theta | dict(zip(chosen[i].names, screened[i].start, strict=True))))
    return found


def _with_scanned(work, chosen, screenings, fitted, number):
    """Candidates and their screenings, each with those added whose shape a scan at one of the fits has found."""
    best = max((one.explained for one in screenings[number]), default=0.0)
    scanned = scan(work, fitted, _one_shape_of_each(chosen), least=WORTH_REFINING * best)
    work.scanned.extend(one.cause for one in scanned)
    screenings = [
        [*rows, *(one.screened if i == number else NOT_SCREENED for one in scanned)]
        for i, rows in enumerate(screenings)
    ]
    return [*chosen, *(one.cause for one in scanned)], screenings


def _one_shape_of_each(chosen):
    """The first shape of each cause and alternative among candidates."""
    return list({(c.cause, *c.variant.values()): c for c in reversed(chosen)}.values())


def _may_explain(screenings, fits):
    """Whether a candidate leaves about as much as noise at one of the fits, to first order."""
    best = [max((one.explained for one in rows), default=0.0) for rows in screenings]
    return any(f.excess - gain <= LEFT_BY_SHAPE * f.excess for f, gain in zip(fits, best, strict=True))


def _explaining(work, found):
    """The explanation of least cost, if it leaves no more than noise and the stated model error; else None."""
    best = min(found, key=lambda e: e.fit.cost, default=None)
    return None if best is None or work.is_rejected_as_stated(best) else best


def _scanned_at(work, best, chosen):
    """Trials of causes in the shapes that a scan finds at the motion of a cause that explains the records.

    Only shapes are tried that may explain as much.
    """
    held = work.held((), best.fit.values)
    if not held:
        return []
    most_left = may_be_left(best, held.cost)
    scanned = scan(work, held, _one_shape_of_each(chosen), most_left=most_left)
    work.scanned.extend(one.cause for one in scanned)
    return trials(work, [_option((), best.fit, *one) for one in scanned])


def _option(causes, known, cause, screened):
    """Causes and one more, with the amplitudes of its Screened and all others as in a known fit."""
    return Option((*causes, cause), known.values | dict(zip(cause.names, screened.start, strict=True)))


def _promising(work, chosen, screenings, most):
    """Candidates worth a fit, {index: Screened}: the best of the screenings in turn, each cause in its best shape.

    A crack that was scanned counts in each alternative, as its columns say little about how it opens.
    """
    lists, of_scans = [], {id(cause): cause.cause for cause in work.scanned if is_sought_everywhere(cause)}
    names = [c.label if c.cause in of_scans.values() else c.cause for c in chosen]
    coarse = {i for i, c in enumerate(chosen) if c.cause in of_scans.values() and id(c) not in of_scans}
    for screened in screenings:
        odds = [one.evidence + np.log(work.prior_odds.of(cause)) for one, cause in zip(screened, chosen, strict=True)]
        order, seen = sorted(set(range(len(chosen))) - coarse, key=lambda i: -odds[i]), set()
        order = [i for i in order if not (names[i] in seen or seen.add(names[i]))]
        best = max((one.explained for one in screened), default=0.0)
        worth = [max(WORTH_FITTING * best, INEXACT * work.prior_odds.even_odds_gain(chosen[i])) for i in order]
        lists.append([(i, screened[i]) for i, low in zip(order, worth, strict=True) if screened[i].explained >= low])
    found = {}
    for rank in range(max(map(len, lists), default=0)):
        for one in lists:
            if rank < len(one) and len(found) < most * len(lists):
                found.setdefault(*one[rank])
    return found


def _near_even_odds(work, chosen, promising):
    """Those of the candidates that may reach even odds beside causes that leave no more than noise.

    At the motion of these, columns tell to a few per cent what a cause explains, but for its shape. It is for a search
    with a smaller error of the causes than assumed at first, under which the others were fitted already.
    """
    needed = {i: EXACT * work.prior_odds.even_odds_gain(chosen[i]) for i in promising}
    return {i: one for i, one in promising.items() if chosen[i].shape or one.explained >= needed[i]}
