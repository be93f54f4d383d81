"""Output-error identification from few sensors: convergence, accuracy under noise, and the Cramer-Rao bound."""

from dataclasses import replace
from itertools import product

import numpy as np

from rotorstudy.errors import NoConvergenceError, NoSteadyState, UnidentifiableError
from rotorstudy.inference.bounds import cramer_rao_bound
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.noise import noise_std, noisy, standard_normal
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.model.rig import build_model
from rotorstudy.store import dataset
from rotorstudy.studies.common import clean_spectrum, is_phase, parameter_coordinates, reported_names, true_values

NOISE = 0.01  # white in time, relative to each sensor's rms
STARTS = 10
START_OFF = 0.3  # relative error of each starting amplitude, of either sign


def sensors(config):
    """Fits of the response of the main rig, for every set of sensors and case.

    On exact data fits start at amplitudes 30 % too large or too small; under noise at the best of these fits.
    returns : bound (sensors, case, parameter) relative, at 1 % white noise, of phases in rad; NaN if not identifiable
              start_error (sensors, case, start) largest relative error of any parameter from exact data
              scatter (sensors, case, parameter) rms error under that noise, as the bound; fitted (sensors, case) share
              of the noisy fits that converged
    """
    rig = config.main_rig
    model, names = config.rig(rig), reported_names(config)
    theta_true = model.theta[model.position(config.unknowns)]
    true = true_values(config, model)
    scale = np.where(is_phase(config, names), 1, np.abs(true))
    shape = (len(config.sensor_sets), len(config.cases))
    bound, scatter = np.full((2, *shape, len(names)), np.nan)
    start_error, fitted = np.full((*shape, STARTS), np.nan), np.full(shape, np.nan)
    seed = config.monte_carlo.seed
    for (s, nodes), (c, case) in product(enumerate(config.sensor_sets.values()), enumerate(config.cases.values())):
        few = build_model({**config.rigs[rig], "sensors": nodes})
        clean = clean_spectrum(config, few, case.speeds)
        std = noise_std(clean, NOISE, "white in time", config.record.samples)
        spectrum = replace(clean, covariance=independent_covariance(std**2))
        problem = Problem(few, spectrum, tuple(config.unknowns))
        try:
            covariance = cramer_rao_bound(problem, theta_true)
        except UnidentifiableError:
            continue
        _, _, covariance = magnitude_and_phase(config.unknowns, theta_true, covariance)
        bound[s, c] = np.sqrt(np.diag(covariance)) / scale
        signs = standard_normal(seed, 1000 + s, STARTS, len(theta_true))
        starts = theta_true * (1 + START_OFF * np.sign(signs))
        same = spectrum.with_amplitude(np.broadcast_to(clean.amplitude, (STARTS, *clean.amplitude.shape)))
        try:
            found = output_error_fit(replace(problem, spectrum=same), start=starts)
        except (NoConvergenceError, NoSteadyState, UnidentifiableError):
            continue
        start_error[s, c] = np.max(np.abs(found.theta / theta_true - 1), axis=-1)
        converged = np.isfinite(found.theta).all(axis=-1)
        first = found.theta[np.where(converged, found.misfit, np.inf).argmin()]
        numbers = standard_normal(seed, 2000 + 100 * s + c, config.monte_carlo.trials, (2, *clean.amplitude.shape))
        trials = spectrum.with_amplitude(noisy(clean.amplitude, std, numbers, "white in time"))
        found = output_error_fit(replace(problem, spectrum=trials), start=first)
        _, theta, _ = magnitude_and_phase(config.unknowns, found.theta, np.eye(len(theta_true)))
        fitted[s, c] = np.isfinite(theta).all(axis=-1).mean()
        scatter[s, c] = np.sqrt(np.nanmean((theta - true) ** 2, axis=0)) / scale
    coordinates = {
        "sensors": (list(config.sensor_sets), "1", "nodes with probes"),
        "case": (list(config.cases), "1", "speeds used together"),
        **parameter_coordinates(names),
        "start": (np.arange(STARTS), "1", "start of the fit, every amplitude 30 % off"),
    }
    dims = ("sensors", "case", "parameter")
    variables = {
        "bound": (dims, bound, "1", "Cramer-Rao bound over the value, of phases in rad, 1 % white noise"),
        "scatter": (dims, scatter, "1", "rms error of maximum likelihood over the value, of phases in rad"),
        "start_error": (("sensors", "case", "start"), start_error, "1", "largest relative error from exact data"),
        "fitted": (("sensors", "case"), fitted, "1", "share of the noisy fits that converged"),
        "true": (("parameter",), true, "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: few sensors", seed=seed)
