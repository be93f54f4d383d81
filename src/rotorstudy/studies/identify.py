"""Identification of every case of a study: without noise, under noise, and with wrong known quantities."""

from dataclasses import replace
from itertools import product

import numpy as np

from rotorstudy.errors import NoConvergenceError, NoSteadyState
from rotorstudy.inference.estimate import estimate_by, magnitude_and_phase
from rotorstudy.inference.output_error import cramer_rao_bound
from rotorstudy.measurement.full_spectra import PHASES
from rotorstudy.measurement.noise import MODELS, standard_normal, with_noise
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.store import chunk_of, dataset, gathered
from rotorstudy.studies.common import parameter_coordinates, reported
from rotorstudy.studies.config import changed, file_name
from rotorstudy.studies.simulate import SOURCES, case_records, kind_spectra, records_of
from rotorstudy.units import HALF_INTERVAL

STEADY, CONDENSED = "steady state", "least_squares, condensed"
UNDER_NOISE = (  # at one noise level: name, dimensions, unit, long name
    ("estimate", ("estimator", "trial", "parameter"), "SI", "estimated parameter"),
    ("stated_std", ("estimator", "parameter"), "SI", "stated standard deviation"),
    ("coverage", ("estimator", "parameter"), "1", "share of 95 % intervals that hold"),
    ("cramer_rao", ("parameter",), "SI", "Cramer-Rao bound of the standard deviation"),
)


def identify(config, rig):
    """A Dataset of the estimates of every case from records of all its speeds, without noise; NaN where a fit fails."""
    methods, estimators = config.spectra, [registry().get("estimator", name) for name in config.estimators]
    model, taken, rows = config.rig(rig), config.record, []
    names = list(config.reported)
    kinds = [taken.kinds[name] for name in taken.identified]
    for case, source in product(config.cases.values(), taken.identified_from):
        delays = {kind.late_samples for kind in kinds}
        signals = {late: SOURCES[source](config, model, case.speeds, late) for late in delays}
        for kind in kinds:
            records = records_of(config, model, case.speeds, kind, signals[kind.late_samples])
            spectra = {method: kind_spectra(config, kind, records, method, PHASES) for method in methods}
            for phase, method, estimator in product(PHASES, methods, estimators):
                problem = config.problem(model, spectra[method][phase])
                try:
                    theta, std = reported(problem, estimate_by(estimator, problem))
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
        "true": (("parameter",), config.true_values(model), "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: identification without noise, rig {rig}")


def _spectrum_without_noise(config, model, speeds, record):
    """The exact steady-state Spectrum, or that of a kind of record from rest, phase compensated; and its samples."""
    if record == STEADY:
        return config.clean_spectrum(model, speeds), config.record.samples
    kind = config.record.kinds[record]
    records = case_records(config, model, speeds, kind, "from rest")
    spectra = kind_spectra(config, kind, records, "regression", ["reference"])
    return spectra["reference"], len(records[0].time)


def _estimate(name, problem):
    if name == CONDENSED:
        name, problem = "least_squares", replace(problem, condensation="without gyroscopic moments")
    return reported(problem, estimate_by(registry().get("estimator", name), problem))


def monte_carlo(config, rig, case, chunk=0, chunks=1):
    """A Dataset of estimates of a case under each record, model and noise level, or of a chunk of the levels."""
    settings, case = config.monte_carlo, next(one for one in config.cases if file_name(one) == file_name(case))
    own, model, speeds = settings.rigs[rig], config.rig(rig), config.cases[case].speeds
    kinds, levels = own.records or [STEADY], chunk_of(settings.levels_percent, chunk, chunks)
    estimators = [*own.estimators, *([CONDENSED] if own.condensed else [])]
    size = (2, len(speeds), len(config.harmonics), len(model.sensors))
    numbers = standard_normal(settings.seed, list(config.cases).index(case), settings.trials, size)
    exact, cells = [], []
    for kind in kinds:
        clean, samples = _spectrum_without_noise(config, model, speeds, kind)
        weighted = with_noise(clean, 0.01, own.models[0], samples)
        exact.append([_estimate(name, config.problem(model, weighted))[0] for name in estimators])
        for noise_model, level in product(own.models, levels):
            noise, has_bound = (level / 100, noise_model, samples), not MODELS[noise_model].one_draw
            problem = config.problem(model, with_noise(clean, *noise))
            cells.append(_under_noise(problem, with_noise(clean, *noise, numbers), estimators, has_bound))
    coordinates = {
        "record": (kinds, "1", "what the noise is added to"),
        "noise_model": (list(own.models), "1", "noise model"),
        "noise": (np.array(levels), "percent", "noise level"),
        "estimator": (estimators, "1", "parameter estimator"),
        "trial": (np.arange(settings.trials), "1", "trial"),
        **parameter_coordinates(config.reported),
    }
    grid = tuple(coordinates)[:3]
    lead = [len(coordinates[name][0]) for name in grid]
    variables = {
        key: ((*grid, *dims), np.reshape(values, (*lead, *np.shape(values[0]))), unit, long_name)
        for values, (key, dims, unit, long_name) in zip(zip(*cells, strict=True), UNDER_NOISE, strict=True)
    } | {
        "without_noise": (("record", "estimator", "parameter"), np.array(exact), "SI", "estimate without noise"),
        "true": (("parameter",), config.true_values(model), "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: {case}, rig {rig}, under noise", seed=settings.seed)


def _under_noise(problem, trials, estimators, has_bound):
    """UNDER_NOISE of a problem without noise, whose covariance is that of the noise of the Spectrum `trials`."""
    theta = problem.model.theta[problem.model.position(problem.names)]
    _, true, bound = magnitude_and_phase(problem.names, theta, cramer_rao_bound(problem, theta))
    noisy_problem, found = replace(problem, spectrum=trials), []
    for name in estimators:
        estimate, std = _estimate(name, noisy_problem)
        std = np.broadcast_to(std, estimate.shape)
        coverage = np.mean(np.abs(estimate - true) <= HALF_INTERVAL * std, axis=0)
        found.append((estimate, np.median(std, axis=0), coverage))
    bound = np.sqrt(np.diag(bound)) if has_bound else np.full(len(true), np.nan)
    return *map(np.array, zip(*found, strict=True)), bound


def gather_monte_carlo(config, case, chunks, parts):
    """What `monte_carlo` returns, from its chunks; parts : {"<file name of the case>_<chunk>": Dataset}"""
    return gathered([parts[f"{case}_{chunk}"] for chunk in range(chunks)], "noise")


def bias(config):
    """A Dataset of errors of the estimates if a known quantity of the main rotor is wrong by some per cent."""
    rig, settings, names = config.main_rig, config.bias, list(config.reported)
    model, estimators = config.rig(rig), [registry().get("estimator", name) for name in config.estimators]
    rows = []
    for key, percent in product(settings.keys, settings.percent):
        wrong = {**config.rigs[rig], "rotor": changed(config.rigs[rig]["rotor"], key, percent)}
        held = build_model(wrong, where=f"study {config.name}, {key} {percent:+g} %")
        for case in config.cases.values():
            clean = config.clean_spectrum(model, case.speeds)  # weighted as if the model were correct
            problem = config.problem(held, with_noise(clean, 0.01, "white in time", config.record.samples))
            for estimator in estimators:
                try:
                    rows.append(reported(problem, estimate_by(estimator, problem))[0])
                except (NoConvergenceError, NoSteadyState):
                    rows.append(np.full(len(names), np.nan))
    coordinates = {
        "known": (settings.keys, "1", "quantity held wrong"),
        "percent": (np.array(settings.percent), "percent", "error of the known quantity"),
        "case": (list(config.cases), "1", "speeds used together"),
        "estimator": (config.estimators, "1", "parameter estimator"),
        **parameter_coordinates(names),
    }
    shape = [len(values) for values, *_ in coordinates.values()]
    off = config.relative_error(np.reshape(rows, shape), config.true_values(model))
    variables = {"relative_error": (tuple(coordinates), off, "1", "relative error; of phases the difference in rad")}
    return dataset(variables, coordinates, title=f"{config.title}: bias of known quantities, rig {rig}")
