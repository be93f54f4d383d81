"""Replay of a published measurement: printed spectra are converted to records and processed like simulated ones.

Rounding is the only known noise: every value is known to half a unit of its last digit. The uncertainty is propagated
by drawing the printed values uniformly from within it.
"""

from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.full_spectra import full_spectrum
from rotorstudy.measurement.records import Record, keyphasor_signal
from rotorstudy.measurement.spectrum import Spectrum, components, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex
from rotorstudy.studies.common import results
from thesis.config import QUANTITIES
from thesis.scoreboard import published

replay_results = partial(results, stated_in=Path(__file__).with_name("templates") / "results.yaml")
VERSIONS = ["as printed", "corrected"]
COLUMN = "fft"  # the printed column shown on pages and in figures
DAMPINGS, BOTH_DAMPINGS = ("external_damping", "internal_damping"), "both_dampings"


def thesis_estimates(config, folder, group):
    """(parameter,) estimates the thesis prints for a group, as amplitudes theta of the rig's model.

    The thesis's crack force is its estimate times the deflection it assumed; theta is that force over our deflection.
    """
    table = published(folder, [config.estimates_table])
    values = table[table.case == group].set_index("item").published
    model, names = config.model, config.thesis_names
    e = values["e"] * np.exp(1j * np.deg2rad(values["phi"]))
    known = {ours: values[name] for name, (ours, _) in names.items()}
    known |= {"eccentricity_real": e.real, "eccentricity_imag": e.imag}
    theta = np.array([known[name] for name in model.names])
    if config.thesis_deflection_m:
        ratio = config.thesis_deflection_m / model.structure.static_deflection[model.measured[0]].real
        theta[model.position(list(config.losses.values()))] *= ratio
    return theta


def printed_values(config, folder, *, corrected):
    """{quantity: (values, one unit of the last digit)} as printed, each (data_set, case, harmonic), m and rad."""
    table = published(folder, config.tables)
    for one in config.corrections if corrected else ():
        wrong = (table.case == one.case) & (table.item == str(one.item)) & (table.quantity == one.quantity)
        table.loc[wrong, ["published", "last_digit"]] = one.used, 0.01
    axes = (QUANTITIES, config.data_sets, list(config.cases), list(map(str, config.harmonics)))
    table = table.set_index(["quantity", "method", "case", "item"]).loc[pd.MultiIndex.from_product(axes)]
    values, digits = (table[key].to_numpy().reshape(*map(len, axes)) for key in ("published", "last_digit"))
    return dict(zip(QUANTITIES, zip(values, digits, strict=True), strict=True))


def records(config, reference):
    """A Dataset of time records of the published spectra, as printed and with the misprints corrected.

    The reference is of unit amplitude at every harmonic, because the thesis prints only its phases.
    """
    time, harmonics = config.time, np.array(config.harmonics)
    forward = harmonics >= 0
    displacement, marks = [], []
    for corrected in (False, True):
        values = {q: v for q, (v, _) in printed_values(config, reference, corrected=corrected).items()}
        amplitude = values["amplitude"] * np.exp(1j * values["phase"])
        mark = np.exp(1j * values["reference phase"][..., forward])  # a real signal: -n is the conjugate of +n
        for signals, size, order in ((displacement, amplitude, harmonics), (marks, mark, harmonics[forward])):
            turned = [synthesize(size[:, c], w, order, time) for c, w in enumerate(config.speeds)]
            signals.append(np.moveaxis(turned, 0, 1))
    given = {"version": VERSIONS, "data_set": config.data_sets, "case": list(config.cases), "time": time}
    given |= {"displacement": displacement, "reference": np.real(marks), "speed": config.speeds}
    return replay_results("records", f"{config.title}: replayed records", **given)


def spectra(config, records):
    """A Dataset of full spectra of replayed records by every method: plain, compensated, and without the slow roll."""

    def found(version, data_set, name):
        here, method, taken = records.sel(version=version, data_set=data_set), registry().get("spectrum", name), []
        for case, w in config.cases.items():
            one, mark = here.sel(case=case), keyphasor_signal(w, config.time)
            signals = as_complex(one.displacement)[None], w, (1,), one.reference.values, mark
            taken.append(Record(config.time, *signals, f"{config.name}, {case}"))
        both = (full_spectrum(taken, config.harmonics, method, phase) for phase in ("none", "reference"))
        plain, compensated = (spectrum.amplitude[..., 0] for spectrum in both)
        phase, corrected = np.angle(plain * compensated.conj()), remove_slow_roll(config, compensated)
        return {"displacement": plain, "compensated": compensated, "corrected": corrected, "reference_phase": phase}

    along = {"version": VERSIONS, "data_set": config.data_sets, "spectrum_method": config.spectra}
    given = {"case": list(config.cases), "harmonic": config.harmonics, "speed": config.speeds}
    return replay_results("spectra", f"{config.title}: full spectra", tuple(along), found, **along, **given)


def remove_slow_roll(config, amplitude):
    """Eq. (3.1): subtract 0X and 1X of the slow roll from those of every speed; amplitude (..., case, harmonic), m."""
    static = np.isin(config.harmonics, (0, 1))
    return amplitude - np.where(static, amplitude[..., [config.slow], :], 0)


def rounding_draws(config, folder, data_set):
    """Compensated spectra (trial, case, harmonic), m, with every printed value drawn from within its last digit."""
    values = printed_values(config, folder, corrected=True)
    d = config.data_sets.index(data_set)
    shape = (len(config.cases), len(config.harmonics))
    streams = (np.random.SeedSequence(config.seed, spawn_key=(d, t)) for t in range(config.trials))
    uniform = np.array([np.random.default_rng(s).uniform(-0.5, 0.5, (3, *shape)) for s in streams])
    amplitude, phase, mark = (values[q][0][d] + values[q][1][d] * uniform[:, i] for i, q in enumerate(QUANTITIES))
    place = {n: i for i, n in enumerate(config.harmonics)}
    mirror = [place.get(-n, place[n]) if n < 0 else place[n] for n in config.harmonics]
    mark = np.sign(config.harmonics) * mark[..., mirror]  # the mean of a real signal has no phase to be rounded
    return np.maximum(amplitude, 0) * np.exp(1j * (phase - mark))


def replay_problem(config, cases, compensated, draws):
    """The Problem of some cases of compensated spectra (..., case, harmonic), m, without slow roll; draws : trials."""
    corrected, moved = remove_slow_roll(config, compensated), remove_slow_roll(config, draws)
    chosen = [list(config.cases).index(case) for case in cases]
    real = components(moved[:, chosen, :, None])[..., 0]  # (trial, speed, component)
    centred = real - real.mean(axis=0)
    covariance = np.einsum("tsi,tsj->sij", centred, centred) / (len(real) - 1)
    floor = config.model_error * np.abs(moved.mean(axis=0))[chosen, :, None] / np.sqrt(2)
    covariance = covariance[:, None] + independent_covariance(floor**2)
    model = config.model
    amplitude = corrected[..., chosen, :, None]
    spectrum = Spectrum(amplitude, config.speeds[chosen], np.array(config.harmonics), model.sensors, covariance)
    return Problem(model, spectrum, model.names)


def identify(config, reference, spectra):
    """A Dataset of the estimates of every estimator, data set and group, with 95 % intervals, and their response.

    Intervals of least squares are percentiles of estimates from values drawn within their last digit; those of maximum
    likelihood follow from rounding and model error, widened where the misfit exceeds these.
    """
    compensated = as_complex(spectra.compensated.sel(version="corrected", spectrum_method="regression"))
    drawn = {data_set: rounding_draws(config, reference, data_set) for data_set in config.data_sets}
    speeds, free = list(config.higher_cases.values()), config.model.names
    names, *_ = _reported(free, np.ones(len(free)), np.eye(len(free)))
    is_phase = np.array([unit == "rad" for unit in config.model.reported_units(names)])

    def found(name, data_set, group):
        estimator, draws = registry().get("estimator", name).function, drawn[data_set]
        cases, values = config.groups[group], compensated[config.data_sets.index(data_set)]
        problem = replay_problem(config, cases, values, draws)
        fitted = estimator(problem)
        misfit = fitted.misfit / (2 * problem.spectrum.amplitude.size - len(problem.names))
        _, theta, covariance = _reported(problem.names, fitted.theta, fitted.covariance)
        if np.isfinite(fitted.misfit):
            half = 1.96 * np.sqrt(np.diag(covariance) * max(1.0, misfit))
            low, high = theta - half, theta + half
        else:
            of_draws = estimator(replay_problem(config, cases, draws, draws))
            of_draws = _reported(of_draws.names, of_draws.theta, of_draws.covariance)[1]
            beside = theta + np.angle(np.exp(1j * (of_draws - theta)))  # within half a revolution of the estimate
            low, high = np.percentile(np.where(is_phase, beside, of_draws), [2.5, 97.5], axis=0)
        simulated = measured_response(problem.model, speeds, config.harmonics, fitted.theta)[..., 0]
        return {"estimate": theta, "low": low, "high": high, "misfit": misfit, "simulated": simulated}

    along = {"estimator": config.estimators, "data_set": config.data_sets, "group": list(config.groups)}
    given = {"parameter": list(names), "case": list(config.higher_cases), "harmonic": config.harmonics}
    title = f"{config.title}: identification"
    return replay_results("identification", title, tuple(along), found, **along, **given, seed=config.seed)


def _reported(names, theta, covariance):
    """Complex amplitudes as magnitude and phase, and the sum of both dampings, which impact tests bound."""
    names, theta, covariance = magnitude_and_phase(names, theta, covariance)
    if not set(DAMPINGS) <= set(names):
        return names, theta, covariance
    places = [names.index(name) for name in DAMPINGS]
    row = np.isin(np.arange(len(names)), places).astype(float)
    summing = np.insert(np.eye(len(names)), max(places) + 1, row, axis=0)
    names = (*names[: max(places) + 1], BOTH_DAMPINGS, *names[max(places) + 1 :])
    return names, theta @ summing.T, summing @ covariance @ summing.T
