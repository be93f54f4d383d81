"""The shape of a cause whose form is not known: its median, standard deviations and 95 % intervals over all forms.

The depth of a crack, its position and the shape of its front trade off along a curved sheet, of which the covariance of
a fit is only the tangent: near a bearing the moment grows in proportion to the distance, and the depth with a power of
it. A crack on the other side of midspan may explain as much. So form and position are held at values over all their
ranges, and the rest of the shape is fitted there with all amplitudes. So it is by the law of the library and by any
near it, as far as the records tell them apart. How near is not known: a law taken as exact would place a crack of
another one wrongly, and one that may be anything is too improbable beside it.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.one_cause.stated import stated_numbers
from rotorstudy.diagnosis.search import candidates
from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.held_shapes import CLOSER, UNLIKELY, HeldShapes, Shapes, halfway, slopes_of
from rotorstudy.diagnosis.search.screening import Projection
from rotorstudy.diagnosis.search.shape_fit import Work, at_numbers, ranges_of
from rotorstudy.diagnosis.search.shape_scan import AtOwnMotions
from rotorstudy.inference.fit import Fit
from rotorstudy.model.registry import registry

FORMS = (0.25, 0.5, 0.75, 0.0, 1.0)  # fractions of the range of the form that are held, beside that of the fit
PLACES = 20  # of the position, evenly over the shaft
ABOUT = 1.5 * np.arange(-4, 5)  # further positions about the one that was fitted, in its standard deviations
FEWEST = 3  # likely values that a distribution needs
FINE = 100  # of the weights between values held, and levels of a distribution
LEVELS = 9  # of each normal distribution of a mixture
INTERVAL = (0.025, 0.5, 0.975)


def in_form(work: Work, cause: Candidate, spread: float = 0.0) -> Candidate:
    """A cause by its law, in the middle of its forms where it has any.

    spread : of the freedom of `Effect.any_form` that it has, too, times the standard deviations there
    """
    form, freedoms = {name: ends.value(0.5) for name, ends in candidates.form_ranges(cause.effect).items()}, ()
    if form:
        freedoms = candidates.freedoms_of(cause.effect, any_form=False)
    if form and spread:
        options, every, _ = registry().get("effect", cause.effect).any_form
        own = freedoms[0].amplitudes
        law = {n: (mean, max(spread * std, own.get(n, (mean, 0.0))[1])) for n, (mean, std) in every.items()}
        freedoms += (candidates.Freedom(options, law),)
    given = cause.term.label, work.settings.prior_width, cause.variant, freedoms
    return candidates.candidate(work.rig, cause.effect, cause.where, cause.shape | form, *given)


def laws_of(work: Work, cause: Candidate) -> list[Candidate]:
    """A cause in the middle of its forms by its own law and, where it may have any near it, by these."""
    near = candidates.variants_of(registry().get("effect", cause.effect).any_form[2])
    return [in_form(work, cause, one) for one in (candidates.SPREADS if cause.variant in near else (0.0,))]


class OverForms(NamedTuple):
    """The cause with medians and standard deviations over all forms."""

    cause: Candidate
    stated: dict[str, tuple[float, float]]  # name of a stated number -> median and standard deviation of it
    intervals: dict[str, tuple[float, float]]  # option or stated number -> ends of its 95 % interval
    cost: float  # misfit and penalty of the most probable law, where it explains most
    # amplitudes (unknown,) and cost by the law of the cause itself; None if it can act nowhere
    by_own_law: tuple[np.ndarray, float] | None
    log_evidence: float  # mean over the laws, of all forms


class _Weighted(NamedTuple):
    """A law with its evidence, (row, level) values of each option over all forms, and (row,) weights of these."""

    law: Candidate
    known: dict[float, Shapes]  # form -> in which it was fitted
    amplitudes: np.ndarray  # where it explains most
    cost: float  # there
    log_evidence: float = -np.inf  # of one that explains too little, which has no values
    values: dict[str, np.ndarray] = {}  # of each option and of each number that the effect states
    weight: np.ndarray | None = None


def over_forms(
    work: Work, fitted: Fit, cause: Candidate, laws: Sequence[Candidate], others: Sequence[Candidate] = ()
) -> OverForms | None:
    """A cause over all its forms by some laws, which are weighted by their evidence.

    fitted  : Fit with the cause, at whose motion it is judged;  cause, others : the causes in their shapes there
    laws    : as `laws_of` returns them
    returns : None if form and position of the cause are not both free, or no law explains the records
    """
    form = [name for name in candidates.form_ranges(cause.effect) if name in laws[0].shape]
    place = [name for name in cause.shape if name.startswith("position")]
    if len(form) != 1 or len(place) != 1:
        return None
    work = at_numbers(work, fitted.free)
    slopes = slopes_of(work, fitted, others, cause.names)
    projection = Projection(fitted, work.spectrum, cause.names, slopes, answers=False)
    ranges = ranges_of(work, laws[0])  # as of all laws
    judge = AtOwnMotions(projection, work.rig.structure, projection.motions_elsewhere, {})
    shapes = HeldShapes(work, judge, laws[0], ranges, tuple(list(ranges).index(name) for name in (*form, *place)))
    starts = shapes.searched(_places(cause, laws[0], ranges, *place))
    every = []
    for law in reversed(laws):  # the one with most freedom first, beside which the others may be unlikely everywhere
        wider = every[-1] if every else None
        other = -2 * wider.log_evidence if wider else np.inf  # a law that leaves as much has less evidence
        one = _weighted(shapes._replace(law=law, other=other), starts, wider)
        every += [one] if one else []
    found = [one for one in every if one.weight is not None]
    if not found:
        return None
    best = max(found, key=lambda one: one.log_evidence)
    weight = np.concatenate([one.weight * np.exp(one.log_evidence - best.log_evidence) for one in found])
    shape, spread, intervals = {}, {}, {}
    for key in best.values:
        drawn = np.concatenate([one.values[key] for one in found])
        low, shape[key], high = _quantiles(drawn, weight)
        spread[key] = float(np.sqrt(np.average((drawn - shape[key]) ** 2, weights=weight, axis=0).mean()))
        intervals[key] = low, high
    own = next(((one.amplitudes, one.cost) for one in every if one.law is laws[0]), None)
    stated = {key: (shape.pop(key), spread.pop(key)) for key in [*shape] if key not in ranges}
    cause = laws[0]._replace(shape=shape, shape_std=spread)
    whole = np.logaddexp.reduce([one.log_evidence for one in every]) - np.log(len(laws))
    return OverForms(cause, stated, intervals, best.cost, own, float(whole))


def _weighted(shapes, starts, wider=None):
    """The _Weighted of the law of some HeldShapes; None if it can act nowhere.

    It begins with points (row, option) of the first form, or the likely shapes of a law with more freedom.
    """
    at, along = shapes.held
    begun, known = (wider.known if wider else {}), {}
    wanted = [starts[0, at], *(x for x in FORMS if x != starts[0, at])]
    for _ in range(1 + CLOSER):
        for x in wanted:
            near = begun.get(x) or (known and known[min(known, key=lambda other, x=x: abs(other - x))])
            start = [starts]
            if near:
                likely = likely_of(near, along)
                start = [np.concatenate(both) for both in zip(likely[:2], beyond(likely, along), strict=True)]
                start[0][:, at] = x
            known[x] = shapes.over_places(*start)
        forms = np.sort(list(known))
        wanted = halfway(forms, np.array([known[x].cost.min(initial=np.inf) for x in forms]), shapes.other)[0]
    best = min(known.values(), key=lambda one: one.cost.min(initial=np.inf))
    if not len(best.cost):
        return None
    best = best.part([np.argmin(best.cost)])
    least = min(float(best.cost[0]), shapes.other)
    likely = [x for x, one in sorted(known.items()) if np.sum(one.cost < least + UNLIKELY) >= FEWEST]
    if len(likely) < FEWEST:
        best = shapes._replace(other=np.inf).fitted(best.points)
        return _Weighted(shapes.law, known, best.amplitudes[0], float(best.cost[0]))
    rows = {}
    for x in likely:
        stated = _stated(shapes, known[x], least)
        rows[x] = _distribution(known[x], along, [*stated.values()])
    whole, values, weight = _mixture(rows, shapes.ranges, shapes.held, [*stated])
    evidence = whole + float(best.log_volume[0])
    return _Weighted(shapes.law, known, best.amplitudes[0], float(best.cost[0]), evidence, values, weight)


def likely_of(near, along):
    """The likely Shapes of a form, along the position."""
    near = near.part(near.cost < near.cost.min(initial=np.inf) + 2 * UNLIKELY)
    return near.part(np.argsort(near.points[:, along]))


def beyond(near, along):
    """Points beyond the ends of each stretch of Shapes along the position, up to its own length; their amplitudes."""
    points, amplitudes = [near.points[:0]], [near.amplitudes[:0]]
    gaps = np.flatnonzero(np.diff(near.points[:, along]) > 1.5 / PLACES) + 1
    for rows in (one for one in np.split(np.arange(len(near.cost)), gaps) if len(one) > 1):
        reach = np.ptp(near.points[rows, along]) * np.array([0.25, 0.5, 1.0])
        for end, way in ((rows[0], -1), (rows[-1], 1)):
            x = near.points[end, along] + way * reach
            x = x[(x > 0) & (x < 1)]
            points.append(np.tile(near.points[end], (len(x), 1)))
            points[-1][:, along] = x
            amplitudes.append(np.tile(near.amplitudes[end], (len(x), 1)))
    return np.concatenate(points), np.concatenate(amplitudes)


def _places(cause, law, ranges, place):
    """Points (row, option) in the shape of a cause by a law, at positions over the shaft and about its own."""
    point = np.array([ends.fraction((law.shape | cause.shape)[name]) for name, ends in ranges.items()])
    along, ends = list(ranges).index(place), ranges[place]
    std = cause.shape_std.get(place, 0.0) / (ends.high - ends.low)
    x = np.concatenate([(np.arange(PLACES) + 0.5) / PLACES, point[along] + std * ABOUT])
    points = np.tile(point, (len(x), 1))
    points[:, along] = x
    return points[(x > 0) & (x < 1)]


def _stated(shapes, there, least):
    """Stated number -> (2, row) its logarithm and the variance of that; of unlikely rows as of those beside them."""
    along, scale, found = shapes.held[1], np.ones(there.covariance.shape[1]), {}
    likely = np.flatnonzero(there.cost < least + UNLIKELY)
    likely = likely[np.argsort(there.points[likely, along])]
    for row, cause in zip(likely, shapes.reshaped(there.points[likely])[0], strict=True):
        slopes = [ends.slope(cause.shape[name]) for name, ends in shapes.ranges.items()]
        scale[: len(slopes)] = slopes
        covariance = there.covariance[row] * np.outer(scale, scale)
        known = stated_numbers(shapes.work.rig.structure, cause, there.amplitudes[row], covariance)
        for name, (value, std) in known.items():
            found.setdefault(name, []).append((np.log(value), (std / value) ** 2))
    at = there.points[:, along]
    return {name: [np.interp(at, at[likely], x) for x in zip(*rows, strict=True)] for name, rows in found.items()}


def _distribution(there, along, stated):
    """Along the position: (level, number and its log variance) of options and stated numbers, and the log evidence.

    The posterior volume of amplitudes, depth and angle is taken to be the same everywhere: fits at nine places of a
    shaft agree to 1.4 in its logarithm, while at a motion that is held it changes by 7 within an element.
    """
    from scipy.interpolate import PchipInterpolator

    held, first = np.unique(there.points[:, along].round(9), return_index=True)
    values = np.column_stack([there.points, *(value for value, _ in stated)])
    options = np.diagonal(there.covariance, axis1=1, axis2=2)[:, : there.points.shape[1]]
    variances = np.column_stack([options, *(variance for _, variance in stated)])
    spread = np.log(np.where(variances > 0, variances, 1.0))
    rows = np.column_stack([values, spread, there.cost / 2])[first]
    curve = PchipInterpolator(held, rows)  # no overshoot where the misfit rises steeply
    x = np.unique(np.concatenate([np.linspace(a, b, 16) for a, b in pairwise(held)]))
    energy = curve(x)[:, -1]
    weight = np.exp(energy.min() - energy) * np.gradient(x)
    below = np.cumsum(weight) - weight / 2
    at = np.interp((np.arange(FINE) + 0.5) / FINE * weight.sum(), below, x)
    return curve(at)[:, :-1], np.log(weight.sum()) - energy.min()


def _mixture(rows, ranges, held, stated):
    """Log evidence, values and weights of a law from rows: fraction of the form -> what `_distribution` gives."""
    from scipy.interpolate import PchipInterpolator
    from scipy.special import ndtri

    forms = np.array(list(rows))
    x = np.linspace(forms[0], forms[-1], FINE)
    evidence = PchipInterpolator(forms, [one for _, one in rows.values()])(x)
    weight = np.exp(evidence - evidence.max())
    parts = PchipInterpolator(forms, [one for one, _ in rows.values()])(x).reshape(FINE * FINE, -1)
    levels = ndtri((np.arange(LEVELS) + 0.5) / LEVELS)
    drawn, count = {}, len(ranges) + len(stated)
    for i, key in enumerate([*ranges, *stated]):
        std = 0.0 * parts[:, i] if i in held else np.exp(parts[:, count + i] / 2)
        values = parts[:, i, None] + np.multiply.outer(std, levels)
        drawn[key] = _values(ranges[key], values) if key in ranges else np.exp(values)
    whole = evidence.max() + np.log(weight.sum() * (x[1] - x[0]))
    return whole, drawn, np.repeat(weight, FINE) / (weight.sum() * FINE)


def _values(ends, fractions):
    """Values at fractions of a range, those beyond its ends at them; of angles without going around."""
    if not ends.goes_around:
        fractions = np.clip(fractions, 0.0, 1.0)
    if ends.low > 0:
        return ends.low * (ends.high / ends.low) ** fractions
    return ends.low + fractions * (ends.high - ends.low)


def _quantiles(values, weight):
    """Those at `INTERVAL` of values (row, draw) with weights (row,)."""
    order = np.argsort(values, axis=None)
    share = np.cumsum(np.repeat(weight, values.shape[1])[order])
    return [float(one) for one in np.interp(np.array(INTERVAL) * share[-1], share, values.ravel()[order])]
