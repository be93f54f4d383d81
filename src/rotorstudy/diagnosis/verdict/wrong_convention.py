"""Whether records look as if a measuring convention were stated wrongly, rather than as if the rotor had a fault."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.free_force import free_forces
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.search import with_one_cause
from rotorstudy.diagnosis.verdict.measuring_chain import Hypothesis, hypotheses
from rotorstudy.diagnosis.verdict.result import ChainHypothesis, Place, PValues
from rotorstudy.inference.fit import Fit, chi_square_p_value, fit, residual_share
from rotorstudy.inference.linear import marginal
from rotorstudy.inference.prediction import carried_order, shown_and_slopes, with_model_error
from rotorstudy.measurement.spectrum import Spectrum

PRIOR_ODDS = 0.02  # that some convention is stated wrongly, divided among the hypotheses
LEAST_MARGIN = 5.0  # of log odds over the stated conventions, and over the best causes under them
FITTED = 3  # number of hypotheses that are fitted, those best when linearised
SMALL_SHARE = 0.1  # of the excess error (rms), which a right hypothesis may leave alone, as there may be a fault too


class Tested(NamedTuple):
    """A hypothesis, its Fit to the corrected Spectrum, and the log of its prior odds and the change's determinant."""

    hypothesis: Hypothesis
    spectrum: Spectrum
    fit: Fit
    log_factor: float


def tested_convention(found, spectrum):
    """The Tested hypothesis with the highest odds; None where the records do not contradict the rig, or none is near.

    Beside causes that explain the records it is fitted only as far as it may be more probable.
    """
    base, best, settings = found.base, found.best, found.settings
    margin = LEAST_MARGIN + (0.0 if best.fit.is_rejected(settings.significance) else max(0.0, odds_of(best)))
    is_far = chi_square_p_value(base.penalty, len(base.names)) < settings.significance
    if not (base.is_rejected(settings.significance) or is_far):
        return None
    model, prior, about = base.model, base.prior, base.stated_theta  # all are linearised about the stated values
    every = list(hypotheses(spectrum, model))
    models = (model, replace(model, from_unloaded_line=not model.from_unloaded_line))
    linearised = [shown_and_slopes(one, spectrum, about, prior.names, carried_order(spectrum)) for one in models]
    films = found.spectrum.covariance - with_model_error(spectrum, settings).covariance
    screened = []
    for hypothesis in every:
        corrected, log_volume = hypothesis.corrected(spectrum)
        corrected = with_model_error(corrected, settings)
        covariance = corrected.covariance + films
        corrected = replace(corrected, covariance=covariance, common_error=found.spectrum.common_error)
        volume = corrected.log_volume - found.spectrum.log_volume
        log_factor = float(log_volume + volume + np.log(PRIOR_ODDS / len(every)))
        shown, change = linearised[hypothesis.other_zero]
        left = marginal(corrected.whitened(change).T @ prior.factor, corrected.whitened(corrected.amplitude - shown))
        screened.append((log_factor - 0.5 * sum(left), log_factor, hypothesis, corrected))
    screened.sort(key=lambda one: -one[0])
    tested = []
    for _, log_factor, one, corrected in screened[:FITTED]:
        needed = 2 * (log_factor - margin - base.evidence)  # of its cost, to be accepted
        if needed > 0:
            fitted = fit(models[one.other_zero], corrected, prior, start=about, needed=needed)
            tested.append(Tested(one, corrected, fitted, log_factor))
    return max(tested, key=lambda one: one.fit.evidence + one.log_factor, default=None)


def chain_hypothesis(found, spectrum):
    """The ChainHypothesis that, perhaps with one cause, explains the records better than any causes alone, or None.

    found : Search that is over;  spectrum : what it explains, without the model error
    """
    tested = tested_convention(found, spectrum)
    if tested is None:
        return None
    best, gain, tried = found.best, _gain(tested, found.base), [Explanation((), tested.fit, 0.0)]
    if gain > LEAST_MARGIN and all(one.is_rejected(found.settings.significance) for one in (best.fit, tested.fit)):
        tried += _with_one_cause(found, tested)
    ranked = sorted(tried, key=odds_of, reverse=True)
    return next(filter(None, (_accepted(tested, one, found.base, odds_of(best), found) for one in ranked)), None)


def _gain(tested, base):
    """Log odds of a hypothesis, without causes, over the stated conventions."""
    return tested.fit.evidence - base.evidence + tested.log_factor


def _accepted(tested, explained, base, odds_of_best, work):
    """The ChainHypothesis if it meets the standards of a cause, or alone leaves only a small share of the excess error.

    With a cause beside it, no further fault excuses what is left. The base parameters must move no more than expected,
    or than under the stated conventions, under which the best causes have the log odds `odds_of_best`.
    """
    odds, after, rows = odds_of(explained) + _gain(tested, base), explained.fit, len(base.residual)
    left, significance = residual_share(base.cost, after.cost, rows), work.settings.significance
    p_after, p_parameters = chi_square_p_value(after.cost, rows), chi_square_p_value(after.penalty, len(after.names))
    if (
        odds - max(0.0, odds_of_best) < LEAST_MARGIN
        or p_parameters < significance  # moved that far, they imitate what the convention does not explain
        or (p_after < significance and (explained.causes or left > SMALL_SHARE))
        or after.penalty > max(base.penalty, len(after.names))  # as many as names are expected
    ):
        return None
    return ChainHypothesis(
        hypothesis=tested.hypothesis.name,
        remedy=tested.hypothesis.remedy,
        beside=next((Place.of(one.effect, one.where, base.model.structure) for one in explained.causes), None),
        log_odds=odds,
        log_odds_of_best_causes=odds_of_best,
        residual_p_value=PValues(before=chi_square_p_value(base.cost, rows), after=p_after),
        residual_share=left,
    )


def _with_one_cause(found, tested):
    """Explanations of the corrected records by one cause on the rotor."""
    candidates = [cause for cause in found.candidates if not cause.term.acts_on_output]
    if not candidates:
        return []
    anew = {"found": {frozenset(): Explanation((), tested.fit, 0.0)}, "starts": {}, "impossible": {}, "unfitted": {}}
    given = {"model": tested.fit.model, "spectrum": tested.spectrum, "base": tested.fit, "candidates": candidates}
    work = replace(found, **given, **anew)
    return with_one_cause(replace(work, free_forces=tuple(free_forces(work))))
