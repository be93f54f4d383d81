"""What is said of an effect that was identified: its shape and sizes, and others that explain the records as well."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.one_cause.over_forms import laws_of, over_forms
from rotorstudy.diagnosis.one_cause.stated import sizes_of
from rotorstudy.diagnosis.search.candidates import Candidate, form_ranges, shape_ranges
from rotorstudy.diagnosis.search.shape_fit import Fitted, Work, ranges_of
from rotorstudy.inference.fit import Fit, chi_square_cost
from rotorstudy.model.structure import Structure
from rotorstudy.units import ANY_ANGLE, ends_of_interval, unit_ending

LIKELY = 0.95  # of the region about the best shape whose misfit another one must have to be stated beside it
SAME = 3.0  # standard deviations of the shape, within which two fits are one
FAR = 2.6  # standard deviations of the prior: an amplitude further away is as unlikely as a p-value of 1 %


class Identified(NamedTuple):
    """An effect as identified."""

    # (cause,) Candidate with its shape, and the standard deviations of that: over all forms if it has one
    causes: tuple[Candidate, ...]
    fit: Fit  # with the effect in the shape that fits best, which is free in its covariance
    p_value: float  # probability of a misfit as large by noise alone
    misfits: dict[str, float]  # alternatives of the effect (as a text) -> misfit and penalty beyond those of the best
    structure: Structure  # of the rig, which says in which ranges the shapes are
    elsewhere: tuple["Identified", ...] = ()  # in other shapes, that explain the records as well
    # of a cause over all forms: stated number -> value and standard deviation; option or such -> ends of 95 %
    stated: dict[str, tuple[float, float]] = {}
    intervals: dict[str, tuple[float, float]] = {}

    @property
    def cause(self) -> Candidate:
        """The first one."""
        return self.causes[0]


def is_same(work: Work, one: Fitted, other: Fitted) -> bool:
    """Whether two fits have the same laws, and shapes within their uncertainty, in any order."""
    if one.variant != other.variant:
        return False
    pairs = (sorted(fitted.causes, key=lambda c: (c.cause, *c.shape.values())) for fitted in (one, other))
    for a, b in zip(*pairs, strict=True):
        if a.where != b.where:
            return False
        for name, ends in ranges_of(work, a).items():
            if ends.mirrored:  # a form, which trades off with the rest
                continue
            turn, off = ends.high - ends.low, abs(a.shape[name] - b.shape[name])
            off = min(off % turn, -off % turn) if ends.goes_around else off
            if off > SAME * max(a.shape_std[name], b.shape_std[name]):
                return False
    return True


def identified(work: Work, best: Fitted, tried: list[Fitted]) -> Identified:
    """The Identified of a fit, the best of all that were tried."""
    misfits = {}
    for one in tried:
        misfits[one.variant] = min(misfits.get(one.variant, np.inf), one.fit.cost - best.fit.cost)
    least = best.fit.cost + chi_square_cost(1 - LIKELY, sum(len(cause.shape) for cause in best.causes))
    elsewhere = [best]
    for one in tried:
        if one.fit.converged and one.fit.cost <= least and not any(is_same(work, one, known) for known in elsewhere):
            elsewhere.append(one)
    best, *others = (Identified(*one, one.fit.p_value, {}, work.rig.structure) for one in elsewhere)
    found = best._replace(misfits=misfits, elsewhere=tuple(others))
    if len(found.causes) == 1 and form_ranges(found.cause.effect).keys() & found.cause.shape.keys():
        over = over_forms(work, found.fit, found.cause, laws_of(work, found.cause))
        if over is not None:
            cause = found.cause._replace(shape=over.cause.shape, shape_std=over.cause.shape_std)
            found = found._replace(causes=(cause,), stated=over.stated, intervals=over.intervals)
    return found


def interval_of(found: Identified, name: str) -> tuple[float, float]:
    """Ends of the 95 % interval of an option of the shape of the first cause."""
    return next(ends for own, *_, ends in estimates_of(found._replace(causes=found.causes[:1])) if own == name)


def estimates_of(found: Identified) -> list[tuple[str, float, float, str, tuple[float, float]]]:
    """(name, value, standard deviation, unit, ends of 95 %) of shapes, of what follows from them, and of amplitudes.

    The ends are within what is possible; those of an angle that is not determined are all around.
    """
    rows, names = [], shown_names(found.causes)
    for cause, more in _numbered(found.causes):
        units = {unknown.name: unknown.unit for unknown in cause.term.unknowns}
        known = sizes_of(found.fit, cause) | found.stated | {name: found.fit.by_name[name] for name in units}
        limits = _limits(found, cause)
        for name, (value, std) in known.items():
            least, most, goes_around = limits.get(name, (0.0, np.inf, False))  # what follows is positive
            ends = found.intervals.get(name) or ends_of_interval(value, std, least, most)
            if goes_around:
                ends = (least, most) if std >= ANY_ANGLE else ends_of_interval(value, std)
            unit = units.get(name) or unit_ending(name)[1] or "1"
            rows.append((names.get(name, name + more), value, std, unit, ends))
    return rows


def _limits(found, cause):
    """Name -> least and largest value of an option of the shape or an amplitude, and whether it goes around."""
    given = cause.effect, found.structure, cause.where.get("node")
    ranges = shape_ranges(*given, half_turn=cause.half_turn) | form_ranges(cause.effect)
    limits = {name: (ends.low, ends.high, ends.goes_around) for name, ends in ranges.items()}
    limits |= dict.fromkeys(cause.names, (-np.inf, np.inf, False))
    for name, same in cause.positive.items():  # together with what the rig has of the same
        limits[name] = -sum(factor * found.fit.values[other] for other, factor in same.items()), np.inf, False
    return limits


def shown_names(causes: Sequence[Candidate]) -> dict[str, str]:
    """Name of each amplitude of some causes -> how it is shown, with the number of its cause if there are several."""
    every = ((cause, more, name) for cause, more in _numbered(causes) for name in cause.names)
    return {name: name.replace(f"[{cause.term.label}]", more) for cause, more, name in every}


def _numbered(causes):
    """Each cause with '[1]', '[2]', ..., or with nothing if it is the only one."""
    return [(cause, f"[{number}]" if len(causes) > 1 else "") for number, cause in enumerate(causes, start=1)]


def far_amplitudes(causes: Sequence[Candidate], values: Mapping[str, float]) -> dict[str, float]:
    """Amplitudes of causes of known size that are far from it -> how far, in standard deviations of their prior."""
    known = {name: one for cause in causes if cause.fixed for name, one in cause.prior.items()}
    off = {name: (values[name] - mean) / std for name, (mean, std) in known.items()}
    return {name: away for name, away in off.items() if abs(away) > FAR}
