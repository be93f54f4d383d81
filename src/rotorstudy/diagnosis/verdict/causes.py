"""The causes of an explanation as data: place, parameters with their standard deviations, and posterior probability."""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import far_amplitudes
from rotorstudy.diagnosis.one_cause.over_forms import laws_of, over_forms
from rotorstudy.diagnosis.one_cause.stated import sizes_of
from rotorstudy.diagnosis.search.candidates import form_ranges
from rotorstudy.diagnosis.search.odds import faults_of, odds_of
from rotorstudy.diagnosis.verdict.cause_words import FEW, readable
from rotorstudy.diagnosis.verdict.findings import told
from rotorstudy.diagnosis.verdict.result import Cause, ParameterEstimate
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.fit import chi_square_p_value


def causes_of(explanation, probability, inadequacy, among, share, over):
    """The Cause of every fault of an explanation; among : the explanations with which its variants are compared."""
    found = []
    for fault, parts in faults_of(explanation.causes).items():
        every = [_variant(e, parts[0].cause) for e in _by_variant(explanation, parts[0].cause, among, share)]
        found.append(cause_of(parts, explanation, probability[fault], inadequacy, every, over))
    return found


def _by_variant(explanation, name, among, share):
    """The best explanation by each variant of a cause, the likeliest first.

    As many as hold the true variant with a probability of `share`, if the cause is true.
    """
    best = {}
    for e in sorted((e for e in among if e.named == explanation.named), key=odds_of, reverse=True):
        best.setdefault(tuple(_variant(e, name).items()), e)
    odds = np.array([odds_of(e) for e in best.values()])
    weights = np.exp(odds - odds[0])
    before = np.cumsum(weights) - weights
    return [e for e, less in zip(best.values(), before, strict=True) if less < share * weights.sum()]


def _variant(explanation, name):
    """The alternatives of a cause of an explanation."""
    return next(c.variant for c in explanation.causes if c.cause == name)


def _over_forms(found, explanation, name):
    """The OverForms of a cause of an explanation, beside its others, and its log evidence; None as of `over_forms`."""
    ((cause,), others) = ([c for c in explanation.causes if (c.cause == name) == own] for own in (True, False))
    work = replace(found, spectrum=explanation.spectrum)
    over = over_forms(work, explanation.fit, cause, laws_of(work, cause), others)
    return over and (over, over.log_evidence - work.spectrum.log_shared_volume / 2)


def cause_of(parts, explanation, probability, inadequacy, variants=(), over=None):
    """The Cause of the parts of a fault, options listed where they differ; variants : that are not excluded."""
    where = together([part.where for part in parts])
    fitted, error = explanation.fit, explanation.form.mean_std if explanation.form else 0.0
    parameters = {}
    for part in parts:
        found = _parameters(part, fitted, error)
        taken = "".join(f"_{key}_{own}" for key, own in part.where.items() if isinstance(where[key], list))
        parameters |= {f"{name}{taken}" if name in parameters else name: one for name, one in found.items()}
    usual, variant = {}, parts[0].variant
    if over and parts[0].cause == over.cause.cause:
        usual, variant = _estimates(sizes_of(fitted, parts[0]), error), over.cause.variant
        shape = {name: (value, over.cause.shape_std[name]) for name, value in over.cause.shape.items()}
        parameters |= _estimates(shape | over.stated, error, over.intervals)
    return Cause.of(
        parts[0].effect,
        where,
        fitted.model.structure,
        parameters=parameters,
        usual_form=usual,
        variant=variant,
        other_variants=[one for one in variants if one != variant],
        posterior_probability=probability,
        probability=probability * (1 - inadequacy[len(explanation.faults) > 1]),
    )


def together(places):
    """The options of the places of the parts of a fault, listed where they differ; of stretches both ends of each."""
    found = {}
    for key in dict.fromkeys(key for where in places for key in where):
        values = sorted({where[key] for where in places if key in where})
        found[key] = values if len(values) > 1 else values[0]
    stretches = {(own["element"], own.get("last_element", own["element"])) for own in places if "element" in own}
    if "last_element" in found and len(stretches) > 1:
        found["element"], found["last_element"] = map(list, zip(*sorted(stretches), strict=True))
    return found


def _parameters(candidate, fitted, error):
    """{name: ParameterEstimate} of a candidate as fitted, complex ones by magnitude and phase, then its shape."""
    _, theta, covariance = magnitude_and_phase(candidate.names, *fitted.of(candidate.names))
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
    return parameters | _estimates(sizes_of(fitted, candidate), error)


def _estimates(sizes, error, intervals=None):
    """{name: ParameterEstimate} of a shape.

    In a fit the errors of form of the harmonics are independent. An error that turns all of them alike is as likely,
    and cannot be told from an angle. So the standard deviation of an angle includes it, in rad.

    sizes : name -> (value, std);  error : standard deviation of the form;  intervals : name -> ends of 95 %
    """
    found = {}
    for name, (value, std) in sizes.items():
        unit, ends = "rad" if name.endswith("_rad") else "", (intervals or {}).get(name)
        if unit and std:
            wider = np.hypot(std, error) / std
            std, ends = wider * std, ends and tuple(value + wider * (end - value) for end in ends)
        found[name] = ParameterEstimate(value=value, std=std, unit=unit, part="shape", interval_95=ends)
    return found


def over_its_forms(found, share):
    """The OverForms of the one cause of the best explanation that has a form, None if there is none, and findings.

    The search takes the usual form (a straight front) by any law near its own, and so one depth. Here the form is free,
    by the likely variant of most evidence. A form far from those of the library is told.
    """
    best, settings = found.best, found.settings
    formed = [cause.cause for cause in best.causes if cause.shape and form_ranges(cause.effect)]
    if len(formed) != 1:
        return None, []
    every = [_over_forms(found, one, *formed) for one in _by_variant(best, *formed, found.explanations, share)]
    over, _ = max(filter(None, every), key=lambda one: one[1], default=(None, 0.0))
    odd, has = [], "has"
    explains = over is not None and chi_square_p_value(over.cost, best.spectrum.data_count) >= settings.significance
    if over is None or over.by_own_law is None:
        odd, has = ["its form could not be fitted"], "may have"
    else:
        amplitudes, cost = over.by_own_law
        far = far_amplitudes([over.cause], dict(zip(over.cause.names, amplitudes, strict=True)))
        far = sorted(((abs(away), readable(name.partition("[")[0])) for name, away in far.items()), reverse=True)
        odd += [f"{name} is {away:.1f} usual standard deviations from its value" for away, name in far[:FEW]]
        odd += [f"{len(far) - FEW} more of its numbers are far from theirs"] if len(far) > FEW else []
        if (p_value := chi_square_p_value(cost, best.spectrum.data_count)) < settings.significance:
            odd.append(f"the fit with its form free has a p-value of {p_value:.1g}")
    size = "its intervals allow for any law near them" if explains else "its size may be wrong"
    words = {"odd": "; ".join(odd), "cause": formed[0], "has": has, "size": size}
    return over if explains else None, [told("form of the cause", "causes", **words)] if odd else []
