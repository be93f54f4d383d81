"""Every spectrum method with every estimator on every study, under noise and with the faults of real records.

Records are made and shown to a spectrum method trial by trial; its harmonics, with the covariance it states, go to
every estimator. What comes out is one array over study, spectrum method, estimator, fault, noise and parameter.
"""

from dataclasses import replace
from itertools import product
from time import perf_counter
from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rotorstudy.errors import PluginError, RotorstudyError, UnidentifiableError, unknown_name
from rotorstudy.inference.bounds import cramer_rao_bound
from rotorstudy.inference.problem import Problem, estimate_by, magnitude_and_phase
from rotorstudy.measurement.keyphasor import phase_from_keyphasor
from rotorstudy.measurement.noise import noise_std, standard_normal
from rotorstudy.measurement.records import (
    Record,
    compensate,
    full_spectrum,
    keyphasor_signal,
    simulate_records,
)
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.model import Model
from rotorstudy.model.options import NonNegative, Positive
from rotorstudy.response.harmonic import check_harmonics
from rotorstudy.store import as_complex, dataset, load, read_yaml
from rotorstudy.studies import identify
from rotorstudy.studies.config import SPEED, clean_spectrum, load_study, parameter_coordinates
from rotorstudy.thesis.replay import load_replay

STATISTICS = ("bias", "scatter", "rmse", "efficiency", "coverage", "failed", "seconds")


class Fault(Strict):
    """What is wrong with a record; the default is nothing.

    turns : revolutions it holds;  speed_error : of its label, relative
    keyphasor_jitter_rad : standard deviation of each pulse
    outlier_share : of the samples;  outlier_size : of an outlier, in rms of the vibration
    """

    turns: float = Field(default=12.0, ge=2)
    speed_error: float = Field(default=0.0, gt=-0.05, lt=0.05)
    keyphasor_jitter_rad: float = Field(default=0.0, ge=0)
    outlier_share: float = Field(default=0.0, ge=0, lt=0.5)
    outlier_size: float = Field(default=0.0, ge=0)


class Compared(Strict):
    """A rotor to compare on: the main rig of a study, or that of a replay, with the parameters identified there.

    speeds_rad_s : needed for a study; of a replay, its own
    harmonics : identified from, if not all of the study's; a spectrum method is asked for all of those
    levels_percent : instead of the comparison's own
    """

    study: str | None = None
    replay: str | None = None
    speeds_rad_s: list[Positive] = []
    harmonics: list[int] | None = None
    levels_percent: list[float] | None = None

    @model_validator(mode="after")
    def _one_source(self):
        if (self.study is None) == (self.replay is None):
            raise ValueError("give either 'study' or 'replay'")
        if self.study and not self.speeds_rad_s:
            raise ValueError("a study needs speeds_rad_s")
        return self


class CompareConfig(Strict):
    """trials : of each cell with noise; trials_without_noise : of those without, where only a fault draws numbers"""

    title: str
    trials: int = Field(ge=2)
    trials_without_noise: int = Field(ge=2)
    samples: int = Field(ge=64)
    levels_percent: list[NonNegative] = Field(min_length=1)
    faults: dict[str, Fault] = Field(min_length=1)
    rotors: dict[str, Compared] = Field(min_length=1)
    seed: int

    def levels(self, rotor):
        own = self.rotors[rotor].levels_percent
        return self.levels_percent if own is None else own

    def check(self, studies, replays):
        """Raise for a name that no study or replay has, a level that makes no sense."""
        for name, compared in self.rotors.items():
            known = studies if compared.study else replays
            wanted = compared.study or compared.replay
            if wanted not in known:
                raise unknown_name("study or replay", wanted, known, f"compare, rotor '{name}'")
            if compared.harmonics is not None:
                try:
                    check_harmonics(compared.harmonics)
                except RotorstudyError as error:
                    raise RotorstudyError(f"compare, rotor '{name}': {error}") from None
            if any(level not in self.levels_percent for level in self.levels(name)) or not self.levels(name):
                raise RotorstudyError(
                    f"compare, rotor '{name}': levels_percent = {self.levels(name)} must be some of "
                    f"{self.levels_percent}"
                )


def load_comparison(path):
    """A CompareConfig from a YAML file; unknown and missing keys are one-line errors."""
    return check_config(CompareConfig, read_yaml(path), str(path))


class Rotor(NamedTuple):
    """A rotor to compare on: model with true values, unknowns, speeds (speed,) rad/s.

    measured, harmonics : (harmonic,) what a spectrum method is asked for, and those of it that an estimator gets
    """

    model: Model
    unknowns: tuple
    measured: list
    harmonics: list
    speeds: np.ndarray


def study_rotor(compared, study):
    """The main rig of a study."""
    return _rotor(compared, study.rig(study.main_rig), tuple(study.unknowns), study.harmonics, compared.speeds_rad_s)


def _rotor(compared, model, unknowns, harmonics, speeds):
    used = compared.harmonics or harmonics
    measured = [*harmonics, *(n for n in used if n not in harmonics)]
    return Rotor(model, unknowns, measured, used, np.array(speeds))


def replay_rotor(compared, replay, identification):
    """The rotor of a replayed experiment, with the parameters found from all its speeds, at its own speeds."""
    found = identification.estimate.sel(estimator="maximum_likelihood", data_set="regression").isel(group=-1)
    terms = []
    for term in replay.model.terms:
        values = {}
        for p in term.parameters:
            name = term.full_name(p)
            values[p.name] = float(found.sel(parameter=name))
            if p.is_complex:
                values[p.name] *= np.exp(1j * float(found.sel(parameter=f"{name}_phase")))
        terms.append(replace(term, values=values))
    model = replace(replay.model, terms=tuple(terms))
    speeds = [w for case, w in replay.cases.items() if case != replay.slow_roll]
    return _rotor(compared, model, model.names, replay.harmonics, speeds)


def load_rotor(config, name, source, identification=None):
    """The rotor of a comparison by name; source : file of its study or replay; identification : file, of a replay."""
    compared = config.rotors[name]
    if compared.study:
        return study_rotor(compared, load_study(source))
    return replay_rotor(compared, load_replay(source), load(identification))


class Trials(NamedTuple):
    """Records of one speed with one fault: time (time,) s, label rad/s, signal (trial, sensor, time) complex m,
    keyphasor (trial or 1, time) V."""

    time: np.ndarray
    label: float
    signal: np.ndarray
    keyphasor: np.ndarray


def make_trials(config, rotor_index, rotor, fault_name, place, level, count):
    """Trials of one speed (by its place in rotor.speeds): steady state, noise, and what the fault does."""
    fault, speed = config.faults[fault_name], float(rotor.speeds[place])
    stream = (rotor_index * len(config.faults) + list(config.faults).index(fault_name)) * 1000 + place
    time = np.arange(config.samples) * fault.turns * 2 * np.pi / speed / config.samples
    clean = simulate_records(rotor.model, [speed], rotor.measured, time)[0].displacement
    moving = clean - clean.mean(axis=-1, keepdims=True)
    rms = np.sqrt(np.mean(np.abs(moving) ** 2, axis=-1, keepdims=True) / 2)
    x, y = np.moveaxis(standard_normal(config.seed, stream, count, (2, *clean.shape)), 1, 0)
    signal = clean + level / 100 * rms * (x + 1j * y)
    others = [
        np.random.default_rng(np.random.SeedSequence(config.seed, spawn_key=(stream, 1, t))) for t in range(count)
    ]
    if fault.outlier_share:
        drawn = np.array([rng.uniform(size=(2, *clean.shape)) for rng in others])
        hit, angle = drawn[:, 0] < fault.outlier_share, 2 * np.pi * drawn[:, 1]
        signal = signal + hit * fault.outlier_size * rms * np.exp(1j * angle)
    keyphasor = keyphasor_signal(speed, time)[None]
    if fault.keyphasor_jitter_rad:
        turn = np.rint(speed * time / (2 * np.pi)).astype(int)  # each pulse is early or late as a whole
        late = np.array([rng.normal(size=turn.max() + 1)[turn] for rng in others]) * fault.keyphasor_jitter_rad
        keyphasor = np.array([keyphasor_signal(speed, time - shift / speed) for shift in late])
    return Trials(time, speed * (1 + fault.speed_error), signal, keyphasor)


def trial_spectra(method, trials, harmonics):
    """Harmonics (trial, harmonic, sensor) and the mean of their stated covariance (sensor, component, component).

    Trials that share their keyphasor go to the method in one call.
    """
    count, sensors, _ = trials.signal.shape

    def spectrum(signal, keyphasor, phase):
        record = Record(trials.time, signal, trials.label, tuple(range(len(signal))), keyphasor=keyphasor)
        found = full_spectrum([record], harmonics, method, phase)
        return found.amplitude[0].T, found.covariance[0]  # (signal, harmonic), (signal, component, component)

    if len(trials.keyphasor) == 1 or not method.uses_marks:
        phase = "keyphasor" if len(trials.keyphasor) == 1 else "none"
        amplitude, covariance = spectrum(trials.signal.reshape(-1, len(trials.time)), trials.keyphasor[0], phase)
        amplitude = amplitude.reshape(count, sensors, -1)
        covariance = covariance.reshape(count, sensors, *covariance.shape[1:])
    if len(trials.keyphasor) > 1:
        turned = []
        for t, keyphasor in enumerate(trials.keyphasor):
            if method.uses_marks:
                turned.append(spectrum(trials.signal[t], keyphasor, "keyphasor"))
            else:
                record = Record(trials.time, trials.signal[t], trials.label, tuple(range(sensors)), keyphasor=keyphasor)
                psi = phase_from_keyphasor(record, harmonics)
                turned.append(compensate(amplitude[t], covariance[t], *psi))
        amplitude, covariance = (np.array(part) for part in zip(*turned, strict=True))
    return np.swapaxes(amplitude, 1, 2), covariance.mean(axis=0)


def spectra(config, name, rotor, method):
    """What a spectrum method makes of all records of a rotor.

    returns : amplitude (fault, noise, trial, speed, harmonic, node, part) m, NaN beyond the trials of a cell;
              covariance (fault, noise, speed, node, component, component_2) m^2, as stated, mean over trials;
              harmonic_error (fault, noise), rms over trials and harmonics over the rms of the vibration;
              seconds (fault, noise) a record
    """
    faults, levels = list(config.faults), config.levels(name)
    model, harmonics = rotor.model, rotor.measured
    shape = (len(faults), len(levels), config.trials, len(rotor.speeds), len(harmonics), len(model.sensors))
    amplitude = np.full(shape, np.nan, complex)
    size = 2 * len(harmonics)
    covariance = np.full((len(faults), len(levels), len(rotor.speeds), len(model.sensors), size, size), np.nan)
    error, seconds = np.zeros(shape[:2]), np.zeros(shape[:2])
    true = clean_spectrum(_NamedHarmonics(harmonics), model, rotor.speeds).amplitude
    vibration = np.sqrt(np.sum(np.abs(true[:, np.array(harmonics) != 0]) ** 2, axis=1, keepdims=True))
    for (f, fault), (n, level) in product(enumerate(faults), enumerate(levels)):
        count = config.trials if level else min(config.trials, config.trials_without_noise)
        for s in range(len(rotor.speeds)):
            trials = make_trials(config, list(config.rotors).index(name), rotor, fault, s, level, count)
            start = perf_counter()
            amplitude[f, n, :count, s], covariance[f, n, s] = trial_spectra(method, trials, harmonics)
            seconds[f, n] += (perf_counter() - start) / count / len(rotor.speeds)
        error[f, n] = np.sqrt(np.mean(np.abs((amplitude[f, n, :count] - true) / vibration) ** 2))
    coordinates = {
        "fault": (faults, "1", "what is wrong with the record"),
        "noise": (np.array(levels, float), "percent", "white noise on each sample, of the rms of the vibration"),
        "speed": (rotor.speeds, *SPEED),
        "harmonic": (np.array(harmonics), "1", "harmonic of the spin speed, positive forward"),
        "node": (np.array(model.sensors), "1", "node where the displacement is measured"),
    }
    dims = ("fault", "noise", "trial", "speed", "harmonic", "node")
    stated = ("fault", "noise", "speed", "node", "component", "component_2")
    variables = {
        "amplitude": (dims, amplitude, "m", "full spectrum"),
        "covariance": (stated, covariance, "m^2", "stated covariance: real parts, then imaginary parts"),
        "harmonic_error": (dims[:2], error, "1", "rms error of the harmonics over the rms of the vibration"),
        "seconds": (dims[:2], seconds, "s", "time for one record; differs from run to run"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: {name}, {method.name}")


class _NamedHarmonics(NamedTuple):
    harmonics: list


def estimates(config, name, rotor, by_method, estimator):
    """How well an estimator does on the harmonics of every spectrum method.

    by_method : name of a spectrum method -> Dataset of `spectra`
    returns   : bias, scatter, rmse (SI; of phases rad), efficiency (Cramer-Rao variance of whole turns over mean square
                error), coverage (of 95 % intervals), all (spectrum_method, fault, noise, parameter);
                failed (share of trials), seconds (an estimate) (spectrum_method, fault, noise); true (parameter)
    """
    faults, levels = list(config.faults), config.levels(name)
    model, unknowns = rotor.model, rotor.unknowns
    theta_true = model.theta[model.position(unknowns)]
    names, true, _ = magnitude_and_phase(unknowns, theta_true, np.eye(len(unknowns)))
    is_phase = np.array([n.endswith("_phase") for n in names])
    shape = (len(by_method), len(faults), len(levels))
    found = {key: np.full((*shape, len(names)), np.nan) for key in STATISTICS[:5]}
    found |= {key: np.full(shape, np.nan) for key in STATISTICS[5:]}
    bounds = _bounds(config, name, rotor, theta_true)
    asked = without_values(model, unknowns)
    for (m, data), (f, fault), (n, level) in product(
        enumerate(by_method.values()), enumerate(faults), enumerate(levels)
    ):
        cell = data.sel(fault=fault, noise=level)
        amplitude = as_complex(cell.amplitude)
        amplitude = amplitude[np.isfinite(amplitude[:, 0, 0, 0])]
        spectrum = Spectrum(amplitude, rotor.speeds, np.array(rotor.measured), model.sensors, cell.covariance.values)
        spectrum = spectrum.at_harmonics(rotor.harmonics)
        start = perf_counter()
        try:
            result = estimate_by(estimator, Problem(asked, spectrum, unknowns))
        except PluginError:
            raise  # a mistake in the estimator is not a failed estimate
        except (RotorstudyError, UnidentifiableError, np.linalg.LinAlgError):
            found["failed"][m, f, n] = 1.0
            continue
        found["seconds"][m, f, n] = (perf_counter() - start) / len(amplitude)
        _, theta, full = magnitude_and_phase(unknowns, result.theta, result.covariance)
        std = np.broadcast_to(np.sqrt(np.diagonal(full, axis1=-2, axis2=-1)), theta.shape)
        off = theta - true
        off = np.where(is_phase, np.angle(np.exp(1j * off)), off)
        good = np.isfinite(off).all(axis=-1)
        found["failed"][m, f, n] = 1 - good.mean()
        if not good.any():
            continue
        off, std = off[good], std[good]
        found["bias"][m, f, n] = off.mean(axis=0)
        found["scatter"][m, f, n] = off.std(axis=0)
        found["rmse"][m, f, n] = np.sqrt(np.mean(off**2, axis=0))
        found["coverage"][m, f, n] = np.mean(np.abs(off) <= 1.959964 * std, axis=0)
        if level:
            found["efficiency"][m, f, n] = (bounds[level] / found["rmse"][m, f, n]) ** 2
    texts = {
        "bias": ("SI", "mean error"),
        "scatter": ("SI", "standard deviation over trials"),
        "rmse": ("SI", "root mean square error"),
        "efficiency": ("1", "Cramer-Rao variance over mean square error"),
        "coverage": ("1", "share of stated 95 % intervals that hold the truth"),
        "failed": ("1", "share of trials without an estimate"),
        "seconds": ("s", "time for one estimate; differs from run to run"),
    }
    dims = ("spectrum_method", "fault", "noise", "parameter")
    variables = {key: (dims[: found[key].ndim], found[key], *texts[key]) for key in STATISTICS}
    variables["true"] = (("parameter",), true, "SI", "value assumed")
    coordinates = {
        "spectrum_method": (list(by_method), "1", "spectrum method"),
        "fault": (faults, "1", "what is wrong with the record"),
        "noise": (np.array(levels, float), "percent", "white noise on each sample, of the rms of the vibration"),
        **parameter_coordinates(names),
    }
    return dataset(variables, coordinates, title=f"{config.title}: {name}, {estimator.name}")


def without_values(model, unknowns):
    """The model with its unknowns not given a value: a start or a prior must not know the truth."""
    terms = []
    for term in model.terms:
        sought = {p.name for p in term.parameters if {term.full_name(p), f"{term.full_name(p)}_real"} & {*unknowns}}
        terms.append(replace(term, values={name: v for name, v in term.values.items() if name not in sought}))
    return replace(model, terms=tuple(terms))


def _bounds(config, name, rotor, theta):
    """Level -> (parameter,) Cramer-Rao standard deviations for whole turns with white noise."""
    clean = clean_spectrum(_NamedHarmonics(rotor.measured), rotor.model, rotor.speeds)
    found = {}
    for level in config.levels(name):
        if not level:
            continue
        std = noise_std(clean, level / 100, "white in time", config.samples)
        both = np.concatenate([std, std], axis=1) ** 2
        covariance = np.moveaxis(both, -1, 1)[..., None] * np.eye(both.shape[1])
        used = replace(clean, covariance=covariance).at_harmonics(rotor.harmonics)
        bound = cramer_rao_bound(Problem(rotor.model, used, rotor.unknowns), theta)
        found[level] = np.sqrt(np.diag(magnitude_and_phase(rotor.unknowns, theta, bound)[2]))
    return found


class _Speeds(NamedTuple):
    speeds: np.ndarray


def bias(study, rotor, estimator):
    """What wrong known quantities of its study cost an estimator, at the speeds compared on; see `identify.bias`."""
    cases = {"speeds compared": _Speeds(rotor.speeds)}
    settings = {"cases": cases, "harmonics": list(rotor.harmonics), "estimators": [estimator.name]}
    return identify.bias(study.model_copy(update=settings), study.main_rig)


def comparison(parts):
    """One array over everything: {(rotor, estimator): Dataset of `estimates`} -> Dataset with both as dimensions."""
    import xarray as xr

    rotors = list(dict.fromkeys(rotor for rotor, _ in parts))
    estimators = list(dict.fromkeys(estimator for _, estimator in parts))
    along, equal = xr.Variable("estimator", estimators), {"compat": "equals"}
    by_rotor = [xr.concat([parts[r, e] for e in estimators], dim=along, data_vars="different", **equal) for r in rotors]
    whole = xr.concat(by_rotor, dim=xr.Variable("rotor", rotors), data_vars="all", join="outer", **equal)
    whole["rotor"].attrs = {"units": "1", "long_name": "rotor compared on"}
    whole["estimator"].attrs = {"units": "1", "long_name": "parameter estimator"}
    return whole


def ranking(whole):
    """How the pairs of spectrum method and estimator rank, by rotor, fault and noise.

    returns : DataFrame with the error over the Cramer-Rao bound (geometric mean over the parameters), the error of
              the worst parameter, coverage, failures and time, best first
    """
    import xarray as xr

    whole = whole.sel(noise=whole.noise > 0)
    over = np.sqrt(1 / whole.efficiency)
    columns = {
        "error over bound": np.exp(np.log(over).mean("parameter")),
        "worst parameter": over.max("parameter"),
        "coverage": whole.coverage.mean("parameter"),
        "failed": whole.failed,
        "ms an estimate": 1e3 * whole.seconds,
    }
    table = xr.Dataset(columns).to_dataframe().reset_index()
    table = table[table["error over bound"].notna() | (table.failed == 1)]
    keys = ["rotor", "fault", "noise"]
    table = table[[*keys, "spectrum_method", "estimator", *columns]]
    return table.sort_values([*keys, "error over bound"]).reset_index(drop=True)


HONEST = (0.90, 0.99)  # mean coverage of 95 % intervals that may be believed: 200 trials know it to 1.5 % a parameter


SELDOM = 0.02  # share of trials a pair may fail in and still be advised: one sees it fail, and takes another
AS_GOOD = 1.05  # errors that close are one another's equal: 200 trials know an error to 5 %
ANY_FAULT = "not known which"


def advice(ranked):
    """Which spectrum method and estimator for which fault: the smallest error in the worst rotor and noise level.

    Of the pairs that seldom fail, each spectrum method's best estimator; of equals one with honest intervals, then one
    that never fails.
    returns : DataFrame (fault, three best spectrum methods): estimator, its equals, the error over the bound in the
              worst cell, which cell that is, the median, coverage; last the same for a fault that is not known
    """
    import pandas as pd

    every = pd.concat([ranked, ranked.assign(fault=ANY_FAULT)], ignore_index=True)
    keys = ["fault", "spectrum_method", "estimator"]
    every = every[every.groupby(keys).failed.transform("max") <= SELDOM]
    groups, error = every.groupby(keys, sort=False), "error over bound"
    table = groups.agg(
        worst=(error, "max"),
        typical=(error, "median"),
        lowest_coverage=("coverage", "min"),
        highest_coverage=("coverage", "max"),
        failed=("failed", "max"),
        ms=("ms an estimate", "median"),
    ).reset_index()
    cells = every.loc[groups[error].idxmax()]
    table["worst_in"] = [f"{rotor}, {noise:g} %" for rotor, noise in zip(cells.rotor, cells.noise, strict=True)]
    table["intervals"] = [
        "honest" if HONEST[0] <= low and high <= HONEST[1] else "too narrow" if low < HONEST[0] else "too wide"
        for low, high in zip(table.lowest_coverage, table.highest_coverage, strict=True)
    ]
    rows = []
    for _, same in table.groupby(keys[:2], sort=False):
        good = same[same.worst <= AS_GOOD * same.worst.min()]
        good = good.assign(dishonest=good.intervals != "honest", fails=good.failed > 0)
        good = good.sort_values(["dishonest", "fails", "worst"], kind="stable")
        rows.append({**good.iloc[0], "as_good": ", ".join(good.estimator[1:]) or "none"})
    best = pd.DataFrame(rows, columns=[*table.columns, "as_good"])
    best["last"] = best.fault == ANY_FAULT
    best["step"] = np.round(np.log(best.worst.astype(float)) / np.log(AS_GOOD))  # equals: by the median
    best = best.sort_values(["last", "fault", "step", "typical"], kind="stable").groupby("fault", sort=False).head(3)
    shown = {
        **{key: key for key in keys},
        "as_good": "estimators as good",
        "worst": "error over bound, worst rotor and noise",
        "worst_in": "where that is",
        "typical": "error over bound, median",
        "intervals": "intervals",
        "lowest_coverage": "lowest coverage",
        "highest_coverage": "highest coverage",
        "failed": "failed, largest share",
        "ms": "ms an estimate",
    }
    return best[list(shown)].rename(columns=shown).reset_index(drop=True)
