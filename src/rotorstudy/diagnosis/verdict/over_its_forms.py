"""The cause of a verdict whose form is not known, over all its forms: the depth of a crack over all its fronts.

The search takes the usual form (a straight front) with an error; the depth then depends on it alone. `identify --cause`
states the shape over all forms, and so does a verdict.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import far_amplitudes
from rotorstudy.diagnosis.one_cause.over_forms import OverForms, over_forms
from rotorstudy.diagnosis.search.candidates import Candidate, candidate, form_ranges
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.shape_fit import Work, fitted_from
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.measurement.findings import Finding


class Formed(NamedTuple):
    """usual : Candidate in its usual form;  over : its OverForms, None if there is none;  findings : what is odd."""

    usual: Candidate
    over: OverForms | None
    findings: tuple[Finding, ...] = ()


def over_its_forms(found: Search) -> Formed | None:
    """The one cause of the best explanation that has a form, over all its forms; None if there is not one such cause.

    A form far from that of the library is told: none fits the records, or only one with an unusual size.
    """
    best, settings = found.best, found.settings
    formed = [cause for cause in best.causes if cause.shape and form_ranges(cause.effect)]
    if len(formed) != 1:
        return None
    (usual,), others = formed, [cause for cause in best.causes if cause is not formed[0]]
    shape = usual.shape | {name: ends.value(0.5) for name, ends in form_ranges(usual.effect).items()}
    label = usual.term.label
    try:
        one = candidate(found.rig, usual.effect, usual.where, shape, label, settings.prior_width, usual.variant, True)
    except CannotAct:  # a published formula has one form
        return None
    work = Work(found.rig, found.whole, found.prior, best.spectrum, settings)
    names = [*found.prior.names, *(name for cause in others for name in cause.names)]
    means = [mean for mean, _ in one.prior.values()]
    over, odd = None, []
    try:
        fitted = fitted_from(work, [*others, one], np.array([*(best.fit.values[name] for name in names), *means]))
        over = over_forms(work, fitted)
    except (CannotAct, NoSteadyState, NoConvergenceError):
        odd.append("it has no steady motion with another form")
    if over is not None:
        far = far_amplitudes(fitted.causes[-1:], [*names, *one.names], fitted.amplitudes)
        odd += [f"{name} is {abs(away):.1f} usual standard deviations from its value" for name, away in far.items()]
        if (p_value := chi_square_p_value(fitted.cost, best.spectrum.data_count)) < settings.significance:
            odd, over = [*odd, f"the fit with its form free has a p-value of {p_value:.1g}"], None
    elif not odd:
        odd.append("its form could not be fitted")
    text = f"{'; '.join(odd)}: {usual.cause} has another form than those of the library, and its size may be wrong"
    return Formed(usual, over, (Finding("warning", "form of the cause", "causes", text),) if odd else ())
