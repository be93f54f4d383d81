"""The shape options of a cause (a clearance) refined by Gauss-Newton steps, together with all amplitudes."""

import numpy as np

from rotorstudy.diagnosis.candidates import shape_ranges, with_shape
from rotorstudy.diagnosis.explanations import Search, shape_equations
from rotorstudy.diagnosis.odds import Explanation, odds_of
from rotorstudy.diagnosis.shape_scan import can_be_scanned, scan
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.linear import invert

RESCANS = 4  # of the shape of a cause, each at its last fit
SHAPE_STEPS = 8  # of the shape options of a cause
SHAPE_GAIN = 0.25  # convergence tolerance of the shape, in log posterior odds
SHARES_OF_STEP = (1.0, 0.3, 0.1)


def refine(work: Search, explanation: Explanation) -> Explanation:
    """The explanation with the best shape of its last cause; unchanged if that shape cannot be varied.

    Parameters
    ----------
    work : Search
    explanation : Explanation

    Returns
    -------
    Explanation
    """
    try:
        return _best_of_all_shapes(work, explanation)
    except NoSteadyState:
        return explanation
    except Exception as error:
        work.note_broken(explanation.causes, error)
        return explanation


def _best_of_all_shapes(work, explanation):
    """The explanation with the shape options of its last cause optimised by Gauss-Newton steps.

    Options are scaled to their range. The linearised columns of a contact depend strongly on its shape and may select a
    wrong one: where more than noise is left, all shapes are tried first.
    """
    explanation = _best_shape(work, explanation)
    *rest, last = explanation.causes
    ranges = shape_ranges(last.effect, work.rig.structure, last.where.get("node"))

    def explain(point, theta):
        shape = {name: ranges[name].value(x) for name, x in zip(ranges, point, strict=True)}
        moved = with_shape(work.rig, last, shape, work.settings.prior_width)
        return work.explain((*rest, moved), [theta])

    best = explanation
    point = [ranges[name].fraction(last.shape[name]) if name in last.shape else 0.5 for name in ranges]
    if ranges and set(ranges) != set(last.shape):
        best = explain(point, best.fit.theta) or best
    for _ in range(SHAPE_STEPS if set(ranges) == set(best.causes[-1].shape) and ranges else 0):
        normal, right = shape_equations(work, best.causes, best.fit, best.causes[-1])
        step, moved = np.split(invert(normal) @ right, [len(right) - len(ranges)])
        tried = None
        for share in SHARES_OF_STEP:
            ahead = [
                ends.fraction(ends.value(x)) for ends, x in zip(ranges.values(), point + share * moved, strict=True)
            ]
            theta = best.fit.theta.copy()
            theta[best.fit.model.position(best.fit.names)] += share * step
            tried = explain(ahead, theta)
            if tried and odds_of(tried) > odds_of(best):
                break
        if not tried or odds_of(tried) <= odds_of(best):
            break
        gained, best, point = odds_of(tried) - odds_of(best), tried, ahead
        if gained < SHAPE_GAIN:
            break
    return max(best, explanation, key=odds_of)


def _best_shape(work, explanation):
    """The explanation with the last cause in the best of the shapes tried."""
    *rest, last = explanation.causes
    if not last.shape or explanation.fit.cost < len(explanation.fit.residual):
        return explanation
    if can_be_scanned(last):
        return _rescanned(work, explanation)
    looked = []
    for cause in _shapes_worth_a_fit(work, rest, last):
        fitted = work.trial_fit((*rest, cause))
        looked += [(fitted.cost, (*rest, cause), fitted.theta)] if fitted else []
    if not looked:
        return explanation
    _, causes, theta = min(looked, key=lambda one: one[0])
    return max(explanation, work.explain(causes, [theta]) or explanation, key=odds_of)


def _rescanned(work, explanation):
    """The explanation with the shape of its last cause scanned at its own fit, as long as that improves it."""
    for _ in range(RESCANS):
        *rest, last = explanation.causes
        scanned = scan(work, work.held(rest, explanation.fit), [last])
        if not scanned:
            break
        ((cause, screened),) = scanned
        own = dict(zip(explanation.fit.model.names, explanation.fit.theta, strict=True))
        start = work.start((*rest, cause), own | dict(zip(cause.names, screened.start, strict=True)))
        tried = work.explain((*rest, cause), [start])
        if not tried or odds_of(tried) <= odds_of(explanation):
            break
        gained, explanation = odds_of(tried) - odds_of(explanation), tried
        if gained < SHAPE_GAIN:
            break
    return explanation


def _shapes_worth_a_fit(work, rest, last):
    """The shapes of a cause: all of them, or of each alternative (where it has some) the best when linearised."""
    same = [cause for cause in work.candidates if cause.cause == last.cause]
    if not last.variant:
        return same
    best = {}
    for cause, screened in zip(same, work.screen(work.before((*rest, last)), same), strict=True):
        best.setdefault(tuple(cause.variant.values()), []).append((screened.evidence, cause.label, cause))
    return [max(shapes, key=lambda one: one[:2])[-1] for shapes in best.values()]
