"""The shape options of a cause (a clearance) refined by Gauss-Newton steps, together with all amplitudes."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import with_shape
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.shape_equations import shape_equations
from rotorstudy.diagnosis.search.shape_fit import fitted_from, ranges_of
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, is_sought_everywhere, scan
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.inference.linear import invert

RESCANS = 4  # of the shape of a cause, each at its last fit
SHAPE_STEPS = 8  # of the shape options of a cause
SHAPE_GAIN = 0.25  # convergence tolerance of the shape, in log posterior odds
SHARES_OF_STEP = (1.0, 0.3, 0.1)


def refine(work: Search, explanation: Explanation, name: str | None = None, again: bool = True) -> Explanation:
    """The explanation with the best shape of one of its causes; unchanged if that shape cannot be varied.

    name  : of the cause (`Candidate.cause`); by default the last one
    again : whether all shapes are tried again where more than noise is left
    """
    name = name or explanation.causes[-1].cause
    try:
        if not can_be_scanned(_apart(explanation, name)[1]):
            return _stepped(work, _best_shape(work, explanation, name), name)
        stepped = _stepped(work, explanation, name)  # from the shape that a scan has found
        stepped = _from_stated_values(work, stepped)
        best = _best_shape(work, stepped, name) if again else stepped
        return best if best is stepped else _stepped(work, best, name)
    except NoSteadyState:
        return explanation
    except Exception as error:
        work.note_broken(explanation.causes, error)
        return explanation


def refine_in_turn(work: Search, explanation: Explanation, again: bool = True) -> Explanation:
    """The explanation with the shape of each of its causes refined, once more if that of another has changed since.

    again : as for `refine`
    """
    shaped = [cause.cause for cause in explanation.causes if cause.shape]
    due = shaped
    while due:
        (name, *due), before = due, odds_of(explanation)
        explanation = refine(work, explanation, name, again)
        if odds_of(explanation) - before >= SHAPE_GAIN:
            due = [other for other in shaped if other != name]
    return explanation


def _apart(explanation, name):
    """The other causes of an explanation, and the one of a name."""
    (one,) = (cause for cause in explanation.causes if cause.cause == name)
    return tuple(cause for cause in explanation.causes if cause is not one), one


def _stepped(work, explanation, name):
    """The explanation with the shape options of a cause, scaled to their ranges, optimised by Gauss-Newton steps."""
    rest, own = _apart(explanation, name)
    ranges = ranges_of(work, own)

    def explain(point, values):
        shape = {option: ranges[option].value(x) for option, x in zip(ranges, point, strict=True)}
        try:
            moved = (*rest, with_shape(work.rig, own, shape, work.settings.prior_width))
        except CannotAct:  # such as a crack at a disc
            return None
        return work.explain(moved, [work.start(moved, values)])

    best = explanation
    point = [ranges[option].fraction(own.shape[option]) if option in own.shape else 0.5 for option in ranges]
    if ranges and set(ranges) != set(own.shape):
        best = explain(point, best.fit.values) or best
    for _ in range(SHAPE_STEPS if set(ranges) == set(_apart(best, name)[1].shape) and ranges else 0):
        normal, right = shape_equations(work, best.causes, best.fit, _apart(best, name)[1])
        step, moved = np.split(invert(normal) @ right, [len(right) - len(ranges)])
        tried = None
        for share in SHARES_OF_STEP:
            ahead = [
                ends.fraction(ends.value(x)) for ends, x in zip(ranges.values(), point + share * moved, strict=True)
            ]
            changed = dict(zip(best.fit.names, (best.fit.free + share * step).tolist(), strict=True))
            tried = explain(ahead, best.fit.values | changed)
            if tried and odds_of(tried) > odds_of(best):
                break
        if not tried or odds_of(tried) <= odds_of(best):
            break
        gained, best, point = odds_of(tried) - odds_of(best), tried, ahead
        if gained < SHAPE_GAIN:
            break
    return max(best, explanation, key=odds_of)


def _from_stated_values(work, explanation):
    """The explanation by one cause, fitted again from the stated values of the rig where it leaves more than noise.

    At the values that were fitted with a wrong shape the rig imitates what that lacks, and no step leads away from it.
    """
    (cause, *others), fitted = explanation.causes, explanation.fit
    if others or not is_sought_everywhere(cause) or not fitted.excess:
        return explanation
    values = dict(zip(work.prior.names, work.prior.mean, strict=True))
    amplitudes = np.array([values.get(name, fitted.values[name]) for name in fitted.names])
    try:
        found = fitted_from(work, explanation.causes, amplitudes, HYPOTHESIS)
    except (CannotAct, NoSteadyState, NoConvergenceError):
        return explanation
    known = dict(zip((*work.prior.names, *found.causes[0].names), found.amplitudes.tolist(), strict=True))
    tried = work.explain(found.causes, [work.start(found.causes, fitted.values | known)])
    return max(explanation, tried or explanation, key=odds_of)


def _best_shape(work, explanation, name):
    """The explanation with a cause in the best of all shapes tried, where more than noise is left.

    The linearised columns of a contact depend strongly on its shape and may select a wrong one.
    """
    rest, own = _apart(explanation, name)
    if not own.shape or explanation.fit.cost < len(explanation.fit.residual):
        return explanation
    if can_be_scanned(own):
        return _rescanned(work, explanation, name)
    looked = []
    for cause in _shapes_worth_a_fit(work, rest, own):
        fitted = work.trial_fit((*rest, cause))
        looked += [(fitted.cost, (*rest, cause), fitted.theta)] if fitted else []
    if not looked:
        return explanation
    _, causes, theta = min(looked, key=lambda one: one[0])
    return max(explanation, work.explain(causes, [theta]) or explanation, key=odds_of)


def _rescanned(work, explanation, name):
    """The explanation with the shape of a cause scanned at its own fit, as long as that improves it."""
    for _ in range(RESCANS):
        rest, own = _apart(explanation, name)
        held = work.held(rest, explanation.fit.values)
        scanned = scan(work, held, [own]) if held else []
        if not scanned:
            break
        cause, screened = scanned[0]
        causes = (*rest, cause)
        start = work.start(causes, explanation.fit.values | dict(zip(cause.names, screened.start, strict=True)))
        tried = work.explain(causes, [start])
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
