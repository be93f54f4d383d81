"""Held-out speeds: which, how well each model predicts them, and what that says of an explanation."""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS
from rotorstudy.diagnosis.verdict.result import Gain
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit, chi_square_p_value
from rotorstudy.inference.prediction import carried_order, predicted, whitened_prediction
from rotorstudy.measurement.spectrum import Spectrum, components
from rotorstudy.response.measured import measured_response_and_jacobian

IMPROBABLE = 0.01  # probability by which the error at held-out speeds may rise although the causes are right


def split(spectrum, hold_out):
    """The spectrum without the held-out speeds, and those; by default a quarter of five speeds or more."""
    count = len(spectrum.speed)
    if hold_out is None:
        held = np.linspace(0, count - 1, count // 4 + 2).round().astype(int)[1:-1] if count >= 5 else []
    else:
        held = []
        for speed in hold_out:
            near = int(np.abs(spectrum.speed - speed).argmin())
            if not abs(spectrum.speed[near] - speed) <= 1e-3 * speed:
                known = ", ".join(f"{w:g}" for w in spectrum.speed)
                raise RotorstudyError(
                    f"hold-out speed {speed:g} rad/s was not measured (measured: {known}; --rpm for rpm)"
                )
            held.append(near)
    mask = np.isin(np.arange(count), held)
    if mask.all():
        raise RotorstudyError("every speed is held out; leave some to fit")
    return spectrum.at_speeds(~mask), spectrum.at_speeds(mask) if mask.any() else None


def gain_of(base, best, held, expected):
    """The Gain of the extension at the held-out speeds; None if there are none.

    expected : Spectrum held out, whose covariance has the error of the causes too
    """
    if held is None:
        return None

    def error(fitted):
        shown = predicted(fitted.model, held, fitted.theta)
        off = held.amplitude - held.shown(shown)
        return float(np.sqrt(np.mean(np.abs(off) ** 2))), float(np.sqrt(np.mean(held.whitened(off) ** 2)))

    (before_m, before_sigma), (after_m, after_sigma) = error(base), error(best)
    ratio, sigma = after_m / before_m if before_m else 1.0, {"before_sigma": before_sigma, "after_sigma": after_sigma}
    sigma["rise_probability"] = rise_probability(base, best, expected)
    return Gain(speeds=held.speed, before_m=before_m, after_m=after_m, ratio=ratio, **sigma)


def rise_probability(base: Fit, best: Fit, held: Spectrum) -> float:
    """Probability that the error (rms, m) at held-out speeds rises, though the extended model is true.

    With the error e of its prediction, by noise and uncertain parameters, and what the causes change, d, it rises if
    |e| > |e + d|, that is if d.e < -|d|^2 / 2. This is linear in e, which is normally distributed.

    base, best : of the model without and with the causes
    returns    : one half where the causes change nothing there
    """
    from scipy.special import ndtr

    model = best.model
    shown, columns = measured_response_and_jacobian(
        model, held.speed, held.harmonics, best.theta, order=carried_order(held)
    )
    change = held.shown(shown - predicted(base.model, held, base.theta))
    columns = held.shown(np.moveaxis(columns[..., model.position(best.names)], -1, 0))
    slope, parts = np.sum((change.conj() * columns).real, axis=(1, 2, 3)), components(change)
    noise = np.einsum("wcs,wscd,wds->", parts, held.covariance, parts)
    spread = np.sqrt(noise + slope @ best.covariance @ slope)
    return float(ndtr(-np.sum(np.abs(change) ** 2) / (2 * spread))) if spread else 0.5


def is_upheld(found, held):
    """Whether the posterior odds of the best explanation suffice with the held-out speeds included.

    They do not where it allows no steady motion at one of them.
    """
    best = found.best
    if held is None or not best.causes:
        return True
    try:
        before, after = (_misfit(fitted, held).log_likelihood for fitted in (found.base, best.fit))
    except NoSteadyState:
        return False
    return best.log_posterior_odds + after - before > LEAST_LOG_ODDS


def is_worse(base, best, held, settings, gain):
    """Whether the held-out speeds contradict the extended model, and the base model less.

    Its prediction must be off by more than its uncertainty and than that of the base model, or the error rise where
    noise hardly explains it.
    """
    if held is None:
        return False
    before, after = (_misfit(fitted, held) for fitted in (base, best))
    is_off = after.p_value < settings.significance and after.misfit > before.misfit
    return is_off or (gain.ratio > 1 and gain.rise_probability < IMPROBABLE)


class HeldOutMisfit(NamedTuple):
    """Held-out speeds against their prediction: misfit, its p-value, and log-likelihood less a constant."""

    misfit: float
    p_value: float
    log_likelihood: float


def _misfit(fitted, held):
    """Misfit of the held-out speeds, given their noise and the posterior covariance of the parameters."""
    shown, columns = whitened_prediction(fitted.model, held, fitted.names, fitted.free)
    off = held.whitened(held.amplitude) - shown
    spread = np.eye(len(off)) + columns @ fitted.covariance @ columns.T
    misfit = float(off @ np.linalg.solve(spread, off))
    return HeldOutMisfit(misfit, chi_square_p_value(misfit, len(off)), -0.5 * (misfit + np.linalg.slogdet(spread)[1]))
