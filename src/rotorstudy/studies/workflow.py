"""Configuration of the whole workflow."""

from rotorstudy.studies.config import Strict


class WorkflowConfig(Strict):
    """results, reference: folders;  studies, replays: name -> configuration file;  plugin_folders: further plugins

    blind   : configuration file of the blind tests of the diagnosis; none: they are left out
    compare : configuration file of the comparison of spectra and estimators; none: it is left out
    cracks : configuration file of the comparison of crack models; none: left out
    """

    results: str
    reference: str
    plugin_folders: list[str] = []
    studies: dict[str, str] = {}
    replays: dict[str, str] = {}
    blind: str | None = None
    compare: str | None = None
    cracks: str = ""
