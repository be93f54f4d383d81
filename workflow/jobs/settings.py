"""Configuration of the workflow, and of all that it names, checked before anything runs."""

import os
import sys
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, Field

from rotorstudy.blind.config import load_blind
from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.registry import registry
from rotorstudy.studies.comparison.config import load_comparison
from rotorstudy.studies.config import load_study
from rotorstudy.studies.crack_study.config import load_crack_study
from rotorstudy.studies.cracks import load_cracks
from rotorstudy.yaml_file import base_of, read_yaml
from thesis.config import check_replay, load_replay

ROOT = Path(__file__).parents[2]  # of the project, where paths start that are not from the root of the file system
Placed = Annotated[str, AfterValidator(lambda stated: str(ROOT / stated) if stated else stated)]
LOADERS = {"compare": load_comparison, "blind": load_blind, "cracks": load_cracks, "crack_study": load_crack_study}


class DiagnosisItem(Strict):
    """records : paths of record files or tables;  rig : rig file;  replay : the replay of the same data, if any"""

    records: list[Placed] = Field(min_length=1)
    rig: Placed
    replay: str = ""


class Chunks(Strict):
    """Jobs into which a sweep is split: blind by cases, monte_carlo by noise levels, compare by faults."""

    blind: int = Field(default=1, ge=1)
    monte_carlo: int = Field(default=1, ge=1)
    compare: int = Field(default=1, ge=1)


class WorkflowConfig(Strict):
    """Folders, and configuration files by name; what is not given is left out."""

    results: str
    reference: Placed
    plugin_folders: list[str] = []
    studies: dict[str, Placed] = {}
    replays: dict[str, Placed] = {}
    blind: Placed = ""
    compare: Placed = ""
    diagnoses: dict[str, DiagnosisItem] = {}  # measured records and rig files
    cracks: Placed = ""
    crack_study: Placed = ""
    chunks: Chunks = Chunks()  # jobs of long sweeps
    independent_records: dict[str, Placed] = {}  # name -> cases (CSV) beside the blind tests
    published: Placed = ""  # folder of rig files, each beside a table of what others printed


class Settings(NamedTuple):
    """The configuration of the workflow, with full paths, and those that it names; None of what is left out."""

    config: WorkflowConfig
    studies: dict
    replays: dict
    compare: object = None
    blind: object = None
    cracks: object = None
    crack_study: object = None

    @property
    def bases(self):
        """Files on which studies and replays are based."""
        stated = [*self.config.studies.values(), *self.config.replays.values(), self.config.crack_study]
        paths = [Path(path) for path in stated if path]
        return sorted({base for path in paths if (base := base_of(path, read_yaml(path)))})


def read_settings(given):
    """The Settings of a configuration (dict); a mistake ends the process in one line."""
    try:
        _check_folders(str(given.get("results", "")))
        config = check_config(WorkflowConfig, dict(given), "the workflow configuration")
        studies = {name: load_study(path) for name, path in config.studies.items()}
        replays = {name: load_replay(path) for name, path in config.replays.items()}
        others = {key: load(path) for key, load in LOADERS.items() if (path := getattr(config, key))}
        found = Settings(config, studies, replays, **others)
        if found.compare:
            found.compare.check(studies, replays)
        for name, study in studies.items():
            study.check_rigs()
            if name in ("chapter_2", "chapter_4"):
                study.check_shown(2)
        for replay in replays.values():
            check_replay(replay, config.reference)
        for name, item in config.diagnoses.items():
            where = f"the workflow configuration, diagnoses.{name}"
            check_known("replay", filter(None, [item.replay]), replays, where)
    except RotorstudyError as error:
        sys.exit(f"error: {error}")
    for failure in registry().failures:
        print(f"warning: {failure}", file=sys.stderr)
    return found


def _check_folders(results):
    for folder, use in (
        (os.getcwd(), "where results are written"),
        (results if os.path.exists(results) else None, "where results are written"),
        (os.environ.get("TMPDIR"), "stated by TMPDIR"),
    ):
        if folder and not (os.path.isdir(folder) and os.access(folder, os.W_OK)):
            raise RotorstudyError(f"{folder}, {use}, is not a folder that can be written to; change its rights")
