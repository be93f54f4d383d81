"""Findings of a diagnosis: what is odd about the records, the rig or the search, and what to do about it."""

from functools import partial
from pathlib import Path

import numpy as np

from rotorstudy.diagnosis.search.impossible import grows
from rotorstudy.diagnosis.verdict.cause_words import place
from rotorstudy.diagnosis.verdict.evidence import moved_parameters, parameter_labels
from rotorstudy.diagnosis.verdict.wide_ranges import wide_ranges
from rotorstudy.inference.fit import residual_share
from rotorstudy.inference.prediction import misfit
from rotorstudy.measurement import findings
from rotorstudy.units import RAD_PER_S, percent, quantity, spins

# severity: name (which of its kind): words, also of findings on two states or several runs
WORDS = Path(__file__).with_name("templates") / "findings.txt"
told = partial(findings.told, table=findings.words_of(WORDS.read_text(encoding="utf-8")))
CONTRADICTED = 5.0  # stated standard deviations, by which a parameter that moves further contradicts the rig
MOST = 0.1  # of the excess error (rms), which the rig with other values may leave
UNUSUAL = 0.1  # error of form (rms), of what the causes change
CERTAIN = 3.0  # standard deviations of the fitted value, by which it differs from the stated one
OTHER = 1.0  # of the stated size, by which it differs


def findings_of(one, kind):
    """Each Finding on a Sought with a verdict of some kind."""
    found, chain, best = one.judged, one.chain, one.judged.best
    if chain:
        beside = f" with {place(chain.beside)}" if chain.beside else ""
        yield told("measuring chain", "records and rig", chain=chain, beside=beside, left=percent(chain.residual_share))
    elif kind == "nothing":
        yield from _within_uncertainty(found)
    else:
        yield from _far_from_the_rig(found, found.base if kind == "unknown" else best.fit)
    if found.stopped:
        yield told("search stopped", "diagnosis", count=len(found.found) - 1)
    elif kind == "unknown" and found.rig.before is None:
        free = wide_ranges(found.rig, found.spectrum, found.settings, found.base)
        yield from [told("free parts of the rig", "records and rig", said=free)] if free else []
    if one.surprised is not None:
        yield told("held-out speeds", "diagnosis", speeds=spins(one.surprised.speed))
    if best.like:
        yield told("model-form error", " and ".join(sorted(best.named)), others=" and ".join(sorted(best.like)))
    speed = found.spectrum.speed
    if found.unstable.any() and (unstable := found.unstable & grows(best.fit, speed)).any():
        at = speed[unstable] / RAD_PER_S["rpm"]
        yield told("unstable rig", "rig", count=len(at), of=len(speed), low=at.min(), high=at.max())


def _far_from_the_rig(found, fitted):
    """A warning if the records look like those of a rig with other values: another machine, other units, other speeds.

    The best explanation then needs unusual values of the rig, as `fitted`, sizes of causes, errors of form or several
    faults at once, and the rig without causes, but with other values, explains most of the excess error.
    """
    best, settings = found.best, found.settings
    theta, labels = best.fit.values, parameter_labels(best.fit.model, best.causes)
    said = [
        f"{labels[row.name]} moved by {abs(row.moved_sigma):.0f} stated standard deviations"
        for row in moved_parameters(fitted, found.prior.by_name)
        if abs(row.moved_sigma) > CONTRADICTED
    ]
    said += [
        f"{labels[unknown.name]} would be {quantity(theta[unknown.name], unknown.unit)}"
        for cause in best.causes
        for unknown in cause.term.unknowns
        if not cause.fixed and abs(theta[unknown.name]) > settings.prior_width * unknown.typical
    ]
    if found.form_error > UNUSUAL:
        said.append(f"the model-form error of the best explanation would be {percent(found.form_error)} (rms)")
    if len(best.faults) > 1:
        said.append(f"{len(best.faults)} faults would have to act at once")
    base = found.base
    before, after = (misfit(base.model, found.spectrum, one) for one in (base.stated_theta, base.theta))
    left = residual_share(before, after, len(base.residual))
    if said and left <= MOST:
        yield told("far from the rig", "records and rig", said="; ".join(said), left=percent(left))


def _within_uncertainty(found):
    """A note if nothing is missing because a vector of the rig, such as an unbalance, took over what changed."""
    fitted, prior, said = found.base, found.prior, []
    vectors = [(term.full_name(p), p) for term in found.rig.terms for p in term.parameters if p.is_complex]
    for name, p in vectors if found.rig.before is None else ():
        parts = [f"{name}_real", f"{name}_imag"]
        if not set(parts) <= set(prior.names):
            continue
        stated, (free, covariance) = complex(*prior.part(parts).mean), fitted.of(parts)
        value, std = complex(*free), float(np.sqrt(np.trace(covariance) / 2))
        if stated and abs(value - stated) > max(OTHER * abs(stated), CERTAIN * std):
            called, (unit, factor) = next(iter(p.also.items()), (p.name, (p.unit, 1.0)))
            both = [f"{quantity(abs(v) / factor, unit)} at {quantity(np.angle(v), 'rad')}" for v in (value, stated)]
            said.append(f"{name.replace(p.name, called)} is {' instead of '.join(both)}")
    if said:
        yield told("explained by the rig", "records and rig", said="; ".join(said))
