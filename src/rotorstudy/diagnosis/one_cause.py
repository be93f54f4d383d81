"""One effect of the library where it is known to be the cause: its shape and amplitudes, beside the rig's parameters.

The shape (the position, depth and angle of a crack) is searched in three steps: many shapes by their columns at the
motion that the records imply (see `shape_scan`), the best of them by a few Gauss-Newton steps of all parameters
together, and the best of those to convergence.
"""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.candidates import Candidate, candidate, shape_ranges, with_shape, with_vibration
from rotorstudy.diagnosis.screening import Projection, screen_each
from rotorstudy.diagnosis.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.shape_scan import acts_on, motion_by_a_free_force
from rotorstudy.errors import CannotAct, NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import (
    ESTIMATE,
    HYPOTHESIS,
    Fit,
    Minimum,
    chi_square_p_value,
    fit,
    levenberg_marquardt,
)
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import whitened_prediction, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry

TRIED = {"position": 20, "angle": 16, "other": 9}  # values of an option
STARTS = 3  # shapes of each alternative from which steps are made
FIRST_STEPS = 4
FINISHED = 2  # of all starts
DIFFERENCE = 1e-4  # of the range of an option, for its derivative
APART = 0.08  # of the range of the position or the angle: starts that are closer count as one
SOMEWHERE = (0.5, 0.37, 0.61, 0.13, 0.89)  # fractions of the ranges: at some of them an effect may be unable to act
FREE = 10.0  # standard deviation of an amplitude in typical sizes, while the options that scale it are not yet known


class Identified(NamedTuple):
    """An effect as identified.

    cause      : Candidate with its shape, and the standard deviations of that
    model      : Model with the effect in that shape
    names      : (parameter,) of the free amplitudes of the model, then of the options of the shape
    theta      : (parameter,) their values, of options as fractions of their ranges
    covariance : (parameter, parameter) of the posterior
    p_value    : probability of a misfit as large by noise alone
    misfits    : alternatives of the effect (as a text) -> misfit and penalty beyond those of the best
    """

    cause: Candidate
    model: Model
    names: tuple[str, ...]
    theta: np.ndarray
    covariance: np.ndarray
    p_value: float
    misfits: dict[str, float]


class _Work(NamedTuple):
    """What is known: the rig, with the nuisance terms, their Prior; the Spectrum with the model error."""

    rig: Model
    whole: Model
    prior: Prior
    spectrum: Spectrum
    settings: Settings


class _Fitted(NamedTuple):
    cause: Candidate
    minimum: Minimum

    @property
    def cost(self):
        return float(self.minimum.cost[0])


def identify_cause(spectrum: Spectrum, model: Model, effect: str, settings: Settings | None = None) -> Identified:
    """The shape and the amplitudes of an effect that is known to be the only cause.

    Parameters
    ----------
    spectrum : Spectrum
    model : Model
        With a value for every amplitude, without the effect.
    effect : str
        Name of a plugin with options that enter nonlinearly, such as `transverse_crack`.
    settings : Settings, optional

    Returns
    -------
    Identified

    Raises
    ------
    RotorstudyError
        For an unknown effect, one without such options, or one that cannot act on this rotor.
    """
    settings = settings or Settings()
    spectrum = with_model_error(spectrum, settings)
    model = with_vibration(model, spectrum)
    work = _Work(model, *base_model(model, settings), spectrum, settings)
    causes = _alternatives(work, effect)
    base = fit(work.whole, spectrum, work.prior, steps=0)  # its parameters would imitate the cause
    begun = []
    for cause in causes:
        for start, amplitudes in _starts(work, base, cause):
            try:
                begun.append(_fitted(work, start, np.concatenate([base.free, amplitudes]), FIRST_STEPS))
            except NoSteadyState:  # in that shape
                continue
    if not begun:
        raise RotorstudyError(f"{effect}: no shape of it gives a steady motion of this rotor")
    begun.sort(key=lambda one: one.cost)
    count = len(begun[0].minimum.theta[0]) - len(begun[0].cause.shape)
    finished = [_fitted(work, one.cause, one.minimum.theta[0, :count], ESTIMATE.steps) for one in begun[:FINISHED]]
    return _identified(work, min(finished, key=lambda one: one.cost), [*begun, *finished])


def _alternatives(work, effect):
    """The effect at every place with every alternative, in the middle of its shapes."""
    plugin, structure = registry().get("effect", effect, "--cause"), work.rig.structure
    if not plugin.shape or plugin.acts_on_output:
        known = sorted(n for n, p in registry().plugins["effect"].items() if p.shape and not p.acts_on_output)
        raise RotorstudyError(f"{effect} has no shape to be searched; known causes with one: {', '.join(known)}")
    ranges = shape_ranges(effect, structure)
    chosen = product(*(known() for known in plugin.alternatives.values()))
    variants = [dict(zip(plugin.alternatives, values, strict=True)) for values in chosen]
    found = []
    for where, variant in product(plugin.places(structure, work.rig.sensors), variants):
        for x in SOMEWHERE:
            shape = {name: ends.value(x) for name, ends in ranges.items()}
            try:
                found.append(candidate(work.rig, effect, where, shape, "cause", work.settings.prior_width, variant))
            except CannotAct:
                continue
            break
    if not found:
        raise RotorstudyError(f"{effect} cannot act on this rotor at any place")
    return found


def _reshaped(work, cause, point, label="cause"):
    """The cause in the shape at a point (option,) of its ranges."""
    ranges = shape_ranges(cause.effect, work.rig.structure)
    shape = {name: ends.value(x) for (name, ends), x in zip(ranges.items(), point, strict=True)}
    return with_shape(work.rig, cause._replace(term=replace(cause.term, label=label)), shape, work.settings.prior_width)


def _point(work, cause):
    """The shape of a cause as fractions (option,) of its ranges."""
    ranges = shape_ranges(cause.effect, work.rig.structure)
    return np.array([ends.fraction(cause.shape[name]) for name, ends in ranges.items()])


def _kind(name, ends):
    """Kind of an option, as in `TRIED`."""
    return "angle" if ends.goes_around else "position" if name.startswith("position") else "other"


def _starts(work, base: Fit, cause):
    """The best shapes of a cause and its amplitudes there, by columns; first with the other options in the middle."""
    projection = Projection(base, work.spectrum)
    kinds = [_kind(*one) for one in shape_ranges(cause.effect, work.rig.structure).items()]
    first = [[0.5] if kind == "other" else (np.arange(TRIED[kind]) + 0.5) / TRIED[kind] for kind in kinds]
    mean = 0.0 if "other" in kinds else None
    coarse = _judged(work, projection, cause, np.array(list(product(*first))), mean)
    apart = [i for i, kind in enumerate(kinds) if kind != "other"]
    found = []
    for point, _, _ in coarse:
        if len(found) == STARTS:
            break
        if all(_distance(point[apart], other[apart]) > APART for other, *_ in found):
            rest = [
                np.linspace(0, 1, TRIED["other"]) if kind == "other" else [x]
                for kind, x in zip(kinds, point, strict=True)
            ]
            found.append(_judged(work, projection, cause, np.array(list(product(*rest))), None)[0])
    return [(chosen, amplitudes) for _, chosen, amplitudes in found]


def _distance(a, b):
    return np.max(np.abs(a - b)) if len(a) else 0.0


def _judged(work, projection, cause, points, mean):
    """(point, cause, amplitudes) of shapes at points (shape, option), the one that explains most first.

    mean : if not None, the amplitude is free about that
    """
    groups, found = {}, []
    for number, point in enumerate(points):
        try:
            one = _reshaped(work, cause, point, f"shape {number}")
        except CannotAct:
            continue
        row = acts_on(one, work.rig.structure)
        groups.setdefault(row.tobytes(), (row, []))[1].append((point, one))
    for row, there in groups.values():
        motion = motion_by_a_free_force(projection.fitted, work.spectrum, row, projection.near)
        chosen = [one if mean is None else _freed(one, mean) for _, one in there]
        for (point, _), one, seen in zip(
            there, chosen, screen_each(projection.of(chosen, motion), chosen), strict=True
        ):
            found.append((seen.evidence, point, one, seen.start))
    return [one[1:] for one in sorted(found, key=lambda one: -one[0])]


def _freed(cause, mean):
    """The cause with a wide prior of its amplitudes, as if their size were not known."""
    prior = {unknown.name: (mean, FREE * unknown.typical) for unknown in cause.term.unknowns}
    return cause._replace(prior=prior, fixed=False)


def _fitted(work, cause, amplitudes, steps):
    """A fit of all amplitudes and the shape of a cause together, from its shape and some amplitudes (parameter,)."""
    prior = work.prior.plus(Prior.independent(cause.prior))
    point, count = _point(work, cause), len(amplitudes)
    ranges = shape_ranges(cause.effect, work.rig.structure)
    about = {name: (x if ends.goes_around else 0.5, 1.0) for (name, ends), x in zip(ranges.items(), point, strict=True)}
    prior = prior.plus(Prior.independent(about))

    def predict(theta):
        (one,) = theta
        try:
            return _predicted(work, cause, one[:count], one[count:])
        except CannotAct as error:  # such as a crack at a disc
            raise NoSteadyState(str(error)) from None

    found = levenberg_marquardt(
        predict,
        work.spectrum.whitened(work.spectrum.amplitude)[None],
        np.concatenate([amplitudes, point])[None],
        prior.names,
        prior=prior,
        convergence=replace(HYPOTHESIS, steps=steps),
    )
    return _Fitted(_reshaped(work, cause, found.theta[0, count:]), found)


def _predicted(work, cause, amplitudes, point):
    """Whitened prediction (1, component) and its derivatives (1, component, parameter), the shape last.

    The derivative by an option follows from the columns of the cause in that shape and in one beside it, of amplitude
    zero, at the same motion.
    """
    here = _reshaped(work, cause, point)
    offs = np.where(point < 0.5, DIFFERENCE, -DIFFERENCE)
    beside = [_reshaped(work, cause, at, f"beside {i}") for i, at in enumerate(point + np.diag(offs))]
    names = work.prior.names + here.names + tuple(name for one in beside for name in one.names)
    size = amplitudes[len(work.prior.names) :]
    model = work.whole.plus(here.term, *(one.term for one in beside))
    values = np.concatenate([amplitudes, np.zeros(len(size) * len(beside))])
    shown, slopes = whitened_prediction(model, work.spectrum, names, values)
    own, *others = np.split(slopes[:, len(work.prior.names) :], 1 + len(beside), axis=1)
    columns = [(other - own) @ size / off for other, off in zip(others, offs, strict=True)]
    return shown[None], np.column_stack([slopes[:, : len(amplitudes)], *columns])[None]


def _identified(work, best, tried):
    """The Identified of a fit, the best of all that were tried."""
    cause, minimum = best.cause, best.minimum
    names = work.prior.names + cause.names + tuple(cause.shape)
    normal = minimum.jacobian[0].T @ minimum.jacobian[0]
    covariance = invert(normal)
    ranges, first = shape_ranges(cause.effect, work.rig.structure), len(names) - len(cause.shape)
    std = np.sqrt(np.diag(covariance)[first:])
    spread = {n: ranges[n].slope(cause.shape[n]) * x for n, x in zip(cause.shape, std, strict=True)}
    misfits = {}
    for one in tried:
        told = ", ".join(f"{key} {value}" for key, value in one.cause.variant.items()) or one.cause.cause
        misfits[told] = min(misfits.get(told, np.inf), one.cost - best.cost)
    p_value = chi_square_p_value(best.cost, 2 * work.spectrum.amplitude.size)
    cause, model = cause._replace(shape_std=spread), work.whole.plus(cause.term)
    return Identified(cause, model, names, minimum.theta[0], covariance, p_value, misfits)


def estimates_of(found: Identified) -> list[tuple[str, float, float, str]]:
    """(name, value, standard deviation, unit) of the shape of a cause, what follows from it, and its amplitudes.

    Parameters
    ----------
    found : Identified

    Returns
    -------
    list of tuple
    """
    cause, rows = found.cause, []
    for name, value in cause.shape.items():
        rows.append((name, value, cause.shape_std[name], _unit(name)))
    stated = registry().get("effect", cause.effect).stated
    for name, (option, factor) in stated(found.model.structure, **cause.shape).items() if stated else ():
        rows.append((name, factor * cause.shape[option], factor * cause.shape_std[option], _unit(name)))
    place = [found.names.index(name) for name in cause.names]
    std = np.sqrt(np.diag(found.covariance))
    units = [unknown.unit for unknown in cause.term.unknowns]
    names = (name.replace(f"[{cause.term.label}]", "") for name in cause.names)
    return rows + list(zip(names, found.theta[place].tolist(), std[place].tolist(), units, strict=True))


def _unit(name):
    """Unit of an option, by the end of its name."""
    return next((unit for unit in ("rad", "m") if name.endswith(f"_{unit}")), "1")
