"""Several causes compared as they are judged: without an error of their form.

The error that is allowed to a single cause hides what a small second one explains. So where the best explanation by
several causes needs such an error, they are compared without it, and where none explains the records, one cause is
sought beside a free force at the node of another. Then each in turn is taken out, and all others are tried in its
place, in every shape. So are then those of the best few explanations, at the motion of each: one of its causes may be
true, though others that imitate both explain more. Where causes need more error than is allowed, they may imitate a
crack and another cause, which are sought together; beside a crack that is among them, other causes are tried.
"""

import logging
from dataclasses import replace

from rotorstudy.diagnosis.search.alternatives import exchanged, with_alternatives
from rotorstudy.diagnosis.search.beside_a_force import with_causes_beside_a_force
from rotorstudy.diagnosis.search.crack_beside import with_a_crack, with_others_beside_a_crack
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.one_more import with_one_more
from rotorstudy.diagnosis.search.shapes import refine, refine_in_turn
from rotorstudy.diagnosis.search.trials import best_of_each_shape
from rotorstudy.inference.fit import fit

log = logging.getLogger(__name__)

REFINED = 2  # explanations whose shape is refined
ROUNDS = 3  # of exchanges at the motion of the best few explanations
FEW = 3  # of these
COMPARED = 4  # most explanations that are compared without an error, and as many by a crack and another cause


def without_error(settled: Search) -> Search:
    """The search without an error of causes, where only that error makes its best explanation fit.

    settled : with the error that its best explanation needs
    returns : the one given, where several causes without an error do not explain the records either
    """
    best, error = settled.best, settled.cause_error
    is_one = len(best.faults) == 1
    is_allowed = error < settled.settings.cause_error if is_one else error == 0 and not _is_rejected(settled, best)
    is_comparison = settled.rig.before is not None  # whose few data two causes without an error explain too easily
    if not best.causes or is_comparison:
        return settled
    if is_allowed:
        return settled if is_one else _exchanged_once(settled, best)
    log.info("comparing several causes without an error of their form")
    base = fit(settled.model, settled.stated, settled.prior, start=settled.base.theta)
    exact = replace(settled, spectrum=settled.stated, base=base, found={}, equations={}, cause_error=0.0)
    exact.found[frozenset()] = Explanation((), base, 0.0)
    tried = best_of_each_shape(e for e in settled.explanations if e.causes)[:COMPARED]
    if error >= settled.settings.cause_error:
        tried += best_of_each_shape(_refined(settled, with_a_crack(settled, best)))[:COMPARED]
    found = [exact.explain(e.causes, [e.fit.theta]) for e in tried]
    found = [refine_in_turn(exact, e) for e in best_of_each_shape(e for e in found if e)[:REFINED]]
    if not found:
        return settled
    current = max(found, key=odds_of)
    if _is_rejected(exact, current):
        current = max([current, *with_causes_beside_a_force(exact, current)], key=odds_of)
    if _is_rejected(exact, current):
        current = max([current, *with_others_beside_a_crack(exact, current)], key=odds_of)
    if _is_rejected(exact, current) and not _is_rejected(settled, best):  # else its motion is wrong
        current = _exchanged_at_motion(exact, [current, *_taken_out(exact, current)])
    if _is_rejected(exact, current):
        return settled
    with_alternatives(exact, refine_in_turn(exact, current))
    return exact


def _exchanged_once(work, best):
    """The search with exchanges of each of several causes that explain the records, found under a larger error."""
    better = max(exchanged(work, best), key=odds_of, default=best)
    if odds_of(better) > odds_of(best):
        with_alternatives(work, better)
    return work


def _is_rejected(work, explanation):
    return explanation.fit.is_rejected(work.settings.significance)


def _exchanged_at_motion(work, found):
    """The best explanation after exchanges of each cause of the best few, as long as none explains the records."""
    done = set()
    for _ in range(ROUNDS):
        found = best_of_each_shape(found)
        few = [e for e in found[:FEW] if e.named not in done]
        if not few or not _is_rejected(work, found[0]):
            break
        done |= {e.named for e in few}
        tried = best_of_each_shape(e for known in few for e in exchanged(work, known))
        found += [*tried, *(refine(work, e, again=False) for e in tried[:REFINED])]
    return max(found, key=odds_of)


def _taken_out(work, current):
    """Explanations with one more cause, and with any other in the place of each, in every shape.

    The other causes keep their values while all are tried, as they would imitate one that is missing. Where these are
    wrong, what is left shows at values fitted without it.
    """
    tried = with_one_more(work, current)
    for cause in current.causes:
        rest = tuple(c for c in current.causes if c is not cause)
        without = work.explain(rest)
        if without:
            held = work.held(rest, current.fit.values)
            tried += with_one_more(work, without, [held, without.fit], values=held) if held else []
    return _refined(work, tried)


def _refined(work, tried):
    """Explanations, and the best of them in better shapes of their last cause."""
    shaped = best_of_each_shape(e for e in tried if e.causes[-1].shape)[:REFINED]
    return [*tried, *(refine(work, e) for e in shaped)]
