"""What is compared: faults of a record, rotors, levels of noise."""

from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.model import Model
from rotorstudy.model.options import NonNegative, Positive
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.studies.common import clean_spectrum
from rotorstudy.yaml_file import read_yaml


class Fault(Strict):
    """A fault of a record; by default none."""

    revolutions: float = Field(default=12.0, ge=2)  # length of the record
    speed_error: float = Field(default=0.0, gt=-0.05, lt=0.05)  # of its speed label, relative
    keyphasor_jitter_rad: float = Field(default=0.0, ge=0)  # standard deviation of each pulse
    outlier_share: float = Field(default=0.0, ge=0, lt=0.5)  # of the samples
    outlier_size: float = Field(default=0.0, ge=0)  # relative to the rms vibration
    levels_percent: list[NonNegative] | None = None  # noise levels, by default those of the comparison
    use_if: str = ""  # when a reader should follow the advice for this fault, in words that end "Use this if ..."


class Compared(Strict):
    """A rotor to compare on: the main rig of a study (needs speeds), or that of a replay with what it identified."""

    study: str | None = None
    replay: str | None = None
    speeds_rad_s: list[Positive] = []
    harmonics: list[int] | None = None

    @model_validator(mode="after")
    def _one_source(self):
        if (self.study is None) == (self.replay is None):
            raise ValueError("give either 'study' or 'replay'")
        if self.study and not self.speeds_rad_s:
            raise ValueError("a study needs speeds_rad_s")
        return self


class CompareConfig(Strict):
    """trials : of each cell with noise; trials_without_noise : of the others, where only faults are random"""

    title: str
    trials: int = Field(ge=2)
    trials_without_noise: int = Field(ge=2)
    samples: int = Field(ge=64)
    levels_percent: list[NonNegative] = Field(min_length=1)
    faults: dict[str, Fault] = Field(min_length=1)
    rotors: dict[str, Compared] = Field(min_length=1)
    seed: int

    def levels(self, fault):
        """Noise levels of a fault, percent, in the order of those of the comparison."""
        own = self.faults[fault].levels_percent
        return [level for level in self.levels_percent if own is None or level in own]

    def check(self, studies, replays):
        """Raise RotorstudyError for an unknown study or replay, wrong harmonics or noise levels."""
        for name, compared in self.rotors.items():
            known, wanted = studies if compared.study else replays, compared.study or compared.replay
            check_known("study or replay", [wanted], known, f"compare, rotor '{name}'")
            if compared.harmonics is not None:
                check_harmonics(compared.harmonics, f"compare, rotor '{name}': harmonics")
        for name, fault in self.faults.items():
            known = self.levels_percent
            own = known if fault.levels_percent is None else fault.levels_percent
            if not own or {*own} - {*known}:
                raise RotorstudyError(f"compare, fault '{name}': levels_percent = {own} must be some of {known}")


def load_comparison(path):
    """A CompareConfig from a YAML file; unknown and missing keys are one-line errors."""
    return check_config(CompareConfig, read_yaml(path), str(path))


class Rotor(NamedTuple):
    """A rotor to compare on: speeds (speed,) rad/s, harmonics (harmonic,) measured and those given to an estimator."""

    model: Model
    unknowns: tuple
    measured: list
    harmonics: list
    speeds: np.ndarray

    @property
    def without_noise(self):
        """Its steady-state Spectrum without noise, at the harmonics that a spectrum method estimates."""
        return clean_spectrum(self.model, self.speeds, self.measured)


def make_rotor(compared, model, unknowns, harmonics, speeds):
    """The Rotor of a Compared; harmonics : those of its source;  speeds : (speed,) rad/s."""
    used = compared.harmonics or harmonics
    measured = [*harmonics, *(n for n in used if n not in harmonics)]
    return Rotor(model, unknowns, measured, used, np.array(speeds))


def study_rotor(compared, study):
    """The Rotor of the main rig of a study."""
    model = study.rig(study.main_rig)
    return make_rotor(compared, model, tuple(study.unknowns), study.harmonics, compared.speeds_rad_s)
