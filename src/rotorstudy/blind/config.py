"""Configuration of the blind tests."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.rig import build_model
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.yaml_file import read_yaml

KINDS = ("clean", "single", "two", "chain", "foreign")
Share = Annotated[float, Field(ge=0, le=1)]
PositiveNumber = Annotated[float, Field(gt=0)]


class BlindRig(Strict):
    """A rotor in which effects are hidden: a rig file or the rig itself, and the sensor sets it is measured with."""

    file: str | None = None
    rig: dict | None = None
    sensor_sets: list[list[int]] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_source(self):
        if (self.file is None) == (self.rig is None):
            raise ValueError("give either 'file' or 'rig'")
        return self


class BlindConfig(Strict):
    """Settings of the blind tests; those marked * are stated to the diagnosis.

    cases, seed    : defaults of the command line
    shares         : of clean, single, two, chain and foreign cases; they sum to 1
    noise_percent  : standard deviations of a harmonic, percent of the rms vibration (median over speeds); one per case
    two_noise_percent : the same for cases with two effects
    size, two_size : smallest and largest change over noise, drawn log-uniformly
    most_colour    : largest lag-one autocorrelation of the noise
    revolutions, samples_per_revolution : of a record
    fewest_speeds, most_speeds : of a case
    mesh_factor    : elements of the machine per element of the rig file
    base_share     : relative standard deviation of each base parameter about its value in the rig file *
    rotor_share    : the same of the uncertain numbers of the rotor (modulus, density, masses) *
    model_error    : relative discretisation error of a harmonic on the mesh of the rig file *
    phase_mark_std_rad, gain_std : standard deviations of the phase mark and of the probe gains *
    records        : number of cases whose records are also written as NetCDF
    """

    title: str
    cases: int = Field(ge=1)
    seed: int = Field(ge=0)
    rigs: dict[str, BlindRig] = Field(min_length=1)
    harmonics: list[int]
    shares: dict[str, Share]
    noise_percent: list[PositiveNumber] = Field(min_length=1)
    two_noise_percent: list[PositiveNumber] = Field(min_length=1)
    size: tuple[PositiveNumber, PositiveNumber]
    two_size: tuple[PositiveNumber, PositiveNumber]
    most_colour: float = Field(ge=0, lt=1)
    revolutions: int = Field(ge=8)
    samples_per_revolution: int = Field(ge=16)
    fewest_speeds: int = Field(ge=3)
    most_speeds: int = Field(ge=3)
    mesh_factor: int = Field(ge=1)
    base_share: float = Field(ge=0, lt=0.5)
    rotor_share: float = Field(ge=0, lt=0.5)
    model_error: float = Field(ge=0, lt=0.5)
    phase_mark_std_rad: float = Field(ge=0, lt=0.2)
    gain_std: float = Field(ge=0, lt=0.2)
    records: int = Field(ge=0)

    @model_validator(mode="after")
    def _sensible(self):
        if set(self.shares) != set(KINDS) or abs(sum(self.shares.values()) - 1) > 1e-9:
            raise ValueError(f"shares must name {', '.join(KINDS)} and sum to 1")
        if self.fewest_speeds > self.most_speeds:
            raise ValueError("fewest_speeds must not exceed most_speeds")
        if 2 * max(abs(n) for n in self.harmonics) >= self.samples_per_revolution:
            raise ValueError("samples_per_revolution must be more than twice the highest harmonic")
        return self

    def nominal(self, name):
        """The rig dict as the diagnosis is given it."""
        entry = self.rigs[name]
        return entry.rig if entry.rig is not None else read_yaml(entry.file)


def load_blind(path):
    """A BlindConfig from a YAML file; every rig is built once as a check. A mistake raises a one-line RotorstudyError.

    Rig files are sought from the working directory, then from two folders above that of the configuration.
    """
    given = read_yaml(path)
    for key in ("size", "two_size"):
        if isinstance(given.get(key), list):
            given[key] = tuple(given[key])
    if isinstance(given.get("rigs"), dict):
        given["rigs"] = {
            name: check_config(BlindRig, _checked(entry, path, name), f"{path}, rigs.{name}")
            for name, entry in given["rigs"].items()
        }
    config = check_config(BlindConfig, given, str(path))
    check_harmonics(config.harmonics)
    for name, entry in config.rigs.items():
        for sensors in entry.sensor_sets:
            build_model({**config.nominal(name), "sensors": sensors}, f"{path}, rigs.{name}").require_values()
    return config


def _checked(entry, path, name):
    if not isinstance(entry, dict):
        raise RotorstudyError(f"{path}, rigs.{name}: expected keys and values, found {type(entry).__name__}")
    if "file" not in entry or Path(str(entry["file"])).is_file():
        return entry
    beside = Path(path).resolve().parents[2] / str(entry["file"])
    return {**entry, "file": str(beside)}
