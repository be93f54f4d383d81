"""The shape options of a cause as parameters: derivatives by them, and the equations of a step with all amplitudes."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, with_shape
from rotorstudy.diagnosis.search.shape_fit import ranges_of
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order, predicted
from rotorstudy.response.measured import measured_response_and_jacobian

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
    offs, beside = [], []
    for name, ends in ranges.items():
        point = ends.fraction(cause.shape[name])
        offs.append(ends.step(point))
        there = {**cause.shape, name: ends.value(point + offs[-1])}
        beside.append(with_shape(work.rig, cause, there, work.settings.prior_width))
    of = _by_new_responses if any(u.exact for u in cause.term.unknowns) else _by_forces
    return ranges, [column / off for column, off in zip(of(work, causes, fitted, cause, beside), offs, strict=True)]


def _by_forces(work, causes, fitted, cause, beside):
    """Changes (component,) of the prediction with a cause in other shapes, to first order in the change of its force.

    The response is linear in a small force: all follow from the columns of the cause in these shapes, with amplitudes
    of zero, at the motion of the fit.
    """
    beside = [one._replace(term=replace(one.term, label=f"beside {i}")) for i, one in enumerate(beside)]
    model = work.model.plus(*(c.term for c in (*causes, *beside)))
    theta = np.array([fitted.values.get(name, 0.0) for name in model.names])
    order, spectrum = carried_order(work.spectrum, model), work.spectrum
    change = measured_response_and_jacobian(model, spectrum.speed, spectrum.harmonics, theta, order=order).jacobian
    amplitudes = theta[model.position(cause.names)]
    own, *others = (change[..., model.position(one.names)] @ amplitudes for one in (cause, *beside))
    return list(spectrum.whitened(np.stack([other - own for other in others]))) if others else []


def _by_new_responses(work, causes, fitted, cause, beside):
    """The same of a cause whose amplitude does not multiply columns."""
    changes = []
    for moved in beside:
        extended = work.model.plus(*((moved if c is cause else c).term for c in causes))
        left = work.spectrum.whitened(work.spectrum.amplitude - predicted(extended, work.spectrum, fitted.theta))
        changes.append(fitted.residual - left)
    return changes


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
