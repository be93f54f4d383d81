"""From a rig file, and records if given, to a folder with its rotordynamic analysis."""

import logging

import numpy as np

from rotorstudy.errors import check_known
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.files import kind_of
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.tables import gap_positions
from rotorstudy.model.rig import read_rig
from rotorstudy.model.shown_units import shown_for
from rotorstudy.presentation.captions import MEASURED_FIGURES, ROTOR_FIGURES
from rotorstudy.presentation.plots import save_pictures
from rotorstudy.presentation.rotor_figures import rotor_charts, rotor_figures
from rotorstudy.presentation.rotor_page import rotor_page
from rotorstudy.store import provenance, save, whole_folder, write_text
from rotorstudy.studies.centreline import centrelines
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.studies.stability_margin import stability_margin
from rotorstudy.studies.unbalance_response import probe_vectors

log = logging.getLogger(__name__)

ALONG = 50  # speeds of a shaft centreline
BEYOND = 2.0  # times the highest operating speed: least range of speeds by default, so that margins above are seen


def analyse_files(rig_path, out, speeds=(None, None), operating=None, records=()):
    """The RotorAnalysis of a rig, written to the folder `out` (index.html, rotor.nc, figures), all of it or nothing.

    speeds, operating : lowest and highest, rad/s;  records : of the machine, whose 1X is shown beside the response
    """
    rig, measured, from_rest = read_rig(rig_path), None, {}
    model, conventions = rig.model, read_conventions(rig.given, str(rig_path))
    for probe in conventions.probes:
        if probe.node is not None:
            check_known("node", [probe.node], model.structure.measurable, f"{rig_path}, probe '{probe.channel}'")
    reading = conventions.reading(model.sensors)
    if records:
        spectrum, model, _ = measured_spectrum(records, rig)
        reading = model.structure.reading
        measured = spectrum.speed, measured_vectors(spectrum, reading)
        from_rest = mean_positions(records, conventions, spectrum, model)
    analysis = analyse_rotor(model, *speeds, reading, BEYOND * operating[1] if operating else 0.0)
    if operating:
        analysis = analysis._replace(operating=operating, margin=stability_margin(model, operating[1]))
    shown = analysis.data.speed.values if operating is None else np.linspace(*operating, ALONG)
    analysis = analysis._replace(centrelines=centrelines(model, shown, from_rest))
    with whole_folder(out) as folder, shown_for(rig.given, str(rig_path)):
        log.info("drawing")
        charts = rotor_charts(analysis, model.structure, measured)
        png = save_pictures(rotor_figures(rig, analysis, charts), folder / "figures")
        attributes = {**provenance(rig.given, rig.plugins), "rig": str(rig_path)}
        save(analysis.data.assign_attrs(attributes), folder / "rotor.nc")
        captions = ROTOR_FIGURES | (MEASURED_FIGURES if measured else {})
        write_text(folder / "index.html", rotor_page(analysis, png, charts, rig.path.stem, captions))
    return analysis


def mean_positions(records, conventions, spectrum, model):
    """{node: (speed, rad/s, position, complex, m, from rest)} by the gaps in tables, or by 0X of records."""
    tables = [gap_positions(path, conventions) for path in records if kind_of(path) == "csv"]
    found = {}
    for node in dict.fromkeys(node for table in tables for node in table):
        speed, place = (np.concatenate(part) for part in zip(*(t[node] for t in tables if node in t), strict=True))
        order = np.argsort(speed, kind="stable")
        found[node] = speed[order], place[order]
    if 0 in spectrum.harmonics and not model.from_unloaded_line:
        mean = spectrum.amplitude[:, spectrum.harmonics.tolist().index(0)].T
        found |= {node: (spectrum.speed, one) for node, one in zip(spectrum.sensors, mean, strict=True)}
    return found


def measured_vectors(spectrum, reading):
    """1X along each probe (speed, probe), complex, m, of a Spectrum with harmonics 1 and -1; lead from the mark."""
    check_known("harmonic", (1, -1), spectrum.harmonics, "the records; 1X along a probe needs 1X and -1X")
    both = spectrum.at_harmonics((1, -1)).amplitude
    return probe_vectors({node: both[..., i].T for i, node in enumerate(spectrum.sensors)}, reading)[1]
