"""Replay of a published measurement: printed spectra turned back into records, which take the path of simulated ones.

The printed digits are the only noise there is: every value is known to half a unit of its last digit, and that
uncertainty is carried by drawing printed values from within it.
"""

from itertools import product
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.inference.problem import Problem, magnitude_and_phase
from rotorstudy.measurement.records import Record, full_spectrum, keyphasor_signal
from rotorstudy.measurement.spectrum import Spectrum, components, independent_covariance
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex, dataset, read_yaml
from rotorstudy.studies.config import SPEED, named_methods, parameter_coordinates
from rotorstudy.thesis.scoreboard import published

QUANTITIES = ("amplitude", "phase", "reference phase")


COLUMN = "fft"  # the printed column that pages and figures show
DAMPINGS, BOTH_DAMPINGS = ("external_damping", "internal_damping"), "both_dampings"
NEEDED = {  # of a picture by its kind
    "record": ("case",),
    "spectra": ("case",),
    "without slow roll": ("case",),
    "orbits": ("case",),
    "model": ("case", "group"),
    "checks": ("group",),
}
COMPARED = {"data_sets": ("regression", "fft"), "estimators": ("least_squares", "maximum_likelihood")}  # on every page


class Correction(Strict):
    """A misprint of the source: which value, what was printed, what is used, and why."""

    case: str
    item: int
    quantity: str
    printed: float
    used: float
    reason: str


class Sheet(Strict):
    """How a printed table is shown: its title, what to note, and which keys go across (the harmonics go down)."""

    title: str
    note: str
    across: list[Literal["case", "quantity", "method"]]


class Picture(Strict):
    """A figure: what it shows, of which published speed, with the estimates of which group of the thesis."""

    kind: Literal[
        "record", "spectra", "without slow roll", "orbits", "model", "crack force", "bow magnification", "checks"
    ]
    case: str = ""
    group: str = ""


class ReplayConfig(Strict):
    """A replayed experiment.

    tables : of the published spectra;  estimates_table : of the thesis's estimates
    cases  : name of each published speed -> rad/s, the slow roll first
    groups : name of each group of estimates -> published cases used for it here, the one with most speeds last
    thesis_groups : group as the thesis names it -> the group here; those not listed have the same name
    thesis_deflection_m : static deflection of the thesis's own simulation, if it contradicts its rig
    sheets, figures : printed tables and pictures by name
    """

    name: str
    title: str
    tables: list[str]
    estimates_table: str
    data_sets: list[str]
    cases: dict[str, float]
    slow_roll: str
    corrections: list[Correction] = []
    harmonics: list[int]
    sampling_rate_Hz: float = Field(gt=0)
    duration_s: float = Field(gt=0)
    rig: dict
    spectra: list[str] = Field(min_length=1)
    estimators: list[str]
    groups: dict[str, Annotated[list[str], Field(min_length=1)]] = Field(min_length=1)
    thesis_groups: dict[str, str] = {}
    thesis_deflection_m: float | None = None
    sheets: dict[str, Sheet]
    figures: dict[str, Picture]
    trials: int = Field(ge=2)
    seed: int
    model_error: float = Field(ge=0)  # of each harmonic, slow roll removed: what the model is not trusted to explain
    natural_frequency_Hz: dict[str, float]
    frequency_resolution_Hz: float = Field(gt=0)
    undamped_frequency_uncertainty: float = Field(ge=0)  # relative

    @property
    def model(self):
        return build_model(self.rig, where=f"replay {self.name}, rig")

    @property
    def all_speeds(self):
        """The group of estimates with most speeds."""
        return list(self.groups)[-1]

    @property
    def thesis_names(self):
        """Name of a parameter in the thesis -> (name here, factor to its unit)."""
        (loss,) = {name.split("_p")[0] for name in self.model.names if "stiffness_loss" in name}
        names = {"c_E": ("external_damping", 1.0), "c_H": ("internal_damping", 1.0), "e": ("eccentricity", 1.0)}
        names["phi"] = ("eccentricity_phase", 180 / np.pi)
        return names | {f"dk p_{n}": (f"{loss}_p{n}", 1.0) for n in self.harmonics}

    @property
    def time(self):
        return np.arange(round(self.sampling_rate_Hz * self.duration_s)) / self.sampling_rate_Hz

    @property
    def speeds(self):
        return np.array(list(self.cases.values()))


def load_replay(path):
    """A ReplayConfig from a YAML file; unknown and missing keys are one-line errors."""
    return check_config(ReplayConfig, read_yaml(path), str(path))


def check_replay(config, folder):
    """Build the rig and find every name the replay uses, so that mistakes show before anything runs.

    folder : holds the printed values
    """
    config.model.position(())
    where = f"replay {config.name}"
    known = {"case": config.cases, "group": {**config.groups, **config.thesis_groups}}
    named = [("case", config.slow_roll), *(("case", case) for cases in config.groups.values() for case in cases)]
    named += [("group", group) for group in config.thesis_groups.values()]
    named += [(key, getattr(p, key)) for p in config.figures.values() for key in known if getattr(p, key)]
    for key, name in named:
        if name not in known[key]:
            raise unknown_name(key, name, known[key], where)
    for name, cases in config.groups.items():
        if config.slow_roll in cases:
            raise RotorstudyError(
                f"{where}: group '{name}' holds the slow roll '{config.slow_roll}', which is zero after subtraction; "
                "take it out"
            )
    named_methods(config.spectra, config.estimators, where)
    _check_figures(config, where)
    _check_printed(config, folder, where)


def _check_figures(config, where):
    """Every picture says what its kind needs."""
    for name, picture in config.figures.items():
        for key in NEEDED.get(picture.kind, ()):
            if not getattr(picture, key):
                raise RotorstudyError(f"{where}, figure '{name}': kind '{picture.kind}' needs '{key}:'")
        if picture.kind == "model" and picture.case == config.slow_roll:
            raise RotorstudyError(
                f"{where}, figure '{name}': there is no model of the slow roll '{config.slow_roll}'; name another case"
            )
    kinds = {picture.kind for picture in config.figures.values()}
    if "crack force" in kinds and "model" not in kinds:
        raise RotorstudyError(
            f"{where}: a figure of kind 'crack force' shows the groups of kind 'model'; give one of those"
        )


def _check_printed(config, folder, where):
    """Every table is printed, and holds what the replay takes from it."""
    try:
        sheets = published(folder, [*config.sheets, config.estimates_table])
        spectra = published(folder, config.tables)
    except RotorstudyError as error:
        raise RotorstudyError(f"{where}: {error}") from None
    for data_set in config.data_sets:
        if data_set not in set(spectra.method):
            raise unknown_name("data set", data_set, spectra.method.unique(), where)
    for key, names in COMPARED.items():
        for name in names:
            if name not in getattr(config, key):
                raise RotorstudyError(f"{where}: {key} must list '{name}', which the pages compare with the others")
    found = set(spectra[["case", "item", "quantity", "method"]].itertuples(index=False, name=None))
    for case, n, quantity, data_set in product(config.cases, config.harmonics, QUANTITIES, config.data_sets):
        if (case, str(n), quantity, data_set) not in found:
            raise RotorstudyError(
                f"{where}: tables {', '.join(config.tables)} print no {quantity} of {n}X for case '{case}', column "
                f"'{data_set}' (cases printed: {', '.join(spectra.case.unique())})"
            )
    if config.estimates_table not in config.sheets:
        raise unknown_name("estimates_table", config.estimates_table, config.sheets, f"{where}, sheets")
    estimates = sheets[sheets.table == config.estimates_table]
    place = f"{where}, Table {config.estimates_table}"
    for group, part in estimates.groupby("case", sort=False):
        if config.thesis_groups.get(group, group) not in config.groups:
            raise unknown_name("group", group, {**config.groups, **config.thesis_groups}, place)
        for name in config.thesis_names:
            if name not in set(part.item):
                raise unknown_name("parameter", name, part.item, f"{place}, '{group}'")
    for group in (config.all_speeds, *(p.group for p in config.figures.values() if p.kind == "model")):
        if group not in set(estimates.case):
            raise unknown_name("group", group, estimates.case.unique(), place)


def thesis_estimates(config, folder, group):
    """Estimates the thesis prints for a group, as amplitudes theta of the rig's model, and the model they belong to.

    The thesis's crack force is its estimate times the deflection it assumed, so theta is that force over ours.
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
        theta[[name.startswith("stiffness_loss") for name in model.names]] *= ratio
    return theta


def printed_values(config, folder, *, corrected):
    """Printed amplitude, phase and reference phase, and one unit of their last digit.

    returns : {quantity: (values, last_digit)}, each (data_set, case, harmonic), m and rad
    """
    table = published(folder, config.tables)
    shape = (len(config.data_sets), len(config.cases), len(config.harmonics))
    found = {quantity: (np.zeros(shape), np.zeros(shape)) for quantity in QUANTITIES}
    table = table.set_index(["case", "item", "quantity", "method"])
    fixes = {(c.case, str(c.item), c.quantity): c.used for c in config.corrections} if corrected else {}
    for quantity, (values, digits) in found.items():
        for d, data_set in enumerate(config.data_sets):
            for c, case in enumerate(config.cases):
                for h, n in enumerate(config.harmonics):
                    row = table.loc[(case, str(n), quantity, data_set)]
                    values[d, c, h] = fixes.get((case, str(n), quantity), row.published)
                    digits[d, c, h] = row.last_digit if (case, str(n), quantity) not in fixes else 0.01
    return found


def records(config, folder):
    """The published spectra as time records, as printed and with the misprints corrected.

    returns : displacement (version, data_set, case, time, part) m; reference (version, data_set, case, time), of unit
              amplitude at every harmonic, because the thesis prints the phases of its reference signal only
    """
    time, harmonics = config.time, np.array(config.harmonics)
    forward = harmonics >= 0
    displacement, reference = [], []
    for corrected in (False, True):
        values = {q: v for q, (v, _) in printed_values(config, folder, corrected=corrected).items()}
        amplitude = values["amplitude"] * np.exp(1j * values["phase"])
        mark = np.exp(1j * values["reference phase"][..., forward])  # a real signal: -n is the conjugate of +n
        for signals, size, order in ((displacement, amplitude, harmonics), (reference, mark, harmonics[forward])):
            turned = [synthesize(size[:, c], w, order, time) for c, w in enumerate(config.speeds)]
            signals.append(np.moveaxis(turned, 0, 1))
    coordinates = {
        "version": (["as printed", "corrected"], "1", "with the misprints or without"),
        "data_set": (config.data_sets, "1", "column of the tables: spectrum method of the thesis"),
        "case": (list(config.cases), "1", "published speed"),
        "time": (time, "s", "time from the first sample"),
    }
    dims = tuple(coordinates)
    variables = {
        "displacement": (dims, np.array(displacement), "m", "complex displacement with bow and sensor gap"),
        "reference": (dims, np.array(reference).real, "1", "reference signal"),
        "speed": (("case",), config.speeds, *SPEED),
    }
    return dataset(variables, coordinates, title=f"{config.title}: replayed records")


def spectra(config, replay):
    """Full spectra of replayed records by every method, as they come, compensated, and without bow and sensor gap.

    returns : displacement, compensated, corrected (version, data_set, spectrum_method, case, harmonic, part) m;
              reference_phase (version, data_set, spectrum_method, case, harmonic) rad
    """
    methods = {name: registry().get("spectrum", name) for name in config.spectra}
    signals, references = as_complex(replay.displacement), replay.reference.values
    shape = (*signals.shape[:2], len(methods), len(config.cases), len(config.harmonics))
    plain, compensated = np.zeros(shape, complex), np.zeros(shape, complex)
    for v, d in np.ndindex(*signals.shape[:2]):
        for m, method in enumerate(methods.values()):
            taken = []
            for c, (case, w) in enumerate(config.cases.items()):
                signal, reference, mark = signals[v, d, c], references[v, d, c], keyphasor_signal(w, config.time)
                taken.append(Record(config.time, signal[None], w, (1,), reference, mark, f"{config.name}, {case}"))
            plain[v, d, m] = full_spectrum(taken, config.harmonics, method, "none").amplitude[..., 0]
            compensated[v, d, m] = full_spectrum(taken, config.harmonics, method, "reference").amplitude[..., 0]
    coordinates = {
        "version": (replay.version.values, "1", "with the misprints or without"),
        "data_set": (config.data_sets, "1", "column of the tables"),
        "spectrum_method": (list(methods), "1", "spectrum method"),
        "case": (list(config.cases), "1", "published speed"),
        "harmonic": (np.array(config.harmonics), "1", "harmonic of the spin speed, positive forward"),
    }
    dims = tuple(coordinates)
    phase = np.angle(plain * compensated.conj())
    variables = {
        "displacement": (dims, plain, "m", "full spectrum"),
        "compensated": (dims, compensated, "m", "full spectrum, phase from the reference signal"),
        "corrected": (dims, remove_slow_roll(config, compensated), "m", "compensated, without bow and sensor gap"),
        "reference_phase": (dims, phase, "rad", "phase of the reference signal"),
        "speed": (("case",), config.speeds, *SPEED),
    }
    return dataset(variables, coordinates, title=f"{config.title}: full spectra")


def remove_slow_roll(config, amplitude):
    """Eq. (3.1): the 0X and 1X harmonics of the slow roll off those of every speed; (..., case, harmonic)."""
    slow = list(config.cases).index(config.slow_roll)
    static = np.isin(config.harmonics, (0, 1))
    return amplitude - np.where(static, amplitude[..., slow : slow + 1, :], 0)


def rounding_draws(config, folder, data_set):
    """Compensated spectra (trial, case, harmonic) with every printed value drawn from within its last digit."""
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
    """The Problem of some cases, slow roll removed.

    compensated : (..., case, harmonic) of all cases;  draws : (trial, case, harmonic), give the covariance
    """
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


def identify(config, folder, spectra_data):
    """Estimates of every estimator, data set and group, with 95 % intervals.

    Intervals of least squares come from estimates with printed values drawn from within their last digit; those of
    maximum likelihood from rounding and model error, widened where the misfit is larger than these allow.

    returns : estimate, low, high (estimator, data_set, group, parameter), both dampings together, too;
              misfit (estimator, data_set, group);
              simulated (estimator, data_set, group, case, harmonic, part) m, what the identified model predicts
    """
    compensated = as_complex(spectra_data.compensated.sel(version="corrected"))
    method = list(spectra_data.spectrum_method.values).index("regression")
    higher = [case for case in config.cases if case != config.slow_roll]
    speeds = [config.cases[case] for case in higher]
    estimates, misfits, simulated = [], [], []
    for name in config.estimators:
        estimator = registry().get("estimator", name).function
        for d, data_set in enumerate(config.data_sets):
            draws = rounding_draws(config, folder, data_set)
            for cases in config.groups.values():
                problem = replay_problem(config, cases, compensated[d, method], draws)
                found = estimator(problem)
                freedom = 2 * problem.spectrum.amplitude.size - len(problem.names)
                names, theta, covariance = _reported(problem.names, found.theta, found.covariance)
                if np.isfinite(found.misfit):
                    half = 1.96 * np.sqrt(np.diag(covariance) * max(1.0, found.misfit / freedom))
                    low, high = theta - half, theta + half
                else:
                    drawn = estimator(replay_problem(config, cases, draws, draws))
                    drawn = _reported(problem.names, drawn.theta, drawn.covariance)[1]
                    low, high = np.percentile(_unwrapped(names, drawn, theta), [2.5, 97.5], axis=0)
                estimates.append((theta, low, high))
                misfits.append(found.misfit / freedom)
                simulated.append(measured_response(problem.model, speeds, config.harmonics, found.theta)[..., 0])
    coordinates = {
        "estimator": (config.estimators, "1", "parameter estimator"),
        "data_set": (config.data_sets, "1", "column of the tables"),
        "group": (list(config.groups), "1", "speeds used together"),
        **parameter_coordinates(names),
        "case": (higher, "1", "published speed"),
        "harmonic": (np.array(config.harmonics), "1", "harmonic of the spin speed, positive forward"),
    }
    dims = ("estimator", "data_set", "group")
    shape = (len(config.estimators), len(config.data_sets), len(config.groups))
    table = np.array(estimates).reshape(*shape, 3, len(names))
    variables = {
        "estimate": ((*dims, "parameter"), table[..., 0, :], "SI", "estimated parameter"),
        "low": ((*dims, "parameter"), table[..., 1, :], "SI", "lower end of the 95 % interval"),
        "high": ((*dims, "parameter"), table[..., 2, :], "SI", "upper end of the 95 % interval"),
        "misfit": (
            dims,
            np.array(misfits).reshape(shape),
            "1",
            "misfit over degrees of freedom, 1 if the model explains the data",
        ),
        "simulated": (
            (*dims, "case", "harmonic"),
            np.array(simulated).reshape(*shape, len(higher), -1),
            "m",
            "response of the identified model, slow roll removed",
        ),
    }
    return dataset(variables, coordinates, title=f"{config.title}: identification")


def _reported(names, theta, covariance):
    """Complex amplitudes as magnitude and phase, and after the dampings their sum, which impact tests bound."""
    names, theta, covariance = magnitude_and_phase(names, theta, covariance)
    if not set(DAMPINGS) <= set(names):
        return names, theta, covariance
    places = [names.index(name) for name in DAMPINGS]
    row = np.isin(np.arange(len(names)), places).astype(float)
    turn = np.insert(np.eye(len(names)), max(places) + 1, row, axis=0)
    names = (*names[: max(places) + 1], BOTH_DAMPINGS, *names[max(places) + 1 :])
    return names, theta @ turn.T, turn @ covariance @ turn.T


def _unwrapped(names, drawn, theta):
    """Drawn phases within half a turn of the estimate, so that an interval makes sense."""
    is_phase = np.array([n.endswith("_phase") for n in names])
    near = theta + np.angle(np.exp(1j * (drawn - theta)))
    return np.where(is_phase, near, drawn)
