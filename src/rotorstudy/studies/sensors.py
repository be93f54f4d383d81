"""Output-error identification from few sensors: convergence, accuracy under noise, and the Cramer-Rao bound."""

from dataclasses import replace
from functools import partial

import numpy as np

from rotorstudy.errors import NoConvergenceError, NoSteadyState, UnidentifiableError
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.output_error import cramer_rao_bound, output_error_fit
from rotorstudy.measurement.noise import standard_normal, with_noise
from rotorstudy.model.rig import build_model
from rotorstudy.studies.common import results

NOISE = 0.01  # white in time, relative to each sensor's rms
STARTS = 10
START_OFF = 0.3  # relative error of each starting amplitude, of either sign


def sensors(config):
    """A Dataset of fits for every set of sensors and case: exact from 30 % off, noisy from the best of these."""
    given = config.coordinates | {"sensors": list(config.sensor_sets), "start": np.arange(STARTS)}
    given |= {"true": config.true_values(config.rig(config.main_rig)), "seed": config.monte_carlo.seed}
    title = f"{config.title}: few sensors"
    return results("sensors", title, ("sensors", "case"), partial(_fits, config), **given)


def _fits(config, sensors, case):
    """The results of `sensors` for one set of sensors and case, by name, as far as the fits go."""
    s, c = list(config.sensor_sets).index(sensors), list(config.cases).index(case)
    model = build_model({**config.rigs[config.main_rig], "sensors": config.sensor_sets[sensors]})
    clean = config.clean_spectrum(model, config.cases[case].speeds)
    theta_true = model.theta[model.position(config.unknowns)]
    true, seed = config.true_values(model), config.monte_carlo.seed
    scale = np.where([unit == "rad" for unit in config.reported.values()], 1, np.abs(true))
    noise = NOISE, "white in time", config.record.samples
    spectrum = with_noise(clean, *noise)
    problem = config.problem(model, spectrum)
    try:
        covariance = cramer_rao_bound(problem, theta_true)
    except UnidentifiableError:
        return {}
    _, _, covariance = magnitude_and_phase(config.unknowns, theta_true, covariance)
    found = {"bound": np.sqrt(np.diag(covariance)) / scale}
    signs = standard_normal(seed, 1000 + s, STARTS, len(theta_true))
    starts = theta_true * (1 + START_OFF * np.sign(signs))
    same = spectrum.with_amplitude(np.broadcast_to(clean.amplitude, (STARTS, *clean.amplitude.shape)))
    try:
        exact = output_error_fit(replace(problem, spectrum=same), start=starts)
    except (NoConvergenceError, NoSteadyState, UnidentifiableError):
        return found
    converged = np.isfinite(exact.theta).all(axis=-1)
    first = exact.theta[np.where(converged, exact.misfit, np.inf).argmin()]
    numbers = standard_normal(seed, 2000 + 100 * s + c, config.monte_carlo.trials, (2, *clean.amplitude.shape))
    under_noise = output_error_fit(replace(problem, spectrum=with_noise(clean, *noise, numbers)), start=first)
    _, theta, _ = magnitude_and_phase(config.unknowns, under_noise.theta, np.eye(len(theta_true)))
    return found | {
        "start_error": np.max(np.abs(exact.theta / theta_true - 1), axis=-1),
        "scatter": np.sqrt(np.nanmean((theta - true) ** 2, axis=0)) / scale,
        "fitted": np.isfinite(theta).all(axis=-1).mean(),
    }
