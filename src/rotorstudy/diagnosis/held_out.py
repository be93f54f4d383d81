"""Held-out speeds: which, how well each model predicts them, and what that says of an explanation."""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.explanations import LEAST_LOG_ODDS
from rotorstudy.diagnosis.result import Gain
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.inference.prediction import predicted, whitened_prediction


def split(spectrum, hold_out):
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


def gain_of(base, best, held):
    """The Gain of the extension at the held-out speeds; None if there are none."""
    if held is None:
        return None

    def error(fitted):
        shown = predicted(fitted.model, held, fitted.theta)
        off = held.amplitude - held.shown(shown)
        return float(np.sqrt(np.mean(np.abs(off) ** 2))), float(np.sqrt(np.mean(held.whitened(off) ** 2)))

    (before_m, before_sigma), (after_m, after_sigma) = error(base), error(best)
    ratio, sigma = after_m / before_m if before_m else 1.0, {"before_sigma": before_sigma, "after_sigma": after_sigma}
    return Gain(speeds=held.speed, before_m=before_m, after_m=after_m, ratio=ratio, **sigma)


def is_upheld(found, held):
    """Whether the posterior odds of the best explanation suffice with the held-out speeds included."""
    best = found.best
    if held is None or not best.causes:
        return True
    before, after = (_misfit(fitted, held).log_likelihood for fitted in (found.base, best.fit))
    return best.log_posterior_odds + after - before > LEAST_LOG_ODDS


def is_worse(base, best, held, settings):
    """Whether the held-out speeds contradict the prediction of the extended model, and that of the base less."""
    if held is None:
        return False
    before, after = (_misfit(fitted, held) for fitted in (base, best))
    return after.p_value < settings.significance and after.misfit > before.misfit


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
