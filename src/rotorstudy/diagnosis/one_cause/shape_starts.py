"""Shapes from which a cause is fitted: many of them judged by their columns at a known motion, without a fit."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.free_forces import motions_by_free_forces
from rotorstudy.diagnosis.search.screening import Projection, screen_each
from rotorstudy.diagnosis.search.shape_fit import Fitted, Work, as_fit, check_together, point_of, ranges_of, reshaped
from rotorstudy.diagnosis.search.shape_scan import acts_on
from rotorstudy.errors import CannotAct
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.response.neighbourhood import carried_motion

TRIED = {"position": 20, "angle": 16, "other": 9, "form": 3}  # values of an option
STARTS = 3  # shapes of each alternative and motion from which steps are made
APART = 0.08  # of the range of the position or the angle: shapes that are closer count as one
LATER = ("other", "form")  # kinds of options of which the middle is tried first
FREE = 10.0  # standard deviation of an amplitude in typical sizes, while the options that scale it are not yet known
IMPLIED, OWN = "implied", "own"  # motion that the records imply, and that of the fit


def first_starts(work: Work, base: Fit, cause: Candidate) -> list:
    """(causes, amplitudes) of the best shapes of a cause alone, by columns at a fit of the rig.

    At the motion that the records imply, which is the better one for a large effect, and at that of the fit, which is
    for a small one.
    """
    projection = Projection(base, work.spectrum)
    found = [one for motion in (IMPLIED, OWN) for one in _best(work, projection, cause, motion, ())]
    return [((one,), np.concatenate([base.free, size])) for one, size in found]


def further_starts(
    work: Work, found: Fitted, gone: Candidate, cause: Candidate, known: Sequence[Fitted], everywhere: bool = False
) -> list:
    """(causes, amplitudes) with a cause instead of one of a fit, far from all known fits with the same alternatives.

    By columns at the motion of that fit, at which those of another cause of the same motion are exact.

    everywhere : the best shape at each position instead of the few best of all
    """
    others = tuple(one for one in found.causes if one is not gone)
    rest, motion = _without(work, found, others)
    taken = [point_of(work, one) for fitted in known for one in fitted.causes if one.variant == cause.variant]
    cause = reshaped(work, cause, point_of(work, cause), gone.term.label)
    starts = _best(work, Projection(rest, work.spectrum), cause, motion, taken, point_of(work, gone), everywhere)
    return _beside(work, others, rest.free, starts)


def starts_of_another(work: Work, found: Fitted, cause: Candidate) -> list:
    """(causes, amplitudes) with one more cause beside those of a fit, by columns at its motion."""
    rest, _ = _without(work, found, found.causes)
    cause = reshaped(work, cause, point_of(work, cause), f"cause {len(found.causes) + 1}")
    return _beside(work, found.causes, rest.free, _best(work, Projection(rest, work.spectrum), cause, OWN, ()))


def _beside(work, others, free, starts):
    """(causes, amplitudes) of starts (cause, amplitudes) beside other causes, where they can be together."""
    found = []
    for one, size in starts:
        try:
            check_together(work, (*others, one))
        except CannotAct:
            continue
        found.append(((*others, one), np.concatenate([free, size])))
    return found


def _without(work, found, kept):
    """The Fit with some of the causes of a fit, its amplitudes as they are, and the Motion with all of them."""
    whole, spectrum = as_fit(work, found), work.spectrum
    motion = carried_motion(whole.model, spectrum.speed, spectrum.harmonics, whole.theta, order=carried_order(spectrum))
    return as_fit(work, found, kept), motion


def _best(work, projection, cause, motion, taken, near=None, everywhere=False):
    """(cause, amplitudes) of up to `STARTS` shapes that explain most, apart from each other and from points `taken`.

    Options other than positions and angles are first in the middle of their ranges.

    near : point (option,) whose angles are tried too: they are known well where the position is not
    everywhere : the best one at each position instead
    """
    kinds = [_kind(*one) for one in ranges_of(work, cause).items()]
    first = [[0.5] if kind in LATER else (np.arange(TRIED[kind]) + 0.5) / TRIED[kind] for kind in kinds]
    for i in [i for i, kind in enumerate(kinds) if kind == "angle" and near is not None]:
        first[i] = np.append(first[i], near[i])
    judged = _judged(work, projection, cause, np.array(list(product(*first))), motion, "other" in kinds)
    points, found = [point for point, _ in judged], []
    for point in _best_at_each_position(points, kinds) if everywhere else _few_apart(points, kinds, taken):
        rest = [np.linspace(0, 1, TRIED[kind]) if kind in LATER else [x] for kind, x in zip(kinds, point, strict=True)]
        best, amplitudes = _judged(work, projection, cause, np.array(list(product(*rest))), motion, False)[0]
        found.append((reshaped(work, cause, best), amplitudes))
    return found


def _few_apart(points, kinds, taken):
    """The first `STARTS` of points (option,) that are apart from each other and from points `taken`."""
    apart = [i for i, kind in enumerate(kinds) if kind not in LATER]
    around = np.array([kinds[i] == "angle" for i in apart])
    chosen, avoided = [], [point[apart] for point in taken]
    for point in points:
        if len(chosen) == STARTS:
            break
        if all(_distance(point[apart], other, around) > APART for other in avoided):
            chosen.append(point)
            avoided.append(point[apart])
    return chosen


def _best_at_each_position(points, kinds):
    """The first of points (option,) with each value of the positions."""
    first = {}
    for point in points:
        first.setdefault(tuple(x for x, kind in zip(point, kinds, strict=True) if kind == "position"), point)
    return list(first.values())


def _kind(name, ends):
    """Kind of an option, as in `TRIED`."""
    if ends.mirrored:
        return "form"
    return "angle" if ends.goes_around else "position" if name.startswith("position") else "other"


def _distance(a, b, around):
    """Largest distance of two points (option,), of those that go around the shorter way."""
    off = np.abs(a - b)
    return np.max(np.where(around, np.minimum(off, 1 - off), off)) if len(a) else 0.0


def _judged(work, projection, cause, points, motion, free):
    """(point, amplitudes) of shapes at points (shape, option), the one that explains most first.

    motion : a Motion, or one of `IMPLIED`, `OWN`;  free : with amplitudes of any size
    """
    groups = {}
    for number, point in enumerate(points):
        try:
            one = reshaped(work, cause, point, f"shape {number}")
        except CannotAct:
            continue
        row = acts_on(one, work.rig.structure) if motion is IMPLIED else None
        groups.setdefault(b"" if row is None else row.tobytes(), (row, []))[1].append((point, one))
    chosen = [[_freed(one) if free else one for _, one in there] for _, there in groups.values()]
    if motion is IMPLIED:
        rows = [row for row, _ in groups.values()]
        motions = motions_by_free_forces(projection.fitted, work.spectrum, rows, projection.near)
    else:
        motions = [None if motion is OWN else motion for _ in groups]
    projected = projection.of_groups(list(zip(chosen, motions, strict=True)))
    judged = screen_each(projected, [one for there in chosen for one in there])
    points = [point for _, there in groups.values() for point, _ in there]
    found = [(seen.evidence, point, seen.start) for point, seen in zip(points, judged, strict=True)]
    return [one[1:] for one in sorted(found, key=lambda one: -one[0])]


def _freed(cause):
    """The cause with a wide prior of its amplitudes, as if their size were not known."""
    prior = {unknown.name: (0.0, FREE * unknown.typical) for unknown in cause.term.unknowns}
    return cause._replace(prior=prior, fixed=False)
