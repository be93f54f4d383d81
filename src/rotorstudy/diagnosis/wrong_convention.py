"""Whether records look as if a measuring convention were stated wrongly, rather than as if the rotor had a fault."""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.diagnosis.measuring_chain import Hypothesis, hypotheses
from rotorstudy.diagnosis.odds import Explanation, log_posterior_odds, odds_of
from rotorstudy.diagnosis.result import ChainHypothesis, Place, PValues
from rotorstudy.diagnosis.search import with_one_more
from rotorstudy.diagnosis.words import place
from rotorstudy.inference.fit import Fit, chi_square_p_value, fit, residual_share
from rotorstudy.inference.prediction import carried_order, with_model_error
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.measured import measured_response_and_jacobian
from rotorstudy.units import percent

PRIOR_ODDS = 0.02  # that some convention is stated wrongly, divided among the hypotheses
LEAST_LOG_ODDS = 5.0  # beyond the stated conventions and beyond the best causes under them
FITTED = 3  # hypotheses that are fitted, the best linearised ones
SMALL_SHARE = 0.1  # of the excess error, which a wrong convention may leave: a fault beside it


@dataclass(frozen=True)
class Tested:
    """A hypothesis fitted.

    spectrum   : corrected, with the model error;  fit : to that
    log_factor : logarithm of what its likelihood is multiplied by: its prior odds, and the determinant of the change
    """

    hypothesis: Hypothesis
    spectrum: Spectrum
    fit: Fit
    log_factor: float


def chain_hypothesis(found, spectrum, settings):
    """The ChainHypothesis that explains the records better than any cause under the stated conventions, or None.

    It is tried without causes and, where neither it nor the best causes leave noise, with a cause on the rotor. It must
    explain the records by the standards of a cause (what it leaves is noise, the base parameters stay plausible), or
    all but a small share; and the base parameters move no more than expected, or less than under the stated
    conventions.
    """
    stated, rows, best = with_model_error(spectrum, settings), 2 * spectrum.amplitude.size, found.best
    base = fit(found.model, stated, found.prior, start=found.base.theta)  # without the error of a cause
    p_before, p_base = chi_square_p_value(base.cost, rows), chi_square_p_value(base.penalty, len(base.names))
    if min(p_before, p_base) >= settings.significance:
        return None
    as_stated = fit(best.fit.model, stated, best.fit.prior, start=best.fit.theta)
    odds_as_stated = log_posterior_odds(best.causes, as_stated, base, found.prior_odds)
    tested = best_hypothesis(spectrum, base, settings)
    gain, tried = tested.fit.evidence - base.evidence + tested.log_factor, [Explanation((), tested.fit, 0.0)]
    if gain > LEAST_LOG_ODDS and all(one.is_rejected(settings.significance) for one in (as_stated, tested.fit)):
        tried += _with_one_cause(found, tested)
    explained = max(tried, key=odds_of)
    odds, after = odds_of(explained) + gain, explained.fit
    left = residual_share(base.cost, after.cost, rows)
    p_after, p_parameters = chi_square_p_value(after.cost, rows), chi_square_p_value(after.penalty, len(after.names))
    if (
        odds - max(0.0, best.log_posterior_odds, odds_as_stated) < LEAST_LOG_ODDS
        or (min(p_after, p_parameters) < settings.significance and left > SMALL_SHARE)
        or after.penalty > max(base.penalty, len(after.names))  # as many as names are expected
    ):
        return None
    return ChainHypothesis(
        hypothesis=tested.hypothesis.name,
        remedy=tested.hypothesis.remedy,
        beside=next((Place(effect=cause.effect, where=cause.where) for cause in explained.causes), None),
        log_odds=odds,
        log_odds_of_best_causes=best.log_posterior_odds,
        residual_p_value=PValues(before=p_before, after=p_after),
        residual_share=left,
    )


def _with_one_cause(found, tested):
    """Explanations of the corrected records by one cause on the rotor."""
    work = replace(
        found,
        model=tested.fit.model,
        stated=tested.spectrum,
        spectrum=tested.spectrum,
        base=tested.fit,
        candidates=[cause for cause in found.candidates if not cause.term.acts_on_output],
        screened=[],
        found={frozenset(): Explanation((), tested.fit, 0.0)},
        cause_error=0.0,
    )
    work.screened.extend(work.screen(work.base, work.candidates))
    return with_one_more(work, work.found[frozenset()])


def finding_of(chain):
    """The warning that a convention seems to be stated wrongly."""
    beside = f" with {place(chain.beside)}" if chain.beside else ""
    text = (
        f"the records look as if {chain.hypothesis}: corrected for that, the rig{beside} explains all but "
        f"{percent(chain.residual_share)} of the excess error (rms), better than any cause (log odds "
        f"{chain.log_odds:.3g}, best causes {chain.log_odds_of_best_causes:.3g}). No cause is named: {chain.remedy}, "
        "then diagnose again"
    )
    return Finding("warning", "measuring chain", "records and rig", text)


def best_hypothesis(spectrum, base, settings) -> Tested:
    """The Tested hypothesis with the highest odds.

    Parameters
    ----------
    spectrum : Spectrum
        Without the model error.
    base : Fit
        Of the model without causes; the hypotheses are judged about the stated values of its parameters.
    settings : Settings
    """
    model, prior, about = base.model, base.prior, base.stated_theta
    every = hypotheses(spectrum, model)
    models = (model, replace(model, from_unloaded_line=not model.from_unloaded_line))
    linearised = [_linearised(one, prior.names, about, spectrum) for one in models]
    stated, screened = _volume(with_model_error(spectrum, settings)), []
    for hypothesis in every:
        corrected, log_volume = hypothesis.corrected(spectrum)
        corrected = with_model_error(corrected, settings)
        log_factor = float(log_volume + _volume(corrected) - stated + np.log(PRIOR_ODDS / len(every)))
        evidence = _linear_evidence(corrected, *linearised[hypothesis.other_zero], prior)
        screened.append((evidence + log_factor, log_factor, hypothesis, corrected))
    screened.sort(key=lambda one: -one[0])
    tested = [
        Tested(hypothesis, corrected, fit(models[hypothesis.other_zero], corrected, prior, start=about), log_factor)
        for _, log_factor, hypothesis, corrected in screened[:FITTED]
    ]
    return max(tested, key=lambda one: one.fit.evidence + one.log_factor)


def _linearised(model, names, theta, spectrum):
    """Harmonics of a model, and their derivatives (parameter, ...) by some parameters."""
    shown, change = measured_response_and_jacobian(
        model, spectrum.speed, spectrum.harmonics, theta, order=carried_order(spectrum)
    )
    return shown, np.moveaxis(change[..., model.position(names)], -1, 0)


def _volume(spectrum):
    """Logarithm of the determinant of the whitener."""
    return float(np.linalg.slogdet(spectrum.whitener)[1].sum())


def _linear_evidence(spectrum, shown, change, prior):
    """Log evidence of a spectrum less a constant; shown : by the linearised model at the prior mean."""
    columns = spectrum.whitened(change).T @ prior.factor
    off = np.concatenate([spectrum.whitened(spectrum.amplitude - shown), np.zeros(columns.shape[1])])
    # not by the normal equations: data that a hypothesis shrinks leave them without digits
    basis, triangle = np.linalg.qr(np.vstack([columns, np.eye(columns.shape[1])]))
    left = off - basis @ (basis.T @ off)
    return float(-0.5 * left @ left - np.log(np.abs(np.diag(triangle))).sum())
