"""What is said of an effect that was identified: its shape and sizes, and others that explain the records as well."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.one_cause.over_forms import laws_of, over_forms
from rotorstudy.diagnosis.one_cause.stated import sizes_of
from rotorstudy.diagnosis.search.candidates import Candidate, form_ranges
from rotorstudy.diagnosis.search.shape_fit import Fitted, Work, as_fit, ranges_of, shaped
from rotorstudy.inference.fit import Fit, chi_square_cost, chi_square_p_value
from rotorstudy.units import HALF_INTERVAL, unit_ending

LIKELY = 0.95  # of the region about the best shape whose misfit another one must have to be stated beside it
SAME = 3.0  # standard deviations of the shape, within which two fits are one
FAR = 2.6  # standard deviations of the prior: an amplitude further away is as unlikely as a p-value of 1 %
ALIKE = 0.5  # standard deviations of the data: predictions that are closer are the same


class Identified(NamedTuple):
    """An effect as identified."""

    # (cause,) Candidate with its shape, and the standard deviations of that: over all forms if it has one
    causes: tuple[Candidate, ...]
    fit: Fit  # with the effect in the shape that fits best, which is free in its covariance
    p_value: float  # probability of a misfit as large by noise alone
    misfits: dict[str, float]  # alternatives of the effect (as a text) -> misfit and penalty beyond those of the best
    # other shapes (with their standard deviations) that explain the records as well, each (cause,), with its Fit
    elsewhere: tuple[tuple[tuple[Candidate, ...], Fit], ...] = ()
    # of a cause over all forms: stated number -> value and standard deviation; option or such -> ends of 95 %
    stated: dict[str, tuple[float, float]] = {}
    intervals: dict[str, tuple[float, float]] = {}

    @property
    def cause(self) -> Candidate:
        """The first one."""
        return self.causes[0]


def is_same(work: Work, one: Fitted, other: Fitted) -> bool:
    """Whether two fits have the same laws, and shapes within their uncertainty, in any order.

    Where they predict the same, a half turn counts as none: a slot looks the same from both sides.
    """
    if one.variant != other.variant:
        return False
    data = slice(2 * work.spectrum.amplitude.size)
    alike = np.abs(one.minimum.residual[0, data] - other.minimum.residual[0, data]).max() < ALIKE
    pairs = (sorted(shaped(work, fitted), key=lambda c: (c.cause, *c.shape.values())) for fitted in (one, other))
    for a, b in zip(*pairs, strict=True):
        if a.where != b.where:
            return False
        for name, ends in ranges_of(work, a).items():
            if ends.mirrored:  # a form, which trades off with the rest
                continue
            turn, off = (ends.high - ends.low) / (2 if alike else 1), abs(a.shape[name] - b.shape[name])
            off = min(off % turn, -off % turn) if ends.goes_around else off
            if off > SAME * max(a.shape_std[name], b.shape_std[name]):
                return False
    return True


def identified(work: Work, best: Fitted, tried: list[Fitted]) -> Identified:
    """The Identified of a fit, the best of all that were tried."""
    misfits = {}
    for one in tried:
        misfits[one.variant] = min(misfits.get(one.variant, np.inf), one.cost - best.cost)
    least, elsewhere = best.cost + chi_square_cost(1 - LIKELY, sum(len(cause.shape) for cause in best.causes)), [best]
    for one in tried:
        if one.minimum.converged[0] and one.cost <= least and not any(is_same(work, one, known) for known in elsewhere):
            elsewhere.append(one)
    causes, fitted, known = shaped(work, best), _with_free_shapes(work, best), ()
    if len(causes) == 1 and form_ranges(causes[0].effect).keys() & causes[0].shape.keys():
        over = over_forms(work, fitted, causes[0], laws_of(work, causes[0]))
        if over is not None:
            causes = (causes[0]._replace(shape=over.cause.shape, shape_std=over.cause.shape_std),)
            known = over.stated, over.intervals
    return Identified(
        causes,
        fitted,
        chi_square_p_value(best.cost, 2 * work.spectrum.amplitude.size),
        misfits,
        tuple((shaped(work, one), _with_free_shapes(work, one)) for one in elsewhere[1:]),
        *known,
    )


def _with_free_shapes(work, one):
    """The Fit at the values of a Fitted, with the derivatives and covariance of its amplitudes beside its shapes."""
    data, count = 2 * work.spectrum.amplitude.size, len(one.amplitudes)
    slopes, covariance = one.minimum.jacobian[0, :data, :count], one.covariance[:count, :count]
    return replace(as_fit(work, one), jacobian=slopes, covariance=covariance)


def interval_of(found: Identified, name: str) -> tuple[float, float]:
    """Ends of the 95 % interval of an option of the shape of the first cause."""
    value, half = found.cause.shape[name], HALF_INTERVAL * found.cause.shape_std[name]
    return found.intervals.get(name, (value - half, value + half))


def estimates_of(
    causes: Sequence[Candidate], fitted: Fit, stated: Mapping[str, tuple[float, float]] | None = None
) -> list[tuple[str, float, float, str]]:
    """(name, value, standard deviation, unit) of the shapes of causes of a Fit, what follows, and their amplitudes."""
    rows, names = [], shown_names(causes)
    for cause, more in _numbered(causes):
        rows += [(name + more, *one) for name, *one in shape_of(fitted, cause, stated)]
        rows += [(names[u.name], *fitted.by_name[u.name], u.unit) for u in cause.term.unknowns]
    return rows


def shown_names(causes: Sequence[Candidate]) -> dict[str, str]:
    """Name of each amplitude of some causes -> how it is shown, with the number of its cause if there are several."""
    every = ((cause, more, name) for cause, more in _numbered(causes) for name in cause.names)
    return {name: name.replace(f"[{cause.term.label}]", more) for cause, more, name in every}


def _numbered(causes):
    """Each cause with '[1]', '[2]', ..., or with nothing if it is the only one."""
    return [(cause, f"[{number}]" if len(causes) > 1 else "") for number, cause in enumerate(causes, start=1)]


def shape_of(
    fitted: Fit, cause: Candidate, stated: Mapping[str, tuple[float, float]] | None = None
) -> list[tuple[str, float, float, str]]:
    """(name, value, standard deviation, unit) of the shape of a cause of a Fit, and what follows or is stated."""
    sizes = sizes_of(fitted, cause) | (stated or {})
    return [(name, *one, unit_ending(name)[1] or "1") for name, one in sizes.items()]


def far_amplitudes(causes: Sequence[Candidate], values: Mapping[str, float]) -> dict[str, float]:
    """Amplitudes of causes of known size that are far from it -> how far, in standard deviations of their prior."""
    off = {}
    for cause in causes:
        for name in cause.names if cause.fixed else ():
            mean, std = cause.prior[name]
            away = (values[name] - mean) / std
            if abs(away) > FAR:
                off[name] = away
    return off
