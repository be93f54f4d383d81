"""From a spectrum and a model to a verdict: nothing, a cause, ambiguous, or unknown."""

import logging
from dataclasses import dataclass, replace

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.film_error import with_film_error
from rotorstudy.diagnosis.search.impossible import unstable_rig
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.search.search import begin, is_asked_to_stop, search, unsearched
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.causes import cause_of, causes_of
from rotorstudy.diagnosis.verdict.evidence import (
    detection_limits,
    identifiability,
    moved_parameters,
    not_considered,
    parameter_labels,
    parameter_p_value,
    separating_measurements,
    unexplained,
)
from rotorstudy.diagnosis.verdict.excluded import excluded
from rotorstudy.diagnosis.verdict.far_from_the_rig import far_from_the_rig
from rotorstudy.diagnosis.verdict.first_answer import first_answer, stopped_early
from rotorstudy.diagnosis.verdict.held_out import (
    HeldOutMisfit,
    expected_of,
    gain_of,
    held_out_misfit,
    is_contradicted,
    largest_of,
    others_held_out,
    split,
    with_held_out,
)
from rotorstudy.diagnosis.verdict.next_run import next_runs
from rotorstudy.diagnosis.verdict.over_its_forms import over_its_forms
from rotorstudy.diagnosis.verdict.result import LIKELY_OUTSIDE, OnePlace, PValues, Verdict
from rotorstudy.diagnosis.verdict.resultant import resultant_of
from rotorstudy.diagnosis.verdict.wide_ranges import wide_ranges
from rotorstudy.diagnosis.verdict.within_uncertainty import within_uncertainty
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.diagnosis.verdict.wrong_convention import (
    chain_hypothesis,
    clear_convention,
    finding_of,
    tested_convention,
)
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit, chi_square_p_value, residual_share
from rotorstudy.inference.prediction import misfit, with_model_error
from rotorstudy.inference.prior import with_usual
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import effects_failed, registry, using

log = logging.getLogger(__name__)

STATED_SET = 0.99  # posterior probability that the causes named contain the true one


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and the data it is based on.

    verdict            : Verdict, the content of verdict.json
    spectrum, held_out : Spectrum fitted (its covariance with the model error); the one held out, or None
    search             : Search;  best : Fit of the extended model, the base fit if nothing was added
    alternatives       : names (`Candidate.cause`) of the other causes that cannot be ruled out
    labels             : readable name of each parameter of the extended model
    surprise           : HeldOutMisfit of what was found, with no larger an error of form than the fit has; or None
    """

    verdict: Verdict
    spectrum: Spectrum
    held_out: Spectrum | None
    search: Search
    best: Fit
    settings: Settings
    alternatives: frozenset[str]
    labels: dict[str, str]
    surprise: HeldOutMisfit | None = None


def diagnose(spectrum: Spectrum, model: Model, *, hold_out=None, settings=None, findings=()) -> Verdict:
    """The Verdict on what a model lacks to explain a spectrum; see `investigate`."""
    return investigate(spectrum, model, hold_out=hold_out, settings=settings, findings=findings).verdict


def investigate(
    spectrum: Spectrum,
    model: Model,
    *,
    hold_out: list[float] | None = None,
    settings: Settings | dict | None = None,
    findings: tuple[Finding, ...] = (),
) -> Diagnosis:
    """What a model lacks to explain a spectrum.

    spectrum : measured harmonics (speed, harmonic, sensor), m, with their covariance, of the sensors of the model
    model    : with values for all its parameters
    hold_out : speeds held out of every fit, rad/s; by default about a quarter, from the middle, or others if these
               show what the rest does not
    settings : or a dict of some of them
    findings : on the records, to be included in the verdict
    raises   : RotorstudyError for sensors that do not match, speeds that were not measured, a model without values
    """
    settings = Settings(**settings) if isinstance(settings, dict) else settings or Settings()
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    chosen, failed = settings.hold_out_rad_s if hold_out is None else hold_out, {}
    with using(registry()):  # which is asked for at every shape
        while True:
            try:
                found = _investigated(*split(spectrum, chosen), model, settings, findings, failed)
                if chosen is not None or not _is_surprised(found, settings):
                    return found
                again = [*findings, others_held_out(found.held_out)]
                again = _investigated(*split(spectrum, chosen, others=True), model, settings, again, failed)
                return min(found, again, key=lambda one: one.surprise.misfit)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # of a plugin, any: the diagnosis is made again without it
                new = {name: line for name, line in effects_failed(error).items() if name not in failed}
                if not new:
                    raise
                failed |= new


def _is_surprised(found, settings):
    """Whether the speeds held out show something of what is missing that the others do not."""
    known = found.search.stopped or found.verdict.measuring_chain or found.verdict.outside_probability > LIKELY_OUTSIDE
    return found.surprise is not None and found.surprise.p_value < settings.significance and not known


def _investigated(measured, held, model, settings, findings, failed):
    """The Diagnosis, see `investigate`; failed : effects left out -> why."""
    held = None if held is None else with_film_error(with_model_error(held, settings), model)
    kept = settings.model_copy(update={"leave_out": [*settings.leave_out, *failed]})
    fitted = with_film_error(with_model_error(measured, kept), model)
    found, chain, tested = _searched(model, measured, fitted, kept)
    found.failures.update(failed)
    while True:
        judged, shown, expected = _against_held_out(found, chain, tested, held)
        try:
            return _judged(judged, shown, expected, measured, held, settings, findings)
        except NoSteadyState:  # with its causes the machine could not run as it was measured
            if not judged.best.causes:
                raise
            del found.found[judged.best.kind]


def _judged(found, chain, expected, measured, held, settings, findings):
    """The Diagnosis that follows from a Search; see `_against_held_out`."""
    model, fitted = found.rig, found.spectrum
    base, best = found.base, found.best
    rows = fitted.data_count
    p_values = PValues(before=chi_square_p_value(base.cost, rows), after=chi_square_p_value(best.fit.cost, rows))
    p_parameters = parameter_p_value(best.fit, found.prior.by_name)
    left = residual_share(*(misfit(one.model, fitted, one.theta) for one in (base, best.fit)), rows)
    weights = found.posterior()
    probability = _probability(weights)
    stated, gain = _stated(weights, best), gain_of(base, best.fit, held, expected)
    against = is_contradicted(base, best.fit, expected, settings, gain)
    kind = _kind(found, p_values, p_parameters, probability, is_alone=not stated, is_contradicted=against)
    outside = found.outside_probability if best.causes and not chain else 0.0
    formed = over_its_forms(found) if kind in ("cause", "ambiguous") else None
    labels = parameter_labels(best.fit.model, best.causes)
    moved = moved_parameters(best.fit, found.prior.by_name)
    if chain is not None:
        findings = [*findings, finding_of(chain)]
    elif kind != "nothing":
        findings = [*findings, *far_from_the_rig(found, moved, labels)]
    else:
        findings = [*findings, *within_uncertainty(found)]
    if (
        kind == "unknown"
        and not found.stopped
        and model.before is None
        and (said := wide_ranges(model, fitted, settings))
    ):
        findings = [*findings, Finding("note", "free parts of the rig", "records and rig", said)]
    findings = [*findings, *unstable_rig(found.unstable, best.fit, fitted.speed), *stopped_early(found)]
    findings += formed.findings if formed else []
    odds, others = [e.log_posterior_odds for e in found.explanations if e.causes], [parts[0] for _, parts, _ in stated]
    verdict = Verdict(
        verdict=kind,
        causes=causes_of(best, probability, found.explanations, STATED_SET, formed),
        ambiguous_with=[cause_of(parts, e.fit, probability[fault]) for fault, parts, e in stated],
        resultant=resultant_of(found, best),
        separating_measurement=separating_measurements(best.causes, others, model.structure),
        next_runs=_next_runs(kind, found, measured, held),
        excluded=excluded(found, best, [one.effect for one in others]) if best.causes else [],
        not_considered=not_considered(best.causes, settings, {term.kind for term in model.terms}),
        broken_plugins=[*registry().failures, *found.broken],
        unexplained=unexplained(best.fit, fitted, settings) if kind == "unknown" or best.causes else [],
        residual_p_value=p_values,
        form_error=found.form_error,
        one_place=_places_of_outside(found) if kind == "unknown" and not chain else (),
        outside_probability=outside,
        residual_share=left,
        log_posterior_odds=max(odds, default=None),
        parameter_p_value=p_parameters,
        detection_limit=detection_limits(found),
        gain=gain,
        base_parameters=moved,
        identifiability=identifiability(best.fit, found.prior.by_name),
        candidates=len(found.candidates),
        settings=settings.model_copy(update={"uncertainty": with_usual(settings.uncertainty, model)}),
        measuring_chain=chain,
        findings=worst_first(findings),
    )
    verdict = verdict.model_copy(update={"summary": summary(verdict)})
    surprise = None if held is None else held_out_misfit(best.fit, expected_of(found.best, found, held, 0.0))
    alternatives = frozenset(c.cause for _, parts, _ in stated for c in parts)
    return Diagnosis(verdict, fitted, held, found, best.fit, settings, alternatives, labels, surprise)


def _searched(model, measured, fitted, settings):
    """The Search, the ChainHypothesis that explains the records better or None, and the conventions tested or None.

    measured : Spectrum;  fitted : with the model error
    """
    begun = begin(model, fitted, settings)
    log.info("%s", first_answer(begun))
    tested, chain = None, None
    try:
        log.info("testing whether conventions of the records are wrongly stated")
        tested = tested_convention(begun, measured) if model.before is None else None  # shared by both states
        chain = clear_convention(begun, tested) if tested else None
        found = unsearched(begun) if chain else search(begun)
    except KeyboardInterrupt as stop:
        if not is_asked_to_stop(stop):
            raise
        found = replace(unsearched(begun), stopped=True)
    return found, chain, tested


def _against_held_out(found, chain, tested, held):
    """The Search with whether it is upheld, the ChainHypothesis or None, and the Spectrum held out or None.

    held : with the model error;  the one returned has the error of the causes too
    """
    if tested and not (chain or found.stopped):
        chain = chain_hypothesis(found, found.base, tested)
    found = replace(found, upheld=False) if chain else with_held_out(found, held)
    expected = None if held is None else expected_of(found.best, found, held, largest_of(found.best, found.settings))
    return found, chain, expected


def _kind(found, p_values, p_parameters, probability, *, is_alone, is_contradicted):
    """The kind of verdict: "nothing", "cause", "ambiguous" or "unknown".

    probability : fault -> posterior probability;  is_alone : whether no other causes have to be stated
    is_contradicted : whether the held-out speeds contradict the verdict
    """
    settings, best = found.settings, found.best
    if found.stopped:
        return "unknown"
    if not best.causes:
        explained = min(p_values.before, p_parameters) >= settings.significance and not is_contradicted
        return "nothing" if explained else "unknown"
    rejected = min(p_values.after, p_parameters) < settings.significance
    if is_contradicted or rejected or found.outside_probability > LIKELY_OUTSIDE:
        return "unknown"
    is_sure = min(probability[fault] for fault in best.faults) >= settings.naming_probability
    return "cause" if is_sure and is_alone else "ambiguous"


def _places_of_outside(found):
    """The OnePlace of each place at which a fault that the library lacks may act, if it explains the records."""
    named = []
    for one in found.outside_places(STATED_SET):
        p_value = chi_square_p_value(one.left, one.count)
        if p_value >= found.settings.significance:
            named.append(OnePlace(where=one.where, motion=one.motion, p_value=p_value))
    return named


def _stated(weights, best):
    """(fault, its parts, explanation) of other causes needed for a credible set of probability `STATED_SET`.

    Other parts of a fault that is named (another shape of a bow) are no other causes.
    """
    total, found, seen = 0.0, [], set(best.faults)
    for explanation, weight in weights:
        if total >= STATED_SET:
            break
        total += weight
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


def _next_runs(kind, found, measured, held):
    """Runs that would decide an ambiguous verdict; of a change both states would have to be run."""
    if kind != "ambiguous" or found.rig.before is not None:
        return []
    return next_runs(found, measured, () if held is None else tuple(held.speed), STATED_SET)
