"""Configuration of the workflow, and of all that it names, checked before anything runs."""

import os
import sys
from pathlib import Path
from typing import NamedTuple

from pydantic import Field

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


class DiagnosisItem(Strict):
    """records : paths of record files or tables;  rig : rig file;  replay : the replay of the same data, if any"""

    records: list[str] = Field(min_length=1)
    rig: str
    replay: str = ""


class Chunks(Strict):
    """Jobs into which a sweep is split: blind by cases, monte_carlo by noise levels, compare by faults."""

    blind: int = Field(default=1, ge=1)
    monte_carlo: int = Field(default=1, ge=1)
    compare: int = Field(default=1, ge=1)


class WorkflowConfig(Strict):
    """Folders, and configuration files by name; what is not given is left out."""

    results: str
    reference: str
    plugin_folders: list[str] = []
    studies: dict[str, str] = {}
    replays: dict[str, str] = {}
    blind: str = ""
    compare: str = ""
    diagnoses: dict[str, DiagnosisItem] = {}  # measured records and rig files
    cracks: str = ""
    crack_study: str = ""
    chunks: Chunks = Chunks()  # jobs of long sweeps
    independent_records: dict[str, str] = {}  # name -> cases (CSV) beside the blind tests
    published: str = ""  # folder of rig files, each beside a table of what others printed


class Settings(NamedTuple):
    """The configuration of the workflow, with full paths, and those that it names; None of what is left out."""

    config: WorkflowConfig
    studies: dict
    replays: dict
    comparison: object
    blind: object
    cracks: object
    crack_study: object

    @property
    def bases(self):
        """Files on which studies and replays are based."""
        stated = [*self.config.studies.values(), *self.config.replays.values(), self.config.crack_study]
        paths = [Path(path) for path in stated if path]
        return sorted({base for path in paths if (base := base_of(path, read_yaml(path)))})


def read_settings(given, root):
    """The Settings of a configuration (dict), with paths from a root; a mistake ends the process in one line."""
    try:
        _check_folders(str(given.get("results", "")))
        config = _placed(check_config(WorkflowConfig, dict(given), "the workflow configuration"), root)
        found = Settings(
            config,
            studies={name: load_study(path) for name, path in config.studies.items()},
            replays={name: load_replay(path) for name, path in config.replays.items()},
            comparison=load_comparison(config.compare) if config.compare else None,
            blind=load_blind(config.blind) if config.blind else None,
            cracks=load_cracks(config.cracks) if config.cracks else None,
            crack_study=load_crack_study(config.crack_study) if config.crack_study else None,
        )
        _check(found)
    except RotorstudyError as error:
        sys.exit(f"error: {error}")
    for failure in registry().failures:
        print(f"warning: {failure}", file=sys.stderr)
    return found


def _placed(config, root):
    """The configuration with every path but that of the results from the root of the file system."""

    def place(stated):
        return str(root / stated) if stated else stated

    single = ("reference", "blind", "compare", "cracks", "crack_study", "published")
    update = {key: place(getattr(config, key)) for key in single}
    for key in ("studies", "replays", "independent_records"):
        update[key] = {name: place(path) for name, path in getattr(config, key).items()}
    update["diagnoses"] = {
        name: item.model_copy(update={"records": [*map(place, item.records)], "rig": place(item.rig)})
        for name, item in config.diagnoses.items()
    }
    return config.model_copy(update=update)


def _check_folders(results):
    for folder, use in (
        (os.getcwd(), "where results are written"),
        (results if os.path.exists(results) else None, "where results are written"),
        (os.environ.get("TMPDIR"), "stated by TMPDIR"),
    ):
        if folder and not (os.path.isdir(folder) and os.access(folder, os.W_OK)):
            raise RotorstudyError(f"{folder}, {use}, is not a folder that can be written to; change its rights")


def _check(settings):
    config, studies = settings.config, settings.studies
    if settings.comparison:
        settings.comparison.check(studies, settings.replays)
    for name, study in studies.items():
        study.check_rigs()
        if name in ("chapter_2", "chapter_4"):
            study.check_shown(2)
    for replay in settings.replays.values():
        check_replay(replay, config.reference)
    for name, item in config.diagnoses.items():
        where = f"the workflow configuration, diagnoses.{name}"
        check_known("replay", filter(None, [item.replay]), settings.replays, where)
