"""From a spectrum and a model to a verdict: nothing, a cause, ambiguous, or unknown."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.measuring_chain import LEAST_LOG_ODDS as LEAST_CHAIN_LOG_ODDS
from rotorstudy.diagnosis.measuring_chain import best_hypothesis
from rotorstudy.diagnosis.result import (
    Cause,
    ChainHypothesis,
    DetectionLimit,
    Gain,
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
from rotorstudy.diagnosis.search import LEAST_LOG_ODDS, Search, search
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.words import place, readable, summary
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import predicted, whitened_prediction, with_model_error
from rotorstudy.inference.prior import with_rotor
from rotorstudy.inference.problem import magnitude_and_phase
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.units import percent, quantity

STATED_SET = 0.99  # posterior probability that the causes named contain the true one
LEFT_OVER = 0.1  # of the excess rms: if more is left, and it is significant, the cause is rejected
SEEN = 0.5  # of the prior standard deviation: an amplitude known no better from the data has no detection limit
POWER = 1.645  # standard deviations above the threshold for a detection probability of 95 %
MOVED = 2.0  # stated standard deviations beyond which a parameter is listed as moved
CONTRADICTED = 5.0  # stated standard deviations beyond which the records contradict the rig
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
    measured, held = _split(spectrum, settings.hold_out_rad_s if hold_out is None else hold_out)
    fitted = with_model_error(measured, settings)
    held = None if held is None else with_model_error(held, settings)
    found = search(model, fitted, settings)
    chain = _chain_hypothesis(found, measured, settings)
    found = replace(found, upheld=chain is None and _is_upheld(found, held))
    base, best = found.base, found.best
    rows = 2 * fitted.amplitude.size
    p_values = PValues(before=_p_value(base.cost, rows), after=_p_value(best.fit.cost, rows))
    p_parameters = _p_value(best.fit.penalty, len(best.fit.names))
    left = _residual_share(base.cost, best.fit.cost, rows)
    weights = found.posterior()
    probability = {name: sum(w for e, w in weights if name in e.named) for e, _ in weights for name in e.named}
    stated = _stated(weights, best)
    if not best.causes:
        kind = "nothing" if min(p_values.before, p_parameters) >= settings.significance else "unknown"
    elif (
        (p_values.after < settings.significance and left > LEFT_OVER)
        or p_parameters < settings.significance
        or _is_worse(base, best.fit, held, settings)
    ):
        kind = "unknown"
    elif stated or min(probability[name] for name in best.named) < settings.naming_probability:
        kind = "ambiguous"
    else:
        kind = "cause"
    labels = _parameter_labels(best.fit.model, best.causes)
    moved = _moved(best.fit, found.prior.by_name)
    if chain is not None:
        findings = [*findings, _wrong_convention(chain)]
    elif kind != "nothing":
        findings = [*findings, *_far_from_the_rig(found, spectrum, moved, labels, settings)]
    odds = [e.log_posterior_odds for e in found.explanations if e.causes]
    verdict = Verdict(
        verdict=kind,
        causes=[_cause(c, best.fit, probability[c.cause]) for c in best.causes],
        ambiguous_with=[_cause(c, e.fit, probability[c.cause]) for c, e in stated],
        separating_measurement=_separating(best.causes, [c for c, _ in stated]),
        not_considered=_not_considered(best.causes, settings, {term.kind for term in model.terms}),
        broken_plugins=[*registry().failures, *found.broken],
        unexplained=_unexplained(best.fit, fitted, settings) if kind == "unknown" or best.causes else [],
        residual_p_value=p_values,
        residual_share=left,
        log_posterior_odds=max(odds, default=None),
        parameter_p_value=p_parameters,
        detection_limit=_detection_limits(found),
        gain=_gain(base, best.fit, held),
        base_parameters=moved,
        identifiability=_identifiability(best.fit, found.prior.by_name),
        candidates=len(found.candidates),
        settings=settings.model_copy(update={"uncertainty": with_rotor(settings.uncertainty, model.structure)}),
        measuring_chain=chain,
        findings=worst_first(findings),
    )
    verdict = verdict.model_copy(update={"summary": summary(verdict)})
    alternatives = frozenset(c.cause for c, _ in stated)
    return Diagnosis(verdict, fitted, held, found, best.fit, settings, alternatives, labels)


def _split(spectrum, hold_out):
    """The spectrum without the held-out speeds, and those; by default a quarter of five speeds or more."""
    count = len(spectrum.speed)
    if hold_out is None:
        held = np.linspace(0, count - 1, count // 4 + 2).round().astype(int)[1:-1] if count >= 5 else []
    else:
        held = []
        for speed in hold_out:
            near = int(np.abs(spectrum.speed - speed).argmin())
            if abs(spectrum.speed[near] - speed) > 1e-3 * speed:
                known = ", ".join(f"{w:g}" for w in spectrum.speed)
                raise RotorstudyError(f"hold-out speed {speed:g} rad/s was not measured (measured: {known})")
            held.append(near)
    mask = np.isin(np.arange(count), held)
    if mask.all():
        raise RotorstudyError("every speed is held out; leave some to fit")
    return spectrum.at_speeds(~mask), spectrum.at_speeds(mask) if mask.any() else None


def _p_value(cost, freedom):
    """Probability of a cost this large by noise alone; 1 if nothing is free."""
    from scipy.stats import chi2

    return float(max(chi2.sf(cost, freedom), np.finfo(float).tiny)) if freedom else 1.0


def _residual_share(before, after, rows):
    """Remaining share of the excess error (rms): 0 if all is explained, 1 if nothing."""
    return float(np.sqrt(max(after - rows, 0) / max(before - rows, 1e-300))) if before > rows else 0.0


def _stated(weights, best):
    """(candidate, explanation) of the other causes needed for a credible set of probability `STATED_SET`."""
    total, found, seen = 0.0, [], set(best.named)
    for explanation, weight in weights:
        if total >= STATED_SET:
            break
        total += weight
        if not explanation.causes or best.named <= explanation.named:
            continue
        for c in explanation.causes:
            if c.cause not in seen:
                seen.add(c.cause)
                found.append((c, explanation))
    return found


def _cause(candidate, fitted, probability):
    """The Cause of a candidate: fitted parameters, complex ones by magnitude and phase, then its shape."""
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
    for name, value in candidate.shape.items():
        unit = "rad" if name.endswith("_rad") else ""
        parameters[name] = ParameterEstimate(value=value, std=candidate.shape_std.get(name), unit=unit, part="shape")
    return Cause(
        effect=candidate.effect,
        where=candidate.where,
        parameters=parameters,
        variant=candidate.variant,
        posterior_probability=probability,
    )


def _gain(base, best, held):
    """The Gain of the extension at the held-out speeds; None if there are none."""
    if held is None:
        return None

    def error(fitted):
        shown = predicted(fitted.model, held, fitted.theta)
        off = held.amplitude - shown
        return float(np.sqrt(np.mean(np.abs(off) ** 2))), float(np.sqrt(np.mean(held.whitened(off) ** 2)))

    (before_m, before_sigma), (after_m, after_sigma) = error(base), error(best)
    ratio, sigma = after_m / before_m if before_m else 1.0, {"before_sigma": before_sigma, "after_sigma": after_sigma}
    return Gain(speeds=held.speed, before_m=before_m, after_m=after_m, ratio=ratio, **sigma)


def _chain_hypothesis(found, spectrum, settings):
    """The ChainHypothesis that explains the records better than any cause under the stated conventions, or None.

    It must explain them by the standards of a cause: what it leaves is noise or little, the base parameters stay
    plausible, and they move less than under the stated conventions.
    """
    base, rows = found.base, 2 * spectrum.amplitude.size
    p_before, p_base = _p_value(base.cost, rows), _p_value(base.penalty, len(base.names))
    if min(p_before, p_base) >= settings.significance:
        return None
    tested = best_hypothesis(found.model, spectrum, base, settings)
    beyond = tested.log_odds - max(0.0, found.best.log_posterior_odds)
    left = _residual_share(base.cost, tested.fit.cost, rows)
    p_after, p_parameters = _p_value(tested.fit.cost, rows), _p_value(tested.fit.penalty, len(base.names))
    if (
        beyond < LEAST_CHAIN_LOG_ODDS
        or (p_after < settings.significance and left > LEFT_OVER)
        or p_parameters < settings.significance
        or tested.fit.penalty > base.penalty
    ):
        return None
    return ChainHypothesis(
        hypothesis=tested.hypothesis.name,
        remedy=tested.hypothesis.remedy,
        log_odds=tested.log_odds,
        log_odds_of_best_causes=found.best.log_posterior_odds,
        residual_p_value=PValues(before=p_before, after=p_after),
        residual_share=left,
    )


def _wrong_convention(chain):
    """The warning that a convention seems to be stated wrongly."""
    text = (
        f"the records look as if {chain.hypothesis}: corrected for that, the rig explains all but "
        f"{percent(chain.residual_share)} of the excess error (rms), better than any cause (log odds "
        f"{chain.log_odds:.3g}, best causes {chain.log_odds_of_best_causes:.3g}). No cause is named: {chain.remedy}, "
        "then diagnose again"
    )
    return Finding("warning", "measuring chain", "records and rig", text)


def _is_upheld(found, held):
    """Whether the posterior odds of the best explanation suffice with the held-out speeds included."""
    best = found.best
    if held is None or not best.causes:
        return True
    before, after = (_held_out_misfit(fitted, held).log_likelihood for fitted in (found.base, best.fit))
    return best.log_posterior_odds + after - before > LEAST_LOG_ODDS


def _is_worse(base, best, held, settings):
    """Whether the held-out speeds contradict the prediction of the extended model, and that of the base less."""
    if held is None:
        return False
    before, after = (_held_out_misfit(fitted, held) for fitted in (base, best))
    return after.p_value < settings.significance and after.misfit > before.misfit


class HeldOutMisfit(NamedTuple):
    """Held-out speeds against their prediction: misfit, its p-value, and log-likelihood less a constant."""

    misfit: float
    p_value: float
    log_likelihood: float


def _held_out_misfit(fitted, held):
    """Misfit of the held-out speeds, given their noise and the posterior covariance of the parameters."""
    shown, columns = whitened_prediction(fitted.model, held, fitted.names, fitted.free)
    off = held.whitened(held.amplitude) - shown
    spread = np.eye(len(off)) + columns @ fitted.covariance @ columns.T
    misfit = float(off @ np.linalg.solve(spread, off))
    return HeldOutMisfit(misfit, _p_value(misfit, len(off)), -0.5 * (misfit + np.linalg.slogdet(spread)[1]))


def residual_map(fitted, spectrum):
    """(speed, harmonic, sensor) rms of the real and imaginary whitened residual, in standard deviations."""
    count = len(spectrum.harmonics)
    parts = fitted.residual.reshape(len(spectrum.speed), len(spectrum.sensors), 2, count)
    return np.sqrt(np.mean(parts**2, axis=2)).transpose(0, 2, 1)


def _unexplained(fitted, spectrum, settings):
    """Harmonics and nodes with a significant residual, the largest share first."""
    from scipy.stats import chi2

    square = residual_map(fitted, spectrum) ** 2
    total, speeds = square.sum(), len(spectrum.speed)
    found = []
    for h, n in enumerate(spectrum.harmonics):
        for s, node in enumerate(spectrum.sensors):
            part = 2 * square[:, h, s].sum()
            if chi2.sf(part, 2 * speeds) * square[0].size < settings.significance:
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
        needed = np.sqrt(2 * LEAST_LOG_ODDS + found.even_odds_gain(c)) + POWER
        for (p, part, unknown), one in zip(_parts(c.term), screened.detection, strict=True):
            if one < SEEN * c.prior[unknown.name][1]:
                size = {"amplitude": needed * one, "unit": p.unit, "of_typical": needed * one / unknown.typical}
                limits.append(DetectionLimit(effect=c.effect, where=c.where, parameter=p.name, part=part, **size))
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


def _separating(causes, others):
    """Measurements that separate the causes: those that the plugins state for their confounders, else general ones."""
    effects = registry().plugins["effect"]
    found = []
    for a in causes:
        for b in others:
            told = (dict(effects[x.effect].confounders).get(y.effect) for x, y in ((a, b), (b, a)))
            text = next(filter(None, told), "other speeds, nearer to and beyond resonance")
            if a.effect == b.effect:
                text = "a probe nearer to one of the places, or a speed near a mode that moves them differently"
            pair = tuple(Place(effect=c.effect, where=c.where) for c in (a, b))
            found.append(SeparatingMeasurement(causes=pair, measurement=text))
    return list({(one.measurement, *map(place, one.causes)): one for one in found}.values())


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
            text = f"relative change of {p.name}" if term.variation else f"{readable(p.name)}{label}"
            if cause:
                text = place(cause) if p.name == cause.effect else f"{readable(p.name)} of {place(cause)}"
            labels[unknown.name] = f"{text}, {part} part" if part in PARTS else text
    return labels


def _far_from_the_rig(found, spectrum, moved, labels, settings):
    """A warning if the records may not be of this rig: another machine, other units, other speeds.

    Then the rig's own values are contradicted, or an amplitude is beyond `prior_width` typical sizes.
    """
    said = [
        f"{labels[row.name]} moved by {abs(row.moved_sigma):.0f} stated standard deviations"
        for row in moved
        if abs(row.moved_sigma) > CONTRADICTED
    ]
    fitted = found.best.fit
    theta = dict(zip(fitted.model.names, fitted.theta, strict=True))
    said += [
        f"{labels[unknown.name]} would be {quantity(theta[unknown.name], unknown.unit)}"
        for cause in found.best.causes
        for unknown in cause.term.unknowns
        if not cause.fixed and abs(theta[unknown.name]) > settings.prior_width * unknown.typical
    ]
    if not said:
        return []
    moving = spectrum.harmonics != 0
    off = spectrum.amplitude - predicted(found.base.model, spectrum, found.base.theta)
    measured = np.linalg.norm(spectrum.amplitude[:, moving])
    missed = np.linalg.norm(off[:, moving]) / measured if measured else 0.0
    text = (
        f"{'; '.join(said)}; the fitted rig does not explain {100 * missed:.0f} % of the vibration. Are these records "
        "of this rig, at these speeds, in these units? If so, check the sizes of the causes before relying on them, "
        "and the values and the 'uncertainty' in the rig file"
    )
    return [Finding("warning", "far from the rig", "records and rig", text)]
