"""From a spectrum and a model to a verdict: nothing, a cause, ambiguous, or unknown."""

import logging
from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS, Search
from rotorstudy.diagnosis.search.impossible import unstable_rig
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.search.search import search
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.excluded import excluded
from rotorstudy.diagnosis.verdict.far_from_the_rig import far_from_the_rig
from rotorstudy.diagnosis.verdict.held_out import gain_of, is_upheld, is_worse, split
from rotorstudy.diagnosis.verdict.next_run import next_runs
from rotorstudy.diagnosis.verdict.outside import with_outside
from rotorstudy.diagnosis.verdict.result import (
    Cause,
    DetectionLimit,
    Identifiability,
    MovedParameter,
    ParameterEstimate,
    Place,
    PValues,
    SeparatingMeasurement,
    Tradeoff,
    Unexplained,
    Verdict,
)
from rotorstudy.diagnosis.verdict.resultant import resultant_of
from rotorstudy.diagnosis.verdict.words import place, readable, summary
from rotorstudy.diagnosis.verdict.wrong_convention import chain_hypothesis, finding_of
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.fit import Fit, chi_square_p_value, residual_share
from rotorstudy.inference.prediction import misfit, predicted, with_cause_error, with_model_error
from rotorstudy.inference.prior import with_rotor
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import is_number

log = logging.getLogger(__name__)

STATED_SET = 0.99  # posterior probability that the causes named contain the true one
SEEN = 0.5  # of the prior standard deviation: an amplitude known no better from the data has no detection limit
POWER = 1.645  # standard deviations above the threshold for a detection probability of 95 %
MOVED = 2.0  # stated standard deviations beyond which a parameter is listed as moved
PARTS = ("real", "imaginary")
TRADED_OFF = 0.95  # correlation above which two parameters can hardly be separated


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and the data it is based on.

    verdict            : Verdict, the content of verdict.json
    spectrum, held_out : Spectrum fitted (its covariance with the model error); the one held out, or None
    search             : Search;  best : Fit of the extended model, the base fit if nothing was added
    alternatives       : names (`Candidate.cause`) of the other causes that cannot be ruled out
    labels             : readable name of each parameter of the extended model
    """

    verdict: Verdict
    spectrum: Spectrum
    held_out: Spectrum | None
    search: Search
    best: Fit
    settings: Settings
    alternatives: frozenset[str]
    labels: dict[str, str]


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

    Parameters
    ----------
    spectrum
        Measured harmonics (speed, harmonic, sensor), m, with their covariance, of the sensors of the model.
    model
        A model with values for all its parameters.
    hold_out
        Speeds held out of every fit, rad/s; by default about a quarter, from the middle.
    settings
        Settings, or a dict of some of them.
    findings
        Findings on the records, to be included in the verdict.

    Raises
    ------
    RotorstudyError
        For sensors that do not match, speeds that were not measured, a model without values.
    """
    settings = Settings(**settings) if isinstance(settings, dict) else settings or Settings()
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    measured, held = split(spectrum, settings.hold_out_rad_s if hold_out is None else hold_out)
    fitted = with_model_error(measured, settings)
    held = None if held is None else with_model_error(held, settings)
    found = search(model, fitted, settings)
    base, expected = found.base, None
    if held is not None:
        expected = with_cause_error(held, held.amplitude - predicted(base.model, held, base.theta), found.cause_error)
    log.info("testing whether conventions of the records are wrongly stated")
    chain = chain_hypothesis(found, measured, settings) if model.before is None else None  # shared by both states
    found = replace(found, upheld=chain is None and is_upheld(found, expected))
    best = found.best
    rows = fitted.data_count
    p_values = PValues(before=chi_square_p_value(base.cost, rows), after=chi_square_p_value(best.fit.cost, rows))
    p_parameters = chi_square_p_value(best.fit.penalty, len(best.fit.names))
    left = residual_share(*(misfit(one.model, fitted, one.theta) for one in (base, best.fit)), rows)
    weights = found.posterior()
    probability = _probability(weights)
    stated, gain = _stated(weights, best), gain_of(base, best.fit, held, expected)
    if not best.causes:
        kind = "nothing" if min(p_values.before, p_parameters) >= settings.significance else "unknown"
    elif _is_rejected(found, p_values.after, p_parameters) or is_worse(base, best.fit, expected, settings, gain):
        kind = "unknown"
    elif stated or min(probability[fault] for fault in best.faults) < settings.naming_probability:
        kind = "ambiguous"
    else:
        kind = "cause"
    labels = _parameter_labels(best.fit.model, best.causes)
    moved = _moved(best.fit, found.prior.by_name)
    if chain is not None:
        findings = [*findings, finding_of(chain)]
    elif kind != "nothing":
        findings = [*findings, *far_from_the_rig(found, moved, labels)]
    findings = [*findings, *unstable_rig(found.unstable, fitted.speed)]
    odds = [e.log_posterior_odds for e in found.explanations if e.causes]
    verdict = Verdict(
        verdict=kind,
        causes=_causes(best, probability),
        ambiguous_with=[_cause(parts, e.fit, probability[fault]) for fault, parts, e in stated],
        resultant=resultant_of(found, best),
        separating_measurement=_separating(best.causes, [parts[0] for _, parts, _ in stated], model.structure),
        next_runs=_next_runs(kind, found, measured, held),
        excluded=excluded(found, best, [parts[0].effect for _, parts, _ in stated]) if best.causes else [],
        not_considered=_not_considered(best.causes, settings, {term.kind for term in model.terms}),
        broken_plugins=[*registry().failures, *found.broken],
        unexplained=_unexplained(best.fit, fitted, settings) if kind == "unknown" or best.causes else [],
        residual_p_value=p_values,
        cause_error=found.cause_error if best.causes else 0.0,
        residual_share=left,
        log_posterior_odds=max(odds, default=None),
        parameter_p_value=p_parameters,
        detection_limit=_detection_limits(found),
        gain=gain,
        base_parameters=moved,
        identifiability=_identifiability(best.fit, found.prior.by_name),
        candidates=len(found.candidates),
        settings=settings.model_copy(update={"uncertainty": with_rotor(settings.uncertainty, model.structure)}),
        measuring_chain=chain,
        findings=worst_first(findings),
    )
    verdict = with_outside(verdict)
    verdict = verdict.model_copy(update={"summary": summary(verdict)})
    alternatives = frozenset(c.cause for _, parts, _ in stated for c in parts)
    return Diagnosis(verdict, fitted, held, found, best.fit, settings, alternatives, labels)


def _is_rejected(found, p_residual, p_parameters):
    """Whether the best causes leave more than noise and the allowed error of a cause, or need implausible parameters.

    That error is allowed to one cause only, as it could hide what a second one explains.
    """
    if min(p_residual, p_parameters) < found.settings.significance:
        return True
    faults = found.prior_odds.together(found.best.causes)
    return found.cause_error > 0 and (len(faults) > 1 or found.cause_error >= found.settings.cause_error)


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


def _causes(explanation, probability):
    """The Cause of every fault of an explanation; the parts of a fault are one cause."""
    faults = faults_of(explanation.causes)
    return [_cause(parts, explanation.fit, probability[fault]) for fault, parts in faults.items()]


def _cause(parts, fitted, probability):
    """The Cause of the parts of a fault, whose options are listed where they differ."""
    where = {}
    for key in dict.fromkeys(key for part in parts for key in part.where):
        values = sorted({part.where[key] for part in parts if key in part.where})
        where[key] = values if len(values) > 1 else values[0]
    parameters = {}
    for part in parts:
        found = _parameters(part, fitted)
        taken = "".join(f"_{key}_{own}" for key, own in part.where.items() if isinstance(where[key], list))
        parameters |= {f"{name}{taken}" if name in parameters else name: one for name, one in found.items()}
    return Cause(
        effect=parts[0].effect,
        where=where,
        label=fitted.model.structure.label_at(where),
        parameters=parameters,
        variant=parts[0].variant,
        posterior_probability=probability,
    )


def _parameters(candidate, fitted):
    """{name: ParameterEstimate} of a candidate as fitted, complex ones by magnitude and phase, then its shape."""
    place = [fitted.names.index(name) for name in candidate.names]
    theta, covariance = fitted.free[place], fitted.covariance[np.ix_(place, place)]
    _, theta, covariance = magnitude_and_phase(candidate.names, theta, covariance)
    estimates = zip(theta, np.sqrt(np.diag(covariance)), strict=True)
    parameters = {}
    for p in candidate.term.parameters:
        parts = {p.name: (p.unit, "magnitude"), f"{p.name}_phase": ("rad", "phase")}
        for name, (unit, part) in parts.items() if p.is_complex else [(p.name, (p.unit, "amplitude"))]:
            value, std = next(estimates)
            parameters[name] = ParameterEstimate(value=value, std=std, unit=unit, part=part)
        size = parameters[p.name]  # an eccentricity is an unbalance too
        for name, (unit, factor) in p.also.items():
            also = {"value": size.value / factor, "std": size.std / factor, "unit": unit}
            parameters[name] = size.model_copy(update=also)
    for name, value in candidate.shape.items():
        unit = "rad" if name.endswith("_rad") else ""
        parameters[name] = ParameterEstimate(value=value, std=candidate.shape_std.get(name), unit=unit, part="shape")
    plugin = registry().get("effect", candidate.effect)
    known = plugin.stated and set(plugin.shape) <= set(candidate.shape)  # not before its whole shape was searched
    for name, (option, factor) in plugin.stated(fitted.model.structure, **candidate.shape).items() if known else ():
        one = parameters[option]
        std = None if one.std is None else factor * one.std
        parameters[name] = ParameterEstimate(value=factor * one.value, std=std, unit="", part="shape")
    return parameters


def residual_map(fitted, spectrum):
    """(speed, harmonic, sensor) rms of the real and imaginary whitened residual, in standard deviations."""
    return spectrum.by_harmonic(fitted.residual)


def _unexplained(fitted, spectrum, settings):
    """Harmonics and nodes with a significant residual, the largest share first."""
    from scipy.special import chdtrc

    square = residual_map(fitted, spectrum) ** 2
    total, speeds = square.sum(), len(spectrum.speed)
    found = []
    for h, n in enumerate(spectrum.harmonics):
        for s, node in enumerate(spectrum.sensors):
            part = 2 * square[:, h, s].sum()
            if chdtrc(2 * speeds, part) * square[0].size < settings.significance:
                share, sigma = part / (2 * total), np.sqrt(part / (2 * speeds))
                found.append(Unexplained(harmonic=int(n), node=int(node), share=share, sigma=sigma))
    return sorted(found, key=lambda row: -row.share)


def _parts(term):
    """(parameter, part, unknown) of each real amplitude of a term."""
    parts = [(p, part) for p in term.parameters for part in (PARTS if p.is_complex else ("amplitude",))]
    return [(p, part, unknown) for (p, part), unknown in zip(parts, term.unknowns, strict=True)]


def _detection_limits(found):
    """Amplitude of each candidate detected with a probability of 95 %, the most sensitive first."""
    limits = []
    for c, screened in zip(found.candidates, found.screened, strict=True):
        needed = np.sqrt(2 * LEAST_LOG_ODDS + found.prior_odds.even_odds_gain(c)) + POWER
        for (p, part, unknown), one in zip(_parts(c.term), screened.detection, strict=True):
            if one < SEEN * c.prior[unknown.name][1]:
                size = {"amplitude": needed * one, "unit": p.unit, "of_typical": needed * one / unknown.typical}
                label = found.model.structure.label_at(c.where)
                at = {"effect": c.effect, "where": c.where, "label": label}
                limits.append(DetectionLimit(**at, parameter=p.name, part=part, **size))
    return sorted(limits, key=lambda row: row.of_typical)


def _moved(fitted, prior):
    """Base parameters that a fit moved by more than two of their stated standard deviations."""
    value = dict(zip(fitted.names, fitted.free, strict=True))
    std = dict(zip(fitted.names, np.sqrt(np.diag(fitted.covariance)), strict=True))
    units = dict(zip(fitted.model.names, fitted.model.units, strict=True))
    rows = []
    for name, (mean, given) in prior.items():
        found = {"stated": mean, "stated_std": given, "value": value[name], "std": std[name]}
        rows.append(MovedParameter(name=name, unit=units[name], moved_sigma=(value[name] - mean) / given, **found))
    return [row for row in rows if abs(row.moved_sigma) > MOVED]


def _identifiability(fitted, prior):
    """Parameters that are dead, known by their prior alone, or traded off against another."""
    std = np.sqrt(np.diag(fitted.covariance))
    seen = np.linalg.norm(fitted.jacobian, axis=0)
    correlation = fitted.covariance / np.outer(std, std)
    names = fitted.names
    return Identifiability(
        dead=[n for n, size in zip(names, seen, strict=True) if size == 0],
        known_by_prior_alone=[n for n, s in zip(names, std, strict=True) if n in prior and s > 0.9 * prior[n][1]],
        traded_off=[
            Tradeoff(pair=(names[i], names[j]), correlation=correlation[i, j])
            for i, j in zip(*np.triu_indices(len(std), 1), strict=True)
            if abs(correlation[i, j]) > TRADED_OFF
        ],
    )


def _separating(causes, others, structure):
    """Measurements that separate the causes: those that the plugins state for their confounders, else general ones."""
    effects = registry().plugins["effect"]
    found = []
    for a in causes:
        for b in others:
            told = (dict(effects[x.effect].confounders).get(y.effect) for x, y in ((a, b), (b, a)))
            text = next(filter(None, told), "other speeds, nearer to and beyond resonance")
            if a.effect == b.effect:
                text = "a probe nearer to one of the places, or a speed near a mode that moves them differently"
            pair = (Place(effect=c.effect, where=c.where, label=structure.label_at(c.where)) for c in (a, b))
            found.append(SeparatingMeasurement(causes=tuple(pair), measurement=text))
    return list({(one.measurement, *map(place, one.causes)): one for one in found}.values())


def _next_runs(kind, found, measured, held):
    """Runs that would decide an ambiguous verdict; of a change both states would have to be run."""
    if kind != "ambiguous" or found.rig.before is not None:
        return []
    return next_runs(found, measured, () if held is None else tuple(held.speed), STATED_SET)


def _not_considered(causes, settings, known):
    """Declared confounders of the causes that are not candidates; known : effects of the rig."""
    effects = registry().plugins["effect"]
    alike = dict.fromkeys(name for cause in causes for name, _ in effects[cause.effect].confounders)
    return [
        name
        for name in alike
        if name in effects and name not in known and (name in settings.leave_out or not effects[name].candidate)
    ]


def _parameter_labels(model, causes):
    """{name: readable name} of the parameters of the extended model: those of causes with their place."""
    labels, of_cause = {}, {id(cause.term): cause for cause in causes}
    for term in model.terms:
        cause, label = of_cause.get(id(term)), f" ({term.label})" if term.label else ""
        for p, part, unknown in _parts(term):
            text = f"relative change of {p.name}" if is_number(p.name) else f"{readable(p.name)}{label}"
            if cause:
                text = place(cause) if p.name == cause.effect else f"{readable(p.name)} of {place(cause)}"
            labels[unknown.name] = f"{text}, {part} part" if part in PARTS else text
    return labels
