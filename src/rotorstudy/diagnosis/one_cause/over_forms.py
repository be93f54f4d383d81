"""The shape of a cause whose form is not known: the mean and the standard deviations over all forms.

The depth of a crack and the shape of its front trade off along a curve, of which the covariance of a fit is only the
tangent. The form is held at values about the best one, all else is fitted, and the fits are weighted.
"""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, form_ranges
from rotorstudy.diagnosis.search.shape_fit import Fitted, Work, fitted_from, ranges_of
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.model.rig_items import with_options

REACH = 4.0  # standard deviations of the form to either side of the best
HELD = 5  # values on either side at which it is held
UNLIKELY = 30.0  # misfit above that of the best, beyond which a form has no weight
FINE = 400  # of the weights between them


def over_forms(work: Work, best: Fitted) -> Candidate | None:
    """The one cause of a fit with the mean of its shape and its standard deviations; None if its form is not free."""
    cause = best.causes[0]
    names = [name for name in form_ranges(cause.effect) if name in cause.shape]
    if len(best.causes) > 1 or len(names) != 1:
        return None
    (name,), ranges = names, ranges_of(work, cause)
    middle = ranges[name].fraction(cause.shape[name])
    spread = np.sqrt(best.covariance[-1, -1])
    low, high = max(0.0, middle - REACH * spread), min(1.0, middle + REACH * spread)
    fits = {middle: _held(work, cause, best.amplitudes, name, cause.shape[name])}
    for end in (low, high):
        start = fits[middle]
        for x in np.linspace(middle, end, HELD + 1)[1:] if end != middle and start else ():
            found = _held(work, start.causes[0], start.amplitudes, name, ranges[name].value(x))
            if found is None or not found.minimum.converged[0]:
                break
            fits[x], start = found, found
            if found.cost > best.cost + UNLIKELY:
                break
    fits = {x: one for x, one in sorted(fits.items()) if one}
    return _mean(cause, fits, name, ranges) if len(fits) > 2 else None


def _held(work, cause, amplitudes, name, value):
    """The fit with an option of the form held at a value; None where there is none."""
    term = with_options(cause.term, {name: value}, work.rig.structure, work.rig.sensors)
    shape = {key: x for key, x in cause.shape.items() if key != name}
    try:
        held = cause._replace(term=term, shape=shape, options=cause.options | {name: value})
        return fitted_from(work, [held], amplitudes, HYPOTHESIS)
    except (CannotAct, NoSteadyState, NoConvergenceError):
        return None


def _mean(cause, fits, name, ranges):
    """The cause with mean and standard deviations over fits: fraction of the range of the form -> Fitted."""
    from scipy.interpolate import PchipInterpolator

    rest = [key for key in cause.shape if key != name]
    rows = []
    for one in fits.values():
        covariance = one.covariance
        slopes = [ranges[key].slope(one.causes[0].shape[key]) for key in rest]
        variance = np.diag(covariance)[-len(rest) :] * np.square(slopes)
        values = [one.causes[0].shape[key] for key in rest]
        for i, key in enumerate(rest):
            if ranges[key].goes_around:  # beside the best one
                turn = ranges[key].high - ranges[key].low
                values[i] = cause.shape[key] + (values[i] - cause.shape[key] + turn / 2) % turn - turn / 2
        rows.append([*values, *np.log(variance), one.cost / 2 - np.linalg.slogdet(covariance)[1] / 2])
    held = np.array(list(fits))
    x = np.linspace(held[0], held[-1], FINE)
    fine = PchipInterpolator(held, rows)(x)  # no overshoot where the misfit rises steeply
    weight = np.exp(fine[:, -1].min() - fine[:, -1])
    weight /= weight.sum()
    values = np.column_stack([fine[:, : len(rest)], ranges[name].low + x * (ranges[name].high - ranges[name].low)])
    within = np.column_stack([np.exp(fine[:, len(rest) : -1]), np.zeros(FINE)])
    mean = weight @ values
    std = np.sqrt(weight @ (within + (values - mean) ** 2))
    order = [*rest, name]
    shape, spread = (dict(zip(order, part.tolist(), strict=True)) for part in (mean, std))
    return cause._replace(shape=shape, shape_std=spread)
