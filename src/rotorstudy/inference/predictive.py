"""Densities of data not yet measured, as several fitted models predict them.

To first order in the parameters of a model, whose posterior has the covariance P, the data are normally distributed. In
standard deviations of their noise they have the mean m and the covariance

    S = 1 + J P J^T,        J the derivatives of the prediction.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import whitened_prediction
from rotorstudy.measurement.spectrum import Spectrum

DECISIVE = np.log(1000)  # log odds beyond which more are no gain
DRAWS = 400  # of the data, for each model: the probability of a decision to about 2 %
SEED = 1


class Predictive(NamedTuple):
    """What models predict, in standard deviations of the noise: mean (model, component) and its covariance."""

    mean: np.ndarray
    covariance: np.ndarray


def predictive(fits: list[Fit], spectrum: Spectrum) -> list[Predictive]:
    """The Predictive of fitted models at each speed of a spectrum, which gives harmonics, sensors and noise too."""
    means, covariances, speeds = [], [], len(spectrum.speed)
    for fitted in fits:
        mean, columns = whitened_prediction(fitted.model, spectrum, fitted.names, fitted.free)
        columns = columns.reshape(speeds, -1, len(fitted.names))
        means.append(mean.reshape(speeds, -1))
        covariances.append(np.eye(columns.shape[1]) + columns @ fitted.covariance @ np.swapaxes(columns, -1, -2))
    return [Predictive(*both) for both in zip(np.stack(means, 1), np.stack(covariances, 1), strict=True)]


def log_densities(run: Predictive, measured: np.ndarray) -> np.ndarray:
    """Logarithm (..., model) of the predictive density of data (..., component), whitened, less a constant."""
    from scipy.linalg import solve_triangular

    found = []
    for mean, factor in zip(run.mean, np.linalg.cholesky(run.covariance), strict=True):
        off = solve_triangular(factor, (measured - mean).reshape(-1, len(mean)).T, lower=True)
        square = np.sum(off**2, axis=0).reshape(measured.shape[:-1])
        found.append(-0.5 * square - np.log(np.diag(factor)).sum())
    return np.stack(found, axis=-1)


def divergence(run: Predictive) -> np.ndarray:
    """Kullback-Leibler divergence (model, model) of the true density (first) from another one.

    (tr(S_j^-1 S_i) - n + (m_j - m_i)^T S_j^-1 (m_j - m_i) + ln(det S_j / det S_i)) / 2 for n components.
    """
    inverse = np.linalg.inv(run.covariance)
    volume = np.linalg.slogdet(run.covariance)[1]
    off = run.mean[:, None] - run.mean[None, :]
    trace = np.einsum("jab,iba->ij", inverse, run.covariance)
    distance = np.einsum("ija,jab,ijb->ij", off, inverse, off)
    return 0.5 * (trace - run.mean.shape[-1] + distance + volume[None, :] - volume[:, None])


def posterior_after(run: Predictive, weights: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Posterior probabilities (..., model) of models after whitened data (..., component); weights (model,) before."""
    log_odds = np.log(weights) + log_densities(run, measured)
    return np.exp(log_odds - np.logaddexp.reduce(log_odds, axis=-1, keepdims=True))


def expected_log_odds(run: Predictive, weights: np.ndarray) -> float:
    """Mean log posterior odds of the true model against its closest rival after the data, each at most `DECISIVE`."""
    odds = np.log(weights)[:, None] - np.log(weights)[None, :] + divergence(run)
    np.fill_diagonal(odds, np.inf)
    return float(weights @ np.minimum(odds.min(axis=1), DECISIVE))


def decision_probability(run: Predictive, weights: np.ndarray, decided: float) -> float:
    """Probability that data raise one model, of weights (model,) before, to a posterior probability of `decided`."""
    draws, share = np.random.default_rng(SEED), []
    for mean, covariance in zip(*run, strict=True):
        data = mean + draws.normal(size=(DRAWS, len(mean))) @ np.linalg.cholesky(covariance).T
        share.append(np.mean(posterior_after(run, weights, data).max(axis=-1) >= decided))
    return float(weights @ share)
