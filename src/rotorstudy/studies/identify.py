"""Identification of every case of a study: without noise, under noise, and with wrong known quantities."""

from dataclasses import replace
from itertools import product

import numpy as np

from rotorstudy.chunks import chunk_of, gathered
from rotorstudy.errors import NoConvergenceError, NoSteadyState
from rotorstudy.inference.bounds import cramer_rao_bound
from rotorstudy.inference.estimate import estimate_by, magnitude_and_phase
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.full_spectra import PHASES
from rotorstudy.measurement.noise import MODELS, noise_std, noisy, standard_normal
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.store import dataset
from rotorstudy.studies.common import (
    clean_spectrum,
    is_phase,
    parameter_coordinates,
    relative_error,
    reported,
    reported_names,
    true_values,
)
from rotorstudy.studies.config import changed
from rotorstudy.studies.simulate import SOURCES, case_records, kind_spectra, records_of


def identify(config, rig):
    """Identification of every case from time records of all its speeds, without noise; NaN where a fit fails.

    returns : estimate, standard_deviation (case, source, record, phase_reference, spectrum_method, estimator,
              parameter); true (parameter)
    """
    methods, estimators = config.spectra, [registry().get("estimator", name) for name in config.estimators]
    model, taken, rows = config.rig(rig), config.record, []
    names = reported_names(config)
    kinds = [taken.kinds[name] for name in taken.identified]
    for case, source in product(config.cases.values(), taken.identified_from):
        delays = {kind.late_samples for kind in kinds}
        signals = {late: SOURCES[source](config, model, case.speeds, late) for late in delays}
        for kind in kinds:
            records = records_of(config, model, case.speeds, kind, signals[kind.late_samples])
            spectra = {method: kind_spectra(config, kind, records, method, PHASES) for method in methods}
            for phase, method, estimator in product(PHASES, methods, estimators):
                problem = Problem(model, spectra[method][phase], tuple(config.unknowns))
                try:
                    _, theta, std = reported(problem, estimate_by(estimator, problem))
                except (NoConvergenceError, NoSteadyState):  # uncompensated phases may fit no model
                    theta = std = np.full(len(names), np.nan)
                rows.append((theta, std))
    coordinates = {
        "case": (list(config.cases), "1", "speeds used together"),
        "source": (taken.identified_from, "1", "how the record was made"),
        "record": (taken.identified, "1", "how the record was taken"),
        "phase_reference": (list(PHASES), "1", "what the phase is compensated by"),
        "spectrum_method": (methods, "1", "spectrum method"),
        "estimator": (config.estimators, "1", "parameter estimator"),
        **parameter_coordinates(names),
    }
    shape = [len(values) for values, *_ in coordinates.values()]
    theta, std = (np.array(part).reshape(shape) for part in zip(*rows, strict=True))
    variables = {
        "estimate": (tuple(coordinates), theta, "SI", "estimated parameter"),
        "standard_deviation": (tuple(coordinates), std, "SI", "its stated standard deviation"),
        "true": (("parameter",), true_values(config, model), "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: identification without noise, rig {rig}")


STEADY = "steady state"


def _spectrum_without_noise(config, model, speeds, record):
    """The exact steady-state Spectrum, or that of a kind of record from rest, phase compensated; and its samples."""
    if record == STEADY:
        return clean_spectrum(config, model, speeds), config.record.samples
    kind = config.record.kinds[record]
    records = case_records(config, model, speeds, kind, "from rest")
    spectra = kind_spectra(config, kind, records, "regression", ["reference"])
    return spectra["reference"], len(records[0].time)


CONDENSED = "least_squares, condensed"


def _estimate(name, problem):
    if name == CONDENSED:
        name, problem = "least_squares", replace(problem, condensation="without gyroscopic moments")
    return reported(problem, estimate_by(registry().get("estimator", name), problem))


def monte_carlo(config, rig, case, chunk=0, chunks=1):
    """Estimates of one case under noise, for every record kind, noise model, level and estimator of the rig.

    case    : its name or file name;  chunk, chunks : which part of the noise levels, 0 to chunks - 1, of how many
    White noise in time is drawn in the spectrum, where it is independent circular noise on each harmonic.
    returns : estimate (record, noise_model, noise, estimator, trial, parameter), stated_std (record, noise_model,
              noise, estimator, parameter; median over trials), coverage (share of trials whose stated 95 % interval
              holds the truth), cramer_rao (record, noise_model, noise, parameter; NaN for correlated noise),
              without_noise (record, estimator, parameter), true (parameter)
    """
    settings, case = config.monte_carlo, config.case_of(case)
    model, speeds = config.rig(rig), config.cases[case].speeds
    kinds = settings.rigs[rig].records or [STEADY]
    study = list(config.cases).index(case)
    size = (2, len(speeds), len(config.harmonics), len(model.sensors))
    levels = chunk_of(settings.levels_percent, chunk, chunks)
    numbers = standard_normal(settings.seed, study, settings.trials, size)
    theta_true = model.theta[model.position(config.unknowns)]
    names_used, models = list(settings.rigs[rig].estimators), settings.rigs[rig].models
    names_used += [CONDENSED] if settings.rigs[rig].condensed else []
    shape = (len(kinds), len(models), len(levels), len(names_used))
    stated, coverage, exact = [], [], []
    bounds, trials = [], []
    for kind in kinds:
        clean, samples = _spectrum_without_noise(config, model, speeds, kind)
        weighted = replace(clean, covariance=independent_covariance(noise_std(clean, 0.01, models[0], samples) ** 2))
        problem = Problem(model, weighted, tuple(config.unknowns))
        exact += [_estimate(name, problem)[1] for name in names_used]
        for noise_model, level in product(models, levels):
            std = noise_std(clean, level / 100, noise_model, samples)
            spectrum = replace(
                clean,
                amplitude=noisy(clean.amplitude, std, numbers, noise_model),
                covariance=independent_covariance(std**2),
            )
            problem = Problem(model, spectrum, tuple(config.unknowns))
            bound = cramer_rao_bound(
                replace(problem, spectrum=replace(spectrum, amplitude=clean.amplitude)), theta_true
            )
            names, true, bound = magnitude_and_phase(problem.names, theta_true, bound)
            one_draw = MODELS[noise_model].one_draw
            bounds.append(np.full(len(names), np.nan) if one_draw else np.sqrt(np.diag(bound)))
            for name in names_used:
                _, theta, std_stated = _estimate(name, problem)
                std_stated = np.broadcast_to(std_stated, theta.shape)
                trials.append(theta)
                stated.append(np.median(std_stated, axis=0))
                coverage.append(np.mean(np.abs(theta - true) <= 1.959964 * std_stated, axis=0))
    count = len(names)
    dims = ("record", "noise_model", "noise", "estimator")
    coordinates = {
        "record": (kinds, "1", "what the noise is added to"),
        "noise_model": (list(models), "1", "noise model"),
        "noise": (np.array(levels), "percent", "noise level"),
        "estimator": (names_used, "1", "parameter estimator"),
        "trial": (np.arange(settings.trials), "1", "trial"),
        **parameter_coordinates(names),
    }
    variables = {
        "estimate": (
            (*dims, "trial", "parameter"),
            np.array(trials).reshape(*shape, -1, count),
            "SI",
            "estimated parameter",
        ),
        "stated_std": (
            (*dims, "parameter"),
            np.array(stated).reshape(*shape, count),
            "SI",
            "stated standard deviation",
        ),
        "coverage": (
            (*dims, "parameter"),
            np.array(coverage).reshape(*shape, count),
            "1",
            "share of 95 % intervals that hold",
        ),
        "cramer_rao": (
            ("record", "noise_model", "noise", "parameter"),
            np.array(bounds).reshape(*shape[:3], count),
            "SI",
            "Cramer-Rao bound of the standard deviation",
        ),
        "without_noise": (
            ("record", "estimator", "parameter"),
            np.array(exact).reshape(shape[0], shape[-1], count),
            "SI",
            "estimate without noise",
        ),
        "true": (("parameter",), true, "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: {case}, rig {rig}, under noise", seed=settings.seed)


def gather_monte_carlo(config, case, chunks, parts):
    """What `monte_carlo` returns, from its chunks; parts : {"<file name of the case>_<chunk>": Dataset}"""
    return gathered([parts[f"{case}_{chunk}"] for chunk in range(chunks)], "noise")


def bias(config):
    """Error of the estimates of the main rig if a known quantity of the rotor is wrong by some per cent.

    returns : relative_error (known, percent, case, estimator, parameter); phases as a difference in rad
    """
    rig = config.main_rig
    model, estimators = config.rig(rig), [registry().get("estimator", name) for name in config.estimators]
    settings = config.bias
    true, rows = true_values(config, model), []
    names = reported_names(config)
    phase = is_phase(config, names)
    for key in settings.keys:
        for percent in settings.percent:
            rotor = config.rigs[rig]["rotor"]
            wrong = {**config.rigs[rig], "rotor": changed(rotor, key, percent)}
            held = build_model(wrong, where=f"study {config.name}, {key} {percent:+g} %")
            for case in config.cases.values():
                spectrum = clean_spectrum(config, model, case.speeds)
                spectrum = replace(spectrum, covariance=_one_percent(config, spectrum))
                problem = Problem(held, spectrum, tuple(config.unknowns))
                for estimator in estimators:
                    try:
                        theta = reported(problem, estimate_by(estimator, problem))[1]
                    except (NoConvergenceError, NoSteadyState):
                        theta = np.full(len(names), np.nan)
                    rows.append(relative_error(phase, theta, true))
    shape = (len(settings.keys), len(settings.percent), len(config.cases), len(estimators), len(names))
    coordinates = {
        "known": (settings.keys, "1", "quantity held wrong"),
        "percent": (np.array(settings.percent), "percent", "error of the known quantity"),
        "case": (list(config.cases), "1", "speeds used together"),
        "estimator": (config.estimators, "1", "parameter estimator"),
        **parameter_coordinates(names),
    }
    variables = {
        "relative_error": (
            tuple(coordinates),
            np.array(rows).reshape(shape),
            "1",
            "relative error; of phases the difference in rad",
        )
    }
    return dataset(variables, coordinates, title=f"{config.title}: bias of known quantities, rig {rig}")


def _one_percent(config, spectrum):
    """Covariance of 1 % white noise, the weights of an estimator that assumes a correct model."""
    return independent_covariance(noise_std(spectrum, 0.01, "white in time", config.record.samples) ** 2)
