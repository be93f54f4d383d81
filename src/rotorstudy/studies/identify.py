"""Identification of every case of a study: without noise, under noise, and with wrong known quantities."""

from dataclasses import replace
from functools import cache, lru_cache

import numpy as np

from rotorstudy.errors import NoConvergenceError, NoSteadyState
from rotorstudy.inference.estimate import estimate_by, magnitude_and_phase
from rotorstudy.inference.output_error import cramer_rao_bound
from rotorstudy.measurement.full_spectra import PHASES
from rotorstudy.measurement.noise import MODELS, standard_normal, with_noise
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.store import chunk_of, gathered
from rotorstudy.studies.common import reported, results
from rotorstudy.studies.config import changed, file_name
from rotorstudy.studies.simulate import SOURCES, case_records, kind_spectra, records_of
from rotorstudy.units import HALF_INTERVAL

STEADY, CONDENSED = "steady state", "least_squares, condensed"


def identify(config, rig):
    """A Dataset of the estimates of every case from records of all its speeds, without noise; NaN where a fit fails."""
    model, taken = config.rig(rig), config.record

    @lru_cache(len(taken.kinds))
    def signals(case, source, late):
        return SOURCES[source](config, model, config.cases[case].speeds, late)

    @cache
    def spectra(case, source, record, method):
        kind, speeds = taken.kinds[record], config.cases[case].speeds
        records = records_of(config, model, speeds, kind, signals(case, source, kind.late_samples))
        return kind_spectra(config, kind, records, method, PHASES)

    def found(case, source, record, phase, method, estimator):
        problem = config.problem(model, spectra(case, source, record, method)[phase])
        try:
            return dict(zip(("estimate", "standard_deviation"), _estimate(estimator, problem), strict=True))
        except (NoConvergenceError, NoSteadyState):  # uncompensated phases may fit no model
            return {}

    given = config.coordinates | {"source": taken.identified_from, "record": taken.identified}
    along = ("case", "source", "record", "phase_reference", "spectrum_method", "estimator")
    title = f"{config.title}: identification without noise, rig {rig}"
    return results("identification", title, along, found, **given, true=config.true_values(model))


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
    clean = {kind: _spectrum_without_noise(config, model, speeds, kind) for kind in kinds}

    def at(kind, noise_model, level):
        spectrum, samples = clean[kind]
        noise, has_bound = (level / 100, noise_model, samples), not MODELS[noise_model].one_draw
        problem = config.problem(model, with_noise(spectrum, *noise))
        return _under_noise(problem, with_noise(spectrum, *noise, numbers), estimators, has_bound)

    weighted = [config.problem(model, with_noise(one, 0.01, own.models[0], samples)) for one, samples in clean.values()]
    exact = [[_estimate(name, problem)[0] for name in estimators] for problem in weighted]
    given = config.coordinates | {"record": kinds, "noise_model": list(own.models), "noise": np.array(levels)}
    given |= {"estimator": estimators, "trial": np.arange(settings.trials)}
    given |= {"without_noise": exact, "true": config.true_values(model), "seed": settings.seed}
    title = f"{config.title}: {case}, rig {rig}, under noise"
    return results("monte_carlo", title, ("record", "noise_model", "noise"), at, **given)


def _under_noise(problem, trials, estimators, has_bound):
    """Results at one noise level, of a problem without noise whose covariance is that of the Spectrum `trials`."""
    theta = problem.model.theta[problem.model.position(problem.names)]
    _, true, bound = magnitude_and_phase(problem.names, theta, cramer_rao_bound(problem, theta))
    noisy_problem, found = replace(problem, spectrum=trials), []
    for name in estimators:
        estimate, std = _estimate(name, noisy_problem)
        std = np.broadcast_to(std, estimate.shape)
        coverage = np.mean(np.abs(estimate - true) <= HALF_INTERVAL * std, axis=0)
        found.append((estimate, np.median(std, axis=0), coverage))
    estimate, std, coverage = map(np.array, zip(*found, strict=True))
    bound = np.sqrt(np.diag(bound)) if has_bound else np.nan
    return {"estimate": estimate, "stated_std": std, "coverage": coverage, "cramer_rao": bound}


def gather_monte_carlo(config, case, chunks, parts):
    """What `monte_carlo` returns, from its chunks; parts : {"<file name of the case>_<chunk>": Dataset}"""
    return gathered([parts[f"{case}_{chunk}"] for chunk in range(chunks)], "noise")


def bias(config):
    """A Dataset of errors of the estimates if a known quantity of the main rotor is wrong by some per cent."""
    rig, settings = config.main_rig, config.bias
    model = config.rig(rig)
    true = config.true_values(model)

    @cache
    def with_wrong(key, percent, case):
        wrong = {**config.rigs[rig], "rotor": changed(config.rigs[rig]["rotor"], key, percent)}
        held = build_model(wrong, where=f"study {config.name}, {key} {percent:+g} %")
        clean = config.clean_spectrum(model, config.cases[case].speeds)  # weighted as if the model were correct
        return config.problem(held, with_noise(clean, 0.01, "white in time", config.record.samples))

    def error(key, percent, case, estimator):
        try:
            estimate, _ = _estimate(estimator, with_wrong(key, percent, case))
        except (NoConvergenceError, NoSteadyState):
            return {}
        return {"relative_error": config.relative_error(estimate, true)}

    given = config.coordinates | {"known": settings.keys, "percent": np.array(settings.percent)}
    along, title = ("known", "percent", "case", "estimator"), f"{config.title}: bias of known quantities, rig {rig}"
    return results("bias", title, along, error, **given)
