"""Several causes compared as they are judged: without an error of their form.

The error that is allowed to a single cause hides what a small second one explains. So where the best explanation by
several causes needs such an error, or a single one needs more than is allowed, each cause in turn is taken out, and all
others are tried in its place, in every shape. They are sought with the error that the best explanation has, as its
motion is no more accurate, then without; they are compared without.
"""

import logging
from dataclasses import replace

from rotorstudy.diagnosis.alternatives import with_alternatives
from rotorstudy.diagnosis.crack_beside import with_a_crack
from rotorstudy.diagnosis.explanations import Search
from rotorstudy.diagnosis.odds import Explanation, odds_of
from rotorstudy.diagnosis.one_more import with_one_more
from rotorstudy.diagnosis.shapes import refine, refine_in_turn
from rotorstudy.diagnosis.trials import best_of_each_shape
from rotorstudy.inference.fit import fit

log = logging.getLogger(__name__)

REFINED = 2  # explanations of an exchange whose shape is refined
COMPARED = 4  # most explanations of an exchange that are compared without an error


def without_error(settled: Search) -> Search:
    """The search without an error of causes, where only that error makes its best explanation fit.

    Parameters
    ----------
    settled : Search
        With the error that its best explanation needs.

    Returns
    -------
    Search
        That given, where several causes without an error do not explain the records either.
    """
    best, error = settled.best, settled.cause_error
    is_allowed = error < settled.settings.cause_error if len(best.faults) == 1 else error == 0
    if not best.causes or is_allowed:
        return settled
    log.info("comparing several causes without an error of their form")
    base = fit(settled.model, settled.stated, settled.prior, start=settled.base.theta)
    exact = replace(settled, spectrum=settled.stated, base=base, found={}, equations={}, cause_error=0.0)
    exact.found[frozenset()] = Explanation((), base, 0.0)
    tried = _exchanged(settled, best, best.causes) + _refined(settled, with_a_crack(settled, best))
    near = [best, *best_of_each_shape(tried)[:COMPARED]]
    found = [exact.explain(e.causes, [e.fit.theta]) for e in near]
    found = [refine_in_turn(exact, e) for e in found if e]
    if not found:
        return settled
    current = max(found, key=odds_of)
    if _is_rejected(exact, current):
        current = max([current, *_exchanged(exact, current, (None, *current.causes))], key=odds_of)
    if _is_rejected(exact, current):
        return settled
    with_alternatives(exact, refine_in_turn(exact, current))
    return exact


def _is_rejected(work, explanation):
    return explanation.fit.is_rejected(work.settings.significance)


def _exchanged(work, current, replaced):
    """Explanations with any other cause in the place of each of some, at the motion of the current one.

    The other causes keep their values while all are tried, as they would imitate one that is missing.

    replaced : causes, or None for one more
    """
    tried = []
    for cause in replaced:
        rest = tuple(c for c in current.causes if c is not cause)
        without = work.explain(rest)
        if without:
            held = work.held(rest, current.fit)
            tried += with_one_more(work, without, [held], values=held)
    return _refined(work, tried)


def _refined(work, tried):
    """Explanations, and the best of them in better shapes of their last cause."""
    shaped = best_of_each_shape(e for e in tried if e.causes[-1].shape)[:REFINED]
    return [*tried, *(refine(work, e) for e in shaped)]
