"""From a rig file to the picture of its probes."""

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.model.rig import read_rig
from rotorstudy.presentation.plots import save_figure
from rotorstudy.presentation.probe_figures import probe_picture


def draw_probes(rig_path, path):
    """Draw the probes of a rig file (path or RigFile) to a file."""
    rig = read_rig(rig_path)
    conventions = read_conventions(rig.given, str(rig.path))
    if not conventions.probes:
        return None
    save_figure(probe_picture(conventions, rig.model.structure.nodes, rig.model.structure.labels), path)
    return path
