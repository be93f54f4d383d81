"""Prediction of a spectrum by a model, its derivatives, and its model error."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotorstudy.errors import MissingValue
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.response.measured import measured_response, measured_response_and_jacobian, recent
from rotorstudy.response.neighbourhood import Neighbourhood

BEYOND = 4  # harmonics carried beyond the highest measured one where a model couples them: off by 0.01 sigma (rms)
BEYOND_JUMPS = 10  # where a law jumps: off by 0.2 sigma for a crack of 30 % that opens at once, 1.3 with BEYOND

LEAK = 0.3  # of what a cause changes at all harmonics: an error of its law by angle or deflection spreads over ten


def carried_order(spectrum: Spectrum, model: Model | None = None) -> int:
    """Highest harmonic carried for a spectrum where harmonics are coupled; without a model as if nothing jumped."""
    jumps = model is not None and any(unknown.jumps for unknown in model.rotor_unknowns)
    return int(np.abs(spectrum.harmonics).max()) + (BEYOND_JUMPS if jumps else BEYOND)


def predicted(model: Model, spectrum: Spectrum, theta: np.ndarray) -> np.ndarray:
    """Displacement (..., speed, harmonic, sensor), complex, m, where a spectrum has it, at theta (..., parameter)."""
    return measured_response(model, spectrum.speed, spectrum.harmonics, theta, order=carried_order(spectrum, model))


def shown_and_slopes(
    model: Model, spectrum: Spectrum, theta: np.ndarray, names: Sequence[str], order: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """`predicted` at theta (parameter,), and its derivatives (name, speed, harmonic, sensor) by some amplitudes."""
    order = carried_order(spectrum, model) if order is None else order
    shown, change = measured_response_and_jacobian(model, spectrum.speed, spectrum.harmonics, theta, order=order)
    return shown, np.moveaxis(change[..., model.position(names)], -1, 0)


def neighbourhood(model: Model, spectrum: Spectrum, theta: np.ndarray | None) -> Neighbourhood:
    """The Neighbourhood of a model at the speeds and harmonics of a spectrum."""
    order = carried_order(spectrum, model)
    return Neighbourhood(model, spectrum.speed, spectrum.harmonics, theta, order=order)


def misfit(model: Model, spectrum: Spectrum, theta: np.ndarray) -> float:
    """Weighted sum of squares of what a model leaves of a spectrum; theta (parameter,) as of `predicted`."""
    off = spectrum.whitened(spectrum.amplitude - predicted(model, spectrum, theta))
    return float(off @ off)


def whitened_prediction(
    model: Model, spectrum: Spectrum, names: Sequence[str], theta: np.ndarray, order: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Prediction (..., component) and derivatives by free amplitudes (..., parameter), in standard deviations."""
    position, full = model.position(names), model.filled(names, theta)
    if np.isnan(full).any():
        missing = [model.names[p] for p in np.flatnonzero(np.isnan(full).reshape(-1, full.shape[-1]).any(axis=0))]
        raise MissingValue(f"{', '.join(missing)}: neither among the unknowns nor given a value")
    order = carried_order(spectrum, model) if order is None else order
    at = spectrum.speed, spectrum.harmonics, full
    shown, change = recent(measured_response_and_jacobian, model, *at, order=order)
    found = spectrum.whitened(np.stack([shown, *np.moveaxis(change[..., position], -1, 0)]))
    return found[0], np.moveaxis(found[1:], 0, -1)


def predicted_derivatives(problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`whitened_prediction` of a Problem at theta (..., parameter)."""
    return whitened_prediction(problem.model, problem.spectrum, problem.names, theta, problem.order)


def with_model_error(spectrum: Spectrum, settings) -> Spectrum:
    """The spectrum with its covariance enlarged by the model error.

    settings : `model_error` is a fraction of each harmonic, `model_floor` one of the rms vibration at a sensor and a
               speed (0X, which may be a probe gap, left out), `covariance_error` one of the stated variances
    """
    enlarged = replace(spectrum, covariance=(1 + settings.covariance_error) * spectrum.covariance)
    return enlarged.with_error(model_error_variance(spectrum.amplitude, spectrum.harmonics, settings))


def model_error_variance(amplitude: np.ndarray, harmonics: np.ndarray, settings) -> np.ndarray:
    """Of each part of harmonics (speed, harmonic, sensor), m^2, by `model_error` and `model_floor` of the settings."""
    size = np.abs(amplitude)
    whole = np.sqrt(np.sum((size * (harmonics != 0)[:, None]) ** 2, axis=-2, keepdims=True))
    return ((settings.model_error * size) ** 2 + (settings.model_floor * whole) ** 2) / 2


def with_cause_error(spectrum: Spectrum, missing: np.ndarray, share: np.ndarray | float) -> Spectrum:
    """The spectrum with its covariance enlarged by the error of whatever cause is added, which has an ideal shape.

    missing : (speed, harmonic, sensor) measured less predicted by the base model, m
    share   : (harmonic,) or float, standard deviation as a fraction of it, and of `LEAK` of that at all harmonics
    """
    size = np.abs(spectrum.shown(missing))
    whole = np.sqrt(np.sum(size**2, axis=-2, keepdims=True))
    share = np.reshape(share, (-1, 1))
    return spectrum.with_error(share**2 * (size**2 + (LEAK * whole) ** 2) / 2)
