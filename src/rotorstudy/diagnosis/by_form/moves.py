"""Moves from one explanation to others, with the log odds that each promises to first order.

All are judged at the motion of the explanation, by the columns of the candidates there: a cause more, another one in
the place of one of its own, or one less. A cause of many shapes comes in the best ones that a scan finds.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.by_form.explanations import FormExplanation, FormSearch
from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.odds import faults_of, odds_of
from rotorstudy.diagnosis.search.parts import (
    faults_at_several_discs,
    faults_of_several_parts,
    faults_with_what_they_bring,
)
from rotorstudy.diagnosis.search.screening import screen, screen_each
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, scan
from rotorstudy.inference.fit import Fit

CLOSE = 15.0  # excess over the cost of an explanation (likelihood ratio e^-7.5) beyond which no shape is tried
LEFT_BY_SHAPE = 0.05  # of what a cause explains, left if its shape is half a step of those tried away from the true one


class Proposal(NamedTuple):
    """Causes worth a fit, the values of parameters by name from which it starts, and the log odds it may reach."""

    causes: tuple[Candidate, ...]
    values: dict[str, float]
    log_odds: float


class _Judge(NamedTuple):
    """What judges causes beside some others; base : log odds of these without the prior odds of any."""

    work: FormSearch
    rest: tuple[Candidate, ...]
    values: dict[str, float]
    base: float

    def proposal(self, more, start, evidence):
        """The Proposal of more causes with a start of their amplitudes."""
        names = [n for c in more for n in c.names]
        causes = (*self.rest, *more)
        odds = self.base + evidence + self.work.prior_odds.log_odds(causes)
        return Proposal(causes, self.values | dict(zip(names, start, strict=True)), odds)

    def scanned(self, fitted, chosen, most_left=np.inf):
        """Proposals of causes in the shapes that a scan at a fit finds."""
        alike = {(c.cause, *c.variant.values()): c for c in reversed(chosen) if can_be_scanned(c)}
        found = scan(self.work, fitted, list(alike.values()), most_left=most_left) if fitted.excess > 0 else []
        return [self.proposal((cause,), one.start, one.evidence) for cause, one in found]


def additions(work: FormSearch, current: FormExplanation, fits: list[Fit]) -> list[Proposal]:
    """One fault more, judged at some fits of the explanation."""
    chosen = [c for c in work.candidates if is_allowed(work, (*current.causes, c))]
    if not chosen:
        return []
    work, found = replace(work, spectrum=current.spectrum or work.spectrum), []
    for fitted in fits:
        base = odds_of(current) - work.prior_odds.log_odds(current.causes)
        judge = _Judge(work, current.causes, fitted.values, base)
        projected, usable = work.project(fitted, chosen)
        alone = [c for c in usable if not can_be_scanned(c)]
        screened = screen_each(projected, alone)
        found += [judge.proposal((c,), one.start, one.evidence) for c, one in zip(alone, screened, strict=True)]
        found += judge.scanned(fitted, usable)
        for several in (faults_of_several_parts, faults_with_what_they_bring, faults_at_several_discs):
            for parts, _ in several(work, fitted, usable):
                together = screen(work.project(fitted, list(parts))[0], *parts)
                found.append(judge.proposal(parts, together.start, together.evidence))
    return found


def exchanges(work: FormSearch, current: FormExplanation) -> list[Proposal]:
    """Another cause in the place of each fault.

    They are judged without an error of form, as another cause may explain what the form of this one leaves.
    """
    found, whole = [], work.held(current.causes, current.fit.values)
    for gone in faults_of(current.causes).values() if whole else ():
        names = {c.cause for c in gone}
        rest = tuple(c for c in current.causes if c.cause not in names)
        without = work.held(rest, current.fit.values)
        chosen = [c for c in work.candidates if is_allowed(work, (*rest, c))]
        if not chosen or without is None:
            continue
        projected, usable = work.project(whole, [*chosen, *gone], tuple(n for c in gone for n in c.names))
        if not {c.label for c in gone} <= {c.label for c in usable}:
            continue
        base = odds_of(current) - screen(projected, *gone).evidence - work.prior_odds.log_odds(current.causes)
        judge = _Judge(work, rest, current.fit.values, base)
        others = [c for c in usable if c.cause not in names and not can_be_scanned(c)]
        screened = screen_each(projected, others)
        found += [judge.proposal((c,), one.start, one.evidence) for c, one in zip(others, screened, strict=True)]
        most_left = whole.cost + max(CLOSE, LEFT_BY_SHAPE * (without.cost - whole.cost))
        found += judge.scanned(without, chosen, most_left)
    return found


def removals(current: FormExplanation) -> list[Proposal]:
    """One fault less."""
    found = []
    for gone in faults_of(current.causes).values():
        names = {c.cause for c in gone}
        rest = tuple(c for c in current.causes if c.cause not in names)
        found += [Proposal(rest, current.fit.values, np.inf)] if rest else []
    return found
