"""Common to the stages of a study: sweeps, reported estimates, and the spectrum without noise."""

from itertools import product

import numpy as np

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import check_stable
from rotorstudy.store import dataset

SPEED = ("rad/s", "spin speed")
ESTIMATE = (("parameter",), "SI", "estimated parameter")
RELATIVE_ERROR = (("parameter",), "1", "relative error; of phases the difference in rad")
HARMONIC = ("1", "harmonic of the spin speed, positive forward")


def sweep(coordinates, along, result, told, constant=None, **attributes):
    """A Dataset of what a function gives for every combination of values along some dimensions.

    coordinates : name -> (values, unit, long name) of all dimensions; those of no variable are left out
    along       : dimensions swept, the first ones of each variable that is told
    result      : function(value along each) -> {variable: array over its further dimensions}, NaN where missing
    told        : variable -> (further dimensions, unit, long name);  constant : others, as `store.dataset` takes them
    """
    size = {name: len(values) for name, (values, *_) in coordinates.items()}
    found = {name: np.full([size[dim] for dim in (*along, *dims)], np.nan) for name, (dims, *_) in told.items()}
    for place in product(*(range(size[name]) for name in along)):
        values = (coordinates[name][0][i] for name, i in zip(along, place, strict=True))
        for name, value in result(*values).items():
            found[name] = found[name].astype(np.result_type(found[name], value), copy=False)  # it may be complex
            found[name][place] = value
    variables = {name: ((*along, *dims), found[name], *text) for name, (dims, *text) in told.items()} | (constant or {})
    used = {dim for dims, *_ in variables.values() for dim in dims}
    return dataset(variables, {dim: one for dim, one in coordinates.items() if dim in used}, **attributes)


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
