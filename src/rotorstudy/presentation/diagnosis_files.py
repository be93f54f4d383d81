"""From record files and a rig file to a folder: verdict, data, extended rig, figures and a page."""

import os
import shutil
from contextlib import contextmanager
from pathlib import Path

from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.result import Verdict
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.estimated_rig import write_rig
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import named_plugins, read_rig
from rotorstudy.model.shown_units import shown_for
from rotorstudy.presentation.charts import axes_of
from rotorstudy.presentation.diagnosis_figures import diagnosis_figures
from rotorstudy.presentation.diagnosis_page import diagnosis_page
from rotorstudy.presentation.plots import save_pictures
from rotorstudy.store import partial_path, provenance, save, write_text


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
    rig_file = read_rig(rig_path)
    rig = rig_file.given
    settings = read_settings(rig, str(rig_path))
    spectrum, model, findings = measured_spectrum(records, rig_file)
    check_names(settings, model, f"{rig_path}, diagnosis")
    with shown_for(rig, str(rig_path)):
        diagnosis = with_hidden(investigate(spectrum, model, hold_out=hold_out, settings=settings, findings=findings))
    added = [registry().get("effect", cause.effect) for cause in diagnosis.verdict.causes]
    origin = provenance(rig, [*named_plugins(rig), *added])
    origin |= {"records": ", ".join(map(str, records)), "rig": str(rig_path)}
    verdict = diagnosis.verdict.model_copy(update={"provenance": origin})
    data = verdict_dataset(diagnosis, spectrum).assign_attrs(origin, axes=axes_of(model, rig))
    write_diagnosis(verdict, data, extended_rig(rig, diagnosis), out, name=name, links=links)
    return verdict


def write_diagnosis(verdict, data, rig, out, first=None, name=None, links=None, states=None):
    """Write a diagnosis into the folder `out`, all of it or nothing.

    data : of `verdict_dataset`;  rig : extended;  first : {name: figure} of `CHANGE_FIGURES`;  states : of their charts
    """
    given = verdict.provenance["rig"]
    with whole_folder(out) as folder, shown_for(rig, given):
        png = save_pictures((first or {}) | diagnosis_figures(verdict, data), folder / "figures")
        save(data, folder / "verdict.nc")
        write_rig(rig, folder / "extended_rig.yaml", f"{given} after a diagnosis of its records\n{verdict.summary}")
        page = diagnosis_page(verdict, data, png, name or Path(given).stem, links, states)
        write_text(folder / "index.html", page)
        write_text(folder / "verdict.json", verdict.model_dump_json(indent=1) + "\n")


@contextmanager
def whole_folder(path):
    """A temporary folder whose files are moved to the folder `path` when the block ends without an error."""
    path = Path(path)
    temporary = partial_path(path)
    temporary.mkdir(parents=True)
    try:
        yield temporary
        for file in sorted(file for file in temporary.rglob("*") if file.is_file()):
            place = path / file.relative_to(temporary)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, place)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
