"""Configuration of the whole workflow."""

from rotorstudy.studies.config import Strict


class WorkflowConfig(Strict):
    """results, reference: folders;  studies, replays: name -> configuration file;  plugin_folders: further plugins

    cracks : configuration file of the comparison of crack models; none: left out
    """

    results: str
    reference: str
    plugin_folders: list[str] = []
    studies: dict[str, str] = {}
    replays: dict[str, str] = {}
    cracks: str = ""
