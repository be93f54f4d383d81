"""Configuration of the whole workflow."""

from pydantic import Field

from rotorstudy.model.configuration import Strict


class DiagnosisItem(Strict):
    """records : paths of record files or tables;  rig : rig file;  replay : the replay they are published data of"""

    records: list[str] = Field(min_length=1)
    rig: str
    replay: str = ""


class WorkflowConfig(Strict):
    """results, reference: folders;  studies, replays: name -> configuration file;  plugin_folders: further plugins

    blind   : configuration file of the blind tests of the diagnosis; none: they are left out
    compare : configuration file of the comparison of spectra and estimators; none: it is left out
    diagnoses : name -> measured records and the rig file that they are of
    cracks : configuration file of the comparison of crack models; none: left out
    """

    results: str
    reference: str
    plugin_folders: list[str] = []
    studies: dict[str, str] = {}
    replays: dict[str, str] = {}
    blind: str | None = None
    compare: str | None = None
    diagnoses: dict[str, DiagnosisItem] = {}
    cracks: str = ""
