"""Common to the stages of a study: Datasets of results, reported estimates, and the spectrum without noise."""

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import check_stable
from rotorstudy.store import dataset
from rotorstudy.yaml_file import read_yaml

RESULTS = Path(__file__).with_name("templates") / "results.yaml"


@cache
def _described(path, kind):
    """Variables {name: (dimensions, unit, long name)} and coordinates {name: (unit, long name)} of results."""
    stated = read_yaml(path)
    every = read_yaml(RESULTS)["coordinates"] | stated["coordinates"] | stated[kind]
    coordinates = {name: told for name, told in every.items() if len(told) == 2}
    variables = {name: (told[0].split(), *told[1:]) for name, told in every.items() if len(told) == 3}
    return variables, coordinates


def results(kind, title, along=(), at=None, stated_in=RESULTS, **given):
    """A Dataset whose variables and coordinates are those that a file states for a kind of results.

    along : dimensions swept, the first ones of every variable that is not given
    at    : function(value along each) -> {variable: array over its further dimensions}, NaN where missing
    given : values of coordinates (those of no variable are left out) and of variables; what is neither is an attribute
    """
    variables, coordinates = _described(stated_in, kind)
    found = {}
    for name in variables.keys() - given.keys():
        found[name] = np.full([len(given[dim]) for dim in variables[name][0]], np.nan)
    for place in product(*(range(len(given[dim])) for dim in along)) if found else ():
        for name, value in at(*(given[dim][i] for dim, i in zip(along, place, strict=True))).items():
            found[name] = found[name].astype(np.result_type(found[name], np.asarray(value)), copy=False)  # or complex
            found[name][place] = value
    found |= given
    used = {dim for dims, *_ in variables.values() for dim in dims}
    return dataset(
        {name: (dims, np.asarray(found[name]), *text) for name, (dims, *text) in variables.items()},
        {dim: (values, *coordinates[dim]) for dim, values in given.items() if dim in used},
        title=title,
        **{name: one for name, one in given.items() if name not in variables and name not in coordinates},
    )


def reported(problem, estimate):
    """Estimate with complex amplitudes as magnitude and phase: theta, std."""
    _, theta, covariance = magnitude_and_phase(problem.names, estimate.theta, estimate.covariance)
    return theta, np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))


def clean_spectrum(model, speeds, harmonics):
    """Steady-state harmonics (harmonic,) of a model as a Spectrum without noise; speeds (speed,) rad/s."""
    check_stable(model, speeds)
    amplitude = measured_response(model, speeds, harmonics)
    covariance = independent_covariance(np.zeros(amplitude.shape))
    return Spectrum(amplitude, np.asarray(speeds, float), np.array(harmonics), model.sensors, covariance)
