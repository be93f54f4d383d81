"""Intervals that allow for an error of the form of several causes.

Published formulas of one crack, beam or bearing differ by a percent or more. What a wrong form leaves can be too small
to be rejected and yet shift parameters by many of their standard deviations, as other parameters take most of it:
beside a large crack an added mass. So each harmonic of what a cause with a law changes gets a complex factor 1 + e, one
for all speeds and nodes, as a law of opening has one for each harmonic. e is unknown, with the standard deviation
FORM_ERROR. The values that were found stay; their covariance is that with these factors as further parameters.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, faults_of
from rotorstudy.diagnosis.search.shape_equations import shape_columns
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import predicted

FORM_ERROR = 0.01  # standard deviation of each factor


def have_a_law(causes: Iterable[Candidate]) -> bool:
    """Whether all causes follow a law that may be off: of a contact, a crack or a beam, not of a mass or a force."""
    return all(cause.shape or "element" in cause.where for cause in causes)


def with_form_error(work: Search, explanation: Explanation) -> Explanation:
    """An explanation by several causes, whose covariance and deviations of shapes allow for an error of their form.

    work        : Search, of the spectrum that the explanation was fitted to
    explanation : returned as it is, where it has a single fault, whose `cause_error` is estimated, or none has a law
    """
    if (
        work.has_form_errors
        or len(explanation.faults) < 2
        or not any(map(have_a_law, faults_of(explanation.causes).values()))
    ):
        return explanation
    fitted, shaped = explanation.fit, [cause for cause in explanation.causes if cause.shape]
    try:
        shapes = [shape_columns(work, explanation.causes, fitted, cause) for cause in shaped]
        factors = FORM_ERROR * _factor_columns(work, explanation)
    except NoSteadyState:  # of a shape next to it, or without one of the causes
        return explanation
    columns = np.column_stack([fitted.jacobian, *(column for _, found in shapes for column in found), factors])
    known, free = np.eye(columns.shape[1]), len(fitted.names)
    known[:free, :free] = fitted.prior.whitener.T @ fitted.prior.whitener
    covariance = invert(columns.T @ columns + known)
    std, spread = iter(np.sqrt(np.diag(covariance))[free:]), {}
    for cause, (ranges, _) in zip(shaped, shapes, strict=True):
        spread[cause.label] = {name: ends.slope(cause.shape[name]) * next(std) for name, ends in ranges.items()}
    causes = tuple(cause._replace(shape_std=spread.get(cause.label, cause.shape_std)) for cause in explanation.causes)
    return replace(explanation, causes=causes, fit=replace(fitted, covariance=covariance[:free, :free]))


def _factor_columns(work, explanation):
    """Changes (component, factor) of the whitened prediction by factors on each harmonic of what a law changes."""
    fitted, spectrum, columns = explanation.fit, work.spectrum, []
    whole = predicted(fitted.model, spectrum, fitted.theta)
    for parts in filter(have_a_law, faults_of(explanation.causes).values()):
        rest = work.held([cause for cause in explanation.causes if cause not in parts], fitted.values)
        change = whole - predicted(rest.model, spectrum, rest.theta)
        for here in np.eye(len(spectrum.harmonics))[:, :, None]:
            columns += [here * change, 1j * here * change]
    return spectrum.whitened(np.array(columns)).T
