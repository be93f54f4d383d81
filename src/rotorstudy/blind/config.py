"""Configuration of the blind tests."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.rig import build_model
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.store import read_yaml

KINDS = ("clean", "single", "two", "chain", "foreign")
Share = Annotated[float, Field(ge=0, le=1)]
PositiveNumber = Annotated[float, Field(gt=0)]


class BlindRig(Strict):
    """A rotor to hide effects on: a rig file or the rig itself, and the sets of sensors it is measured with."""

    file: str | None = None
    rig: dict | None = None
    sensor_sets: list[list[int]] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_source(self):
        if (self.file is None) == (self.rig is None):
            raise ValueError("give either 'file' or 'rig'")
        return self


class BlindConfig(Strict):
    """What is drawn.

    cases, seed    : by default; the command line may say otherwise
    shares         : of clean, single, two, chain and foreign cases; they sum to 1
    noise_percent  : standard deviation of a harmonic, percent of the rms vibration (median over speeds); one is drawn
    two_noise_percent : the same where two effects act at once
    size, two_size : lowest and highest change over noise, drawn log-uniformly
    most_colour    : largest correlation of noise from sample to sample
    revolutions, samples_per_revolution : of a record
    fewest_speeds, most_speeds
    mesh_factor    : elements of the machine for each of the rig file
    base_share     : standard deviation of each base parameter around the rig file's, relative; stated to the diagnosis
    model_error    : share of a harmonic that the mesh of the rig file misses; stated to the diagnosis
    phase_mark_std_rad, gain_std : of the measuring chain; stated to the diagnosis
    records        : cases whose record is written as NetCDF too
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
        """The rig dict a diagnosis is given."""
        entry = self.rigs[name]
        return entry.rig if entry.rig is not None else read_yaml(entry.file)


def load_blind(path):
    """A BlindConfig from a YAML file, its rigs built once; what is wrong is a one-line error.

    Files of rigs are named from the folder of the project, which is two above that of the configuration, or from here.
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
