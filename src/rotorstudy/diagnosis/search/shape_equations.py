"""The shape options of a cause as parameters: derivatives by them, and the equations of a step with all amplitudes."""

from typing import TYPE_CHECKING

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, with_shape
from rotorstudy.diagnosis.search.shape_fit import DIFFERENCE, ranges_of
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import predicted

if TYPE_CHECKING:
    from rotorstudy.diagnosis.search.explanations import Search


def shape_equations(work: "Search", causes, fitted: Fit, cause: Candidate):
    """The equations of a Gauss-Newton step of all parameters and of the shape options of one cause, in their ranges.

    Parameters
    ----------
    work : Search
    causes : sequence of Candidate
    fitted : Fit
        Of these causes.
    cause : Candidate
        One of them.

    Returns
    -------
    normal : ndarray (parameter, parameter)
        Free parameters, then shape options. The prior of an option has the width of its range.
    right : ndarray (parameter,)
    """
    key = frozenset(c.label for c in causes), cause.label  # there is one fit of each set of causes
    if key not in work.equations:
        work.equations[key] = _shape_equations(work, causes, fitted, cause)
    return work.equations[key]


def shape_columns(work: "Search", causes, fitted: Fit, cause: Candidate):
    """Derivatives of the whitened prediction by the shape options of one cause, as fractions of their ranges.

    Parameters
    ----------
    work : Search
    causes : sequence of Candidate
    fitted : Fit
        Of these causes.
    cause : Candidate
        One of them.

    Returns
    -------
    ranges : dict of ShapeRange
        By option.
    columns : list of ndarray (component,)
        One for each option.

    Raises
    ------
    NoSteadyState
    """
    ranges = {name: ends for name, ends in ranges_of(work, cause).items() if name in cause.shape}
    columns = []
    for name, ends in ranges.items():
        off = DIFFERENCE if ends.fraction(cause.shape[name]) < 0.5 else -DIFFERENCE
        there = {**cause.shape, name: ends.value(ends.fraction(cause.shape[name]) + off)}
        moved = with_shape(work.rig, cause, there, work.settings.prior_width)
        extended = work.model.plus(*((moved if c is cause else c).term for c in causes))
        shown = predicted(extended, work.spectrum, fitted.theta)
        left = work.spectrum.whitened(work.spectrum.amplitude - shown)
        columns.append((fitted.residual - left) / off)
    return ranges, columns


def _shape_equations(work, causes, fitted, cause):
    """What `shape_equations` returns, not yet known."""
    ranges, columns = shape_columns(work, causes, fitted, cause)
    point = [ends.fraction(cause.shape[name]) for name, ends in ranges.items()]
    data = np.column_stack([fitted.jacobian, *columns])
    free, count = len(fitted.names), len(data.T)
    rows, distance = np.eye(count), np.zeros(count)  # of the priors; that of a shape is centred between its ends
    rows[:free, :free] = fitted.prior.whitener
    distance[:free] = fitted.prior.whitener @ (fitted.prior.mean - fitted.free)
    distance[free:] = [0 if ends.goes_around else 0.5 - x for ends, x in zip(ranges.values(), point, strict=True)]
    return data.T @ data + rows.T @ rows, data.T @ fitted.residual + rows.T @ distance
