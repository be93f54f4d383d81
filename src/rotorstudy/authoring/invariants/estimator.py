"""Invariants of an estimator: exact without noise, correct covariance, and its claims."""

from dataclasses import replace

import numpy as np

from rotorstudy.authoring.invariants.base import HARMONICS, SPEEDS, claimed, require
from rotorstudy.authoring.invariants.bench import bench_structure, bench_terms, exact_spectrum
from rotorstudy.errors import RotorstudyError, UnidentifiableError
from rotorstudy.inference.estimate import estimate_by
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.noise import with_noise
from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.measured import measured_response
from rotorstudy.units import HALF_INTERVAL


def _bench_problem():
    """Internal and external damping, unbalance and crack of the bench rotor, at five speeds, all unknown."""
    structure = bench_structure()
    here, (damping, crack) = np.eye(1), bench_terms(structure)
    internal = Parameter("inner", "N s/m", (Entry(-here, order=1), Entry(1j * here, gain=lambda w: w)), 20.0)
    turning = (Entry(np.array([2.0]), on="one", shift=1, gain=lambda w: w**2),)
    unbalance = Parameter("eccentricity", "m", turning, 1e-5, is_complex=True)
    terms = (damping, crack, Term("bench_inner", (internal,), {"inner": 20.0}))
    model = Model(structure, (*terms, Term("bench_unbalance", (unbalance,), {"eccentricity": 5e-6 * np.exp(0.5j)})))
    return Problem(model, exact_spectrum(model, measured_response(model, SPEEDS, HARMONICS)), model.names)


def estimator_is_exact(plugin):
    """recovers the true values from data without noise, for one spectrum and for many at once"""
    problem = _bench_problem()
    shown, true = problem.spectrum.amplitude, problem.model.theta
    for amplitude in (shown, np.stack([shown, shown])):
        found = estimate_by(plugin, replace(problem, spectrum=problem.spectrum.with_amplitude(amplitude)))
        finite = np.isfinite(found.std).all() and np.isfinite(found.theta).all()
        require(finite, "theta or its covariance is not finite")
        off = np.abs(found.theta / true - 1)
        require(off.max() < 1e-8, f"{problem.names[off.argmax() % len(true)]} is off by {off.max():.3g} of its value")


TRIALS = 300
BENCH_LEVEL = 2e-3  # of each harmonic; the bias of equation errors, of second order, is negligible


def _noisy_bench():
    """The bench problem with independent noise on each harmonic, many trials."""
    problem = _bench_problem()
    numbers = np.random.default_rng(7).normal(size=(2, TRIALS, *problem.spectrum.amplitude.shape)).swapaxes(0, 1)
    return replace(problem, spectrum=with_noise(problem.spectrum, BENCH_LEVEL, "per harmonic", None, numbers))


def estimator_covariance_is_honest(plugin):
    """states the covariance of its estimates, and 95 % intervals with correct coverage"""
    problem = _noisy_bench()
    found, true = estimate_by(plugin, problem), problem.model.theta
    errors = found.theta - true
    stated = np.broadcast_to(found.covariance, (*errors.shape, len(true)))
    # variances of 300 trials scatter by 8 %: five times that for each unknown, and 3.3 % for all six together
    for name, ratio in zip(problem.names, np.diagonal(stated.mean(axis=0)) / errors.var(axis=0), strict=True):
        require(0.65 < ratio < 1.5, f"stated variance of {name} is {ratio:.3g} times the scatter")
    root = np.linalg.cholesky(stated / (found.std[..., :, None] * found.std[..., None, :]))
    whitened = np.linalg.solve(root, (errors / found.std)[..., None])
    ratio = np.mean(whitened**2)
    require(abs(ratio - 1) < 0.17, f"errors have {ratio:.3g} times the stated variance, correlations counted")
    share = np.mean(np.abs(errors) <= HALF_INTERVAL * found.std)
    require(abs(share - 0.95) < 0.03, f"95 % intervals contain the true value in {100 * share:.1f} % of the trials")


def estimator_uses_covariance(plugin):
    """weights harmonics by their stated covariance"""
    problem = _noisy_bench()
    spectrum = problem.spectrum.with_amplitude(problem.spectrum.amplitude[0])
    loud = np.where(np.arange(2 * len(HARMONICS)) % len(HARMONICS) == HARMONICS.index(2), 10.0, 1.0)
    doubted = replace(spectrum, covariance=spectrum.covariance * np.outer(loud, loud))
    one, other = (estimate_by(plugin, replace(problem, spectrum=s)) for s in (spectrum, doubted))
    moved = np.abs((other.theta - one.theta) / one.std).max()
    if plugin.uses_covariance:
        require(moved > 1e-3, "the estimate does not change when a harmonic is stated to be ten times noisier")
    else:
        told = f"the covariance moves the estimate by {moved:.2g} standard deviations: set uses_covariance=True"
        require(moved < 1e-6, told)


@claimed("fits_output", refused_with=RotorstudyError)
def estimator_fits_output(plugin):
    """estimates an offset of the sensor together with the rotor parameters"""
    problem = _bench_problem()
    gap = Parameter("gap", "m", (Entry(np.array([1.0]), on="one"),), 1e-5)
    model = problem.model.plus(Term("bench_gap", (gap,), {"gap": 2e-5}, label="gap", acts_on="output"))
    problem = Problem(model, exact_spectrum(model, measured_response(model, SPEEDS, HARMONICS)), model.names)
    off = np.abs(estimate_by(plugin, problem).theta / model.theta - 1).max()
    require(off < 1e-6, f"with an unknown sensor offset, an estimate is off by {off:.3g} of its value")


@claimed("handles_rank_deficiency", refused_with=UnidentifiableError)
def estimator_handles_rank_deficiency(plugin):
    """estimates the determined parameters if two others are not separable"""
    problem = _bench_problem()
    model = problem.model.plus(replace(problem.model.terms[0], label="confounder", values={}))
    (confounder,) = set(model.names) - set(problem.names)
    doubled = replace(problem, model=model, names=(*problem.names, confounder))
    found, open_ones = estimate_by(plugin, doubled), np.isin(doubled.names, (problem.names[0], confounder))
    off = np.abs(found.theta[~open_ones] / problem.model.theta[1:] - 1).max()  # all but the one with a confounder
    require(off < 1e-4, f"with two inseparable unknowns, another is off by {off:.3g} of its value")
    sure = found.std[open_ones] < 0.1 * problem.model.typical[0]
    require(not sure.any(), "states a small standard deviation for inseparable unknowns")


@claimed("tolerates_outliers")
def estimator_tolerates_outliers(plugin):
    """is not biased by an outlier of fifty standard deviations in one harmonic"""
    problem = _noisy_bench()
    amplitude = problem.spectrum.amplitude[:50].copy()
    amplitude[:, 2, HARMONICS.index(1)] *= 1 + 50 * BENCH_LEVEL / np.sqrt(2)
    problem = replace(problem, spectrum=problem.spectrum.with_amplitude(amplitude))
    found = estimate_by(plugin, problem)
    off = np.abs((found.theta - problem.model.theta).mean(axis=0) / found.std.mean(axis=0)).max()
    require(off < 1.5, f"an outlier of fifty standard deviations moves an estimate by {off:.2g} of its own")


estimator_uses_covariance.flag = "uses_covariance"
