"""Sets of causes worth a fit, fitted in two stages: a few steps each, then the closest ones to convergence."""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, is_sought_everywhere

FITTED_FULLY = 4  # least number of explanations per round that are fitted to convergence
CLOSE = 15.0  # excess over the lowest cost of a round (likelihood ratio e^-7.5) beyond which a fit is not finished
REACH = 10.0  # log odds below the best, at its motion, beyond which an alternative cannot change a probability
LEFT_BY_SHAPE = 0.05  # of what a cause explains, left if its shape is half a step of those tried away from the true one


class Option(NamedTuple):
    """A set of causes worth a fit, with values of parameters by name to start from."""

    causes: tuple[Candidate, ...]
    start: dict[str, float]


class Trial(NamedTuple):
    """An Option after a few steps of its fit: the cost there, and where to start the fit to convergence."""

    cost: float
    causes: tuple[Candidate, ...]
    starts: list[np.ndarray]


def fit_closest(work, options, from_stated=False, before=0.0):
    """Explanations by options whose cost after a trial fit is close to the lowest, and by cracks that explain much.

    from_stated : whether the trial starts from the stated values, but for causes whose shape was scanned
    before      : cost of the explanation that the options extend
    """
    return closest(work, trials(work, options, from_stated), before)


def trials(work, options, from_stated=False) -> list[Trial]:
    """A Trial of each option whose fit succeeds; arguments as for `fit_closest`."""
    found = []
    for causes, start in options:
        start = work.start(causes, start)
        is_stated = from_stated and not can_be_scanned(causes[-1])
        fitted = work.trial_fit(causes, None if is_stated else start)
        if fitted:  # from the start of a trial that has converged a fit would end where the trial did
            starts = [fitted.theta] if fitted.converged and not is_stated else [fitted.theta, start]
            found.append(Trial(fitted.cost, causes, starts))
    return found


def closest(work, tried: list[Trial], before=0.0):
    """Explanations by the trials of least cost, fitted to convergence; see `fit_closest`."""
    least = min((one.cost for one in tried), default=0.0)
    found = []
    for rank, (cost, causes, starts) in enumerate(sorted(tried, key=lambda one: one.cost)):
        is_crack = is_sought_everywhere(causes[-1]) and explains_much(cost, least, before)
        if rank < FITTED_FULLY or cost <= least + CLOSE or is_crack:
            found.append(work.explain(causes, starts))
    return [e for e in found if e]


def may_be_left(best, before):
    """Cost that an explanation may leave to first order, if it is to compare with one that explains the records.

    before : cost of the explanation that both extend
    """
    return best.fit.cost + max(CLOSE, LEFT_BY_SHAPE * (before - best.fit.cost))


def labels(causes):
    """Labels of causes, in order."""
    return tuple(cause.label for cause in causes)


def explains_much(cost, least, before):
    """Whether a cost has come down by half as much as the least one, from what it was before."""
    return cost <= 0.5 * (least + before)


def law_and_side(cause):
    """Alternatives of a cause, and the quadrants of its angles: steps of its shape do not lead from one to another."""
    return *cause.variant.values(), *(v // (np.pi / 2) for name, v in cause.shape.items() if name.endswith("_rad"))


def best_of_each_shape(explanations):
    """Explanations, the best first; of the same causes with the same laws on the same sides, the best alone."""
    best = {}
    for e in sorted(explanations, key=odds_of, reverse=True):
        best.setdefault(frozenset((c.cause, law_and_side(c)) for c in e.causes), e)
    return list(best.values())
