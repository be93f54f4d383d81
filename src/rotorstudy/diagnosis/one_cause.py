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
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit, chi_square_p_value, fit
from rotorstudy.inference.levenberg_marquardt import ESTIMATE, HYPOTHESIS, Minimum, levenberg_marquardt
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import whitened_prediction, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry

TRIED = {"position": 20, "angle": 16, "other": 9}  # values of an option
STARTS = 3  # shapes of each alternative and motion from which steps are made
FAR = replace(HYPOTHESIS, steps=6, first_damping=1e-2)  # the first steps from a start
CLOSELY = replace(HYPOTHESIS, steps=ESTIMATE.steps)
FINISHED = (2, 4)  # of all starts: always, and at most those that are close to the best
CLOSE = 10.0  # times its misfit
EXPLAINED = 0.05  # p-value below which it is searched again, at the values of the rig that fit best without the cause
FAILURES = 1  # steps of a fit without a steady state, which take long to find out
BEYOND = 10  # harmonics carried beyond the measured ones: a crack that opens at once has many
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


class Work(NamedTuple):
    """What is known.

    rig      : Model of the rig;  whole : with the nuisance terms
    prior    : Prior of the parameters of both that are free
    spectrum : Spectrum with the model error
    """

    rig: Model
    whole: Model
    prior: Prior
    spectrum: Spectrum
    settings: Settings


class Fitted(NamedTuple):
    """A cause in its best shape, and the Minimum of all amplitudes and of the shape."""

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
    work = Work(model, *base_model(model, settings), spectrum, settings)
    causes = _alternatives(work, effect)
    found = _searched(work, causes, fit(work.whole, spectrum, work.prior, steps=0))
    best = min(found, key=lambda one: one.cost)
    if chi_square_p_value(best.cost, 2 * spectrum.amplitude.size) < EXPLAINED:
        found += _searched(work, causes, fit(work.whole, spectrum, work.prior), found)
    return identified(work, min(found, key=lambda one: one.cost), found)


def _searched(work, causes, base, known=()):
    """List of Fitted from the best shapes at a fit of the rig; those worth it, fewer than `known`, to convergence.

    At the stated values of the rig its parameters do not imitate the cause.
    """
    begun = []
    for cause in causes:
        for start, amplitudes in _starts(work, base, cause):
            try:
                begun.append(fitted_from(work, start, np.concatenate([base.free, amplitudes]), FAR))
            except (NoSteadyState, NoConvergenceError):  # in that shape
                continue
    if not begun and not known:
        raise RotorstudyError(f"{causes[0].effect}: no shape of it gives a steady motion of this rotor")
    begun.sort(key=lambda one: one.cost)
    found = []
    for rank, one in enumerate(begun[: max(FINISHED)]):
        if rank < min(FINISHED) or one.cost < CLOSE * begun[0].cost:
            count = len(one.minimum.theta[0]) - len(one.cause.shape)
            try:
                found.append(fitted_from(work, one.cause, one.minimum.theta[0, :count], CLOSELY, BEYOND))
            except (NoSteadyState, NoConvergenceError):
                continue
    return [*found, *begun]


def _alternatives(work, effect):
    """The effect at every place with every alternative, in the middle of its shapes."""
    plugin, structure = registry().get("effect", effect, "--cause"), work.rig.structure
    if not plugin.shape or plugin.acts_on_output:
        known = sorted(n for n, p in registry().plugins["effect"].items() if p.shape and not p.acts_on_output)
        raise RotorstudyError(f"{effect} has no shape to be searched; known causes with one: {', '.join(known)}")
    chosen = product(*(known() for known in plugin.alternatives.values()))
    variants = [dict(zip(plugin.alternatives, values, strict=True)) for values in chosen]
    found = []
    for where, variant in product(plugin.places(structure, work.rig.sensors), variants):
        ranges = shape_ranges(effect, structure, where.get("node"))
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


def _ranges(work, cause):
    """Option -> ShapeRange of a cause."""
    return shape_ranges(cause.effect, work.rig.structure, cause.where.get("node"))


def reshaped(work, cause, point, label="cause"):
    """The cause in the shape at a point (option,) of its ranges."""
    ranges = _ranges(work, cause)
    shape = {name: ends.value(x) for (name, ends), x in zip(ranges.items(), point, strict=True)}
    return with_shape(work.rig, cause._replace(term=replace(cause.term, label=label)), shape, work.settings.prior_width)


def point_of(work, cause):
    """The shape of a cause as fractions (option,) of its ranges."""
    ranges = _ranges(work, cause)
    return np.array([ends.fraction(cause.shape[name]) for name, ends in ranges.items()])


def _kind(name, ends):
    """Kind of an option, as in `TRIED`."""
    return "angle" if ends.goes_around else "position" if name.startswith("position") else "other"


def _starts(work, base: Fit, cause):
    """The best shapes of a cause, with its amplitudes there, by columns.

    At the motion that the records imply, which is the better one for a large effect, and at that of the fit, which is
    for a small one. Options other than positions and angles are first in the middle of their ranges.
    """
    projection = Projection(base, work.spectrum)
    kinds = [_kind(*one) for one in _ranges(work, cause).items()]
    first = [[0.5] if kind == "other" else (np.arange(TRIED[kind]) + 0.5) / TRIED[kind] for kind in kinds]
    free, apart = "other" in kinds, [i for i, kind in enumerate(kinds) if kind != "other"]
    found = []
    for implied in (True, False):
        taken = []
        for point, *_ in _judged(work, projection, cause, np.array(list(product(*first))), implied, free):
            if len(taken) == STARTS:
                break
            if all(_distance(point[apart], other[apart]) > APART for other in taken):
                taken.append(point)
        for point in taken:
            rest = [
                np.linspace(0, 1, TRIED["other"]) if kind == "other" else [x]
                for kind, x in zip(kinds, point, strict=True)
            ]
            found.append(_judged(work, projection, cause, np.array(list(product(*rest))), implied, False)[0][1:])
    return found


def _distance(a, b):
    return np.max(np.abs(a - b)) if len(a) else 0.0


def _judged(work, projection, cause, points, implied, free):
    """(point, cause, amplitudes) of shapes at points (shape, option), the one that explains most first.

    implied : at the motion that the records imply, else at that of the fit;  free : with amplitudes of any size
    """
    groups, found = {}, []
    for number, point in enumerate(points):
        try:
            one = reshaped(work, cause, point, f"shape {number}")
        except CannotAct:
            continue
        row = acts_on(one, work.rig.structure)
        groups.setdefault(row.tobytes() if implied else b"", (row, []))[1].append((point, one))
    for row, there in groups.values():
        chosen = [_freed(one) if free else one for _, one in there]
        motion = motion_by_a_free_force(projection.fitted, work.spectrum, row, projection.near) if implied else None
        judged = screen_each(projection.of(chosen, motion), chosen)
        for (point, _), one, seen in zip(there, chosen, judged, strict=True):
            found.append((seen.evidence, point, one, seen.start))
    return [one[1:] for one in sorted(found, key=lambda one: -one[0])]


def _freed(cause):
    """The cause with a wide prior of its amplitudes, as if their size were not known."""
    prior = {unknown.name: (0.0, FREE * unknown.typical) for unknown in cause.term.unknowns}
    return cause._replace(prior=prior, fixed=False)


def fitted_from(work, cause, amplitudes, convergence=CLOSELY, beyond=None):
    """A fit of all amplitudes and the shape of a cause together, from its shape and some amplitudes (parameter,).

    beyond : harmonics carried beyond the highest measured one, by default as in every other fit
    """
    prior = work.prior.plus(Prior.independent(cause.prior))
    point, count = point_of(work, cause), len(amplitudes)
    ranges = _ranges(work, cause)
    about = {name: (x if ends.goes_around else 0.5, 1.0) for (name, ends), x in zip(ranges.items(), point, strict=True)}
    prior = prior.plus(Prior.independent(about))

    failed = []

    def predict(theta):
        (one,) = theta
        try:
            return predicted_with_shape(work, cause, one[:count], one[count:], beyond)
        except (CannotAct, NoSteadyState) as error:  # such as a crack at a disc
            failed.append(error)
            if len(failed) > FAILURES:
                raise NoConvergenceError(f"{cause.label}: {error}") from None
            raise NoSteadyState(str(error)) from None

    found = levenberg_marquardt(
        predict,
        work.spectrum.whitened(work.spectrum.amplitude)[None],
        np.concatenate([amplitudes, point])[None],
        prior.names,
        prior=prior,
        convergence=convergence,
    )
    return Fitted(reshaped(work, cause, found.theta[0, count:]), found)


def predicted_with_shape(work, cause, amplitudes, point, beyond=None):
    """Whitened prediction (1, component) and its derivatives (1, component, parameter), the shape last.

    The derivative by an option follows from the columns of the cause in that shape and in one beside it, of amplitude
    zero, at the same motion.
    """
    here = reshaped(work, cause, point)
    offs = np.where(point < 0.5, DIFFERENCE, -DIFFERENCE)
    beside = [reshaped(work, cause, at, f"beside {i}") for i, at in enumerate(point + np.diag(offs))]
    names = work.prior.names + here.names + tuple(name for one in beside for name in one.names)
    size = amplitudes[len(work.prior.names) :]
    model = work.whole.plus(here.term, *(one.term for one in beside))
    values = np.concatenate([amplitudes, np.zeros(len(size) * len(beside))])
    order = None if beyond is None else int(np.abs(work.spectrum.harmonics).max()) + beyond
    shown, slopes = whitened_prediction(model, work.spectrum, names, values, order)
    own, *others = np.split(slopes[:, len(work.prior.names) :], 1 + len(beside), axis=1)
    columns = [(other - own) @ size / off for other, off in zip(others, offs, strict=True)]
    return shown[None], np.column_stack([slopes[:, : len(amplitudes)], *columns])[None]


def identified(work, best, tried):
    """The Identified of a fit, the best of all that were tried."""
    cause, minimum = best.cause, best.minimum
    names = work.prior.names + cause.names + tuple(cause.shape)
    normal = minimum.jacobian[0].T @ minimum.jacobian[0]
    covariance = invert(normal)
    ranges, first = _ranges(work, cause), len(names) - len(cause.shape)
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
