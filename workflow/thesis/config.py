"""Configuration of a replayed experiment, checked against the printed values it names."""

from itertools import product
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, check_known, unknown_name
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.rig import build_model
from rotorstudy.studies.config import named_methods
from rotorstudy.yaml_file import read_study
from thesis.scoreboard import published

QUANTITIES = ("amplitude", "phase", "reference phase")
NEEDED = {  # keys that a figure of a kind must give
    "record": ("case",),
    "spectra": ("case",),
    "without slow roll": ("case",),
    "orbits": ("case",),
    "model": ("case", "group"),
    "checks": ("group",),
}
COMPARED = {
    "data_sets": ("regression", "fft"),
    "estimators": ("least_squares", "maximum_likelihood"),
}  # shown on every page


class Correction(Strict):
    """A misprint of the source: which value, what was printed, what is used, and why."""

    case: str
    item: int
    quantity: str
    printed: float
    used: float
    reason: str


class Sheet(Strict):
    """How a printed table is shown: title, note, and the keys of its columns (rows are harmonics)."""

    title: str
    note: str
    across: list[Literal["case", "quantity", "method"]]


class Picture(Strict):
    """A figure: its kind, the published speed it shows, and the group of the thesis whose estimates it uses."""

    kind: Literal[
        "record", "spectra", "without slow roll", "orbits", "model", "crack force", "bow magnification", "checks"
    ]
    case: str = ""
    group: str = ""


class ReplayConfig(Strict):
    """A replayed experiment."""

    name: str
    title: str
    tables: list[str]  # numbers of the published spectra
    estimates_table: str  # number of the thesis's estimates
    data_sets: list[str]
    cases: dict[str, float]  # name of each published speed -> rad/s, the slow roll first
    slow_roll: str
    corrections: list[Correction] = []
    harmonics: list[int]
    sampling_rate_Hz: float = Field(gt=0)
    duration_s: float = Field(gt=0)
    rig: dict
    spectra: list[str] = Field(min_length=1)
    estimators: list[str]
    groups: dict[str, Annotated[list[str], Field(min_length=1)]] = Field(min_length=1)  # -> cases, most speeds last
    thesis_groups: dict[str, str] = {}  # group as the thesis names it -> the group here; others have the same name
    thesis_deflection_m: float | None = None  # static deflection of the thesis's simulation, if it contradicts its rig
    sheets: dict[str, Sheet]  # printed tables by name
    figures: dict[str, Picture]  # printed pictures by name
    trials: int = Field(ge=2)
    seed: int
    model_error: float = Field(ge=0)  # standard deviation, relative to each harmonic without slow roll
    natural_frequency_Hz: dict[str, float]
    frequency_resolution_Hz: float = Field(gt=0)
    undamped_frequency_uncertainty: float = Field(ge=0)  # relative

    @property
    def model(self):
        """The Model of the rig."""
        return build_model(self.rig, where=f"replay {self.name}, rig")

    @property
    def all_speeds(self):
        """The group of estimates from the most speeds."""
        return list(self.groups)[-1]

    @property
    def thesis_names(self):
        """Name of a parameter in the thesis -> (name here, factor to its unit)."""
        names = {"c_E": ("external_damping", 1.0), "c_H": ("internal_damping", 1.0), "e": ("eccentricity", 1.0)}
        names["phi"] = ("eccentricity_phase", 180 / np.pi)
        return names | {f"dk p_{n}": (loss, 1.0) for n, loss in self.losses.items()}

    @property
    def losses(self):
        """Harmonic n -> name of the stiffness loss times participation factor, dk p_n."""
        (loss,) = {name.split("_p")[0] for name in self.model.names if "stiffness_loss" in name}
        return {n: f"{loss}_p{n}" for n in self.harmonics}

    @property
    def time(self):
        """(time,) s, instants of the samples of a record."""
        return np.arange(round(self.sampling_rate_Hz * self.duration_s)) / self.sampling_rate_Hz

    @property
    def speeds(self):
        """(case,) rad/s, the published speeds."""
        return np.array(list(self.cases.values()))

    @property
    def slow(self):
        """Position of the slow roll among the cases."""
        return list(self.cases).index(self.slow_roll)

    @property
    def higher(self):
        """Positions (case,) of all cases but the slow roll."""
        return np.delete(np.arange(len(self.cases)), self.slow)

    @property
    def higher_cases(self):
        """All cases but the slow roll: name -> rad/s."""
        return {case: speed for case, speed in self.cases.items() if case != self.slow_roll}


def load_replay(path):
    """A ReplayConfig from a YAML file; unknown and missing keys are one-line errors."""
    return check_config(ReplayConfig, read_study(path), str(path))


def check_replay(config, folder):
    """Build the rig and look up every name the replay uses, so that mistakes show before anything runs."""
    config.model.position(())
    where = f"replay {config.name}"
    shown, cases = config.figures.values(), [case for cases in config.groups.values() for case in cases]
    check_known("case", [config.slow_roll, *cases, *(p.case for p in shown if p.case)], config.cases, where)
    groups = [*config.thesis_groups.values(), *(p.group for p in shown if p.group)]
    check_known("group", groups, {**config.groups, **config.thesis_groups}, where)
    for name, cases in config.groups.items():
        if config.slow_roll in cases:
            raise RotorstudyError(
                f"{where}: group '{name}' holds the slow roll '{config.slow_roll}', which is zero after subtraction; "
                "remove it"
            )
    named_methods(config.spectra, config.estimators, where)
    _check_figures(config, where)
    _check_printed(config, folder, where)


def _check_figures(config, where):
    """Every figure gives the keys that its kind needs."""
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
            f"{where}: a figure of kind 'crack force' shows the groups of kind 'model'; add a figure of that kind"
        )


def _check_printed(config, folder, where):
    """Every table exists and holds what the replay takes from it."""
    try:
        sheets = published(folder, [*config.sheets, config.estimates_table])
        spectra = published(folder, config.tables)
    except RotorstudyError as error:
        raise RotorstudyError(f"{where}: {error}") from None
    check_known("data set", config.data_sets, spectra.method.unique(), where)
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
    check_known("estimates_table", [config.estimates_table], config.sheets, f"{where}, sheets")
    estimates = sheets[sheets.table == config.estimates_table]
    place = f"{where}, Table {config.estimates_table}"
    for group, part in estimates.groupby("case", sort=False):
        if config.thesis_groups.get(group, group) not in config.groups:
            raise unknown_name("group", group, {**config.groups, **config.thesis_groups}, place)
        check_known("parameter", config.thesis_names, list(part.item), f"{place}, '{group}'")
    of_models = (p.group for p in config.figures.values() if p.kind == "model")
    check_known("group", [config.all_speeds, *of_models], estimates.case.unique(), place)
