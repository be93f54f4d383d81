"""Common to the stages of a study: reported parameters, and the spectrum without noise."""

import numpy as np

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import check_stable

SPEED = ("rad/s", "spin speed")
HARMONIC = ("1", "harmonic of the spin speed, positive forward")


def reported(problem, estimate):
    """Estimate with complex amplitudes as magnitude and phase: names, theta, std."""
    names, theta, covariance = magnitude_and_phase(problem.names, estimate.theta, estimate.covariance)
    return names, theta, np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))


def reported_names(config):
    """Names of the unknowns of a study as reported, complex ones as magnitude and phase."""
    count = len(config.unknowns)
    return magnitude_and_phase(config.unknowns, np.ones(count), np.eye(count))[0]


def parameter_coordinates(names):
    """Coordinate of the reported parameters."""
    return {"parameter": (list(names), "1", "identified parameter, SI units; phases in rad")}


def true_values(config, model):
    """(parameter,) the values assumed for the unknowns, complex ones as magnitude and phase."""
    theta = model.theta[model.position(config.unknowns)]
    return magnitude_and_phase(config.unknowns, theta, np.eye(len(theta)))[1]


def clean_spectrum(config, model, speeds):
    """Steady-state harmonics of a model as a Spectrum without noise; speeds (speed,) rad/s."""
    check_stable(model, speeds)
    amplitude = measured_response(model, speeds, config.harmonics)
    covariance = independent_covariance(np.zeros(amplitude.shape))
    return Spectrum(amplitude, np.asarray(speeds, float), np.array(config.harmonics), model.sensors, covariance)


def parameter_units(config):
    """Reported name of an unknown -> its unit, "rad" for a phase."""
    names = reported_names(config)
    return dict(zip(names, config.rig(config.main_rig).reported_units(names), strict=True))


def is_phase(config, names):
    """(parameter,) whether a reported parameter is a phase, whose error is a difference in rad."""
    units = parameter_units(config)
    return np.array([units[name] == "rad" for name in names])


def relative_error(phase, theta, true):
    """(parameter,) relative errors; where `phase` (parameter,) is true the difference in rad."""
    return np.where(phase, theta - true, theta / true - 1)
