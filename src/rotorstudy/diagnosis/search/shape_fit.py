"""Causes of a stated kind fitted together with their shapes: all amplitudes, positions, depths and angles at once."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, form_ranges, shape_ranges, with_priors, with_shape
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState
from rotorstudy.inference.fit import Fit, fit_each
from rotorstudy.inference.levenberg_marquardt import ESTIMATE, HYPOTHESIS, Convergence
from rotorstudy.inference.prediction import shown_and_slopes
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import Multiples
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import rotor_at, rotor_numbers
from rotorstudy.model.terms import Parameter, Term

CLOSELY = replace(HYPOTHESIS, steps=ESTIMATE.steps)
EVENLY = 12**-0.5  # standard deviation of a fraction of a range of which any is as likely
STEP = 1e-4  # relative change of a number of the rotor, for a derivative
FAILURES = 1  # steps of a fit without a steady state, which take long to find out


class Work(NamedTuple):
    """What a fit of causes starts from, as a Search has it too."""

    rig: Model  # of the rig
    whole: Model  # with the nuisance terms
    prior: Prior  # of the parameters of both that are free
    spectrum: Spectrum  # with the model error
    settings: Settings


class Fitted(NamedTuple):
    """Causes in their best shapes, with the standard deviations of these, and the Fit of all amplitudes beside them."""

    causes: tuple[Candidate, ...]
    fit: Fit  # with the penalty of the shapes, too

    @property
    def variant(self) -> str:
        """The alternatives of the causes, as a text, in any order of the causes the same."""
        told = sorted(f"{key} {value}" for cause in self.causes for key, value in cause.variant.items())
        return ", ".join(told) or " and ".join(sorted(cause.cause for cause in self.causes))


def ranges_of(work: Work, cause: Candidate) -> dict:
    """Option -> ShapeRange of the shape of a cause but what is held, and of its form where it has one."""
    form = {name: ends for name, ends in form_ranges(cause.effect).items() if name in cause.shape}
    node, structure = cause.where.get("node"), work.rig.structure
    ranges = shape_ranges(cause.effect, structure, node, half_turn=cause.half_turn) | form
    return {name: ends for name, ends in ranges.items() if name not in cause.held}


def reshaped(
    work: Work, cause: Candidate, point: np.ndarray, label: str | None = None, ranges: dict | None = None
) -> Candidate:
    """The cause in the shape at a point (option,) of its ranges, with the label of its own or another one.

    ranges : what `ranges_of` returns, if it is known
    """
    ranges = ranges or ranges_of(work, cause)
    shape = {name: ends.value(x) for (name, ends), x in zip(ranges.items(), point.tolist(), strict=True)}
    if label is not None:
        cause = cause._replace(term=replace(cause.term, label=label))
    return with_shape(work.rig, cause, shape, work.settings.prior_width)


def at_numbers(work: Work, theta: np.ndarray) -> Work:
    """The Work with its rotor rebuilt at fitted numbers: the flexibility of a crack follows the modulus of its shaft.

    theta  : (parameter,) those of the rig first
    raises : NoSteadyState if there is no such rotor
    """
    structure = rotor_at(work.rig.structure, dict(zip(work.prior.names, theta.tolist(), strict=False)))
    rig = work.rig if structure is work.rig.structure else replace(work.rig, structure=structure)
    return Work(rig, work.whole, work.prior, work.spectrum, work.settings)


def point_of(work: Work, cause: Candidate) -> np.ndarray:
    """The shape of a cause as fractions (option,) of its ranges."""
    return np.array([ends.fraction(cause.shape[name]) for name, ends in ranges_of(work, cause).items()])


def check_together(work: Work, causes: Sequence[Candidate]) -> None:
    """Raise CannotAct if two of the causes cannot be on the rotor together."""
    for one, other in combinations(causes, 2):
        together = registry().get("effect", one.effect).together
        if together and one.effect == other.effect:
            together(work.rig.structure, other.term.options, one.term.options)


def fitted_from(
    work: Work, causes: Sequence[Candidate], amplitudes: np.ndarray, convergence: Convergence = CLOSELY
) -> Fitted:
    """A fit of all amplitudes and the shapes of causes together, from their shapes and some amplitudes (parameter,).

    raises : NoSteadyState, NoConvergenceError
    """
    points, count = [point_of(work, cause) for cause in causes], len(amplitudes)
    bounds, prior = [np.full((count, 2), [-np.inf, np.inf])], with_priors(work.prior, causes)
    for cause, point in zip(causes, points, strict=True):
        ranges = ranges_of(work, cause)
        bounds.append(np.reshape([ends.ends for ends in ranges.values()], (-1, 2)))
        about = {
            f"{name} of {cause.term.label}": (0.5, EVENLY) if ends.mirrored else (x if ends.goes_around else 0.5, 1.0)
            for (name, ends), x in zip(ranges.items(), point, strict=True)
        }
        prior = prior.plus(Prior.independent(about))
    ends = np.cumsum([len(point) for point in points])[:-1]
    failed = []

    def predict(theta):
        (one,) = theta
        try:
            there = response_with_shape(work, causes, one[:count], np.split(one[count:], ends))
            return whitened_with_slopes(work.spectrum, *there)
        except (CannotAct, NoSteadyState) as error:  # such as a crack at a disc
            failed.append(error)
            if len(failed) > FAILURES:
                raise NoConvergenceError(f"{causes[0].label}: {error}") from None
            raise NoSteadyState(str(error)) from None

    (found,) = fit_each(
        predict,
        work.spectrum.whitened(work.spectrum.amplitude),
        prior,
        [np.concatenate([amplitudes, *points])],
        bounds=np.concatenate(bounds).T,
        convergence=convergence,
    )
    here = causes_at(work, causes, found.free, np.split(found.free[count:], ends))
    stds = np.split(np.sqrt(np.diag(found.covariance))[count:], ends)
    there = tuple(map(with_shape_std, here, (ranges_of(work, c) for c in here), stds))
    of_amplitudes = {
        "prior": with_priors(work.prior, there),
        "free": found.free[:count],
        "covariance": found.covariance[:count, :count],
        "jacobian": found.jacobian[:, :count],
    }
    model = work.whole.plus(*(cause.term for cause in there))
    return Fitted(there, Fit(**vars(found) | of_amplitudes, model=model))


def with_shape_std(cause: Candidate, ranges: dict, std: np.ndarray) -> Candidate:
    """A cause with the standard deviations of its shape, by those (option,) of fractions of its ranges."""
    known = zip(ranges.items(), std, strict=True)
    return cause._replace(shape_std={name: ends.slope(cause.shape[name]) * x for (name, ends), x in known})


def whitened_with_slopes(spectrum: Spectrum, shown: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Harmonics and their derivatives (parameter, ...), whitened, of one trial: (1, component[, parameter])."""
    found = spectrum.whitened(np.concatenate([shown[None], slopes]))
    return found[:1], found[1:].T[None]


def response_with_shape(
    work: Work, causes: Sequence[Candidate], amplitudes: np.ndarray, points: Sequence
) -> tuple[np.ndarray, np.ndarray]:
    """Harmonics shown (speed, harmonic, sensor), m, and their derivatives (parameter, ...), the shapes last.

    The derivative by an option follows from what the cause changes in that shape and in one beside it, at the same
    motion.

    points : (option,) of each cause, fractions of the ranges of its shape; none of a cause without one
    """
    here = causes_at(work, causes, amplitudes, points)
    check_together(work, here)
    names = [*work.prior.names, *(name for cause in here for name in cause.names)]
    beside = []
    for n, (cause, point) in enumerate(zip(causes, points, strict=True)):
        own = [names.index(name) for name in here[n].names]
        for i, (number, step, there) in enumerate(_moved(work, cause, amplitudes, point)):
            term = replace(there.term, label=f"beside {n} {i}")
            beside.append(_Beside(own, number, step, *as_one(term, amplitudes[own])))
    model = work.whole.plus(*(cause.term for cause in here), *(one.term for one in beside))
    more = [unknown.name for one in beside for unknown in one.term.unknowns]
    theta = model.filled([*names, *more], np.append(amplitudes, np.zeros(len(more))))
    shown, change = shown_and_slopes(model, work.spectrum, theta, model.names)
    columns, shapes = change[model.position(names)], []
    for one in beside:
        there = np.tensordot(one.weights, change[model.position([u.name for u in one.term.unknowns])], 1)
        slope = (there - np.tensordot(amplitudes[one.own], columns[one.own], 1)) / one.step
        if one.number is None:
            shapes.append(slope)
        else:
            columns[names.index(one.number)] += slope
    return shown, np.stack([*columns, *shapes])


class _Beside(NamedTuple):
    """A cause with an option of its shape, or a number of the rotor, changed by a step."""

    own: list[int]  # positions of its amplitudes
    number: str | None  # name of the number; None of an option
    step: float
    term: Term
    weights: np.ndarray  # (unknown,) of the term, which together are the cause; see `as_one`


def causes_at(work: Work, causes: Sequence[Candidate], theta: np.ndarray, points: Sequence) -> list[Candidate]:
    """Causes in the shapes at some points (option,), on the rotor as of `at_numbers`."""
    there = at_numbers(work, theta)
    pairs = zip(causes, points, strict=True)
    return [reshaped(there, c, point, ranges=ranges_of(work, c)) for c, point in pairs]


def _moved(work, cause, theta, point):
    """(None, step, cause) of each option of its shape; (name, step, cause) of each number of the rotor.

    A cause that is at no section of the shaft follows none of these.
    """
    ranges, there = ranges_of(work, cause) if len(point) else {}, at_numbers(work, theta)
    for ends, x, unit in zip(ranges.values(), point, np.eye(len(point)), strict=True):
        yield None, ends.step(x), reshaped(there, cause, point + ends.step(x) * unit, ranges=ranges)
    for name in rotor_numbers(work.prior.names) if any(ends.breaks for ends in ranges.values()) else ():
        moved = theta + STEP * (np.arange(len(theta)) == work.prior.names.index(name))
        yield name, STEP, reshaped(at_numbers(work, moved), cause, point, ranges=ranges)


def as_one(term, amplitudes):
    """The Term of a crack at some amplitudes as a single amplitude, and the weight of that; else the term and them all.

    Of its many amplitudes one column is then found instead of one for each.
    """
    unknowns = [(value, u) for value, u in zip(amplitudes, term.unknowns, strict=True) if value]
    bases = {getattr(u.entries, "basis", None) for _, u in unknowns}
    if len(bases) != 1 or None in bases:
        return term, amplitudes
    entries = Multiples(*bases, sum(value * u.entries.factor for value, u in unknowns))
    whole = Parameter("whole", "1", entries, typical=1.0, jumps=any(u.jumps for _, u in unknowns))
    return replace(term, parameters=(whole,), values={}), np.ones(1)
