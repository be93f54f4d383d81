"""Other effects that the records exclude: the odds against each, and the harmonic at which its best fit fails most."""

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.verdict.result import Excluded, Place

MOST = 4
WORSE = 4.0  # mean square (standard deviations) beyond that of the verdict, by which a harmonic excludes: two of them


def excluded(found: Search, best: Explanation, stated: list[str]) -> list[Excluded]:
    """The most probable explanations by other effects than those named, one for each effect.

    best    : the one that is named
    stated  : effects that cannot be ruled out beside it
    returns : the most probable one first
    """
    known, rows = {*stated, *(cause.effect for cause in best.causes)}, {}
    for one in sorted(found.explanations, key=odds_of, reverse=True):
        others = [cause for cause in one.causes if cause.effect not in known]
        if len(others) == 1 and len(one.causes) <= len(best.causes):
            rows.setdefault(others[0].effect, _row(found, best, one, others[0]))
    return list(rows.values())[:MOST]


def _row(found, best, one, other):
    """The Excluded of one cause of an explanation."""
    squares = [found.spectrum.by_harmonic(e.fit.residual) ** 2 for e in (one, best)]  # (speed, harmonic, node)
    worse = (squares[0] - squares[1]).mean(axis=0)
    h, s = np.unravel_index(np.argmax(worse), worse.shape)
    fails = worse[h, s] >= WORSE
    return Excluded(
        cause=Place(effect=other.effect, where=other.where, label=found.model.structure.label_at(other.where)),
        log_odds=odds_of(best) - odds_of(one),
        harmonic=int(found.spectrum.harmonics[h]) if fails else None,
        node=int(found.spectrum.sensors[s]) if fails else None,
        sigma=float(np.sqrt(squares[0][:, h, s].mean())) if fails else None,
    )
