"""Moves from one explanation to others, with the log odds that each promises to first order.

All are judged at the motion of the explanation, by the columns of the candidates there: a cause more, another one in
the place of one of its own, the same by another law or facing another side; two at once at the motion with two forces.
A cause of many shapes comes in the best ones that a scan finds.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import FIXED, Candidate, with_shape
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.form import largest_error, largest_errors
from rotorstudy.diagnosis.search.form_fit import WITHIN
from rotorstudy.diagnosis.search.free_force import FREE_FORCE, two_forces
from rotorstudy.diagnosis.search.held_shapes import slopes_of
from rotorstudy.diagnosis.search.odds import Explanation, faults_of, log_posterior_odds, odds_of
from rotorstudy.diagnosis.search.parts import faults_of_several_parts
from rotorstudy.diagnosis.search.screening import screen, screen_each
from rotorstudy.diagnosis.search.shape_fit import point_of, ranges_of, reshaped
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, scan
from rotorstudy.diagnosis.search.stretches import between_candidates, may_lie_between, next_places
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.prediction import predicted
from rotorstudy.model.structure import Structure

EXPLAINS = 2.0  # misfit for each datum that a free force at one place leaves, at most, if one fault may act there
HIDES = 30.0  # gain of log odds by an error of form, above which it may hide another fault
WORTH_ADDING = -1.0  # change of the log odds that one more cause must promise
OF_INEXACT_FORM = 2  # proposals with the largest error of their own that are fitted, of one size of it
PAIRS = 6  # of two causes at two places that are fitted
STEPS = 6  # of a fit that tells what a cause promises where linear columns do not
LOOSE = 0.5  # standard deviation of a known amplitude in a scan, as a shape that is not yet found has another one


class Proposal(NamedTuple):
    """Causes worth a fit, the values of parameters by name from which it starts, and the log odds it may reach."""

    causes: tuple[Candidate, ...]
    values: dict[str, float]
    log_odds: float


def moves_from(work: Search, current: Explanation) -> list[list[Proposal]]:
    """The Proposals from an explanation with causes, in lists whose promises compare."""
    found = turns(work, current)
    # of one alone, all others were judged at the same motion, unless it changes the films
    if len(current.faults) > 1 or any(p.loads_films for c in current.causes for p in c.term.parameters):
        found += other_laws(work, current) + exchanges(work, current)
    elif between := [c.effect for c in current.causes if may_lie_between(work, c)]:
        found += exchanges(work, current, [c for c in work.candidates if c.effect in between])
    return [found + additions(work, current, [current.fit])]


def single_causes(work: Search) -> Iterator[list[list[Proposal]]]:
    """The Proposals of one cause, in lists whose promises compare; the best may be fitted before the others are sought.

    Each free force that explains the records alone is another motion at which causes are judged; those of many shapes,
    which take longest, at that of the best one and of one at their own place. The most promising is told first, if it
    promises more than the best force. Causes whose position on the shaft is a part of their shape are sought later, and
    those of a less certain form once more at the end.
    """
    forces = [one for one in work.free_forces if one.fitted is not None]
    alone = [one for one in forces if one.left < EXPLAINS * work.spectrum.data_count and one.log_odds > 0]
    if not alone:
        fits = [work.base, *(one.fitted for one in forces[:1])]
        yield [found := additions(work, work.nothing, fits)]
        yield of_inexact_form(work, fits, found)
        return
    first, *others = [one for one in alone if one.log_odds > alone[0].log_odds - WITHIN]
    anywhere = [c for c in work.candidates if _is_anywhere(work, c)]
    rest = [c for c in work.candidates if not _is_anywhere(work, c)]
    found = additions(work, work.nothing, [first.fitted], _within_reach(work, first, rest))
    # films are not linear in their numbers: neither columns nor the first step of a fit tell how much these explain
    films = [c for c in work.candidates if c.term.carries]
    found += by_steps_of_a_fit(work, films, work.base.values, -np.inf)
    if of_readings := [c for c in work.candidates if c.term.acts_on_output]:
        # which an error of the readings leaves as it is
        stated = fit(work.model, work.spectrum, work.prior, steps=0)
        found += additions(work, work.nothing, [work.base, stated], of_readings)
    best = max(found, key=lambda one: one.log_odds, default=None)
    if best and best.log_odds > first.log_odds:
        yield [[best]]
    found += additions(work, work.nothing, [first.fitted], _within_reach(work, first, anywhere))
    yield [found, *(additions(work, work.nothing, [one.fitted], _told_by(work, one)) for one in others)]
    yield of_inexact_form(work, [first.fitted], found)


def _within_reach(work, best, causes):
    """The causes that may be nearly as likely as a free force that explains the records, or as a cause that does.

    To first order in the values of the rig, a cause hardly explains more than a free force at its place, which is known
    before any of its shapes is tried; `WITHIN` allows for the rest. A cause that acts where no force was tried may.
    """
    known = odds_of(work.best) if work.best.causes and not work.is_doubtful else best.log_odds
    least = max(work.base.cost - 2 * (max(best.log_odds, known) - WITHIN), best.left + 2 * WITHIN)
    beyond = [one for one in work.free_forces if one.left >= least]
    near = [one for one in work.free_forces if one.left < least]
    scanned = [c for c in causes if can_be_scanned(c) and ("node" in c.where or _is_anywhere(work, c))]
    tried = [c for c in scanned if any(_acts_at(c, one) for one in beyond)]
    out = {c.label for c in tried if not any(_acts_at(c, one) for one in near)}
    return [c for c in causes if c.label not in out]


def _is_anywhere(work, cause):
    """Whether the position of a cause on the shaft is a part of its shape."""
    return can_be_scanned(cause) and any(ends.breaks for ends in ranges_of(work, cause).values())


def _acts_at(cause, force):
    """Whether a cause acts as a free force does: at its place, or at a bearing against the housing there.

    One that may be anywhere bends an element.
    """
    if not cause.where:
        return force.motion == "bending"
    node = cause.where.get("node")
    return force.motion == "force" and (force.where == cause.where or (node and force.where == {"bearing": node}))


def _told_by(work, force):
    """The candidates that are judged at the motion with a free force that is not the best one."""
    structure = work.rig.structure
    plain = [c for c in work.candidates if not (can_be_scanned(c) or needs_fit(c, structure))]
    contacts = [c for c in work.candidates if can_be_scanned(c) and c.where]
    return [*plain, *(c for c in contacts if _acts_at(c, force))]


class _Judge(NamedTuple):
    """What judges causes beside some others; base : log odds of these without the prior odds of any."""

    work: Search
    rest: tuple[Candidate, ...]
    values: dict[str, float]
    base: float

    def proposal(self, more, start, evidence):
        """The Proposal of more causes with a start of their amplitudes."""
        names = [n for c in more for n in c.names]
        causes = (*self.rest, *more)
        odds = self.base + evidence + self.work.prior_odds.log_odds(causes)
        return Proposal(causes, self.values | dict(zip(names, start, strict=True)), odds)

    def alone(self, projected, usable, least=-np.inf):
        """Proposals of each candidate that has no shape to scan.

        least : log odds that matter; those that cannot reach them are left out
        """
        chosen = [c for c in usable if not can_be_scanned(c)]
        screened = zip(chosen, screen_each(projected, chosen, (), least - self.base), strict=True)
        return [self.proposal((c,), one.start, one.evidence) for c, one in screened if one.evidence > -np.inf]

    def by_fits(self, proposals):
        """Proposals of single causes, of which those that need a fit are judged by a few steps of it."""
        told, untold = [], []
        for one in proposals:
            (untold if needs_fit(one.causes[0], self.work.rig.structure) else told).append(one)
        least = max((one.log_odds for one in told), default=0.0)
        return told + by_steps_of_a_fit(self.work, [one.causes[0] for one in untold], self.values, least)

    def together(self, projected, usable):
        """Proposals of faults of several parts."""
        found = faults_of_several_parts(self.work, projected, usable)
        return [self.proposal(parts, one.start, one.evidence) for parts, one in found]

    def scanned(self, fitted, chosen, plain, without=(), free=(), excess=np.inf):
        """Proposals of causes in the shapes that a scan finds, by all their laws: of those alike one is scanned."""
        laws, found = {}, []
        for c in filter(can_be_scanned, chosen):
            laws.setdefault(c.cause, {}).setdefault(tuple(c.variant.values()), c)
        every = [c for some in laws.values() for c in some.values()]
        first = {(c.cause, tuple(p.name for p in c.term.parameters)): c for c in reversed(every)}
        if not first or (excess <= 0 and not without):
            return []
        for cause, one in in_best_shapes(self.work, fitted, first.values(), without=without, free=free, plain=plain):
            found.append(self.proposal((cause,), one.start, one.evidence))
            for law in laws[cause.cause].values():
                if law.variant != cause.variant:
                    other = with_shape(self.work.rig, law, cause.shape, self.work.settings.prior_width)
                    found.append(self.proposal((other,), usual_amplitudes(other), one.evidence))
        return found


def in_best_shapes(work, fitted, chosen, **given):
    """(cause, Screened) of causes in the shapes of a scan, where known amplitudes are loose; given : as for `scan`.

    A fit begins with the amplitudes as they are known: from those that a scan finds it leads elsewhere.
    """
    loose = [c._replace(fixed_std=LOOSE) for c in chosen]
    for cause, one in scan(work, fitted, loose, **given):
        known = with_shape(work.rig, cause._replace(fixed_std=FIXED), cause.shape, work.settings.prior_width)
        yield known, one._replace(start=usual_amplitudes(known)) if known.fixed else one


def usual_amplitudes(cause: Candidate) -> np.ndarray:
    """(unknown,) the means of the prior of its amplitudes."""
    return np.array([cause.prior[name][0] for name in cause.names])


def additions(
    work: Search,
    current: Explanation,
    fits: list[Fit],
    among: Sequence[Candidate] | None = None,
    largest: float | None = None,
) -> list[Proposal]:
    """One fault more of all candidates or some, judged at some fits of the explanation.

    A free force of a fit is taken out (`free_force.py`). The shapes of the causes follow, to first order. An error of
    form that takes up much may hide the other fault: each is then judged without that error, too. Beside other causes
    it must be worth its prior odds itself, and not by what any error of form takes up.

    largest : error of the form of the cause sought, by default the usual one
    """
    chosen = [c for c in (work.candidates if among is None else among) if work.allows((*current.causes, c))]
    found, form = [], _error_of_form(work, current)
    for plain, has_error in product(fits, (True, False)):
        without = tuple(name for name in plain.names if name == FREE_FORCE)
        here = [c for c in chosen if not (without and c.term.acts_on_output)]  # an error of readings is no force
        if not here or not (has_error or form.size):
            continue
        wide, fitted = _with_error_of_form(work, plain, form if has_error else form[:, :0], without, largest)
        if has_error:
            volume = wide.spectrum.log_shared_volume
        elif fitted.cost < current.fit.cost + 2 * HIDES:
            continue
        free = slopes_of(wide, fitted, current.causes, without)
        projected, usable = wide.project(fitted, here, without, free)
        less = current.fit.cost - projected.residual @ projected.residual + volume - wide.spectrum.log_shared_volume
        base = odds_of(current) - work.prior_odds.log_odds(current.causes) + 0.5 * less
        judge = _Judge(wide, current.causes, fitted.values, base)
        least = odds_of(current) + max(0.5 * less, 0.0) + WORTH_ADDING if current.causes else -np.inf
        alone = judge.alone(projected, usable, least=least)
        judged = (judge.by_fits(alone) if without else alone) + judge.together(projected, usable)
        judged += between_candidates(work, judge, partial(wide.project, fitted, without=without, free=free), alone)
        judged += judge.scanned(fitted, usable, plain, without, free, (plain if has_error else fitted).excess)
        found += [one for one in judged if one.log_odds > least]
    return found


def of_inexact_form(work: Search, fits: list[Fit], found: list[Proposal]) -> list[list[Proposal]]:
    """One fault alone of those whose form is less certain than usual, judged with the largest error of their own.

    With the usual one it promises less than a fit reaches; with its own more: a list for each error, as promises with
    different ones do not compare. Causes whose law is free, or whose shape is scanned, are left out: these take up what
    the usual error leaves. So are those that cannot come near the best that was fitted: an error k times as large
    leaves no less than 1 / k^2 of the cost.

    found : with the usual error; of one judged at several fits the best counts
    """
    usual, by_error = work.settings.form_error, {}
    perfect, known = 0.5 * work.base.cost, max(map(odds_of, work.explanations))  # log odds without any cost, and so far
    promised = {one.causes[0].label: one.log_odds for one in sorted(found, key=lambda one: one.log_odds)}
    for c in work.candidates:
        own = max((largest_error(c.effect, p.name, usual) for p in c.term.parameters), default=usual)
        is_free = can_be_scanned(c) or any(one.amplitudes for one in c.freedoms)
        near = perfect - (own / usual) ** 2 * (perfect - known + WITHIN)
        if own > usual and not is_free and promised.get(c.label, -np.inf) >= near:
            by_error.setdefault(own, []).append(c)
    judged = [additions(work, work.nothing, fits, among, own) for own, among in sorted(by_error.items())]
    return [sorted(some, key=lambda one: -one.log_odds)[:OF_INEXACT_FORM] for some in judged]


def pairs(work: Search) -> list[Proposal]:
    """Two faults at once: causes at the two places at which forces explain most together, each beside the other force.

    Where no single fault explains the records, none is near the motion on which the two act. What a cause promises
    beside a free force ranks it, but is no measure of what the pair reaches.
    """
    sides, found, two = [], [], []
    with suppress(NoSteadyState):
        two = two_forces(work) if work.settings.most_causes > 1 else []
    chosen = [c for c in work.candidates if not c.term.acts_on_output]
    for plain, own in two:
        wide, fitted = _with_error_of_form(work, plain, own, (FREE_FORCE,))
        projected, usable = wide.project(fitted, chosen, (FREE_FORCE,))
        judge, best = _Judge(wide, (), fitted.values, 0.0), {}
        every = judge.alone(projected, usable) + judge.together(projected, usable)
        every += judge.scanned(fitted, usable, plain, (FREE_FORCE,))
        for one in sorted(every, key=lambda one: -one.log_odds):
            best.setdefault(one.causes[0].effect, one)
        sides.append(best.values())
    for one, other in product(*sides) if sides else ():
        causes, prior = (*one.causes, *other.causes), work.prior_odds.log_odds
        if work.allows(causes):
            promised = one.log_odds + other.log_odds - prior(one.causes) - prior(other.causes) + prior(causes)
            found.append((promised, Proposal(causes, one.values | other.values, np.inf)))
    return [one for _, one in sorted(found, key=lambda one: -one[0])[:PAIRS]]


def loading_films(work: Search) -> list[Proposal]:
    """Single causes of which a part is a constant force on oil films, judged by a few steps of a fit."""
    motion = next((one.fitted for one in work.free_forces if one.fitted is not None), work.base)
    chosen = [c for c in work.candidates if len({p.loads_films for p in c.term.parameters}) > 1]
    return by_steps_of_a_fit(work, chosen, motion.values, max(map(odds_of, work.explanations)))


def by_steps_of_a_fit(
    work: Search, chosen: Sequence[Candidate], values: dict[str, float], least: float
) -> list[Proposal]:
    """Proposals of single causes by a few steps of a fit from some values; least : log odds that they should reach."""
    found, needed = [], work.base.cost - 2 * (least - WITHIN)
    for one in ((c,) for c in chosen):
        if held := work.held(one, values, STEPS, needed):
            odds = log_posterior_odds(one, held, work.base, work.prior_odds)
            found.append(Proposal(one, held.values, odds))
    return found


def needs_fit(cause: Candidate, structure: Structure) -> bool:
    """Whether linear columns do not tell what a cause explains: a constant force on oil films, or another block.

    Films are not linear in their load. A block under several bearings moves as a force at no one place moves it, so
    that the motion on which its change acts is not known.
    """
    entries = [entry for p in cause.term.parameters for entry in p.entries if entry.reads_motion]
    acted = {structure.dofs[i] for entry in entries for i in entry.nonzero[0]}
    on_a_block = len(acted) > 1 and all(motion == "housing" for _, motion in acted)
    return on_a_block or all(p.loads_films for p in cause.term.parameters)


def _error_of_form(work, current):
    """Columns (component, error) of the error of form of an explanation; none of the rig without causes."""
    return current.form.columns if current.form else np.zeros((work.spectrum.data_count, 0))


def _with_error_of_form(work, plain, own, without, largest=None):
    """The search and a fit with an error of the form of the cause sought, of what the fit leaves without it.

    A cause is judged at a motion and at values of the rig that are only nearly those with it.

    own     : (component, error) columns of an error of the form of the causes of the fit
    largest : error of the form of the cause sought, by default the usual one
    """
    bare = replace(work.spectrum, shared_error=None)
    held = dict(plain.values) | dict.fromkeys(without, 0.0)
    theta = np.array([held.get(n, v) for n, v in zip(plain.model.names, plain.theta, strict=True)])
    with suppress(NoSteadyState):  # of the other causes, at values that they have beside what is taken out
        left = bare.amplitude - predicted(plain.model, bare, theta)
        own = np.hstack([largest_errors(bare, left, largest or work.settings.form_error), own])
    wide = bare.with_shared_error(own)
    return replace(work, spectrum=wide), fit(plain.model, wide, plain.prior, start=plain.theta, steps=0)


def exchanges(work: Search, current: Explanation, among: Sequence[Candidate] | None = None) -> list[Proposal]:
    """Another cause, of all or some, in the place of each fault, judged at the motion with it; beside the same once."""
    found, whole = [], work.held(current.causes, current.fit.values)
    every = work.candidates if among is None else among
    for gone in faults_of(current.causes).values() if whole else ():
        rest = tuple(c for c in current.causes if c not in gone)
        if work.was_tried(work.rests, rest):
            continue
        work.note(work.rests, rest)
        own = tuple(n for c in gone for n in c.names)
        chosen = [c for c in every if c.fault != gone[0].fault and work.allows((*rest, c))]
        wide, fitted = _with_error_of_form(work, whole, _error_of_form(work, current), own)
        free = slopes_of(wide, fitted, rest, own)
        projected, usable = wide.project(fitted, [*chosen, *gone], own, free)
        if not {c.label for c in gone} <= {c.label for c in usable}:
            continue
        base = odds_of(current) - screen(projected, *gone).evidence - work.prior_odds.log_odds(current.causes)
        judge = _Judge(wide, rest, current.fit.values, base)
        others = [c for c in usable if not any(c is one for one in gone)]
        alone = judge.alone(projected, others)
        found += alone + judge.together(projected, others)
        found += between_candidates(work, judge, partial(wide.project, fitted, without=own, free=free), alone)
        found += judge.scanned(fitted, others, whole, own, free)
    return found


def turns(work: Search, current: Explanation) -> list[Proposal]:
    """The same causes, one of them facing another side, in the best shape there at the motion with it.

    Both explain nearly the same, and no small step leads from one to the other: a support that lifts by up to a play
    is one that is pressed by as much from the other side, and a constant force.
    """
    found, whole = [], work.held(current.causes, current.fit.values)
    for i, cause in enumerate(current.causes if whole else ()):
        if not cause.shape or not any(ends.goes_around for ends in ranges_of(work, cause).values()):
            continue
        wide, fitted = _with_error_of_form(work, whole, _error_of_form(work, current), cause.names)
        away = point_of(work, cause)
        for other, one in in_best_shapes(wide, fitted, [cause], without=cause.names, plain=whole, away=away):
            values = current.fit.values | dict(zip(other.names, one.start, strict=True))
            found.append(Proposal((*current.causes[:i], other, *current.causes[i + 1 :]), values, np.inf))
    return found


def shifts(work: Search, current: Explanation) -> list[tuple[tuple[Candidate, ...], dict[str, float]]]:
    """The same causes with one fault at a next place along the shaft, each with the values from which a fit starts.

    What a fault brings moves with it; parts of one fault at several places were chosen together and stay. The promise
    of another place is that of linear columns, at the motion with the fault where it is: too rough where only the place
    is in question.
    """
    found = []
    for fault in faults_of(current.causes).values():
        here = [c for c in fault if not c.term.acts_on_output]
        if len({tuple(c.where.items()) for c in here}) == 1:
            places = [next_places(work, c) for c in here]
            for there in places[0]:
                if all(there in other for other in places):
                    with suppress(CannotAct):
                        found.append(_at_another_place(work, current, here, [other[there] for other in places]))
    return [one for one in found if work.allows(one[0])]


def _at_another_place(work, current, here, others):
    """Causes and values of an explanation with others for some, of the same amplitudes and shares of their ranges."""
    instead, values = {}, dict(current.fit.values)
    for cause, other in zip(here, others, strict=True):
        instead[cause.cause] = reshaped(work, other, point_of(work, cause)) if cause.shape else other
        if len(cause.names) == len(other.names):
            values |= {name: values[own] for own, name in zip(cause.names, other.names, strict=True)}
    return tuple(instead.get(c.cause, c) for c in current.causes), values


def other_laws(work: Search, current: Explanation) -> list[Proposal]:
    """The same causes, one of them with another of its alternatives in the shape that was found."""
    found = []
    for i, cause in enumerate(current.causes):
        laws = {tuple(c.variant.values()): c for c in work.candidates if c.cause == cause.cause}
        for law in laws.values():
            if law.variant != cause.variant:
                other = with_shape(work.rig, law, cause.shape, work.settings.prior_width)
                values = {n: v for n, v in current.fit.values.items() if n not in cause.names}
                found.append(Proposal((*current.causes[:i], other, *current.causes[i + 1 :]), values, np.inf))
    return found
