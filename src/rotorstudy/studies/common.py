"""Common to the stages of a study: reported estimates, and the spectrum without noise."""

import numpy as np

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import check_stable

SPEED = ("rad/s", "spin speed")
HARMONIC = ("1", "harmonic of the spin speed, positive forward")


def reported(problem, estimate):
    """Estimate with complex amplitudes as magnitude and phase: theta, std."""
    _, theta, covariance = magnitude_and_phase(problem.names, estimate.theta, estimate.covariance)
    return theta, np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))


def parameter_coordinates(names):
    """Coordinate of the reported parameters."""
    return {"parameter": (list(names), "1", "identified parameter, SI units; phases in rad")}


def clean_spectrum(model, speeds, harmonics):
    """Steady-state harmonics (harmonic,) of a model as a Spectrum without noise; speeds (speed,) rad/s."""
    check_stable(model, speeds)
    amplitude = measured_response(model, speeds, harmonics)
    covariance = independent_covariance(np.zeros(amplitude.shape))
    return Spectrum(amplitude, np.asarray(speeds, float), np.array(harmonics), model.sensors, covariance)
