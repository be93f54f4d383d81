"""The shape of a cause whose form is not known: its median, standard deviations and 95 % intervals over all forms.

The depth of a crack, its position and the shape of its front trade off along a curved sheet, of which the covariance of
a fit is only the tangent: near a bearing the moment grows in proportion to the distance, and the depth with a power of
it. Form and position are held at values about the best ones, all else is fitted, and the fits are weighted.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, candidate, form_ranges
from rotorstudy.diagnosis.search.shape_fit import Fitted, Work, fitted_from, ranges_of
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.model.rig_items import with_options

ROUGHLY = replace(HYPOTHESIS, step_in_sigma=0.05)  # of a misfit that the next step would lower by 0.0025
STEP = 1.5  # standard deviations from one value held to the next
LONGEST = {"form": 0.25, "position": 0.1}  # step, of the range
UNLIKELY = 8.0  # misfit above that of the best, beyond which a shape has no weight
MOST = 12  # values held on one side
FEWEST = 3  # values held that describe a weight
FINE = 100  # of the weights between them, and levels of a distribution
LEVELS = 9  # of each normal distribution of a mixture
INTERVAL = (0.025, 0.5, 0.975)


def in_form(work: Work, cause: Candidate, label: str, variant: dict, is_free: bool) -> Candidate:
    """A cause by a law in its usual form, or in the middle of all its forms, where it has any."""
    form = {name: ends.value(0.5) for name, ends in form_ranges(cause.effect).items()} if is_free else {}
    shape, width = cause.shape | form, work.settings.prior_width
    return candidate(work.rig, cause.effect, cause.where, shape, label, width, variant, bool(form))


class OverForms(NamedTuple):
    """The cause with medians and standard deviations over all forms, and option -> ends of its 95 % interval."""

    cause: Candidate
    intervals: dict[str, tuple[float, float]]


def over_forms(work: Work, best: Fitted) -> OverForms | None:
    """The last cause of a fit over all forms; None if its form is not free, or its position is not."""
    cause = best.causes[-1]
    form = [name for name in form_ranges(cause.effect) if name in cause.shape]
    place = [name for name in cause.shape if name.startswith("position")]
    if len(form) != 1 or len(place) != 1:
        return None
    ranges = ranges_of(work, cause)
    least, rows = np.inf, {}
    for x, one in _held_along(work, best, *form, ranges, LONGEST["form"], least).items():
        along = _held_along(work, one, *place, ranges, LONGEST["position"], least)
        least = min([least, *(there.cost for there in along.values())])
        if len(along) >= FEWEST:
            rows[x] = _distribution(cause, along, ranges)
    return _mixture(cause, rows, *place, *form, ranges) if len(rows) >= FEWEST else None


def _held_along(work, start, name, ranges, longest, least):
    """Fraction of the range of an option -> Fitted with it held there, on both sides of a fit as far as is likely."""
    cause, ends = start.causes[-1], ranges[name]
    middle = ends.fraction(cause.shape[name])
    place = list(cause.shape).index(name) - len(cause.shape)
    step = min(STEP * np.sqrt(start.covariance[place, place]), longest)
    found = {middle: held_at(work, start, name, cause.shape[name])}
    least = min(least, found[middle].cost) if found[middle] else least
    for way in (-step, step):
        x, last = middle, found[middle] or start
        for _ in range(MOST):
            if not 0 < x < 1:
                break
            x = min(max(x + way, 0.0), 1.0)
            one = held_at(work, last, name, ends.value(x))
            if one is None or not one.minimum.converged[0]:  # such as a crack at a disc
                continue
            if _at_an_end(one, ranges):  # beyond which it cannot be
                break
            found[x] = last = one
            least = min(least, one.cost)
            if one.cost > least + UNLIKELY:
                break
    return {x: one for x, one in sorted(found.items()) if one}


def held_at(work, fitted, name, value):
    """The fit with an option of its cause held at a value; None where there is none."""
    *others, cause = fitted.causes
    shape = {key: x for key, x in cause.shape.items() if key != name}
    try:
        term = with_options(cause.term, {name: value}, work.rig.structure, work.rig.sensors)
        held = cause._replace(term=term, shape=shape, options=cause.options | {name: value}, held=(name,))
        return fitted_from(work, [*others, held], fitted.amplitudes, ROUGHLY)
    except (CannotAct, NoSteadyState, NoConvergenceError):
        return None


def _at_an_end(fitted, ranges):
    """Whether an option is at an end of its range, where nothing changes with it."""
    shape = fitted.causes[-1].shape
    return any(not 0 < ranges[key].fraction(x) < 1 for key, x in shape.items() if not ranges[key].goes_around)


def _distribution(cause, fits, ranges):
    """The distribution along the position: (level, 1 + 2 * rest) that, the rest of the shape, log variances of it.

    All in fractions of the ranges, from fits at fractions of that of the position; and the logarithm of its evidence.
    """
    from scipy.interpolate import PchipInterpolator

    rest, rows = list(next(iter(fits.values())).causes[-1].shape), []
    for one in fits.values():
        covariance = one.covariance
        values = [ranges[key].fraction(one.causes[-1].shape[key]) for key in rest]
        for i, key in enumerate(rest):
            if ranges[key].goes_around:  # beside the best one
                about = ranges[key].fraction(cause.shape[key])
                values[i] = about + (values[i] - about + 0.5) % 1 - 0.5
        variance = np.diag(covariance)[-len(rest) :]
        rows.append([*values, *np.log(variance), one.cost / 2 - np.linalg.slogdet(covariance)[1] / 2])
    held = np.array(list(fits))
    curve = PchipInterpolator(held, rows)  # no overshoot where the misfit rises steeply
    x = np.linspace(held[0], held[-1], 4 * FINE)
    energy = curve(x)[:, -1]
    weight = np.exp(energy.min() - energy)
    below = np.cumsum(weight) - weight / 2
    at = np.interp((np.arange(FINE) + 0.5) / FINE * weight.sum(), below, x)
    return np.column_stack([at, curve(at)[:, :-1]]), np.log(weight.sum() * (x[1] - x[0])) - energy.min()


def _mixture(cause, rows, place, form, ranges):
    """OverForms of the distributions (fraction of the range of the form -> as `_distribution` returns)."""
    from scipy.interpolate import PchipInterpolator
    from scipy.special import ndtri

    held = np.array(list(rows))
    x = np.linspace(held[0], held[-1], FINE)
    evidence = PchipInterpolator(held, [one for _, one in rows.values()])(x)
    weight = np.repeat(np.exp(evidence - evidence.max()), FINE)
    parts = PchipInterpolator(held, [one for one, _ in rows.values()])(x).reshape(FINE * FINE, -1)
    rest = [key for key in cause.shape if key not in (place, form)]
    values = {place: (parts[:, 0], 0.0), form: (np.repeat(x, FINE), 0.0)}
    for i, key in enumerate(rest, 1):
        values[key] = parts[:, i], np.exp(parts[:, len(rest) + i] / 2)
    levels = ndtri((np.arange(LEVELS) + 0.5) / LEVELS)
    shape, spread, intervals = {}, {}, {}
    for key in cause.shape:
        mean, std = values[key]
        drawn = _values(ranges[key], mean[:, None] + np.multiply.outer(std, levels).reshape(-1, LEVELS))
        low, shape[key], high = _quantiles(drawn, weight)
        spread[key] = float(np.sqrt(np.average((drawn - shape[key]) ** 2, weights=weight, axis=0).mean()))
        intervals[key] = low, high
    return OverForms(cause._replace(shape=shape, shape_std=spread), intervals)


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
