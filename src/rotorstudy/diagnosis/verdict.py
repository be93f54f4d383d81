"""From a spectrum and a model to a verdict: nothing, a cause, ambiguous, or unknown."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search import ACCUSES, Search, search
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import predicted, whitened_prediction, with_model_error
from rotorstudy.inference.problem import magnitude_and_phase
from rotorstudy.measurement.spectrum import Spectrum

STATED_SET = 0.99  # confidence that the causes named together hold the true one
LEFT_OVER = 0.1  # of the excess rms before, above which a significant rest means that the cause is not the right one
SEEN = 0.5  # of its prior's deviation: an amplitude that the data narrow less has no detection limit
POWER = 1.645  # deviations above the price at which 95 % of effects of that size are found


@dataclass(frozen=True)
class Diagnosis:
    """Everything behind a verdict.

    verdict : dict, the content of verdict.json
    spectrum, held_out : Spectrum fitted (its covariance with the model error), and the one no fit has seen, or None
    search  : Search;  best : Fit of the extended model, the base fit if nothing was added
    """

    verdict: dict
    spectrum: Spectrum
    held_out: Spectrum | None
    search: Search
    best: Fit
    settings: Settings


def diagnose(spectrum, model, *, hold_out=None, settings=None):
    """The verdict (dict) on what a model lacks to explain a spectrum, see `investigate`."""
    return investigate(spectrum, model, hold_out=hold_out, settings=settings).verdict


def investigate(spectrum, model, *, hold_out=None, settings=None):
    """What a model lacks to explain a spectrum.

    spectrum : Spectrum of measured harmonics with their covariance, of the model's sensors
    model    : Model with values for all its parameters
    hold_out : speeds (rad/s) no fit shall see; by default about a quarter, from the middle
    settings : Settings, or a dict of some
    returns  : Diagnosis
    raises   : RotorstudyError for sensors that do not match, speeds that do not exist, a model without values
    """
    settings = Settings(**settings) if isinstance(settings, dict) else settings or Settings()
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    fitted, held = _split(spectrum, settings.hold_out_rad_s if hold_out is None else hold_out)
    fitted = with_model_error(fitted, settings)
    held = None if held is None else with_model_error(held, settings)
    found = search(model, fitted, settings)
    found = replace(found, upheld=_is_upheld(found, held))
    best = found.best
    gain = _gain(found.base, best.fit, held)
    rows = 2 * fitted.amplitude.size
    unlikely_before, unlikely_after = _tail(found.base.cost, rows), _tail(best.fit.cost, rows)
    bent = _tail(best.fit.penalty, len(best.fit.names))
    left = _residual_share(found.base.cost, best.fit.cost, rows)
    fits = unlikely_after >= settings.significance or left <= LEFT_OVER
    weights = found.posterior()
    sure = {name: sum(w for e, w in weights if name in e.named) for e, _ in weights for name in e.named}
    stated = _stated(weights, best)
    if not best.causes:
        verdict = "nothing" if min(unlikely_before, bent) >= settings.significance else "unknown"
    elif not fits or bent < settings.significance or _is_worse(found.base, best.fit, held, settings):
        verdict = "unknown"
    elif stated or min(sure[name] for name in best.named) < settings.naming_probability:
        verdict = "ambiguous"
    else:
        verdict = "cause"
    causes = [_cause(c, best.fit, sure[c.cause]) for c in best.causes]
    others = [_cause(c, e.fit, sure[c.cause]) for c, e in stated]
    result = {
        "verdict": verdict,
        "causes": causes,
        "ambiguous_with": others,
        "separating_measurement": _separating(best, [c for c, _ in stated]),
        "unexplained": _unexplained(best.fit, fitted, settings) if verdict == "unknown" or best.causes else [],
        "residual_p_value": {"before": unlikely_before, "after": unlikely_after},
        "score": max((2 * e.log_posterior_odds for e in found.explanations if e.causes), default=None),
        "parameter_p_value": bent,
        "residual_share": left,
        "detection_limit": _detection_limits(found),
        "gain": gain,
        "base_parameters": _moved(best.fit, found.prior.by_name),
        "identifiability": _identifiability(best.fit, found.prior.by_name),
        "settings": settings.model_dump(),
        "candidates": len(found.candidates),
    }
    return Diagnosis(result, fitted, held, found, best.fit, settings)


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


def _tail(cost, freedom):
    from scipy.stats import chi2

    return float(max(chi2.sf(cost, freedom), np.finfo(float).tiny))


def _residual_share(before, after, rows):
    """Share of the excess that is left, as rms: 0 if all is explained, 1 if nothing."""
    return float(np.sqrt(max(after - rows, 0) / max(before - rows, 1e-300))) if before > rows else 0.0


def _stated(weights, best):
    """(candidate, explanation) of other causes that must be named too, for the set to hold the truth surely."""
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


def _cause(candidate, fitted, sure):
    """A cause for verdict.json: effect, place, parameters with value, std and unit, confidence."""
    place = [fitted.names.index(name) for name in candidate.names]
    theta, covariance = fitted.free[place], fitted.covariance[np.ix_(place, place)]
    names, theta, covariance = magnitude_and_phase(candidate.names, theta, covariance)
    units = {}
    for p in candidate.term.parameters:
        units[candidate.term.full_name(p)] = p.unit
    parameters = {}
    for name, value, variance in zip(names, theta, np.diag(covariance), strict=True):
        short = name.replace(f"[{candidate.term.label}]", "")
        unit = "rad" if name not in units and name.endswith("_phase") else units[name]
        parameters[short] = {"value": float(value), "std": float(np.sqrt(variance)), "unit": unit}
    shape = {name: {"value": value, "std": None, "unit": "shape"} for name, value in candidate.shape.items()}
    return {"effect": candidate.effect, "where": candidate.where, "parameters": parameters | shape,
            "posterior_probability": float(sure)}  # fmt: skip


def _gain(base, best, held):
    """Error on speeds no fit has seen, before and after the extension, in m rms and in standard deviations."""
    if held is None:
        return None

    def error(fitted):
        shown = predicted(fitted.model, held, fitted.theta)
        off = held.amplitude - shown
        return float(np.sqrt(np.mean(np.abs(off) ** 2))), float(np.sqrt(np.mean(held.whitened(off) ** 2)))

    (before_m, before_sigma), (after_m, after_sigma) = error(base), error(best)
    return {
        "speeds": [float(w) for w in held.speed],
        "before_m": before_m,
        "after_m": after_m,
        "ratio": after_m / before_m if before_m else 1.0,
        "before_sigma": before_sigma,
        "after_sigma": after_sigma,
    }


def _is_upheld(found, held):
    """Whether the best explanation is still likelier than the base alone once the held-out speeds are counted too."""
    best = found.best
    if held is None or not best.causes:
        return True
    before, after = (_surprise(fitted, held).chance for fitted in (found.base, best.fit))
    return best.log_posterior_odds + after - before > ACCUSES


def _is_worse(base, best, held, settings):
    """Whether held-out speeds speak against the extension: they contradict what it predicts, and the base less so."""
    if held is None:
        return False
    before, after = (_surprise(fitted, held) for fitted in (base, best))
    return after.tail < settings.significance and after.misfit > before.misfit


class Surprise(NamedTuple):
    """Of held-out speeds: misfit, the probability of one as large, the logarithm of their chance less a constant."""

    misfit: float
    tail: float
    chance: float


def _surprise(fitted, held):
    """Surprise of held-out speeds, noise and what the fit leaves open of its parameters counted."""
    shown, columns = whitened_prediction(fitted.model, held, fitted.names, fitted.free)
    off = held.whitened(held.amplitude) - shown
    spread = np.eye(len(off)) + columns @ fitted.covariance @ columns.T
    misfit = float(off @ np.linalg.solve(spread, off))
    return Surprise(misfit, _tail(misfit, len(off)), -0.5 * (misfit + np.linalg.slogdet(spread)[1]))


def residual_map(fitted, spectrum):
    """(speed, harmonic, sensor) rms of the real and imaginary whitened residual, in standard deviations."""
    count = len(spectrum.harmonics)
    parts = fitted.residual.reshape(len(spectrum.speed), len(spectrum.sensors), 2, count)
    return np.sqrt(np.mean(parts**2, axis=2)).transpose(0, 2, 1)


def _unexplained(fitted, spectrum, settings):
    """Harmonics and nodes whose residual noise does not explain: share of the whole, and how many deviations."""
    from scipy.stats import chi2

    square = residual_map(fitted, spectrum) ** 2
    total, speeds = square.sum(), len(spectrum.speed)
    found = []
    for h, n in enumerate(spectrum.harmonics):
        for s, node in enumerate(spectrum.sensors):
            part = 2 * square[:, h, s].sum()
            if chi2.sf(part, 2 * speeds) * square[0].size < settings.significance:
                found.append({
                    "harmonic": int(n), "node": int(node), "share": float(part / (2 * total)),
                    "sigma": float(np.sqrt(part / (2 * speeds))),
                })  # fmt: skip
    return sorted(found, key=lambda row: -row["share"])


def _detection_limits(found):
    """Smallest amplitude of each candidate found in 95 of 100 such records, the most sensitive first."""
    limits = []
    for c, screened in zip(found.candidates, found.screened, strict=True):
        unknowns = c.term.unknowns
        needed = np.sqrt(2 * ACCUSES + found.even_odds_gain(c)) + POWER
        for unknown, one in zip(unknowns, screened.detection, strict=True):
            if one < SEEN * c.prior[unknown.name][1]:
                name = unknown.name.replace(f"[{c.term.label}]", "")
                limits.append({"effect": c.effect, "where": c.where, "parameter": name,
                               "amplitude": float(needed * one), "unit": unknown.unit,
                               "of_typical": float(needed * one / unknown.typical)})  # fmt: skip
    return sorted(limits, key=lambda row: row["of_typical"])


def _moved(fitted, prior):
    """Base parameters that a fit moved by more than two of their stated deviations."""
    found = []
    value = dict(zip(fitted.names, fitted.free, strict=True))
    std = dict(zip(fitted.names, np.sqrt(np.diag(fitted.covariance)), strict=True))
    for name, (mean, given) in prior.items():
        moved = (value[name] - mean) / given
        if abs(moved) > 2:
            found.append({"name": name, "stated": mean, "stated_std": given, "value": float(value[name]),
                          "std": float(std[name]), "moved_sigma": float(moved)})  # fmt: skip
    return found


def _identifiability(fitted, prior):
    """What the data say of each parameter: dead, pinned by its prior alone, or traded off against another."""
    std = np.sqrt(np.diag(fitted.covariance))
    seen = np.linalg.norm(fitted.jacobian, axis=0)
    correlation = fitted.covariance / np.outer(std, std)
    dead = [n for n, size in zip(fitted.names, seen, strict=True) if size == 0]
    by_prior = [n for n, s in zip(fitted.names, std, strict=True) if n in prior and s > 0.9 * prior[n][1]]
    traded = []
    for i, j in zip(*np.triu_indices(len(std), 1), strict=True):
        if abs(correlation[i, j]) > 0.95:
            traded.append({"pair": [fitted.names[i], fitted.names[j]], "correlation": float(correlation[i, j])})
    return {"dead": dead, "known_by_prior_alone": by_prior, "traded_off": traded}


def _separating(best, others):
    """What would tell the causes apart: what the plugins say of their confounders, else what helps in general."""
    from rotorstudy.model.registry import registry

    if not others or not best.causes:
        return ""
    effects = registry().plugins["effect"]
    said = []
    for a in best.causes:
        for b in others:
            text = dict(effects[a.effect].confounders).get(b.effect) or dict(effects[b.effect].confounders).get(
                a.effect
            )
            if a.effect == b.effect:
                text = "a probe nearer to one of the places, or a speed near a mode that moves them differently"
            said.append(f"{a.cause} or {b.cause}: {text or 'other speeds, nearer to and beyond resonance'}")
    return "; ".join(dict.fromkeys(said))
