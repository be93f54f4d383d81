"""From the records of two states of a machine to a folder: what changed, data, figures and a page."""

import json
from pathlib import Path

from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.result import Verdict
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import named_plugins, read_rig
from rotorstudy.model.shown_units import shown_for
from rotorstudy.presentation.change_figures import both_states, two_states
from rotorstudy.presentation.charts import axes_of
from rotorstudy.presentation.diagnosis_files import write_diagnosis
from rotorstudy.presentation.rotor_files import mean_positions
from rotorstudy.store import provenance
from rotorstudy.studies.centreline import journals_moved


def compare_files(before: list[str | Path], after: list[str | Path], rig_path: str | Path, out: str | Path) -> Verdict:
    """Compare the records of two states and write everything into the folder `out`."""
    rig_file = read_rig(rig_path)
    settings = read_settings(rig_file.given, str(rig_path))
    first, model, findings = measured_spectrum(before, rig_file)
    second, other, more = measured_spectrum(after, rig_file)
    model = other if len(second.single_probes) > len(first.single_probes) else model  # it has the probes of both states
    check_names(settings, model, f"{rig_path}, diagnosis")
    with shown_for(rig_file.given, str(rig_path)):
        conventions = read_conventions(rig_file.given, str(rig_path))
        states = ((before, first), (after, second))
        places = (mean_positions(paths, conventions, spectrum, model) for paths, spectrum in states)
        findings = (*findings, *more, *journals_moved(model, *places))
        found = compare(first, second, model, settings=settings, findings=findings)
        diagnosis = with_hidden(found.diagnosis)
        said = summary(diagnosis.verdict, of_change=True)
    added = [registry().get("effect", cause.effect) for cause in diagnosis.verdict.causes]
    origin = provenance(rig_file.given, [*named_plugins(rig_file.given), *added])
    names = [", ".join(map(str, paths)) for paths in (before, after)]
    origin |= {"records": f"{names[1]} after {names[0]}", "rig": str(rig_path)}
    verdict = diagnosis.verdict.model_copy(update={"summary": said, "provenance": origin})
    axes = axes_of(model, rig_file.given)
    data = verdict_dataset(diagnosis, found.difference).assign_attrs(origin, axes=axes)
    with shown_for(rig_file.given, str(rig_path)):
        figures = {
            "two_states": two_states(found.before, found.after, found.difference, model.structure.reading.mark_rad)
        }
        states = both_states(found.before, found.after, json.loads(axes))
    write_diagnosis(verdict, data, extended_rig(rig_file.given, diagnosis), out, figures, states=states)
    return verdict
