"""Configuration of a simulated study."""

import re
from copy import deepcopy
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.full_spectra import PHASES
from rotorstudy.measurement.noise import MODELS
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.options import Positive
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.studies.common import clean_spectrum
from rotorstudy.yaml_file import read_study


class SpeedRange(Strict):
    """Speeds first, first + step, ..., last, rad/s."""

    first_rad_s: float = Field(gt=0)
    last_rad_s: float = Field(gt=0)
    step_rad_s: float = Field(default=1.0, gt=0)

    @property
    def speeds(self):
        """(speed,) rad/s."""
        count = int(np.floor((self.last_rad_s - self.first_rad_s) / self.step_rad_s + 1e-9)) + 1
        return self.first_rad_s + self.step_rad_s * np.arange(count)


class RecordKind(Strict):
    """How a record is taken."""

    late_samples: float = Field(default=0.0, ge=0)  # delay of its start, its length unchanged
    dropped_samples: int = Field(default=0, ge=0)  # samples cut off its start, which shortens it
    whole_revolutions: bool = True  # the last incomplete revolution is cut off before the harmonics are estimated
    # samples from the origin of time of a spectrum method to the record: the thesis has different ones
    clock_samples: dict[str, int] = {}


class RecordConfig(Strict):
    """Simulated records, and how they are taken."""

    duration_s: float = Field(gt=0)
    samples: int = Field(gt=1)
    settling_s: float = Field(default=1.0, ge=0)  # from rest to the start of a record, rounded up to whole revolutions
    from_rest: Literal["integration", "exact"] = "integration"  # exact: of time-invariant models, without its error
    kinds: dict[str, RecordKind] = Field(min_length=1)  # name -> RecordKind
    identified: list[str] = Field(min_length=1)  # kinds used for estimates
    identified_from: list[Literal["steady state", "from rest"]] = Field(default=["steady state"], min_length=1)

    @property
    def step(self):
        """Time between samples, s."""
        return self.duration_s / self.samples

    @property
    def time(self):
        """(time,) s, from the first sample."""
        return np.arange(self.samples) * self.step


class MonteCarloRig(Strict):
    """Monte Carlo trials, from records from rest or else the steady state; condensed: as in the thesis, too."""

    estimators: list[str] = Field(min_length=1)
    models: list[Literal[tuple(MODELS)]] = Field(min_length=1)
    records: list[str] = []
    condensed: bool = False


class MonteCarloConfig(Strict):
    """rigs : name of a rig -> its trials"""

    trials: int = Field(ge=2)
    levels_percent: list[Positive] = Field(min_length=1)
    rigs: dict[str, MonteCarloRig]
    seed: int


class BiasConfig(Strict):
    """keys : rotor options held at wrong values, e.g. mass_kg;  percent : their errors"""

    keys: list[str]
    percent: list[Annotated[float, Field(gt=-100)]]


class ExtraMeasurement(Strict):
    """A further or different measurement, to find which would separate the unknowns best."""

    tilts: list[int] = []  # nodes where two probes, tilt_arm_m apart, measure the tilt
    tilt_arm_m: Positive = 0.04
    stations_m: list[float] = []  # further probes along the shaft
    speeds: SpeedRange | None = None  # instead of the study's
    harmonics: list[int] | None = None  # instead of the study's
    times_longer: Positive = 1.0  # length of the records relative to the study's

    def output_rows(self, structure, sensors):
        """Output matrix (output, dof) of sensors, tilts, stations, and the noise of each relative to a probe's."""
        rows = [structure.unit(node) for node in sensors]
        rows += [structure.unit(node, "tilt") for node in self.tilts]
        for position in self.stations_m:
            if structure.shape_at is None:
                told = "this rotor does not define the shaft's shape between nodes"
                raise RotorstudyError(f"no probe can be placed at {position:g} m: {told}")
            rows.append(structure.shape_at(position))
        relative = np.ones(len(rows))
        relative[len(sensors) : len(sensors) + len(self.tilts)] = np.sqrt(2) / self.tilt_arm_m
        return np.array(rows), relative


class Variant(Strict):
    """Equations solved with the model of one rig from exact spectra of another, to find the error by a wrong model."""

    simulated: str
    identified: str
    condensation: Literal["exact", "without gyroscopic moments"] = "exact"  # see `inference.problem.Problem`
    held_with_percent: float | None = None  # deflection held at that of bearings too stiff by this; else follows them


class StudyConfig(Strict):
    """A simulated study."""

    name: str
    title: str
    rigs: dict[str, dict]  # name -> rig (see `rotorstudy.model.rig`)
    harmonics: list[int] = Field(min_length=1)
    record: RecordConfig
    shown_speeds_rad_s: list[Positive] = Field(min_length=1)
    cases: dict[str, SpeedRange] = Field(min_length=1)  # name -> speeds
    unknowns: list[str] = Field(min_length=1)
    spectra: list[str] = Field(min_length=1)  # shown; `studies.comparison` compares all of the library
    estimators: list[str] = Field(min_length=1)  # likewise
    monte_carlo: MonteCarloConfig
    bias: BiasConfig
    crack_scales: list[Positive] = []
    extra_measurements: dict[str, ExtraMeasurement] = {}
    sensor_sets: dict[str, list[int]] = {}
    variants: dict[str, Variant] = {}

    def rig(self, name):
        """The Model of a rig; raises RotorstudyError for an unknown name."""
        check_known("rig", [name], self.rigs, f"study '{self.name}'")
        return build_model(self.rigs[name], where=f"study {self.name}, rig {name}")

    @property
    def main_rig(self):
        """The first rig: right signs, exact series. Sensitivities are computed for it alone."""
        return next(iter(self.rigs))

    @property
    def reported(self):
        """Unknowns as reported, complex ones as magnitude and phase: name -> unit, "rad" of a phase."""
        count = len(self.unknowns)
        names, *_ = magnitude_and_phase(self.unknowns, np.ones(count), np.eye(count))
        return dict(zip(names, self.rig(self.main_rig).reported_units(names), strict=True))

    @property
    def coordinates(self):
        """Coordinates of the Datasets of its stages."""
        return {
            "case": list(self.cases),
            "spectrum_method": self.spectra,
            "phase_reference": list(PHASES),
            "estimator": self.estimators,
            "speed": np.array(self.shown_speeds_rad_s, float),
            "harmonic": np.array(self.harmonics),
            "parameter": list(self.reported),
        }

    def true_values(self, model):
        """(parameter,) the values that a model has of the reported unknowns."""
        theta = model.theta[model.position(self.unknowns)]
        return magnitude_and_phase(self.unknowns, theta, np.eye(len(theta)))[1]

    def relative_error(self, theta, true):
        """(..., parameter) relative errors of reported unknowns; of phases the differences in rad."""
        phase = [unit == "rad" for unit in self.reported.values()]
        return np.where(phase, theta - true, theta / true - 1)

    def clean_spectrum(self, model, speeds):
        """Its harmonics of a model in steady state, without noise, a Spectrum; speeds (speed,) rad/s."""
        return clean_spectrum(model, speeds, self.harmonics)

    def problem(self, model, spectrum):
        """The Problem of its unknowns."""
        return Problem(model, spectrum, tuple(self.unknowns))

    @property
    def methods(self):
        """Plugins of the spectrum methods and estimators of this study, by kind."""
        tried = [name for rig in self.monte_carlo.rigs.values() for name in rig.estimators]
        return named_methods(self.spectra, [*self.estimators, *tried], f"study {self.name}")

    def check_rigs(self):
        """Build every rig and look up every name the study uses, so that mistakes show before anything runs."""
        where = f"study {self.name}"
        if not self.rigs:
            raise RotorstudyError(f"{where} has no rig; give at least one under 'rigs:'")
        check_harmonics(self.harmonics)
        doubled = [name for name in self.unknowns if self.unknowns.count(name) > 1]
        if doubled:
            raise RotorstudyError(f"unknowns of {where}: {doubled[0]} is given twice")
        self._check_cases(where)
        for key in self.bias.keys:
            changed(self.rigs[self.main_rig]["rotor"], key, 0.0, f"{where}, bias")
        for name, nodes in self.sensor_sets.items():
            build_model({**self.rigs[self.main_rig], "sensors": nodes}, where=f"{where}, sensor set '{name}'")
        for name, variant in self.variants.items():
            check_known("rig", (variant.simulated, variant.identified), self.rigs, f"{where}, variant '{name}'")
        for name in self.rigs:
            self.rig(name).position(self.unknowns)
        self._check_kinds(where)
        check_known("rig", self.monte_carlo.rigs, self.rigs, f"study '{self.name}'")
        _ = self.methods  # an unknown name is an error
        self._check_measurements()

    def _check_cases(self, where):
        files = {}
        for case, speeds in self.cases.items():
            if len(speeds.speeds) == 0:
                ends = f"{speeds.first_rad_s:g} and {speeds.last_rad_s:g} rad/s"
                raise RotorstudyError(f"case '{case}' of {where} has no speed between {ends}")
            other = files.setdefault(file_name(case), case)
            if other != case:
                raise RotorstudyError(f"cases '{other}' and '{case}' of {where} would write the same file; rename one")

    def _check_kinds(self, where):
        named = {"identified": self.record.identified}
        named |= {f"monte_carlo, {rig}": tried.records for rig, tried in self.monte_carlo.rigs.items()}
        for section, kinds in named.items():
            check_known("record kind", kinds, self.record.kinds, f"{where}, {section}")
        for name, kind in self.record.kinds.items():
            for method in kind.clock_samples:
                registry().get("spectrum", method, f"{where}, clock_samples")
            if kind.dropped_samples >= self.record.samples:
                raise RotorstudyError(
                    f"{where}, record kind '{name}': dropped_samples = {kind.dropped_samples} leaves "
                    f"nothing of {self.record.samples} samples; drop fewer"
                )

    def _check_measurements(self):
        model = self.rig(self.main_rig)
        for name, extra in self.extra_measurements.items():
            try:
                extra.output_rows(model.structure, model.sensors)
                if extra.harmonics is not None:
                    check_harmonics(extra.harmonics)
                if extra.speeds is not None and len(extra.speeds.speeds) == 0:
                    raise RotorstudyError("speeds: the last lies below the first")
            except RotorstudyError as error:
                raise RotorstudyError(f"study {self.name}, extra_measurements, '{name}': {error}") from None

    def check_shown(self, count):
        """Raise RotorstudyError unless as many speeds are shown as the printed figures of a chapter have."""
        given = self.shown_speeds_rad_s
        if len(given) != count:
            raise RotorstudyError(
                f"study {self.name}: shown_speeds_rad_s lists {len(given)} speeds, but the printed figures of this "
                f"chapter are of {count}; give {count}"
            )


def changed(options, key, percent, where="the rotor"):
    """Options of a rotor with one number changed by per cent; key: "mass_kg", or "discs.0.mass_kg" inside a list."""
    value = new = deepcopy(options)
    for part in key.split("."):
        inside = value
        part = int(part) if isinstance(inside, list) and part.isdecimal() else part
        of_list = range(len(inside)) if isinstance(inside, list) else ()
        check_known("key", [part], inside if isinstance(inside, dict) else of_list, where)
        value = inside[part]
    if not isinstance(value, (int, float)):
        raise RotorstudyError(f"key '{key}' in {where} is not a number, so it cannot be varied")
    inside[part] = value * (1 + percent / 100)
    return new


def file_name(case):
    """A case as part of a file name."""
    return re.sub(r"[^A-Za-z0-9]+", "_", case).strip("_")


def named_methods(spectra, estimators, where):
    """Plugins by kind and name, each once."""
    named = {"spectrum": spectra, "estimator": estimators}
    return {kind: {n: registry().get(kind, n, f"{where}, {kind}") for n in names} for kind, names in named.items()}


def load_study(path):
    """A StudyConfig from a YAML file; unknown and missing keys are one-line errors."""
    return check_config(StudyConfig, read_study(path), str(path))
