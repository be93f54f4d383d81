"""From records, of one state or two, and a rig file to a folder: verdict, data, extended rig, figures and a page."""

import json
from itertools import chain
from pathlib import Path

import numpy as np

from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.result import Verdict
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.estimated_rig import write_rig
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import named_plugins, read_rig
from rotorstudy.model.shown_units import shown_for
from rotorstudy.presentation.charts import axes_of, drawn
from rotorstudy.presentation.diagnosis_figures import both_states, diagnosis_figures, two_states
from rotorstudy.presentation.diagnosis_page import diagnosis_page
from rotorstudy.presentation.plots import save_pictures
from rotorstudy.presentation.rotor_figures import centreline
from rotorstudy.presentation.rotor_files import mean_positions
from rotorstudy.store import provenance, save, whole_folder, write_text
from rotorstudy.studies.centreline import centrelines, journals_moved


def diagnose_files(
    records: list[str | Path],
    rig_path: str | Path,
    out: str | Path,
    hold_out: list[float] | None = None,
    name: str | None = None,
    links: dict[str, str] | None = None,
) -> Verdict:
    """Diagnose records and write everything into the folder `out`.

    records  : paths of record files and tables of harmonics, or of one spectrum that `rotorstudy import` wrote
    rig_path : the rig file
    out      : folder for verdict.json, verdict.nc, extended_rig.yaml, index.html and figures
    hold_out : speeds held out of every fit, rad/s; by default those of the rig file, else about a quarter
    name     : what was diagnosed, for the title of the page; by default the name of the rig file
    links    : text -> address, relative to index.html, of pages to go to from its top
    raises   : RotorstudyError for files that cannot be read and for findings that are errors; nothing is written then
    """
    rig, where, settings, model, (spectrum,), findings = _read(rig_path, records)
    with shown_for(rig, where):
        diagnosis = with_hidden(investigate(spectrum, model, hold_out=hold_out, settings=settings, findings=findings))
        places = mean_positions(records, read_conventions(rig, where), spectrum, model)
        figures = _centreline(model, spectrum, {"measured": places})
    origin = {"records": ", ".join(map(str, records)), "rig": where}
    return _write(diagnosis, spectrum, model, rig, origin, out, first=figures, name=name, links=links)


def compare_files(before: list[str | Path], after: list[str | Path], rig_path: str | Path, out: str | Path) -> Verdict:
    """Compare the records of two states and write everything into the folder `out`."""
    rig, where, settings, model, (first, second), findings = _read(rig_path, before, after)
    with shown_for(rig, where):
        conventions = read_conventions(rig, where)
        states = ((before, first), (after, second))
        places = [mean_positions(paths, conventions, spectrum, model) for paths, spectrum in states]
        findings = (*findings, *journals_moved(model, *places))
        found = compare(first, second, model, settings=settings, findings=findings)
        diagnosis = with_hidden(found.diagnosis)
        mark, both = model.structure.reading.mark_rad, (found.before, found.after)
        figures = {"two_states": two_states(*both, found.difference, mark)}
        figures |= _centreline(model, second, dict(zip(("before", "after"), places, strict=True)))
        states = both_states(*both, axes_of(model, rig))
    names = [", ".join(map(str, paths)) for paths in (before, after)]
    origin = {"records": f"{names[1]} after {names[0]}", "rig": where}
    return _write(diagnosis, found.difference, model, rig, origin, out, first=figures, states=states)


def _read(rig_path, *states):
    """A rig as a dict, its path and settings, the Model with the probes of all states; their spectra and Findings."""
    rig, where = read_rig(rig_path), str(rig_path)
    settings = read_settings(rig.given, where)
    spectra, models, findings = zip(*(measured_spectrum(records, rig) for records in states), strict=True)
    model = models[np.argmax([len(spectrum.single_probes) for spectrum in spectra])]
    check_names(settings, model, f"{where}, diagnosis")
    return rig.given, where, settings, model, spectra, tuple(chain(*findings))


def _centreline(model, spectrum, measured):
    """The figure of the shaft centreline, by name, if one was measured; measured : state -> `mean_positions`."""
    every = zip(*(centrelines(model, spectrum.speed, places) for places in measured.values()), strict=True)
    journals = [one for one in every if any(len(state.measured) for state in one)]
    charts = [centreline(one, model.structure, tuple(measured), *later) for one, *later in journals]
    return {"centreline": drawn([charts], 2.6, 2.6)} if charts else {}


def _write(diagnosis, spectrum, model, rig, origin, out, first=None, name=None, links=None, states=None):
    """Write a diagnosis into a folder, all of it or nothing; first, states : figures and charts of a comparison."""
    added = [registry().get("effect", cause.effect) for cause in diagnosis.verdict.causes]
    origin = provenance(rig, [*named_plugins(rig), *added]) | origin
    verdict = diagnosis.verdict.model_copy(update={"provenance": origin})
    data = verdict_dataset(diagnosis, spectrum).assign_attrs(origin, axes=json.dumps(axes_of(model, rig)))
    with whole_folder(out) as folder, shown_for(rig, origin["rig"]):
        png = save_pictures((first or {}) | diagnosis_figures(verdict, data), folder / "figures")
        save(data, folder / "verdict.nc")
        comment = f"{origin['rig']} after a diagnosis of its records\n{verdict.summary}"
        write_rig(extended_rig(rig, diagnosis), folder / "extended_rig.yaml", comment)
        page = diagnosis_page(verdict, data, png, name or Path(origin["rig"]).stem, links, states)
        write_text(folder / "index.html", page)
        write_text(folder / "verdict.json", verdict.model_dump_json(indent=1) + "\n")
    return verdict
