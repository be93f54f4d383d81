"""From a spectrum and a model to a verdict: nothing, a cause, ambiguous, or unknown."""

import logging
from dataclasses import dataclass, replace

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.film_error import with_offset_of_mean
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict import evidence
from rotorstudy.diagnosis.verdict.causes import cause_of, causes_of, over_its_forms
from rotorstudy.diagnosis.verdict.findings import findings_of
from rotorstudy.diagnosis.verdict.held_out import gain_of, is_contradicted, split
from rotorstudy.diagnosis.verdict.next_run import next_runs
from rotorstudy.diagnosis.verdict.result import OnePlace, PValues, Verdict
from rotorstudy.diagnosis.verdict.resultant import resultant_of
from rotorstudy.diagnosis.verdict.sought import seek, without_the_best
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit, chi_square_p_value, parameter_p_value, residual_share
from rotorstudy.inference.prediction import misfit
from rotorstudy.inference.prior import with_usual
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import effects_failed, registry, using
from rotorstudy.threads import on_one_thread

log = logging.getLogger(__name__)

STATED_SET = 0.99  # posterior probability that the causes named contain the true one


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and the data it is based on."""

    verdict: Verdict  # the content of verdict.json
    search: Search  # by the speeds fitted, with the others in its odds
    held_out: Spectrum | None  # of the speeds held out
    best: Fit  # of the extended model, the base fit if nothing was added
    alternatives: frozenset[str]  # names (`Candidate.cause`) of the other causes that cannot be ruled out


def diagnose(spectrum: Spectrum, model: Model, *, hold_out=None, settings=None) -> Verdict:
    """The Verdict on what a model lacks to explain a spectrum; see `investigate`."""
    return investigate(spectrum, model, hold_out=hold_out, settings=settings).verdict


@on_one_thread
def investigate(
    spectrum: Spectrum,
    model: Model,
    *,
    hold_out: list[float] | None = None,
    settings: Settings | dict | None = None,
    findings: tuple[Finding, ...] = (),
) -> Diagnosis:
    """What a model lacks to explain a spectrum.

    hold_out : speeds held out of every fit, rad/s; by default about a quarter, from the middle, or others if these
               show what the rest does not
    findings : on the records, to be included in the verdict
    raises   : RotorstudyError for sensors that do not match, speeds that were not measured, a model without values
    """
    settings = Settings(**settings) if isinstance(settings, dict) else settings or Settings()
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    settings = with_offset_of_mean(settings, spectrum, model)
    chosen, failed = settings.hold_out_rad_s if hold_out is None else hold_out, {}
    with using(registry()):  # which is asked for at every shape
        while True:
            try:
                return _diagnosis(_best_sought(spectrum, chosen, model, settings, failed), settings, findings)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # of a plugin, any: the diagnosis is made again without it
                new = {name: line for name, line in effects_failed(error).items() if name not in failed}
                if not new:
                    raise
                failed |= new


def _best_sought(spectrum, hold_out, model, settings, failed):
    """The Sought of a spectrum; with other speeds held out, where the first ones surprise it and these do less."""
    first = seek(*split(spectrum, hold_out), model, settings, failed)
    if hold_out is not None or not first.is_surprised(settings.significance):
        return first
    again = seek(*split(spectrum, None, others=True), model, settings, failed)
    if again.judged.stopped:
        return first._replace(judged=replace(first.judged, stopped=True))
    return again._replace(surprised=first.held) if again.surprise.misfit < first.surprise.misfit else first


def _diagnosis(one, settings, findings):
    """The Diagnosis of a Sought."""
    while True:
        try:
            return _judged(one, settings, findings)
        except NoSteadyState:
            if not one.judged.best.causes:
                raise
            one = without_the_best(one)


def _judged(one, settings, findings):
    """The Diagnosis that follows from a Sought; raises NoSteadyState, if with its causes the machine could not run."""
    found, chain, expected, measured, held = one.judged, one.chain, one.expected, one.measured, one.held
    model, fitted, base, best = found.rig, found.spectrum, found.base, found.best
    of_change = model.before is not None
    left = residual_share(*(misfit(e.model, fitted, e.theta) for e in (base, best.fit)), fitted.data_count)
    probability, inadequacy = _probability(found.posterior()), found.settings.model_inadequacy
    stated, gain = _stated(found.credible(STATED_SET), best), gain_of(found, held, expected)
    kind = _kind(found, probability, is_alone=not stated, is_contradicted=is_contradicted(found, expected, gain))
    over, odd = over_its_forms(found, STATED_SET) if kind in ("cause", "ambiguous") else (None, [])
    odds, others = [e.log_posterior_odds for e in found.explanations if e.causes], [parts[0] for _, parts, _ in stated]
    verdict = Verdict(
        verdict=kind,
        causes=causes_of(best, probability, inadequacy, found.explanations, STATED_SET, over),
        ambiguous_with=[cause_of(parts, e, probability[fault], inadequacy) for fault, parts, e in stated],
        resultant=resultant_of(found, best),
        separating_measurement=evidence.separating_measurements(best.causes, others, model.structure),
        next_runs=next_runs(found, measured, held, STATED_SET) if kind == "ambiguous" and not of_change else [],
        excluded=evidence.excluded(found, best, [one.effect for one in others]) if best.causes else [],
        not_considered=evidence.not_considered(best.causes, settings, {term.kind for term in model.terms}),
        broken_plugins=[*registry().failures, *found.broken],
        unexplained=evidence.unexplained(best.fit, fitted, settings) if kind == "unknown" or best.causes else [],
        residual_p_value=PValues(before=base.p_value, after=best.fit.p_value),
        form_error=found.form_error,
        one_place=_places_of_outside(found) if kind == "unknown" and not chain else (),
        outside_probability=found.outside_probability if best.causes and not chain else 0.0,
        residual_share=left,
        log_posterior_odds=max(odds, default=None),
        parameter_p_value=parameter_p_value(best.fit, found.prior.by_name),
        detection_limit=evidence.detection_limits(found),
        gain=gain,
        base_parameters=evidence.moved_parameters(best.fit, found.prior.by_name),
        identifiability=evidence.identifiability(best.fit, found.prior.by_name),
        candidates=len(found.candidates),
        settings=settings.model_copy(update={"uncertainty": with_usual(settings.uncertainty, model)}),
        measuring_chain=chain,
        findings=worst_first([*findings, *findings_of(one, kind), *odd]),
    )
    verdict = verdict.model_copy(update={"summary": summary(verdict, of_change)})
    return Diagnosis(verdict, found, held, best.fit, frozenset(c.cause for _, parts, _ in stated for c in parts))


def _kind(found, probability, *, is_alone, is_contradicted):
    """The kind of verdict; is_alone : whether no other causes have to be stated."""
    if found.stopped or found.is_rejected or is_contradicted:
        return "unknown"
    if not found.best.causes:
        return "nothing"
    is_sure = min(probability[fault] for fault in found.best.faults) >= found.settings.naming_probability
    return "cause" if is_sure and is_alone else "ambiguous"


def _places_of_outside(found):
    """The OnePlace of each place at which a fault that the library lacks may act, if it explains the records."""
    each = ((one, chi_square_p_value(one.left, found.spectrum.data_count)) for one in found.outside_places(STATED_SET))
    least = found.settings.significance
    return [OnePlace(where=one.where, motion=one.motion, p_value=p) for one, p in each if p >= least]


def _stated(credible, best):
    """(fault, its parts, explanation) of causes of a credible set, but parts of faults that are named."""
    found, seen = [], set(best.faults)
    for explanation, _ in credible:
        if not explanation.causes or best.named <= explanation.named:
            continue
        for fault, parts in faults_of(explanation.causes).items():
            if fault not in seen and not {c.cause for c in parts} <= best.named:
                seen.add(fault)
                found.append((fault, parts, explanation))
    return found


def _probability(weights):
    """Posterior probability of every fault: of all explanations with any of its parts."""
    faults = {fault for e, _ in weights for fault in e.faults}
    return {fault: min(sum(w for e, w in weights if fault in e.faults), 1.0) for fault in faults}
