"""Several runs of one machine, listed in a file (docs/several_runs.md), and what they say together about its rig."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.runs import contradicting
from rotorstudy.diagnosis.runs.other_forces import FIRST, PAIRS, UNSTATED, by_sizes, other_forces
from rotorstudy.diagnosis.runs.run_file import AddedUnbalance, RunItem, read_runs
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings, check_names, read_settings
from rotorstudy.diagnosis.verdict.findings import told
from rotorstudy.errors import RotorstudyError, check_known, unknown_name
from rotorstudy.inference.joint import JointFit, Run, fit_runs, independent_share
from rotorstudy.inference.prediction import whitened_prediction, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.conventions import Conventions, read_conventions
from rotorstudy.measurement.corrections import check_slow_roll
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.estimated_rig import rig_with_estimate, settled, with_effects_at
from rotorstudy.model.model import Model
from rotorstudy.model.rig import RigFile, read_rig
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import is_number
from rotorstudy.model.terms import Term
from rotorstudy.threads import on_one_thread
from rotorstudy.units import percent

log = logging.getLogger(__name__)

GRAM, GRAM_MM = 1e-3, 1e-6  # kg, kg m
LEAST_ERROR, LARGEST_ERROR = 1e-3, 0.5  # of the model, fraction of each harmonic
FEWEST_VECTORS = 4  # of a run that do not equal those of another one by the rounding of the instrument


class _Runs(NamedTuple):
    """The runs of a machine: what is listed of each and its Spectrum without the model error; and the machine."""

    items: list[RunItem]
    measured: list[Spectrum]
    rig: RigFile
    model: Model
    settings: Settings
    conventions: Conventions


class IdentifiedRig(NamedTuple):
    """What the runs say: the JointFit, the rig with its values and covariance, findings, and the Conventions."""

    joint: JointFit
    rig: dict
    findings: list[Finding]
    conventions: Conventions


@on_one_thread
def identify_runs(runs_path: str | Path, rig: str | Path | RigFile) -> IdentifiedRig:
    """Update a rig by a file of runs; parameters that a run has for itself keep their value and uncertainty in it.

    raises : RotorstudyError for files that cannot be read, runs of different probes or with the same records, and
             unknown names
    """
    rig = read_rig(rig)
    settings = read_settings(rig.given, str(rig.path))
    items, measured, findings, model = read_runs(runs_path), [], [], None
    for number, item in enumerate(items):
        paths = [Path(runs_path).parent / path for path in item.records]
        spectrum, own_model, found = measured_spectrum(paths, rig)
        model = model or own_model
        if tuple(own_model.sensors) != tuple(model.sensors):
            raise RotorstudyError(
                f"run '{item.name}' has probes at nodes {list(own_model.sensors)}, run '{items[0].name}' at "
                f"{list(model.sensors)}; the runs of one file need the same probes"
            )
        _check_distinct(item, spectrum, zip(items[:number], measured, strict=True))
        measured.append(spectrum)
        findings += [replace(one, where=f"run '{item.name}': {one.where}") for one in found]
        findings += check_slow_roll(spectrum.speed, own_model, f"run '{item.name}'") if item.slow_roll else []
    check_names(settings, model, f"{rig.path}, diagnosis")
    return _updated(_Runs(items, measured, rig, model, settings, read_conventions(rig.given, str(rig.path))), findings)


def _check_distinct(item, spectrum, others):
    """Raise if another run has the same vectors: counted twice, they would make the intervals too narrow."""
    for other, known in others:
        same = [np.array_equal(one, there) for one in spectrum.amplitude for there in known.amplitude]
        if sum(same) == len(spectrum.speed) and spectrum.amplitude.size >= FEWEST_VECTORS:
            raise RotorstudyError(
                f"runs '{other.name}' and '{item.name}' have the same records; give each record to one run"
            )


def _updated(runs, findings):
    """The IdentifiedRig, whose intervals include the error of the model that the runs show."""
    settings = runs.settings
    found, shared = _settled(runs)
    odd = contradicting.contradictions(found.joint, shared, settings, runs.conventions.sense)
    is_told = any(one.name in contradicting.TOLD_APART for one in odd)
    if not is_told and contradicting.is_implausible(found.joint, settings.significance):
        forced = _with_other_forces(runs)
        if not contradicting.is_implausible(forced.joint, settings.significance):
            return forced._replace(findings=[*findings, told("unstated unbalance or bow", "all runs")])
        wider, share = _with_larger_error(runs)
        odd = odd or [contradicting.not_plausible(found.joint)]
        if wider:
            shares = {"share": percent(share), "stated": percent(settings.model_error)}
            found, odd = wider, [*odd, told("larger model error", "all runs", **shares)]
    return found._replace(findings=[*findings, *odd])


def _with_other_forces(runs):
    """The IdentifiedRig with unbalances elsewhere and a bow, alike in all runs, of their most probable sizes."""
    terms = other_forces(runs.model.structure)
    whole, parts, sizes = runs.model.plus(*terms), [[u.name for u in term.unknowns] for term in terms], FIRST
    units = [_as_large_as_measured(whole, part, runs.measured) for part in parts]
    for _ in range(2):
        own = {n: (0.0, u * size) for part, u, size in zip(parts, units, sizes, strict=True) for n in part}
        found, _ = _settled(runs, forces=(terms, Prior.independent(own)))
        sizes = PAIRS[np.argmax(by_sizes(found.joint.posterior, parts, sizes)[0])]
    return found


def _as_large_as_measured(whole, names, measured):
    """Amplitude of some forces that together cause vibration as large as measured, in standard deviations of that."""
    caused = [whitened_prediction(whole, one, names, np.zeros(len(names)))[1] for one in measured]
    shown = [one.whitened(one.amplitude) for one in measured]
    return np.linalg.norm(np.concatenate(shown)) / np.linalg.norm(np.concatenate(caused))


def _with_larger_error(runs):
    """The IdentifiedRig with the least error of the model that explains the runs, or None; and that error.

    It is alike at neighbouring speeds, so that the runs say as much as fewer speeds would.
    """
    for share in islice(model_errors(runs.settings), 1, None):
        raised = runs._replace(settings=runs.settings.model_copy(update={"model_error": share}))
        log.info("fitting the runs with a model error of %s", percent(share))
        found, _ = _settled(raised)
        if not contradicting.exceeds_noise(found.joint):
            return _settled(raised, variance=1 / independent_share(found.joint))[0], share
    return None, None


def model_errors(settings: Settings) -> Iterator[float]:
    """Errors of the model with which a fit is tried, fractions of each harmonic: the stated one, then larger ones."""
    share = settings.model_error
    yield share
    while share < LARGEST_ERROR:
        share = min(max(2 * share, LEAST_ERROR), LARGEST_ERROR)
        yield share


def _settled(runs, variance=1.0, forces=None):
    """The IdentifiedRig without findings, and the Prior of the parameters that runs share.

    `variance` is a factor of the covariance with the model error; forces : terms that no rig states, and the Prior of
    their amplitudes.
    """
    rig, model, settings, conventions = runs.rig, runs.model, runs.settings, runs.conventions
    spectra = [with_model_error(one, settings) for one in runs.measured]
    spectra = [replace(one, covariance=variance * one.covariance) for one in spectra]
    bare = rig.measured_at(model.sensors, model.structure.reading)
    whole, shared = base_model(replace(bare, from_unloaded_line=model.from_unloaded_line), settings)
    if forces:
        whole, shared = whole.plus(*forces[0]), shared.plus(forces[1])
    each = [_run(*one, whole, shared, settings, conventions) for one in zip(runs.items, spectra, strict=True)]

    def fitted(at, before):
        models = with_effects_at([run.model for run in each], rig.given, at)
        here = [run._replace(model=model) for run, model in zip(each, models, strict=True)]
        return fit_runs(here, shared, before and before.with_values(at))

    joint = settled(fitted, lambda joint: {name: joint.posterior.by_name[name] for name in shared_names(joint)})
    names = [name for name in shared_names(joint) if name in bare.names or is_number(name)]
    return IdentifiedRig(joint, rig_with_estimate(rig.given, bare, names, *joint.of(names)), [], conventions), shared


def shared_names(joint: JointFit) -> list[str]:
    """Names of the parameters that runs share, without forces that no rig states."""
    own = {run.joint_name(name) for run in joint.runs for name in run.own.names}
    return [name for name in joint.prior.names if name not in own and not name.startswith(UNSTATED)]


def _run(item, spectrum, whole, shared, settings, conventions):
    """The Run of a listed one: the machine with what is added in this run, and the Prior of what is its own."""
    added = []  # (term, standard deviation of its amplitudes, or zero)
    for i, one in enumerate(item.unbalances):
        term = unbalance_term(one, whole, conventions, f"added {i + 1}", f"run '{item.name}', unbalances[{i}]")
        added.append((term, one.std_g_mm * GRAM_MM / GRAM))
    for i, effect in enumerate(item.effects):
        labelled = {"label": f"added {len(item.unbalances) + i + 1}", **effect}
        place = f"run '{item.name}', effects[{i}]"
        added.append((make_term("effect", labelled, whole.structure, whole.sensors, place), 0.0))
    known = {  # what has no value is wide, unless its usual size is stated
        u.name: (np.nan_to_num(value), std or settings.prior_width * u.typical)
        for term, std in added
        for u, value in zip(term.unknowns, term.theta, strict=True)
        if std or np.isnan(value)
    }
    own = shared.part(_own_names(item, whole, shared, settings)).plus(Prior.independent(known))
    return Run(item.name, whole.plus(*(term for term, _ in added)), spectrum, own)


def _own_names(item, whole, shared, settings):
    """Names of the parameters of the machine that a run has for itself."""
    found = {}
    for wanted in [*item.own, *settings.run_to_run]:
        here = [name for name in whole.amplitudes_of(wanted) if name in shared.names]
        if not here:
            raise unknown_name("uncertain parameter", wanted, shared.names, f"run '{item.name}', own")
        found |= dict.fromkeys(here)
    return list(found)


def unbalance_term(added: AddedUnbalance, whole: Model, conventions: Conventions, label: str, where: str) -> Term:
    """The Term of an added unbalance, that of a gram at an eccentricity; label : of the term, where : for an error."""
    nodes = {name: node for node, name in whole.structure.labels.items()}
    nodes |= {str(name): node for name, node in conventions.node_of_label.items()}
    node = added.node
    if isinstance(node, str):
        check_known("node label", [node], nodes, f"{where}; label a disc so, or list it under 'node_of_label:'")
        if len(same := [one for one, name in whole.structure.labels.items() if name == node]) > 1:
            told = f"the rig has the label '{node}' at nodes {' and '.join(map(str, same))}; give the number of a node"
            raise RotorstudyError(f"{where}: {told}, or each its own label")
        node = nodes[node]
    item = {"kind": "unbalance", "node": node, "mass_kg": GRAM, "label": label}
    if added.unbalance_g_mm is not None:
        item["eccentricity_m"] = added.unbalance_g_mm * GRAM_MM / GRAM
        item["eccentricity_phase_rad"] = float(conventions.sense * np.deg2rad(added.angle_deg))
    return make_term("effect", item, whole.structure, whole.sensors, where)
