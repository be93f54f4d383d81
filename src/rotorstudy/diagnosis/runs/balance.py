"""Correction masses that balance a rotor: the model's influence of an unbalance on the vibration, and least squares.

The vibration y at 1X is linear in the unbalances w of the correction planes. They minimise the misfit of

    y + J(p) w,

J the influence by the model with the parameters p, weighted by the noise of y. A runout r(p) that the rig states is no
vibration: y is the reading less r. The vibration that is left is known as well as y and J(p): to first order p changes
it by D = d(J w - r) / dp.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.runs.balance_holes import Choice, Holes, chosen
from rotorstudy.diagnosis.runs.joint import GRAM, unbalance_term
from rotorstudy.diagnosis.runs.run_file import AddedUnbalance
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings, read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.linear import check_identifiable, invert
from rotorstudy.inference.prediction import carried_order, with_model_error
from rotorstudy.measurement.conventions import Conventions, read_conventions
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.rig import RigFile, read_rig
from rotorstudy.response.measured import measured_response_and_jacobian

DRAWS, SEED = 1000, 1  # of the vibration left, for its interval
INTERVAL = (2.5, 50.0, 97.5)  # percent


class Balancing(NamedTuple):
    """Corrections, and the vibration before and after.

    corrections : ndarray (plane, part), real and imaginary part from the shaft's reference line, kg m
    covariance  : ndarray (plane * part, plane * part), of the best ones, kg^2 m^2
    choices     : list of Choice (plane,), what is put into given holes; None if any correction can be made
    spectrum    : Spectrum balanced, at 1X and -1X, without the runout that the rig states
    before      : ndarray (speed, sensor), semi-major axis of the orbit, m
    after       : ndarray (percentile, speed, sensor), its 2.5, 50 and 97.5 % points, m
    """

    corrections: np.ndarray
    covariance: np.ndarray
    choices: list[Choice] | None
    spectrum: Spectrum
    before: np.ndarray
    after: np.ndarray


def balance_files(
    paths: Sequence[str | Path], rig: str | Path | RigFile, planes: Sequence[int | str], holes: Holes | None = None
) -> tuple[Balancing, Conventions, list[Finding]]:
    """Balance a rotor by its records.

    paths  : records, tables of harmonics, or one imported spectrum
    rig    : as updated by `rotorstudy identify`: its parameters are not fitted again
    planes : nodes, or labels of nodes, where a correction mass can be put
    holes  : to which, with their weights, the corrections are restricted
    raises : RotorstudyError for files that cannot be read, records without 1X, and planes that the probes cannot tell
             apart
    """
    rig = read_rig(rig)
    settings, conventions = read_settings(rig.given, str(rig.path)), read_conventions(rig.given, str(rig.path))
    spectrum, model, findings = measured_spectrum(paths, rig)
    return balance(spectrum, model, planes, settings, conventions, holes), conventions, findings


def balance(
    spectrum: Spectrum,
    model: Model,
    planes: Sequence[int | str],
    settings: Settings,
    conventions: Conventions,
    holes: Holes | None = None,
) -> Balancing:
    """Unbalances to be added in some planes, so that the least 1X vibration is left.

    spectrum    : of the sensors of the model, in m
    model       : with a value for every parameter
    planes      : nodes, or labels of nodes
    settings    : uncertainty of the parameters, and model error
    conventions : of the records
    holes       : to which, with their weights, the corrections are restricted
    raises      : RotorstudyError for records without 1X, and planes that the probes cannot tell apart
    """
    wanted = [n for n in (1, -1) if n in spectrum.harmonics]
    if 1 not in wanted:
        raise RotorstudyError("the records have no harmonic 1, which balancing needs; add it to 'harmonics:'")
    spectrum = with_model_error(spectrum.at_harmonics(wanted), settings)
    whole, prior = base_model(model, settings)
    terms = _unbalances(whole, planes, conventions)
    names = [unknown.name for term in terms for unknown in term.unknowns]
    whole = whole.plus(*terms)
    values = dict(zip(whole.names, whole.stated, strict=True))
    values |= dict(zip(prior.names, prior.mean, strict=True)) | dict.fromkeys(names, 0.0)
    influence = _changes(whole, spectrum, values, names)
    shown = [name for name in _readings_without_motion(model) if values[name]]
    runout = _changes(whole, spectrum, values, shown)
    still = np.tensordot([values[name] for name in shown], runout, 1)
    spectrum = replace(spectrum, amplitude=spectrum.amplitude - still)
    columns = spectrum.whitened(influence).T
    check_identifiable(columns, names)
    normal = columns.T @ columns
    gain = invert(normal) @ columns.T
    corrections, choices = -gain @ spectrum.whitened(spectrum.amplitude), None
    if holes:
        choices = chosen(holes, GRAM * corrections, normal / GRAM**2)
        corrections = np.concatenate([choice.total for choice in choices]) / GRAM
    corrected = values | dict(zip(names, corrections, strict=True))
    moved = _changes(whole, spectrum, corrected, prior.names) - _changes(whole, spectrum, values, prior.names)
    for name, change in zip(shown, runout, strict=True):
        if name in prior.names:
            moved[prior.names.index(name)] -= change
    spread = np.eye(len(columns))
    if len(moved):
        whitened = spectrum.whitened(moved).T
        spread = spread + whitened @ prior.covariance @ whitened.T
    left = spectrum.amplitude + np.tensordot(corrections, influence, 1)
    draws = np.random.default_rng(SEED)
    parameters = draws.normal(size=(DRAWS, len(prior.names))) @ prior.factor.T
    noise = _noise(spectrum, draws)
    return Balancing(
        GRAM * corrections.reshape(-1, 2),
        GRAM**2 * gain @ spread @ gain.T,
        choices,
        spectrum,
        _axis(spectrum.amplitude),
        np.percentile(_axis(left + noise + np.tensordot(parameters, moved, 1)), INTERVAL, axis=0),
    )


def _unbalances(model, planes, conventions):
    """Terms of an unbalance in each plane, zero."""
    zero = [AddedUnbalance(node=node, unbalance_g_mm=0.0) for node in planes]
    return [
        unbalance_term(one, model.structure, model.sensors, conventions, f"plane {i}", f"plane {one.node}")
        for i, one in enumerate(zero, 1)
    ]


def _readings_without_motion(model):
    """Names of the amplitudes that the probes show without a motion of the shaft: runout."""
    output = [u for term in model.terms if term.acts_on_output for u in term.unknowns]
    return [u.name for u in output if not any(entry.reads_motion for entry in u.entries)]


def _changes(model, spectrum, values, names):
    """Derivatives (parameter, speed, harmonic, sensor) by some parameters at values of all, as the probes show them."""
    theta = np.array([values[name] for name in model.names])
    order = carried_order(spectrum)
    _, found = measured_response_and_jacobian(model, spectrum.speed, spectrum.harmonics, theta, order=order)
    return spectrum.shown(np.moveaxis(found[..., model.position(names)], -1, 0))


def _noise(spectrum, draws):
    """Draws (draw, speed, harmonic, sensor) of the noise of a spectrum, as its probes show it."""
    root = np.linalg.cholesky(spectrum.covariance)
    parts = root @ draws.normal(size=(DRAWS, *root.shape[:-1], 1))
    real, imaginary = np.split(np.moveaxis(parts[..., 0], -1, -2), 2, axis=-2)
    return spectrum.shown(real + 1j * imaginary)


def _axis(amplitude):
    """Semi-major axis (..., speed, sensor) of the orbit of harmonics 1 and -1, m."""
    return np.abs(amplitude).sum(axis=-2)
