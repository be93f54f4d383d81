"""The joint fit of several runs of one machine: shared parameters, and those that each run has for itself."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.inference.fit import Posterior, fit_from_afar
from rotorstudy.inference.prediction import whitened_prediction
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model


class Run(NamedTuple):
    """A run of a machine: its Model, its Spectrum with the model error, the Prior of what it has for itself."""

    name: str
    model: Model
    spectrum: Spectrum
    own: Prior

    def joint_name(self, name: str) -> str:
        """Name among the parameters of all runs: `eccentricity_real[trial] @ run 2` of its own, else the name."""
        return f"{name} @ {self.name}" if name in self.own.names else name


class JointFit(NamedTuple):
    """Several runs fitted together: Prior and Posterior of the parameters of all, named by `Run.joint_name`."""

    runs: tuple[Run, ...]
    prior: Prior
    posterior: Posterior

    def of(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Values (parameter,) and covariance (parameter, parameter) of some joint names, in the units of the model."""
        return self.posterior.of(names)

    def with_values(self, values: dict[str, float]) -> np.ndarray:
        """Values (parameter,) of all parameters, some of them other ones, by joint name."""
        return np.array([values.get(name, value) for name, (value, _) in self.posterior.by_name.items()])

    @property
    def misfits(self) -> dict[str, tuple[float, int]]:
        """Name of each run -> its misfit, and the number of its data."""
        return {run.name: (float(part @ part), part.size) for run, part in zip(self.runs, self.residuals, strict=True)}

    @property
    def residuals(self) -> list[np.ndarray]:
        """Whitened residual (component,) of each run."""
        sizes = [run.spectrum.data_count for run in self.runs]
        return np.split(self.posterior.residual, np.cumsum(sizes)[:-1])


def independent_share(joint: JointFit) -> float:
    """Share (1 - r) / (1 + r) of speeds with something of their own, r the correlation of residuals at neighbours."""
    rows = [part.reshape(len(run.spectrum.speed), -1) for run, part in zip(joint.runs, joint.residuals, strict=True)]
    whole = sum(float(np.sum(one**2)) for one in rows)
    beside = sum(float(np.sum(one[1:] * one[:-1])) for one in rows)
    alike = max(beside, 0.0) / max(whole, 1e-300)
    return (1 - alike) / (1 + alike)


def joint_prior(shared: Prior, runs: Sequence[Run]) -> Prior:
    """The Prior of the parameters of all runs: those of the machine that are shared, then each run's, independent."""
    found = shared.part([name for name in shared.names if not all(name in run.own.names for run in runs)])
    for run in runs:
        found = found.plus(replace(run.own, names=tuple(run.joint_name(name) for name in run.own.names)))
    return found


def fit_runs(runs: Sequence[Run], shared: Prior, start: np.ndarray | None = None) -> JointFit:
    """The JointFit of several runs of one machine within a prior, as `fit_from_afar`, from a start of `joint_prior`."""
    prior = joint_prior(shared, runs)
    column = {name: i for i, name in enumerate(prior.names)}
    free = [[n for n in run.model.names if run.joint_name(n) in column] for run in runs]
    place = [[column[run.joint_name(n)] for n in names] for run, names in zip(runs, free, strict=True)]

    def predict(theta):
        shown, slopes = [], []
        for run, names, own in zip(runs, free, place, strict=True):
            prediction, jacobian = whitened_prediction(run.model, run.spectrum, names, theta[..., own])
            slope = np.zeros((*jacobian.shape[:-1], len(column)))
            slope[..., own] = jacobian
            shown.append(prediction)
            slopes.append(slope)
        return np.concatenate(shown, axis=-1), np.concatenate(slopes, axis=-2)

    measured = np.concatenate([run.spectrum.whitened(run.spectrum.amplitude) for run in runs])
    return JointFit(tuple(runs), prior, fit_from_afar(predict, measured, prior, start))
