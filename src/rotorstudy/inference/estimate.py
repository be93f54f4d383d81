"""The result of an estimator plugin, with its shapes checked, also of a rig that is built again with its numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import PluginError
from rotorstudy.inference.problem import Problem
from rotorstudy.model.kinds import Estimator


@dataclass(frozen=True)
class Estimate:
    """Estimated amplitudes.

    Parameters
    ----------
    names : tuple of str
    theta : ndarray (..., parameter)
    covariance : ndarray (..., parameter, parameter) or (parameter, parameter)
        The latter for all trials.
    misfit : ndarray (...)
        Weighted sum of squares of the residual; NaN for estimators without one.
    """

    names: tuple[str, ...]
    theta: np.ndarray
    covariance: np.ndarray
    misfit: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """Standard deviations (..., parameter) in the units of the parameters."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))


def estimate_by(estimator: Estimator, problem: Problem) -> Estimate:
    """The Estimate of an Estimator plugin; PluginError, with file, shapes and unknowns, for a wrong shape or value."""
    found, who = estimator.function(problem), f"estimator '{estimator.name}' ({estimator.file})"
    if not isinstance(found, Estimate):
        raise PluginError(
            f"{who} gives {type(found).__name__}; it must give an Estimate(names, theta, covariance, misfit), see "
            "rotorstudy.inference.estimate"
        )
    lead, size = problem.spectrum.amplitude.shape[:-3], len(problem.names)
    for name, allowed in (
        ("theta", [(*lead, size)]),
        ("covariance", [(*lead, size, size), (size, size)]),
        ("misfit", [lead]),
    ):
        shape = np.shape(getattr(found, name))
        if shape not in allowed:
            trials = f" and trials of shape {lead}" if lead else ""
            raise PluginError(
                f"{who} gives {name} of shape {shape}; it must be {' or '.join(map(str, dict.fromkeys(allowed)))} for "
                f"{size} unknowns{trials}"
            )
    if not lead and not estimator.handles_rank_deficiency:
        bad = ~(np.isfinite(found.theta) & np.isfinite(np.diagonal(found.covariance)))
        if bad.any():
            names = ", ".join(name for name, wrong in zip(problem.names, bad, strict=True) if wrong)
            raise PluginError(f"{who} gives NaN or infinity for {names} or its variance, without an error")
    return found


def linear_estimate(problem: Problem, theta: np.ndarray, covariance: np.ndarray) -> Estimate:
    """The Estimate of a linear estimator, which has no misfit; shapes as in `Estimate`."""
    return Estimate(problem.names, theta, covariance, np.full(theta.shape[:-1], np.nan))


def estimate_rig(estimator: Estimator, problem: Problem, rig: dict) -> Estimate:
    """The Estimate of some parameters of a rig dict, with effects on the rotor of the numbers that are found."""
    from rotorstudy.model.estimated_rig import settled, with_effects_at, with_values  # heavy for plugins

    def fitted(at, before):
        if before is None:
            return estimate_by(estimator, problem)
        start = dict(zip(before.names, before.theta.tolist(), strict=True)) | at
        (model,) = with_effects_at([problem.model], rig, at)
        return estimate_by(estimator, replace(problem, model=with_values(model, start)))

    return settled(fitted, lambda found: dict(zip(found.names, zip(found.theta, found.std, strict=True), strict=True)))


def magnitude_and_phase(
    names: Sequence[str], theta: np.ndarray, covariance: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Convert real and imaginary parts of complex amplitudes to magnitude and phase, with their covariance.

    Parameters
    ----------
    names : names (parameter,)
        Of real amplitudes; x_real, x_imag become x, x_phase.
    theta : array (..., parameter)
        In the units of the parameters.
    covariance : array (..., parameter, parameter)
        In the units of the parameters.

    Returns
    -------
    names, theta, covariance
        As given, (..., parameter) and (..., parameter, parameter), phases in rad. An amplitude of zero has any phase,
        with the variance pi^2 / 3 of a uniform one.
    """
    names, theta, without_phase = list(names), np.array(theta, float), []
    slope = np.broadcast_to(np.eye(len(names)), (*theta.shape[:-1], len(names), len(names))).copy()
    for i, name in enumerate(names):
        stem = name.removesuffix("_real")
        if stem == name or i + 1 == len(names) or names[i + 1] != f"{stem}_imag":
            continue
        a, b = theta[..., i].copy(), theta[..., i + 1].copy()
        size = np.hypot(a, b)
        still = size == 0
        length = np.where(still, 1, size)
        cosine, sine = np.where(still, 1, a / length), b / length
        slope[..., i, i], slope[..., i, i + 1] = cosine, sine
        slope[..., i + 1, i], slope[..., i + 1, i + 1] = -sine / length, np.where(still, 0, cosine / length)
        without_phase.append((i + 1, still))
        theta[..., i], theta[..., i + 1] = size, np.arctan2(b, a)
        names[i], names[i + 1] = stem, f"{stem}_phase"
    covariance = slope @ covariance @ np.swapaxes(slope, -1, -2)
    for i, still in without_phase:
        covariance[..., i, i] = np.where(still, np.pi**2 / 3, covariance[..., i, i])
    return tuple(names), theta, covariance
