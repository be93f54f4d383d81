"""What changed between two states of a machine: the diagnosis of their difference.

Measured are y = f(p) + o + n before, and f(p, c) + o + n' after: a model f with parameters p, a cause c in the second
state alone, what both states share and no model gets right (runout, the error of the model) as an offset o, and noise.
If nothing is known of o, all that the two say of the cause is in their difference,

    y' - y = f(p, c) - f(p) + n' - n,

whose covariance is the sum of both, and in which the error of the model is that of the change alone. The motion f(p) on
which a parametric cause acts is that of the state before: the parameters p are first fitted to it, with a free offset.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from rotorstudy.diagnosis.runs.joint import model_errors
from rotorstudy.diagnosis.runs.turned_mark import without_turn, without_turn_beside_a_change
from rotorstudy.diagnosis.search.candidates import with_vibration
from rotorstudy.diagnosis.search.film_error import with_film_error, with_offset_of_mean
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.findings import told
from rotorstudy.diagnosis.verdict.investigate import Diagnosis, investigate
from rotorstudy.diagnosis.verdict.wide_ranges import any_offset, wide_ranges
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import Entry
from rotorstudy.model.estimated_rig import with_values
from rotorstudy.model.model import Model, Uncertainty
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import with_numbers
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.measured import measured_response
from rotorstudy.threads import on_one_thread
from rotorstudy.units import percent, spins

SAME_SPEED = 1e-2  # relative difference up to which two records are of the same speed
FLOOR = 0.1  # of the repeatability: by how much of the rms vibration each harmonic differs, as by default
ROUND_OFF = 1e-12  # of the vibration: two states that differ by less are the same records, read along other axes


@dataclass(frozen=True)
class Comparison:
    """What changed between two states: its Diagnosis, and the Spectrum of each state and of the difference."""

    diagnosis: Diagnosis
    before: Spectrum
    after: Spectrum
    difference: Spectrum


@on_one_thread
def compare(
    before: Spectrum,
    after: Spectrum,
    model: Model,
    *,
    settings: Settings | dict | None = None,
    findings: tuple[Finding, ...] = (),
) -> Comparison:
    """What changed in a machine between two states.

    A model whose uncertainty is stated (a section `prior:`) is taken to be known that well; another one is first fitted
    to the state before.

    raises : RotorstudyError for states without a common speed, of different sensors or harmonics, or with the same
             records
    """
    settings = of_changes(Settings(**settings) if isinstance(settings, dict) else settings or Settings())
    settings = with_offset_of_mean(settings, before, model)
    before, after, lost = _with_common_probes(before, after)
    before, after, left = _at_common_speeds(before, after)
    if np.abs(after.amplitude - before.amplitude).max() <= ROUND_OFF * np.abs(before.amplitude).max():
        raise RotorstudyError("both states have the same harmonics at every speed: give the records of two states")
    after, turned = without_turn(before, after, settings)
    notes = [*findings, *lost, *left]
    if model.uncertainty is None:
        model, not_explained, share = known_as_before(model, before, settings)
        notes += not_explained
        settings = settings.model_copy(update={"model_error": share})
    machine = replace(with_vibration(model, after), before=frozenset(model.names))

    def prepared(after):
        """The difference, the model of it and the settings, of a later state."""
        difference = _difference(before, after, machine.earlier, settings)
        if not settings.repeatability:
            return difference, machine, settings
        return difference, *_with_scatter(machine, difference.speed, after, settings)

    if not turned:
        after, turned = without_turn_beside_a_change(after, prepared, settings)
    difference, model, scattered = prepared(after)
    found = investigate(difference, model, settings=scattered, findings=(*notes, *turned))
    return Comparison(found, before, after, difference)


def _with_common_probes(before, after):
    """Both spectra as the probes that work in both states show them, and a list of Finding on the others."""
    if before.sensors != after.sensors or np.array_equal(before.directions, after.directions, equal_nan=True):
        return before, after, []
    lost = sorted(set(before.single_probes) ^ set(after.single_probes))
    before, after = before.along(after.directions), after.along(before.directions)
    finding = told("probe of one state", "both states", nodes=", ".join(map(str, lost)))
    return before, after, [finding] if lost else []


def of_changes(settings: Settings) -> Settings:
    """The settings with how often each effect is what changed between two runs, unless they state their own rate."""
    effects = registry().plugins["effect"]
    rates = {name: one.change_rate for name, one in effects.items() if one.change_rate is not None}
    at_discs = {*settings.at_discs, *(name for name, one in effects.items() if one.at_discs)}
    return settings.model_copy(update={"base_rates": rates | settings.base_rates, "at_discs": sorted(at_discs)})


def _directions(spectrum):
    """Of its single probes, degrees."""
    return np.rad2deg(spectrum.directions[~np.isnan(spectrum.directions)]).round(3).tolist()


def _at_common_speeds(before, after):
    """Both spectra at the speeds that both have, those of each, and a list of Finding on the others."""
    for name, one, other in (
        ("sensors", list(before.sensors), list(after.sensors)),
        ("harmonics", before.harmonics.tolist(), after.harmonics.tolist()),
        ("directions of single probes in degrees", _directions(before), _directions(after)),
    ):
        if one != other:
            raise RotorstudyError(
                f"the states have different {name}: {list(one)} before, {list(other)} after; give records of the same"
            )
    apart = np.abs(before.speed[:, None] / after.speed - 1)
    nearest = apart.argmin(axis=0)
    common = apart.min(axis=0) <= SAME_SPEED
    # a record counts once: of two speeds that meet the same one, the closer is compared
    common &= [apart[i, k] == apart[i, common & (nearest == i)].min(initial=np.inf) for k, i in enumerate(nearest)]
    if not common.any():
        raise RotorstudyError(
            f"no speed is common to both states (before: {spins(before.speed)}, after: {spins(after.speed)}; within "
            f"{percent(SAME_SPEED)}); measure the second state at the speeds of the first"
        )
    left = [*after.speed[~common], *(w for i, w in enumerate(before.speed) if i not in nearest[common])]
    notes = []
    if left:
        severity = "note" if 2 * common.sum() >= min(len(before.speed), len(after.speed)) else "warning"
        notes = [told("speeds of one state", "both states", severity, speeds=spins(left), count=common.sum())]
    return before.at_speeds(nearest[common]), after.at_speeds(np.flatnonzero(common)), notes


def _difference(before, after, model, settings):
    """The difference of two spectra at the speeds of the first, less what small differences in speed cause."""
    moved = np.subtract(*(one.shown(measured_response(model, one.speed, one.harmonics)) for one in (after, before)))
    amplitude = after.amplitude - before.amplitude - moved
    floor = min(settings.model_floor, FLOOR * settings.repeatability)
    share = {"model_error": settings.repeatability, "model_floor": floor, "covariance_error": 0.0}  # does not cancel
    noise = [with_model_error(one, settings.model_copy(update=share)).covariance for one in (before, after)]
    difference = replace(before, amplitude=amplitude, covariance=noise[0] + noise[1])
    moving = before.harmonics != 0
    growth, orbit = (np.linalg.norm(one[:, moving], axis=(1, 2)) for one in (amplitude, before.amplitude))
    growth = growth / np.maximum(orbit, np.finfo(float).tiny)
    return with_film_error(difference.with_error((settings.model_error * np.abs(moved)) ** 2 / 2), model, growth=growth)


def _with_scatter(model, speed, after, settings):
    """The model with what all probes share from run to run at a speed, and settings that say so.

    The phase mark falls between two samples, which turns the readings; and the load differs, which turns and scales the
    motion. Taken as errors of each probe alone, it would be far too improbable that all agree, and look like a change.
    """
    parameters, each = [], np.eye(len(after.sensors))
    moving = [(h, n) for h, n in enumerate(after.harmonics.tolist()) if n]
    for k, w in enumerate(speed.tolist()):
        here, rate = _only_at(w), _only_at(w, 1 / w)
        parameters += [
            Parameter(f"{name} of the run at {w:.6g} rad/s", "1", entries, settings.repeatability)
            for name, entries in {
                "mark": tuple(Entry(1j * n * after.amplitude[k, h], on="one", shift=n, gain=here) for h, n in moving),
                "phase": (Entry(each, order=1, gain=rate),),  # n j z
                "swing": (Entry(each, gain=here),),
            }.items()
        ]
    names = tuple(p.name for p in parameters)
    term = Term("repeatability", tuple(parameters), dict.fromkeys(names, 0.0), acts_on="output")
    known = model.uncertainty
    spread = block_diag(known.covariance, settings.repeatability**2 * np.eye(len(names)))
    model = replace(model.plus(term), uncertainty=Uncertainty((*known.names, *names), spread))
    model = replace(model, before=frozenset(model.names))
    return model, settings.model_copy(update={"run_to_run": [*settings.run_to_run, *names]})


def _only_at(speed, value=1.0):
    """A gain with a value at one speed, and zero at others."""
    return lambda other: np.isclose(other, speed, rtol=1e-9, atol=0) * value


def known_as_before(model: Model, spectrum: Spectrum, settings: Settings) -> tuple[Model, list[Finding], float]:
    """The model as fitted to the state before with any offset; notes; the model error of the prediction of a change.

    The model error is raised until the fit leaves no more than noise: what the model cannot explain cancels in the
    comparison. If it had to be raised far, a note tells so, and the prediction of the change has it too.
    """
    whole, prior = base_model(model, settings)
    offset, known = any_offset(spectrum)
    for share in model_errors(settings):
        widened = with_model_error(spectrum, settings.model_copy(update={"model_error": share}))
        found = fit(whole.plus(offset), widened, prior.plus(known), from_afar=True)
        if found.excess == 0:
            break
    notes, error = [], settings.model_error
    if share > 10 * settings.model_error:
        error, stated = share, with_model_error(spectrum, settings)
        remedy = wide_ranges(model, stated, settings) or "Identify the rig first"
        notes = [told("state before not explained", "state before", share=percent(share), remedy=remedy)]
    model = with_numbers(model, prior.names)  # without the calibration of the probes
    names = tuple(name for name in prior.names if name in model.names)
    covariance = found.of(names)[1]
    moving = {name for one in settings.run_to_run for name in model.amplitudes_of(one)}
    for i, name in enumerate(names):
        if name in moving:  # the next run has another value again, as far off as stated
            covariance[i], covariance[:, i] = 0.0, 0.0
            covariance[i, i] = prior.by_name[name][1] ** 2
    model = with_values(model, {name: found.values[name] for name in model.names})
    return replace(model, uncertainty=Uncertainty(names, covariance)), notes, error
