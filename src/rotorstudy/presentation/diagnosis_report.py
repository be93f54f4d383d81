"""From record files and a rig file to a folder: verdict, data, extended rig, figures and a page."""

import json
import os
import shutil
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rotorstudy.diagnosis.extend import extended_rig
from rotorstudy.diagnosis.force import equivalent_residual_force
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict import investigate
from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.inference.prediction import predicted, with_model_error
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.configuration import check_config
from rotorstudy.model.estimated_rig import write_rig
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import named_plugins, read_rig

CONTRADICTED = 5.0  # stated deviations that a parameter of the rig is moved


def report(records, rig_path, out, hold_out=None):
    """Diagnose records and write everything into the folder `out`; returns the content of verdict.json.

    records  : paths of record files and tables of harmonics, or of one spectrum that `rotorstudy import` wrote
    hold_out : speeds, rad/s, that no fit sees; by default those of the rig file, else about a quarter
    raises   : RotorstudyError for files that cannot be read, and for findings that are errors; then nothing is written
    """
    from rotorstudy.presentation.diagnosis_figures import draw
    from rotorstudy.presentation.diagnosis_page import not_considered, summary, write_page
    from rotorstudy.store import provenance, save, write_text

    rig_file = read_rig(rig_path)
    given = rig_file.given
    settings = read_settings(given, str(rig_path))
    spectrum, model, findings = measured_spectrum(records, rig_file)
    check_names(settings, model, f"{rig_path}, diagnosis")
    diagnosis = investigate(spectrum, model, hold_out=hold_out, settings=settings)
    attributes = provenance(given, [*named_plugins(given), *_effects_named(diagnosis)])
    attributes |= {"records": ", ".join(map(str, records)), "rig": str(rig_path)}
    data = verdict_dataset(diagnosis, spectrum).assign_attrs(attributes)
    findings = worst_first([*findings, *far_from_the_rig(diagnosis, data)])
    kinds = {term.kind for term in model.terms}
    verdict = {**diagnosis.verdict, "not_considered": not_considered(diagnosis.verdict, kinds)}
    verdict |= {
        "summary": summary(verdict, findings),
        "findings": [asdict(finding) for finding in findings],
        "provenance": attributes,
    }
    rig = extended_rig(given, diagnosis)
    with whole_folder(out) as folder:
        draw(diagnosis, data, folder / "figures")
        save(data, folder / "verdict.nc")
        write_rig(
            rig, folder / "extended_rig.yaml", f"{rig_path} after a diagnosis of its records\n{verdict['summary']}"
        )
        write_page(verdict, data, folder / "figures", folder / "index.html", title=Path(rig_path).stem)
        write_text(folder / "verdict.json", json.dumps(finite(verdict), indent=1, ensure_ascii=False) + "\n")
    return verdict


def far_from_the_rig(diagnosis, data):
    """A warning if records and rig hardly belong together: another machine, other units, other speeds.

    Signs of it: the rig's own values are contradicted, or what was found is beyond the `reach` of its usual sizes.

    data : Dataset of verdict.nc
    """
    from rotorstudy.presentation.diagnosis_page import plain, quantity

    verdict = diagnosis.verdict
    if verdict["verdict"] == "nothing":
        return []
    moving = data.sel(harmonic=data.harmonic != 0)
    measured = float(np.sqrt((moving.measured**2).sum()))
    missed = float(np.sqrt(((moving.measured - moving.base) ** 2).sum())) / measured if measured else 0.0
    moved = [row for row in verdict["base_parameters"] if abs(row["moved_sigma"]) > CONTRADICTED]
    said = [f"{plain(row['name'])} moved by {abs(row['moved_sigma']):.0f} stated deviations" for row in moved]
    theta = dict(zip(diagnosis.best.model.names, diagnosis.best.theta, strict=True))
    for cause in diagnosis.search.best.causes:
        for unknown in cause.term.unknowns:
            value = theta[unknown.name]
            if not cause.fixed and abs(value) > diagnosis.settings.prior_width * unknown.typical:
                name = plain(unknown.name.replace(f"[{cause.term.label}]", ""))
                said.append(f"{name} would be {quantity(value, unknown.unit)}")
    if not said:
        return []
    text = (
        f"{'; '.join(said)}; fitted, the rig misses {100 * missed:.0f} % of the vibration. Are these records of this "
        "rig, at these speeds, in these units? If so, look at the sizes of the causes before believing them, and at "
        "the values and 'uncertainty' the rig states"
    )
    return [Finding("warning", "far from the rig", "records and rig", text)]


def _effects_named(diagnosis):
    return [registry().get("effect", cause.effect) for cause in diagnosis.search.best.causes]


@contextmanager
def whole_folder(path):
    """A temporary folder, whose files come into the folder `path` only when the block ends without an error."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    temporary.mkdir(parents=True)
    try:
        yield temporary
        for file in sorted(file for file in temporary.rglob("*") if file.is_file()):
            place = path / file.relative_to(temporary)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, place)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def finite(value):
    """The same with None for numbers JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value


def read_settings(rig, where):
    """The Settings in the section `diagnosis:` of a rig dict; unknown keys are errors with the near miss."""
    given = rig.get("diagnosis") or {}
    if not isinstance(given, dict):
        raise RotorstudyError(f"{where}, diagnosis: expected keys and values, found {type(given).__name__}")
    return check_config(Settings, given, f"{where}, diagnosis")


def check_names(settings, model, where):
    """Every name the settings use exists; an unknown one is an error with the near miss."""
    known = {"default"}
    for term in model.terms:
        known |= {name for p in term.parameters for name in (p.name, term.full_name(p))}
    for name, share in settings.uncertainty.items():
        if name not in known:
            raise unknown_name("parameter", name, known, f"{where}.uncertainty")
        if share < 0:
            raise RotorstudyError(f"uncertainty of {name} = {share:g} in {where}: must not be negative; 0 holds it")
    for name, std in settings.nuisance.items():
        if registry().get("effect", name, f"{where}.nuisance").acts_on != "output":
            raise RotorstudyError(f"nuisance '{name}' in {where}: must be an effect of the measuring chain")
        if not std > 0:
            raise RotorstudyError(f"nuisance {name} = {std:g} in {where}: must be positive; leave it out to have none")
    for name in settings.leave_out:
        registry().get("effect", name, f"{where}.leave_out")


def verdict_dataset(diagnosis, spectrum):
    """What verdict.nc holds: spectra, residual maps, equivalent residual force, parameters and explanations.

    spectrum : Spectrum of all speeds, fitted and held out
    """
    from rotorstudy.store import dataset

    whole = with_model_error(spectrum, diagnosis.settings)
    base, best = diagnosis.search.base, diagnosis.best
    held = diagnosis.held_out.speed if diagnosis.held_out is not None else []
    grid = ("speed", "harmonic", "node")
    variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)
    variance = variance.reshape(*variance.shape[:-1], 2, -1).sum(axis=-2)
    variables = {
        "measured": (grid, spectrum.amplitude, "m", "measured harmonics"),
        "standard_deviation": (grid, np.sqrt(variance).transpose(0, 2, 1), "m", "noise of the measured harmonics"),
        "held_out": (("speed",), np.isin(spectrum.speed, held).astype("int8"), "1", "1 if no fit has seen the speed"),
    }
    for when, fitted in (("before", base), ("after", best)):
        shown = predicted(fitted.model, whole, fitted.theta)
        off = spectrum.amplitude - shown
        parts = whole.whitened(off).reshape(len(spectrum.speed), len(spectrum.sensors), 2, -1)
        sigma = np.sqrt(np.mean(parts**2, axis=2)).transpose(0, 2, 1)
        force = equivalent_residual_force(fitted.model, fitted.theta, spectrum.speed, spectrum.harmonics, off)
        name = "base" if when == "before" else "extended"
        variables |= {
            name: (grid, shown, "m", f"harmonics of the {name} model"),
            f"residual_{when}": (grid, sigma, "1", f"measured minus {name} model, in standard deviations"),
            f"equivalent_residual_force_{when}": (
                grid,
                force,
                "N",
                f"force at the measured nodes missing in the {name} model",
            ),
        }
    variables |= _parameters(diagnosis) | _explanations(diagnosis)
    coordinates = {
        "speed": (spectrum.speed, "rad/s", "spin speed"),
        "harmonic": (spectrum.harmonics, "1", "harmonic, n > 0 forward, n < 0 backward"),
        "node": (np.array(spectrum.sensors), "1", "node"),
        "parameter": (list(best.names), "1", "fitted parameter"),
    }
    return dataset(variables, coordinates, title="diagnosis")


def _parameters(diagnosis):
    """Fitted parameters: as stated, in the base model and in the extended one."""
    base, best, prior = diagnosis.search.base, diagnosis.best, diagnosis.search.prior.by_name
    units = dict(zip(best.model.names, best.model.units, strict=True))
    before = dict(zip(base.names, zip(base.free, np.sqrt(np.diag(base.covariance)), strict=True), strict=True))
    nothing = (np.nan, np.nan)
    columns = {
        "stated": [prior.get(name, nothing)[0] for name in best.names],
        "stated_std": [prior.get(name, nothing)[1] for name in best.names],
        "base_estimate": [before.get(name, nothing)[0] for name in best.names],
        "base_std": [before.get(name, nothing)[1] for name in best.names],
        "estimate": best.free,
        "std": np.sqrt(np.diag(best.covariance)),
    }
    found = {
        name: (("parameter",), np.array(values, float), "SI", f"{name.replace('_', ' ')} of the parameter, in its unit")
        for name, values in columns.items()
    }
    text = np.array([units[name] for name in best.names], object)
    return found | {"unit": (("parameter",), text, "1", "unit of the parameter")}


def _explanations(diagnosis):
    """Every explanation that was fitted, that with the highest score first."""
    weights = diagnosis.search.posterior()
    stated = {(cause["effect"], tuple(cause["where"].items())) for cause in diagnosis.verdict["ambiguous_with"]}
    best = diagnosis.search.best
    labels = [" + ".join(cause.label for cause in e.causes) or "nothing more" for e, _ in weights]
    confounder = [
        any((c.effect, tuple(c.where.items())) in stated for c in e.causes) and not best.named <= e.named
        for e, _ in weights
    ]
    along = ("explanation",)
    return {
        "explanation_label": (along, np.array(labels, object), "1", "causes"),
        "score": (
            along,
            np.array([2 * e.log_posterior_odds for e, _ in weights]),
            "1",
            "twice the logarithm of the odds against the base alone",
        ),
        "posterior_probability": (along, np.array([w for _, w in weights]), "1", "share of belief"),
        "cost": (along, np.array([e.fit.cost for e, _ in weights]), "1", "misfit of data and priors"),
        "is_alternative": (along, np.array(confounder, "int8"), "1", "1 if the data cannot rule it out"),
        "is_best": (along, np.array([e is best for e, _ in weights], "int8"), "1", "1 for the best"),
    }
