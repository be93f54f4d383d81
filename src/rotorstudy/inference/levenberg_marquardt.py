"""Levenberg-Marquardt steps of many trials at once, within a prior, and when they have converged."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.linear import check_identifiable
from rotorstudy.inference.prior import Prior

FIRST_DAMPING = 1e-6  # nearly a Gauss-Newton step
LEAST_DAMPING = 1e-12  # a smaller one has no effect, and delays the recovery after a rejected step
SHORTER = 0.5  # length of a step after a rejected one, over the length of that: a little more damping may shorten none
ROUND_OFF = 1e-12  # relative increase of the cost that is accepted as round-off


@dataclass(frozen=True)
class Convergence:
    """Convergence tolerances of a fit; the first one that is met ends it."""

    step_in_sigma: float  # of a step, in standard deviations of the fit times the root of a reduced misfit above one
    step_relative: float  # step of each amplitude relative to it, for data without noise
    gain_relative: float  # decrease of the cost relative to the cost
    steps: int  # largest number of steps
    first_damping: float = FIRST_DAMPING  # of the normal matrix with a unit diagonal; large if the start may be far off


# for estimates: at a misfit of a few hundred, a gain of 1e-6 is about a hundredth of a standard deviation
ESTIMATE = Convergence(step_in_sigma=1e-4, step_relative=1e-12, gain_relative=1e-6, steps=200)
# for hypotheses, compared by their evidence in hundreds of fits: a wrong one need not be fitted closely
HYPOTHESIS = Convergence(step_in_sigma=1e-3, step_relative=0.0, gain_relative=1e-4, steps=40)


@dataclass(frozen=True)
class Minimum:
    """End of a fit, for each trial."""

    theta: np.ndarray
    cost: np.ndarray  # (trial,) loss of the data plus the squared distance from the prior mean
    residual: np.ndarray  # (trial, row) whitened measured minus predicted; rows of a prior follow those of the data
    jacobian: np.ndarray  # (trial, row, parameter) derivatives of the prediction
    normal: np.ndarray  # (trial, parameter, parameter) weighted J^T J of the last step
    converged: np.ndarray


def levenberg_marquardt(
    predict: Callable,
    measured: np.ndarray,
    start: np.ndarray,
    names: Sequence[str],
    *,
    prior: Prior | None = None,
    clip: float = np.inf,
    longest: np.ndarray | float = np.inf,
    bounds: tuple = (-np.inf, np.inf),
    needed: float = np.inf,
    convergence: Convergence = ESTIMATE,
) -> Minimum:
    """Minimise the sum of squares (or Huber's loss) of the whitened residual, plus the squared distance from a prior.

    All trials are fitted at once. A step without a steady state is rejected like one that raises the cost.

    predict  : theta (trial, parameter) -> whitened prediction (trial, component), and its derivatives
    measured : (trial, component) whitened data;  prior : without it the data must identify the parameters
    clip     : standard deviations beyond which the loss is linear (Huber); data only
    longest  : (parameter,) or float, longest step of each parameter; a longer one is shortened in its direction
    bounds   : (parameter,) or float each, least and largest values, within which the fit begins and stays
    needed   : cost that matters: a trial ends where as much gained by each step left as by the last one misses it
    source   : Nocedal and Wright, Numerical Optimization, 2006, section 10.3
    """
    count, rows = len(names), measured.shape[-1] + (0 if prior is None else len(names))
    clips = np.full(rows, np.inf)
    clips[: measured.shape[-1]] = clip

    def evaluate(trials, theta):
        prediction, jacobian = predict(theta)
        residual = measured[trials] - prediction
        if prior is not None:
            residual = np.concatenate([residual, (prior.mean - theta) @ prior.whitener.T], axis=-1)
            known = np.broadcast_to(prior.whitener, (len(theta), count, count))
            jacobian = np.concatenate([jacobian, known], axis=-2)
        return residual, jacobian, *_loss(residual, clips)

    def attempt(trials, theta):
        """`evaluate`, with an infinite cost for the trials that have no steady state."""
        try:
            return evaluate(trials, theta)
        except NoSteadyState:
            if len(trials) == 1:
                return np.zeros((1, rows)), np.zeros((1, rows, count)), np.array([np.inf]), np.ones((1, rows))
        half = len(trials) // 2
        parts = attempt(trials[:half], theta[:half]), attempt(trials[half:], theta[half:])
        return tuple(np.concatenate(both) for both in zip(*parts, strict=True))

    theta, trials = np.array(start, float), np.arange(len(start))
    residual, jacobian, cost, weight = best = evaluate(trials, theta)
    if prior is None:
        check_identifiable(jacobian[0], names)
    normal = np.zeros((len(theta), count, count))
    damping, radius = np.full(len(theta), convergence.first_damping), np.full(len(theta), np.inf)
    converged = np.zeros(len(theta), bool)
    for number in range(convergence.steps):
        weighted = np.swapaxes(jacobian[trials] * weight[trials][..., None], -1, -2)
        normal[trials] = weighted @ jacobian[trials]
        scale = np.sqrt(np.diagonal(normal[trials], axis1=-2, axis2=-1))
        # trials are given up in which the data no longer depend on a parameter
        seen = (np.isfinite(scale) & (scale > 0)).all(axis=-1)
        trials, weighted, scale = trials[seen], weighted[seen], scale[seen]
        if not len(trials):
            break
        scaled = normal[trials] / (scale[:, :, None] * scale[:, None, :])
        gradient = (weighted @ residual[trials][..., None])[..., 0] / scale
        low, high = ((bound - theta[trials]) * scale for bound in bounds)
        given = scaled, gradient, low, high, np.broadcast_to(longest, count) * scale
        step, damping[trials] = _step_within(radius[trials], damping[trials], *given)
        length, step = np.linalg.norm(step, axis=-1), step / scale
        tried, before = theta[trials] + step, cost[trials]
        _, _, new_cost, _ = found = attempt(trials, tried)
        gain = before - new_cost
        better = gain >= -ROUND_OFF * before
        reduced_misfit = np.minimum(new_cost, before) / max(1, rows - count)
        done = _is_small(step, tried, normal[trials], reduced_misfit, convergence)
        done |= better & (gain <= convergence.gain_relative * new_cost)
        given_up = better & (new_cost - max(convergence.steps - number - 1, 1) * gain > needed)
        for kept, new in zip((theta, *best), (tried, *found), strict=True):
            kept[trials[better]] = new[better]
        damping[trials] = np.maximum(damping[trials] * np.where(better, 0.1, 1.0), LEAST_DAMPING)
        radius[trials] = np.where(better, np.inf, SHORTER * length)
        converged[trials[done]] = True
        trials = trials[~(done | given_up)]
    return Minimum(theta, cost, residual, jacobian, normal, converged)


def _is_small(step, theta, normal, reduced_misfit, convergence):
    """Whether steps (trial, parameter) to some values are so small that the fit of a trial has converged."""
    in_sigma = np.sqrt(np.maximum(np.einsum("tp,tpq,tq->t", step, normal, step), 0))
    relative = np.abs(step) <= convergence.step_relative * np.abs(theta)
    return (in_sigma < convergence.step_in_sigma * np.sqrt(np.maximum(1, reduced_misfit))) | np.all(relative, axis=-1)


def _step_within(radius, damping, scaled, gradient, low, high, longest):
    """Steps (trial, parameter) of at most some lengths (trial,), and the damping, tenfold until they are as short."""
    step, damping, long = np.zeros(gradient.shape), damping.copy(), np.ones(len(gradient), bool)
    while True:
        damped = scaled[long] + damping[long, None, None] * np.eye(gradient.shape[-1])
        found = _bounded_solution(damped, gradient[long], low[long], high[long])
        share = np.max(np.abs(found) / longest[long], axis=-1, keepdims=True, initial=0.0)
        step[long] = found / np.maximum(1.0, share)
        long = np.linalg.norm(step, axis=-1) > radius
        if not long.any():
            return step, damping
        damping[long] *= 10


def _bounded_solution(matrices, right, low, high):
    """Solutions (trial, parameter) of linear systems between bounds; a parameter that would go beyond is held there."""
    held = ((low >= 0) & (right < 0)) | ((high <= 0) & (right > 0))  # at a bound, and drawn out of it
    right = np.where(held, 0.0, right)
    while True:
        matrices = np.where(held[..., None], np.eye(right.shape[-1]), matrices)
        found = np.linalg.solve(matrices, right[..., None])[..., 0]
        beyond = ~held & ((found < low) | (found > high))
        if not beyond.any():
            return found
        held |= beyond
        right = np.where(held, np.clip(found, low, high), right)


def _loss(residual, clip):
    """Huber's loss (...) of residuals (..., row), quadratic up to `clip`, and its weights (..., row)."""
    weight = np.minimum(1, clip / np.maximum(np.abs(residual), np.finfo(float).tiny))
    return np.sum(weight * (2 - weight) * residual**2, axis=-1), weight
