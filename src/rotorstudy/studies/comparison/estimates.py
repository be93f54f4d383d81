"""Accuracy of estimators on the harmonics of every spectrum method."""

from dataclasses import replace
from time import perf_counter
from types import SimpleNamespace

import numpy as np
import xarray as xr

from rotorstudy.errors import PluginError, RotorstudyError
from rotorstudy.inference.estimate import estimate_by, magnitude_and_phase
from rotorstudy.inference.output_error import cramer_rao_bound
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.noise import with_noise
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.store import as_complex
from rotorstudy.studies import identify
from rotorstudy.studies.common import results
from rotorstudy.units import HALF_INTERVAL


def estimates(config, name, rotor, by_method, estimator):
    """A Dataset of the accuracy of an estimator on {spectrum method: Dataset of `spectra`}, all of the same faults."""
    faults, levels = next(iter(by_method.values())).fault.values.tolist(), config.levels_percent
    model, unknowns = rotor.model, rotor.unknowns
    theta_true = model.theta[model.position(unknowns)]
    names, true, _ = magnitude_and_phase(unknowns, theta_true, np.eye(len(unknowns)))
    is_angle = np.array(model.reported_units(names)) == "rad"
    weighted = with_noise(rotor.without_noise, 0.01, "white in time", config.samples).at_harmonics(rotor.harmonics)
    bound = cramer_rao_bound(Problem(model, weighted, unknowns), theta_true)
    bound = np.sqrt(np.diag(magnitude_and_phase(unknowns, theta_true, bound)[2]))  # at 1 % noise, in proportion to it
    asked = rotor._replace(model=without_values(model, unknowns))

    def accuracy(method, fault, level):
        if level not in config.levels(fault):
            return {}
        cell = by_method[method].sel(fault=fault, noise=level)
        return _accuracy(asked, cell, estimator, true, is_angle, level * bound)

    given = {"spectrum_method": list(by_method), "fault": faults, "noise": np.array(levels, float)}
    title, along = f"{config.title}: {name}, {estimator.name}", tuple(given)
    return results("estimates", title, along, accuracy, **given, parameter=list(names), true=true)


def _accuracy(rotor, cell, estimator, true, is_angle, bound):
    """The results of `estimates` for the spectra of one cell, by name; bound : (parameter,), zero without noise."""
    amplitude = as_complex(cell.amplitude)
    amplitude = amplitude[np.isfinite(amplitude[:, 0, 0, 0])]
    measured = np.array(rotor.measured)
    spectrum = Spectrum(amplitude, rotor.speeds, measured, rotor.model.sensors, cell.covariance.values)
    spectrum = spectrum.at_harmonics(rotor.harmonics)
    start = perf_counter()
    try:
        result = estimate_by(estimator, Problem(rotor.model, spectrum, rotor.unknowns))
    except PluginError:
        raise  # a mistake in the estimator is not a failed estimate
    except (RotorstudyError, np.linalg.LinAlgError):
        return {"failed": 1.0}
    seconds = (perf_counter() - start) / len(amplitude)
    off, std = _errors(rotor.unknowns, result, true, is_angle)
    found = {"seconds": seconds, "failed": 1 - len(off) / len(amplitude)}
    if not len(off):
        return found
    rmse = np.sqrt(np.mean(off**2, axis=0))
    found |= {"bias": off.mean(axis=0), "scatter": off.std(axis=0), "rmse": rmse}
    found["coverage"] = np.mean(np.abs(off) <= HALF_INTERVAL * std, axis=0)
    return found | ({"efficiency": (bound / rmse) ** 2} if np.any(bound) else {})


def _errors(unknowns, result, true, is_angle):
    """Errors (trial, parameter) of the trials with an estimate, and their stated standard deviations."""
    _, theta, covariance = magnitude_and_phase(unknowns, result.theta, result.covariance)
    std = np.broadcast_to(np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1)), theta.shape)
    off = theta - true
    off = np.where(is_angle, np.angle(np.exp(1j * off)), off)
    good = np.isfinite(off).all(axis=-1)
    return off[good], std[good]


def without_values(model, unknowns):
    """The model without values of its unknowns, as neither start nor prior may know the truth."""
    terms = []
    for term in model.terms:
        sought = {p.name for p in term.parameters if {term.full_name(p), f"{term.full_name(p)}_real"} & {*unknowns}}
        terms.append(replace(term, values={name: v for name, v in term.values.items() if name not in sought}))
    return replace(model, terms=tuple(terms))


def bias(study, rotor, estimator):
    """Error of an estimator by wrong known quantities, at the speeds compared on; see `identify.bias`."""
    cases = {"speeds compared": SimpleNamespace(speeds=rotor.speeds)}
    settings = {"cases": cases, "harmonics": list(rotor.harmonics), "estimators": [estimator.name]}
    return identify.bias(study.model_copy(update=settings))


def comparison(parts):
    """Combine {(rotor, estimator): Dataset of `estimates`} into one Dataset with both as dimensions."""
    rotors = list(dict.fromkeys(rotor for rotor, _ in parts))
    estimators = list(dict.fromkeys(estimator for _, estimator in parts))
    along = xr.Variable("estimator", estimators, {"units": "1", "long_name": "parameter estimator"})
    across, equal = xr.Variable("rotor", rotors, {"units": "1", "long_name": "rotor compared on"}), {"compat": "equals"}
    by_rotor = [xr.concat([parts[r, e] for e in estimators], dim=along, data_vars="different", **equal) for r in rotors]
    return xr.concat(by_rotor, dim=across, data_vars="all", join="outer", **equal)
