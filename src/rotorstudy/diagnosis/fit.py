"""Output-error fit with priors: base parameters move within what is known of them, causes move freely."""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.response import measured_response
from rotorstudy.spectrum import components, independent_covariance

BEYOND = 4  # harmonics carried beyond the highest measured one where a model couples them
STEPS = 40
STEP_IN_SIGMA = 1e-3  # a fit is at rest when its step is this small against its own standard deviation
GAIN = 1e-4  # or when a step gains less than this share of the cost: a wrong cause need not be fitted well


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    theta      : (parameter,) in the order of model.names
    names      : (free,) those that were fitted;  covariance : (free, free)
    misfit     : weighted sum of squares of the data;  penalty : of the priors
    residual   : (component,) whitened measured minus predicted;  jacobian : (component, free) of the prediction
    """

    model: object
    theta: np.ndarray
    names: tuple
    covariance: np.ndarray
    misfit: float
    penalty: float
    residual: np.ndarray
    jacobian: np.ndarray

    @property
    def cost(self):
        return self.misfit + self.penalty

    @property
    def free(self):
        return self.theta[self.model.position(self.names)]


def with_model_error(spectrum, share):
    """The spectrum with its covariance widened by a share of each harmonic: what the model is not trusted to hit."""
    floor = independent_covariance((share * np.abs(spectrum.amplitude)) ** 2 / 2)
    return replace(spectrum, covariance=spectrum.covariance + floor)


def whitened(spectrum, amplitude, whitener=None):
    """(..., component) harmonics in units of their standard deviation; amplitude (..., speed, harmonic, sensor)."""
    whitener = spectrum.whitener() if whitener is None else whitener
    found = np.einsum("smij,...sjm->...smi", whitener, components(amplitude))
    return found.reshape(*found.shape[:-3], -1)


def predicted(model, spectrum, theta, jacobian=False):
    """What a model shows at the speeds and harmonics of a spectrum; with `jacobian` its derivatives too."""
    order = int(np.abs(spectrum.harmonics).max()) + BEYOND
    return measured_response(model, spectrum.speed, spectrum.harmonics, theta, order=order, jacobian=jacobian)


def fit(model, spectrum, prior, free=(), start=None, steps=STEPS):
    """Levenberg-Marquardt of data and priors.

    prior : name -> (mean, std) of amplitudes that are known so well; they move
    free  : further names, without prior
    start : (parameter,) of the model;  missing values start at zero;  steps : at most, 0 for the start itself
    raises: RotorstudyError if there is no steady state anywhere near the start
    """
    names = (*prior, *free)
    place = model.position(names)
    theta = _start(model) if start is None else np.array(start, float)
    mean = np.array([prior[n][0] if n in prior else 0.0 for n in names])
    weight = np.array([1 / prior[n][1] if n in prior else 0.0 for n in names])
    whitener = spectrum.whitener()
    measured = whitened(spectrum, spectrum.amplitude, whitener)

    def at(theta):
        shown, change = predicted(model, spectrum, theta, jacobian=True)
        model_shows = whitened(spectrum, shown, whitener)
        jacobian = whitened(spectrum, np.moveaxis(change[..., place], -1, 0), whitener).T
        residual = measured - model_shows
        return residual, jacobian, residual @ residual, np.sum((weight * (theta[place] - mean)) ** 2)

    residual, jacobian, misfit, penalty = at(theta)
    damping = 1e-6
    for _ in range(steps):
        normal = jacobian.T @ jacobian + np.diag(weight**2)
        gradient = jacobian.T @ residual - weight**2 * (theta[place] - mean)
        scale = np.sqrt(np.diag(normal))
        scale[scale == 0] = 1.0
        scaled = normal / np.outer(scale, scale) + damping * np.eye(len(names))
        step = np.linalg.solve(scaled, gradient / scale) / scale
        tried = theta.copy()
        tried[place] += step
        try:
            new = at(tried)
        except RotorstudyError:  # a step onto a resonance without damping
            new = (None, None, np.inf, np.inf)
        if new[2] + new[3] <= misfit + penalty:
            gained = misfit + penalty - new[2] - new[3]
            theta, (residual, jacobian, misfit, penalty) = tried, new
            damping = max(damping / 10, 1e-12)
            if step @ normal @ step < STEP_IN_SIGMA**2 or gained < GAIN * (misfit + penalty):
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    normal = jacobian.T @ jacobian + np.diag(weight**2)
    return Fit(model, theta, names, _inverse(normal), misfit, penalty, residual, jacobian)


def _start(model):
    """(parameter,) the values given, zero where none is."""
    given = np.concatenate([term.theta for term in model.terms])
    return np.where(np.isnan(given), 0.0, given)


def _inverse(normal):
    """Inverse of a normal matrix whose columns differ by many orders; what the data do not see gets a huge variance."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)
