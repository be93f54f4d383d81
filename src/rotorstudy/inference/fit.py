"""The fit of the predicted to the measured harmonics within a prior."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import attrgetter
from typing import Any

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS, levenberg_marquardt
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import whitened_prediction
from rotorstudy.inference.prior import Prior, log_narrowing
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model

DOUBTFUL = 1e-3  # p-value of the cost below which a fit may have ended far from the best one
IMPLAUSIBLE = 1e-6  # the same of the parameters alone
LESS = 0.99  # of the cost that the best fit has at most where another one is found
MOST_LEVELS = 12
CERTAIN = 0.999  # p-value of the cost above which nothing is left that another fit could explain
# of machines on films one draw in 2 to 16 leads to the best fit, and is among the best three after two steps
DRAWS, DRAW_STEPS, REFINED = 16, 2, 4
SEED = 0  # of the draws, so that a fit is always the same
AT_ONCE = 200_000  # derivatives of the data in all fits that are made at once, of which the coordinates have some more


@dataclass(frozen=True, eq=False)
class Posterior:
    """Parameters fitted within a prior, and how well."""

    prior: Prior  # of the free ones, in the order of `names`
    free: np.ndarray  # (free,) their values
    covariance: np.ndarray  # (free, free)
    misfit: float  # weighted sum of squares of the data
    penalty: float  # likewise, of the distance from the prior mean
    residual: np.ndarray  # (component,) whitened measured minus predicted
    jacobian: np.ndarray  # (component, free) of the prediction
    evidence: float  # logarithm of the marginal likelihood less a constant, by Laplace's approximation
    converged: bool

    @property
    def names(self) -> tuple[str, ...]:
        """(free,) names of the free parameters."""
        return self.prior.names

    @property
    def by_name(self) -> dict[str, tuple[float, float]]:
        """Name -> (value, standard deviation) of each free parameter."""
        std = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.names, zip(self.free.tolist(), std.tolist(), strict=True), strict=True))

    def of(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Values (parameter,) and covariance (parameter, parameter) of some free ones, in the units of the model."""
        place = [self.names.index(name) for name in names]
        return self.free[place], self.covariance[np.ix_(place, place)]

    @property
    def cost(self) -> float:
        """Misfit plus penalty."""
        return self.misfit + self.penalty

    @property
    def p_value(self) -> float:
        """Probability that noise alone leaves as much."""
        return chi_square_p_value(self.cost, len(self.residual))

    @property
    def slope(self) -> np.ndarray:
        """(free,) half the decrease of the cost by a unit of each parameter; zero unless that is held at a bound."""
        whitener = self.prior.whitener
        return self.jacobian.T @ self.residual + whitener.T @ whitener @ (self.prior.mean - self.free)

    @property
    def gain(self) -> float:
        """By which a further linear step would lower the cost."""
        slope = self.slope
        return float(slope @ self.covariance @ slope)

    @property
    def excess(self) -> float:
        """Cost above that expected of noise; zero if it is below."""
        return max(self.cost - len(self.residual), 0.0)

    def is_rejected(self, significance: float) -> bool:
        """Whether a cost this large is less likely by noise alone than `significance`."""
        return self.p_value < significance


@dataclass(frozen=True, eq=False)
class Fit(Posterior):
    """A model fitted within a prior."""

    model: Model

    @cached_property
    def theta(self) -> np.ndarray:
        """(parameter,) values in the order of `model.names`."""
        return self.model.filled(self.names, self.free)

    @cached_property
    def values(self) -> dict[str, float]:
        """Name -> value of every amplitude of the model, not to be changed."""
        return dict(zip(self.model.names, self.theta.tolist(), strict=True))

    @property
    def stated_theta(self) -> np.ndarray:
        """(parameter,) values with the free parameters at the mean of their prior."""
        return self.model.filled(self.names, self.prior.mean)


def chi_square_p_value(cost: float, freedom: int) -> float:
    """Probability of a cost this large by noise alone, 1 if nothing is free; positive also where it underflows."""
    from scipy.special import chdtrc

    return float(max(chdtrc(freedom, cost), np.finfo(float).tiny)) if freedom else 1.0


def chi_square_cost(p_value: float, freedom: int) -> float:
    """The cost above which `chi_square_p_value` is below a p-value."""
    from scipy.special import chdtri

    return float(chdtri(freedom, p_value))


def parameter_p_value(fitted: Fit, prior: dict) -> float:
    """Probability under the prior that the parameters lie as far from their stated values as in a fit.

    The smaller one of all together, and of the farthest of those of the rig and its measuring chain: among many that
    hardly move, one that is far off would not count.

    prior : name -> (mean, std) of these
    """
    from scipy.special import ndtr

    value = fitted.values
    farthest = max((abs(value[name] - mean) / std for name, (mean, std) in prior.items()), default=0.0)
    of_one = max(2 * len(prior) * ndtr(-farthest), np.finfo(float).tiny) if prior else 1.0
    return min(chi_square_p_value(fitted.penalty, len(fitted.names)), float(of_one))


def fit(
    model: Model,
    spectrum: Spectrum,
    prior: Prior,
    start: np.ndarray | None = None,
    steps: int = HYPOTHESIS.steps,
    *,
    from_afar: bool = False,
    needed: float = np.inf,
) -> Fit:
    """The Fit of a model to a spectrum within a prior, whether or not the steps allowed suffice to converge.

    start : (parameter,) in the order of `model.names`, the prior mean by default;  steps : 0 evaluates the start
    from_afar : whether other ways are tried too, as by `fit_from_afar`
    needed : as of `levenberg_marquardt`
    source : MacKay, Information Theory, Inference, and Learning Algorithms, 2003, ch. 27 and 28
    """
    given = partial(whitened_prediction, model, spectrum, prior.names), spectrum.whitened(spectrum.amplitude), prior
    first = prior.mean if start is None else start[model.position(prior.names)]
    found = fit_from_afar(*given, first) if from_afar else fit_each(*given, [first], steps, needed)[0]
    return Fit(**vars(found), model=model)


def fit_each(
    predict: Callable,
    measured: np.ndarray,
    prior: Prior,
    starts: Sequence[np.ndarray] | None = None,
    steps: int = HYPOTHESIS.steps,
    needed: float = np.inf,
    **more: Any,
) -> list[Posterior]:
    """The Posterior of whitened data (component,) within a prior from each start, whether or not steps suffice.

    starts : (start, parameter), by default the prior mean;  needed, more : as of `levenberg_marquardt`
    """
    starts, ends = [prior.mean] if starts is None else starts, replace(HYPOTHESIS, steps=steps)
    given = {"prior": prior, "convergence": ends, "needed": needed} | more
    data = np.tile(measured, (len(starts), 1))
    fitted, rows, found = levenberg_marquardt(predict, data, starts, prior.names, **given), len(measured), []
    for theta, whole, slope, done in zip(fitted.theta, fitted.residual, fitted.jacobian, fitted.converged, strict=True):
        residual, jacobian = whole[:rows], slope[:rows]
        misfit, penalty = float(residual @ residual), float(np.sum(whole[rows:] ** 2))
        evidence = -0.5 * (misfit + penalty + log_narrowing(jacobian, prior.factor))
        covariance = invert(slope.T @ slope)
        found.append(Posterior(prior, theta, covariance, misfit, penalty, residual, jacobian, evidence, bool(done)))
    return found


def fit_from_afar(predict: Callable, measured: np.ndarray, prior: Prior, start: np.ndarray | None = None) -> Posterior:
    """`fit_each`, from one start; where data or prior reject what it ends at, `_gradually` too: the better one.

    A fit from a draw of the prior counts where it explains the data, and better: a resonance on the wrong side of a
    speed is a minimum of its own, for which unbalances and films make up in part.
    """
    (found,) = fit_each(predict, measured, prior, None if start is None else [start])
    p_penalty = chi_square_p_value(found.penalty, len(prior.names))
    if found.p_value < DOUBTFUL or p_penalty < IMPLAUSIBLE:
        found = min(found, _gradually(predict, measured, prior), key=_with_preference(found))
    if found.p_value > CERTAIN:
        return found
    draws = np.random.default_rng(SEED).normal(size=(DRAWS, len(prior.names))) @ prior.factor.T + prior.mean
    nearest = sorted(_from_each(predict, measured, prior, draws, DRAW_STEPS), key=attrgetter("cost"))[:REFINED]
    starts, needed = np.array([one.free for one in nearest]), chi_square_cost(DOUBTFUL, len(measured))
    others = _from_each(predict, measured, prior, starts, HYPOTHESIS.steps, needed)
    others = [one for one in others if one.cost <= needed]
    return min([found, *others], key=_with_preference(found))


def _with_preference(found):
    """The cost, of another one than found as if it were larger by as much as counts."""
    return lambda one: one.cost * (1 if one is found else 1 / LESS)


def _from_each(predict, measured, prior, starts, steps, needed=np.inf):
    """The Posterior from each of some starts (start, parameter) with a steady state; of few data all at once."""
    try:
        if len(starts) < 2 or len(starts) * measured.size * len(prior.names) <= AT_ONCE:
            return fit_each(predict, measured, prior, starts, steps, needed) if len(starts) else []
    except NoSteadyState:
        if len(starts) == 1:
            return []
    halves = np.array_split(starts, 2)
    return [one for half in halves for one in _from_each(predict, measured, prior, half, steps, needed)]


def _gradually(predict, measured, prior):
    """The Posterior of a fit in which data gain weight step by step, lest it bend a modulus to fit an unbalance."""
    misfit, at = fit_each(predict, measured, prior, None, 0)[0].misfit, prior.mean
    levels = min(MOST_LEVELS, int(np.ceil(np.log10(max(misfit / len(measured), 1.0)))))
    for level in range(levels, -1, -1):
        weight = 10 ** (-0.5 * level)

        def weighed(theta, weight=weight):
            return tuple(weight * part for part in predict(theta))

        (found,) = fit_each(weighed, weight * measured, prior, [at])
        at = found.free
    return found


def residual_share(before: float, after: float, rows: int) -> float:
    """Remaining share of the excess error (rms), by two costs: 0 if all is explained, 1 if nothing; rows : by noise."""
    return float(np.sqrt(max(after - rows, 0) / max(before - rows, 1e-300))) if before > rows else 0.0
