"""Held-out speeds: which, how well each model predicts them, and what that says of an explanation."""

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS, Search
from rotorstudy.diagnosis.search.form import (
    SCALES,
    SLOWLY_VARYING,
    changes_of,
    form_errors,
    largest_error,
    log_predictive,
)
from rotorstudy.diagnosis.search.impossible import grows
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.search import drop_impossible
from rotorstudy.diagnosis.search.shape_fit import point_of, response_with_shape
from rotorstudy.diagnosis.verdict.result import Gain
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.inference.linear import marginal
from rotorstudy.inference.prediction import predicted, shown_and_slopes
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.units import spin, spins

NEAR = 100.0  # log odds by the fit below the best, from which an explanation is not considered further
MOST_FITTED = 40  # speeds
IMPROBABLE = 0.01  # probability by which the error at held-out speeds may rise although the causes are right


def split(spectrum, hold_out, others=False):
    """The spectrum without the speeds held out, and these: by default a quarter of five or more, or the ones below.

    Of more than `MOST_FITTED` others, with which time and memory of fits grow, the rest is held out, too.
    """
    count, held = len(spectrum.speed), []
    if hold_out is None and count >= 5:
        held = np.linspace(0, count - 1, count // 4 + 2).round().astype(int)[1:-1] - int(others)
    for speed in () if hold_out is None else hold_out:
        held.append(int(np.abs(spectrum.speed - speed).argmin()))
        if not abs(spectrum.speed[held[-1]] - speed) <= 1e-3 * speed:
            raise RotorstudyError(
                f"hold-out speed {spin(speed)} was not measured (measured: {spins(spectrum.speed)}; --rpm for rpm)"
            )
    mask = np.isin(np.arange(count), held)
    if mask.all():
        raise RotorstudyError("every speed is held out; leave some to fit")
    if len(rest := np.flatnonzero(~mask)) > MOST_FITTED:
        shift = int(others) * (len(rest) // MOST_FITTED + 1) // 2
        kept = np.maximum(np.linspace(0, len(rest) - 1, MOST_FITTED).round().astype(int) - shift, 0)
        mask = ~np.isin(np.arange(count), rest[kept])
    return spectrum.at_speeds(~mask), spectrum.at_speeds(mask) if mask.any() else None


def gain_of(found, held, expected):
    """The Gain of the extension at the held-out speeds, None without any; expected : with the error of the causes."""
    if held is None:
        return None
    rms = {}
    for when, fitted in (("before", found.base), ("after", found.best.fit)):
        off = held.amplitude - held.shown(predicted(fitted.model, held, fitted.theta))
        rms[f"{when}_m"] = float(np.sqrt(np.mean(np.abs(off) ** 2)))
        rms[f"{when}_sigma"] = float(np.sqrt(np.mean(held.whitened(off) ** 2)))
    ratio = rms["after_m"] / rms["before_m"] if rms["before_m"] else 1.0
    return Gain(speeds=held.speed, ratio=ratio, rise_probability=rise_probability(found, expected), **rms)


def rise_probability(found: Search, held: Spectrum) -> float:
    """Probability that the error (rms, m) at held-out speeds rises, though the extended model is true.

    With the error e of its prediction, normally distributed, and what the causes change, d, it rises if
    |e| > |e + d|, that is if d.e < -|d|^2 / 2.
    """
    from scipy.special import ndtr

    (shown, columns), covariance = _shown_and_slopes(found, found.best, held)
    base = found.base
    change, columns = held.shown(shown - predicted(base.model, held, base.theta)), held.shown(columns)
    slope, by_noise = np.sum((change.conj() * columns).real, axis=(1, 2, 3)), held.covariance_times(change)
    noise = np.sum((change.conj() * by_noise).real)
    if held.shared_error is not None:  # d.e = (C d).C^-1.e, of which the data are whitened
        along = replace(held, shared_error=None).whitened(by_noise) @ held.shared_error
        noise += along @ along
    spread = np.sqrt(noise + slope @ covariance @ slope)
    return float(ndtr(-np.sum(np.abs(change) ** 2) / (2 * spread))) if spread else 0.5


def expected_of(one: Explanation, found: Search, held: Spectrum, *, largest: bool = False) -> Spectrum:
    """Held-out speeds with the error of the form of the causes that the fit has, or the largest one (`form.py`)."""
    if not (changes := _changes(one, found, held)):
        return held
    varies = largest and one.form.shares[0] > SLOWLY_VARYING[0]  # the largest error does, over the speeds
    shares = SLOWLY_VARYING if varies else one.form.shares
    errors, at = form_errors(held.speed, changes, shares)
    stated = found.settings.form_error
    every = [largest_error(c.effect, p.name, stated) for c in one.causes for p in c.term.parameters] if largest else []
    least = max(every, default=0.0) / max(one.inexactness for one in changes)
    std = np.maximum(stated * np.sqrt(one.form.weights @ SCALES**2), least)
    return held.with_shared_error(held.whitened(std[at][:, None, None, None] * errors).T)


def _changes(one, found, held):
    """What the causes change at held-out speeds; none if all act on the measuring chain."""
    if not one.causes:
        return []
    forces = found.local_forces.at(held)
    motion = forces.motion(one.fit.model, one.fit.theta)
    return changes_of(one.causes, one.fit.values, motion, forces, found.settings.form_error)


def log_likelihood(one: Explanation, found: Search, held: Spectrum) -> float:
    """Log-likelihood of held-out speeds, less a constant, over all sizes of the error of form that the fit leaves."""
    if not (changes := _changes(one, found, held)):
        return held_out_misfit(found, one, held).log_likelihood
    off, columns = _off_and_slopes(found, one, held)
    return log_predictive(held, changes, one.form, off, columns, found.settings.form_error)


def with_held_out(found: Search, held: Spectrum | None) -> Search:
    """The Search with the held-out speeds, which have the model error, in the odds of its explanations.

    Odds with all records are those of the fit times the likelihood of the held-out speeds, given the fit. A fault that
    the library lacks is taken to predict these speeds as well as the causes that do so best. What the error of films
    has in common with the speeds fitted is not taken from these: it counts as unknown again.
    """
    if held is None:
        return found
    stated = held_out_misfit(found, found.nothing, held).log_likelihood
    least, gains = max(map(odds_of, found.explanations)) - NEAR, {frozenset(): stated}
    for key, one in found.found.items():
        if one.causes and odds_of(one) > least:
            with suppress(NoSteadyState):
                gains[key] = log_likelihood(one, found, held)
    weighed = {
        key: replace(found.found[key], log_posterior_odds=odds_of(found.found[key]) + gain - stated)
        for key, gain in gains.items()
    }
    forces = tuple(f._replace(log_odds=f.log_odds + max(gains.values()) - stated) for f in found.free_forces)
    before, found = found.best.kind, replace(found, found=weighed, free_forces=forces)
    if found.best.kind != before:
        drop_impossible(found, {frozenset()})
    is_stable = ~grows(found.base, held.speed)
    while found.best.causes and (grows(found.best.fit, held.speed) & is_stable).any():  # no steady records there
        del found.found[found.best.kind]
    alone = odds_of(found.best) - (gains[found.best.kind] - stated)
    return replace(found, upheld=alone > LEAST_LOG_ODDS)


def is_contradicted(found: Search, held: Spectrum | None, gain: Gain | None) -> bool:
    """Whether a prediction is off by more than its uncertainty, or the error rises where noise hardly explains it."""
    if held is None:
        return False
    is_off = held_out_misfit(found, found.best, held).p_value < found.settings.significance
    return is_off or (gain.ratio > 1 and gain.rise_probability < IMPROBABLE)


class HeldOutMisfit(NamedTuple):
    """Held-out speeds against their prediction: misfit, its p-value, and log-likelihood less a constant."""

    misfit: float
    p_value: float
    log_likelihood: float


def held_out_misfit(found: Search, one: Explanation, held: Spectrum) -> HeldOutMisfit:
    """Misfit of the held-out speeds, given their noise and the posterior covariance of amplitudes and shapes."""
    off, columns = _off_and_slopes(found, one, held)
    misfit, volume = marginal(columns, off)
    likelihood = -0.5 * (misfit + volume + held.log_shared_volume)
    return HeldOutMisfit(misfit, chi_square_p_value(misfit, len(off)), likelihood)


def _off_and_slopes(found, one, held):
    """Whitened: measured less predicted (component,); slopes (component, parameter) by independent unit parameters."""
    (shown, columns), covariance = _shown_and_slopes(found, one, held)
    size = np.sqrt(np.diag(covariance))
    unit = np.where(size > 0, size, 1.0)
    variance, along = np.linalg.eigh(covariance / np.outer(unit, unit))
    root = unit[:, None] * along * np.sqrt(np.maximum(variance, 0.0))
    return held.whitened(held.amplitude - shown), held.whitened(columns).T @ root


def _shown_and_slopes(found, one, held):
    """What an Explanation predicts, its slopes by amplitudes and then shapes (parameter, ...), and the covariance."""
    fitted = one.fit
    if one.covariance is None:
        return shown_and_slopes(fitted.model, held, fitted.theta, fitted.names), fitted.covariance
    work, points = replace(found, spectrum=held), [point_of(found, cause) for cause in one.causes]
    return response_with_shape(work, one.causes, fitted.free, points), one.covariance
