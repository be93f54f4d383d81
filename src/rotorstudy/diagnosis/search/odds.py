"""Posterior odds of sets of causes against the base model alone: Bayes factor times prior odds."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from rotorstudy.diagnosis.search.candidates import SCALES, Candidate
from rotorstudy.diagnosis.settings import Settings, base_rate
from rotorstudy.inference.fit import Fit
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure

SWEEPS = 3  # over the parameters of a cause, for their most probable widths
FURTHER_FAULT = 0.1  # prior odds of one more fault against none, whichever it is: most machines have one at a time
FURTHER_PART = 0.5  # prior probability that a fault has one more of its parts: as likely as not
THRESHOLD_STEPS = 20  # of a fixed-point iteration that converges quickly
ROUND_OFF = 1e-15  # of the largest eigenvalue of a covariance: smaller ones have no correct digits
LEAST_LOG_PROBABILITY = -700.0  # keeps posterior probabilities from underflow to zero


@dataclass(frozen=True)
class Explanation:
    """A set of causes, fitted."""

    causes: tuple[Candidate, ...]
    fit: Fit
    log_posterior_odds: float  # natural logarithm of its odds against the base model alone
    form: tuple | None = None  # FormError of the causes, if there are any
    spectrum: Spectrum | None = None  # with that error, to which they were fitted
    # (parameter, parameter) of the amplitudes of the fit and of the shapes as fractions of their ranges, if it has any
    covariance: np.ndarray | None = None
    like: frozenset = frozenset()  # names of causes like which it errs in its form, if that is its most probable error

    @property
    def kind(self):
        """See `kind_of`."""
        return kind_of(self.causes)

    @property
    def named(self):
        """Names of the causes in a verdict, without their shapes."""
        return frozenset(cause.cause for cause in self.causes)

    @property
    def faults(self):
        """Names of the faults that the causes are parts of."""
        return frozenset(faults_of(self.causes))


def kind_of(causes: tuple[Candidate, ...]) -> frozenset:
    """Some causes, each with its alternatives and the quadrants of its angles, between which steps do not lead."""
    return frozenset(
        (c.cause, *c.variant.items(), *(v // (np.pi / 2) for name, v in c.shape.items() if name.endswith("_rad")))
        for c in causes
    )


def faults_of(causes: tuple[Candidate, ...]) -> dict[str, list[Candidate]]:
    """Faults that causes are parts of, each with its parts.

    The parts have the same fault by name, or the first one brings the other: an eccentric mass has an unbalance.
    """
    effects = registry().plugins["effect"]
    brought_by = {
        name + "".join(f", {key} {value}" for key, value in c.where.items()): c.fault
        for c in causes
        for name in effects[c.effect].brings
    }
    found = {}
    for cause in sorted(causes, key=lambda c: c.cause in brought_by):
        found.setdefault(brought_by.get(cause.cause, cause.fault), []).append(cause)
    return found


def is_distributed(parts: list[Candidate]) -> bool:
    """Whether the parts of a fault are faults at places of their own, as an unbalance at several discs is."""
    return len({cause.fault for cause in parts}) > 1 and len({cause.effect for cause in parts}) == 1


def odds_of(explanation: Explanation) -> float:
    """Its log posterior odds, the key by which explanations are compared."""
    return explanation.log_posterior_odds


def log_scales(
    mean: np.ndarray, covariance: np.ndarray, parameter: np.ndarray, scales: np.ndarray = SCALES
) -> np.ndarray:
    """Logarithm of the Bayes factor of a prior whose widths are unknown against the widest one.

    One parameter has one of `scales`. Of several, each has a width of its own or is absent with a probability of one
    half: of the many harmonics of a coupling few may be present. The sum over all combinations is approximated about
    the most probable one, one width varied at a time, which is exact where the data do not correlate the parameters.

    mean, covariance : (..., unknown), (..., unknown, unknown) of the posterior under the widest prior, in standard
                       deviations of that prior
    parameter        : (unknown,) position of the parameter of each amplitude
    returns          : (...)
    """
    narrow, axes = np.linalg.eigh(covariance)
    narrow = np.clip(narrow, np.maximum(1e-30, ROUND_OFF * narrow[..., -1:]), 1)
    known = 1 / narrow - 1  # precision that the data give along each axis of the posterior
    pull = (mean[..., None, :] @ axes)[..., 0, :] / narrow
    if parameter[-1] == 0:  # one width: the posterior keeps its axes
        found = np.logaddexp.reduce(_by_width(pull, known, scales), axis=-1) - np.log(len(scales))
        return found - _by_width(pull, known, np.ones(1))[..., 0]
    pull, known = (axes @ pull[..., None])[..., 0], (axes * known[..., None, :]) @ np.swapaxes(axes, -1, -2)

    def value(widths):
        """Log evidence (...), less a constant, of widths (..., parameter)."""
        root = widths[..., parameter]
        precision = np.eye(len(parameter)) + root[..., :, None] * known * root[..., None, :]
        drawn = root * pull
        solved = np.linalg.solve(precision, drawn[..., None])[..., 0]
        return 0.5 * (np.sum(drawn * solved, axis=-1) - np.linalg.slogdet(precision)[1])

    def varied(best, i):
        """Log evidence (..., width) of one parameter by its width, less that of its absence, beside the others."""
        own, others = np.flatnonzero(parameter == i), np.flatnonzero(parameter != i)
        root = best[..., parameter[others], None]
        rest = np.eye(len(others)) + root * known[..., others[:, None], others] * np.swapaxes(root, -1, -2)
        right = root * np.concatenate([known[..., others[:, None], own], pull[..., others, None]], axis=-1)
        by_others = np.swapaxes(right[..., :-1], -1, -2) @ np.linalg.solve(rest, right)
        left, axes = np.linalg.eigh(known[..., own[:, None], own] - by_others[..., :-1])
        pulled = ((pull[..., own] - by_others[..., -1])[..., None, :] @ axes)[..., 0, :]
        return _by_width(pulled, np.maximum(left, 0), widths)

    widths = np.append(0, scales)
    log_prior = np.append(0, np.full(len(scales), -np.log(len(scales)))) - np.log(2)
    best = np.ones((*mean.shape[:-1], int(parameter[-1]) + 1))
    widest = value(best)
    for _ in range(SWEEPS):
        factor = 0.0
        for i in range(best.shape[-1]):
            found = varied(best, i) + log_prior
            top = found.argmax(axis=-1)
            best[..., i] = widths[top]
            factor += np.logaddexp.reduce(found, axis=-1) - found.max(axis=-1) + log_prior[top]
    return value(best) + factor - widest


def _by_width(pull, precision, widths):
    """Log evidence (..., width), less a constant, of independent amplitudes by the width of their prior.

    pull, precision : (..., unknown) that the data give
    """
    square = widths[:, None] ** 2
    whole = 1 + square * precision[..., None, :]
    return 0.5 * np.sum(square * pull[..., None, :] ** 2 / whole - np.log(whole), axis=-1)


def log_possible(mean: np.ndarray, std: np.ndarray, prior: np.ndarray = 0.0) -> np.ndarray:
    """Logarithm of the Bayes factor of amplitudes that cannot be negative against ones that can.

    The limit raises the prior density above zero, and keeps the posterior probability of a positive amplitude.

    mean, std : (...) of the posterior without the limit
    prior     : (...) mean of the prior without the limit, in its standard deviations
    returns   : (...)
    """
    from scipy.special import log_ndtr

    return log_ndtr(np.asarray(mean) / np.asarray(std)) - log_ndtr(np.asarray(prior, float))


class PriorOdds:
    """Prior odds of causes: the base rate of an effect in the library, divided among its places and alternatives.

    Some effects are expected at some places more often than at others, as an unbalance is where the mass is: there the
    odds follow `Effect.place_rate`, but for a share that all places have alike, as a rig does not list every bolt.
    A further part of a fault that is there already (another harmonic of a runout) is as likely as not, whichever it is.
    """

    def __init__(self, candidates: list[Candidate], settings: Settings, structure: Structure):
        alternatives = dict.fromkeys((c.effect, c.cause, tuple(c.variant.values())) for c in candidates)
        effects = Counter(effect for effect, _, _ in alternatives)  # in order, as the digits of a sum depend on it
        faults = Counter(c.fault for c in candidates)
        rates = {name: base_rate(name, settings) for name in effects}
        self.of_effect = {name: rate / (sum(rates.values()) * effects[name]) for name, rate in rates.items()}
        self.at_place = _relative_to_places_alike(candidates, settings.expected_place, structure)
        self.at_discs, self.discs = settings.at_discs, {disc.node for disc in structure.discs}
        self.further_part = {name: FURTHER_PART / max(count - 1, 1) for name, count in faults.items()}
        # a stretch of elements that is no candidate is one of as many as lie between candidates at each end
        self.candidates, self.between = {c.cause for c in candidates}, 1 / structure.stretch_step**2

    def of(self, cause: Candidate) -> float:
        """Of a cause by itself."""
        return self.of_effect[cause.effect] * self._share(cause) * self.at_place.get(cause.cause, 1.0)

    def _share(self, cause):
        return 1.0 if cause.cause in self.candidates else self.between

    def log_odds(self, causes: tuple[Candidate, ...]) -> float:
        """Logarithm of those of several causes together."""
        faults = self.together(causes)
        total = np.log(FURTHER_FAULT) * max(len(faults) - 1, 0)
        for first, *others in faults:
            total += np.log(self.of(first)) + sum(np.log(self._of_further(first, c)) for c in others)
        return float(total)

    def together(self, causes: tuple[Candidate, ...]) -> list[list[Candidate]]:
        """The parts of each fault, of those at several discs by falling odds: a distributed unbalance is one fault."""
        found = {}
        for name, parts in faults_of(causes).items():
            first = parts[0]
            is_shared = first.effect in self.at_discs and first.where.get("node") in self.discs
            found.setdefault(first.effect if is_shared else name, []).extend(parts)
        return [
            sorted(parts, key=self.of, reverse=True) if is_distributed(parts) else parts for parts in found.values()
        ]

    def _of_further(self, first, cause):
        other_disc = is_distributed([first, cause])  # each as likely as not, whichever it is
        if other_disc:
            return FURTHER_PART / (len(self.discs) - 1)
        return self.further_part.get(cause.fault, FURTHER_PART) * self._share(cause)

    def even_odds_gain(self, cause: Candidate) -> float:
        """Decrease of the cost at which a cause has even posterior odds: it offsets prior odds and Occam factor.

        With the prior width of highest evidence, which is about the amplitude itself, the Occam factor depends on the
        decrease of the cost; hence the fixed-point iteration.
        """
        absent = cause.parameter[-1] * (not cause.fixed)  # all parameters but one
        widths = sum(np.log(len(scales)) for *_, scales in cause.widths) + (absent + 1) * np.log(2) * (absent > 0)
        given = -2 * np.log(self.of(cause)) + 2 * widths
        count, gain = max(np.bincount(cause.parameter)) * (not cause.fixed), given
        for _ in range(THRESHOLD_STEPS):
            gain = given + count * np.log1p(gain / max(count, 1))
        return float(gain)


def _relative_to_places_alike(candidates, expected, structure):
    """{cause: its prior probability over that with all places alike}, of effects with a `place_rate`."""
    found = {}
    for name in {c.effect for c in candidates}:
        rate = registry().get("effect", name).place_rate
        if rate is None:
            continue
        places = {c.cause: max(rate(structure, **c.where), 0.0) for c in candidates if c.effect == name}
        mean = np.mean(list(places.values()))
        found |= {cause: 1 + expected * (one / mean - 1) if mean > 0 else 1.0 for cause, one in places.items()}
    return found


def log_posterior_odds(causes: tuple[Candidate, ...], fitted: Fit, base: Fit, prior_odds: PriorOdds) -> float:
    """Log posterior odds of fitted causes against the base alone."""
    odds = fitted.evidence - base.evidence + prior_odds.log_odds(causes)
    for cause in causes:
        for name in cause.positive:
            mean, std = total(cause, name, fitted)
            odds += float(log_possible(mean, std, _stated(cause, name, fitted)))
            odds += _log_beyond(mean, std, fitted.slope[fitted.names.index(name)])
    for parts in prior_odds.together(causes):
        known = [_in_widths(cause, fitted, *of) for cause in parts for of in cause.widths]
        if is_distributed(parts):
            known = [_static_and_couple(parts, fitted)]
        odds += sum(float(log_scales(*one)) for one in known)
    return float(odds)


def _in_widths(cause, fitted, amplitudes, parameter, scales):
    """Arguments of `log_scales` for some amplitudes of a cause; the other arguments are those of `Candidate.widths`."""
    place = [fitted.names.index(cause.names[i]) for i in amplitudes]
    width = fitted.prior.std[place]
    covariance = fitted.covariance[np.ix_(place, place)] / np.outer(width, width)
    return (fitted.free[place] - fitted.prior.mean[place]) / width, covariance, parameter, scales


def _static_and_couple(parts, fitted):
    """The same of an effect at several discs, by its static part, its couple, and so on, as ISO 21940-1 resolves it.

    Each of them has a width of its own, or is absent: two discs are often loaded oppositely, or alike.
    """
    parts = sorted(parts, key=lambda cause: cause.where["node"])
    place = [fitted.names.index(name) for cause in parts for name in cause.names]
    width, count = fitted.prior.std[place], len(parts[0].names)
    modes = np.linalg.qr(np.vander(np.arange(len(parts), dtype=float), increasing=True))[0].T
    turned = np.kron(modes, np.eye(count)) / width
    parameter = np.repeat(np.arange(len(parts)), count)
    return turned @ fitted.free[place], turned @ fitted.covariance[np.ix_(place, place)] @ turned.T, parameter


def _log_beyond(mean, std, slope):
    """Logarithm of the posterior probability above zero, over that as if the fit, which was held there, ended there.

    mean, std : of an amplitude that cannot be negative;  slope : `Posterior.slope` along it
    """
    from scipy.special import log_ndtr

    at, beyond = mean / std, min(slope * std, 0.0)
    return min(0.0, float(log_ndtr(at + beyond) + beyond**2 / 2 - log_ndtr(at)))  # of one not held there is no more


def total(cause: Candidate, name: str, fitted: Fit) -> tuple[float, float]:
    """Mean and standard deviation of an amplitude of a cause together with what the base has of the same."""
    same = {name: 1.0, **cause.positive[name]}
    theta = fitted.values
    weight = np.array([same.get(free, 0.0) for free in fitted.names])
    return sum(factor * theta[one] for one, factor in same.items()), np.sqrt(weight @ fitted.covariance @ weight)


def _stated(cause, name, fitted):
    """Mean of the prior of that total, in standard deviations of the prior of the amplitude."""
    theta = fitted.values | dict(zip(fitted.prior.names, fitted.prior.mean, strict=True))
    stated = theta[name] + sum(factor * theta[one] for one, factor in cause.positive[name].items())
    return stated / fitted.prior.std[fitted.names.index(name)]
