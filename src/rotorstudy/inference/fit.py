"""Output-error fit with priors: everything moves within what is known of it, and the evidence for the model follows."""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.response.harmonic import measured_response

BEYOND = 4  # harmonics carried beyond the highest measured one where a model couples them
STEPS = 40
STEP_IN_SIGMA = 1e-3  # a fit is at rest when its step is this small against its own standard deviation
GAIN = 1e-4  # or when a step gains less than this share of the cost: a wrong cause need not be fitted well


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    theta      : (parameter,) in the order of model.names
    names      : (free,) those that were fitted;  mean, std : (free,) of their priors;  covariance : (free, free)
    misfit     : weighted sum of squares of the data;  penalty : of the priors
    residual   : (component,) whitened measured minus predicted;  jacobian : (component, free) of the prediction
    evidence   : logarithm of the chance of the data whatever the parameters are, less a constant (Laplace)
    """

    model: object
    theta: np.ndarray
    names: tuple
    mean: np.ndarray
    std: np.ndarray
    covariance: np.ndarray
    misfit: float
    penalty: float
    residual: np.ndarray
    jacobian: np.ndarray
    evidence: float

    @property
    def cost(self):
        return self.misfit + self.penalty

    @property
    def free(self):
        return self.theta[self.model.position(self.names)]


def with_model_error(spectrum, settings):
    """The spectrum with its covariance widened by what the model is not trusted to hit and the scatter does not show.

    settings : Settings; model_error is a share of each harmonic, model_floor one of the rms vibration at a sensor and a
               speed (all harmonics but 0X, which may be a gap), covariance_error one of the stated variances
    """
    size = np.abs(spectrum.amplitude)
    moving = (spectrum.harmonics != 0)[:, None]
    whole = np.sqrt(np.sum((size * moving) ** 2, axis=-2, keepdims=True))
    floor = independent_covariance(((settings.model_error * size) ** 2 + (settings.model_floor * whole) ** 2) / 2)
    return replace(spectrum, covariance=(1 + settings.covariance_error) * spectrum.covariance + floor)


def predicted(model, spectrum, theta, jacobian=False):
    """What a model shows at the speeds and harmonics of a spectrum; with `jacobian` its derivatives too."""
    order = int(np.abs(spectrum.harmonics).max()) + BEYOND
    return measured_response(model, spectrum.speed, spectrum.harmonics, theta, order=order, jacobian=jacobian)


def fit(model, spectrum, prior, start=None, steps=STEPS):
    """Levenberg-Marquardt of data and priors.

    prior : name -> (mean, std) of the amplitudes that move
    start : (parameter,) of the model;  missing values start at zero;  steps : at most, 0 for the start itself
    raises: RotorstudyError if there is no steady state anywhere near the start
    """
    names = tuple(prior)
    place = model.position(names)
    theta = _start(model) if start is None else np.array(start, float)
    mean, std = np.array([prior[n] for n in names], float).reshape(-1, 2).T
    weight = 1 / std
    measured = spectrum.whitened(spectrum.amplitude)

    def at(theta):
        shown, change = predicted(model, spectrum, theta, jacobian=True)
        model_shows = spectrum.whitened(shown)
        jacobian = spectrum.whitened(np.moveaxis(change[..., place], -1, 0)).T
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
    evidence = -0.5 * (misfit + penalty + log_narrowing(jacobian, std))
    return Fit(model, theta, names, mean, std, inverse(normal), misfit, penalty, residual, jacobian, evidence)


def log_narrowing(jacobian, std):
    """ln det (posterior precision / prior precision): how much narrower the data make what the priors leave open.

    jacobian : (component, free) of whitened data;  std : (free,) of the priors
    """
    scaled = jacobian * std
    return float(np.linalg.slogdet(np.eye(len(std)) + scaled.T @ scaled)[1])


def _start(model):
    """(parameter,) the values given, zero where none is."""
    given = np.concatenate([term.theta for term in model.terms])
    return np.where(np.isnan(given), 0.0, given)


def inverse(normal):
    """Inverse of a normal matrix whose columns differ by many orders; what the data do not see gets a huge variance."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)
