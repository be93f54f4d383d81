"""The shape of a cause from its columns at a known motion: many shapes at once, without a fit.

A force that depends on the motion (a contact, a resonant support, a crack) is a known function of time once the motion
where it acts is known, whatever causes it, and linear in its amplitude. That motion follows from the records and the
receptances of the rotor with a free force there. Each shape is then judged by least squares, as in `screen`; the best
of each part of the ranges are refined by Gauss-Newton steps at that motion.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.held_shapes import HeldShapes
from rotorstudy.diagnosis.search.screening import Projected, Projection, Screened, screen_each
from rotorstudy.diagnosis.search.shape_fit import ranges_of, reshaped
from rotorstudy.diagnosis.search.shown_forces import motions_by_free_forces
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.model.entries import Multiples
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.response.neighbourhood import Motion

FIRST_SAMPLES = (0, 16, 32, 64, 128)  # shapes over the whole range, by the number of options
STARTS = 3  # best of these, that are refined: a force at one instant has several near-equal shapes
MORE_ALONG_SHAFT = 2  # times as many shapes and starts where the position on the shaft is one of the options
PARTS = 6  # of the range of an option; starts are in different ones, as one elsewhere may explain nearly as much
HALVES = 2  # of a full turn, likewise
ANOTHER_SIDE = 0.25  # of a turn
REFINED = 2  # places of each effect at which the best shape is refined
LEAST_SEEN = 0.01  # share of the cost that the best coarse shape of a place explains, if it is refined
MOTIONS_AT_ONCE, MOTIONS_KEPT = 4_000_000, 16_000_000  # numbers of the motions of causes judged together; 256 MB


def can_be_scanned(cause):
    """Whether the shape of a cause is scanned: it acts on the rotor, at one node or with several shape options."""
    at_node = "node" in cause.where and not cause.variant
    several = len(registry().get("effect", cause.effect).shape) > 1
    return bool(cause.shape) and not cause.term.acts_on_output and (at_node or several)


def acts_on(cause, structure):
    """The coordinate (dof,) that a cause acts on: its node, or a deformation of the shaft."""
    if "node" in cause.where:
        return structure.unit(cause.where["node"])
    unknown = cause.term.unknowns[0]  # all act there
    if unknown.force:
        return unknown.force.matrix[np.argmax(np.linalg.norm(unknown.force.matrix, axis=1))]
    if isinstance(unknown.entries, Multiples):
        return unknown.entries.basis.whole_row
    row, column, value = unknown.entries[0].nonzero
    here, found = row == np.argmax(np.bincount(row, value.real**2)), np.zeros(len(structure.dofs))
    found[column[here]] = value.real[here]
    return found


class AtOwnMotions(NamedTuple):
    """What judges causes, each at the motion where it acts, as a Projection does at its own."""

    projection: Projection
    structure: Structure
    motions_on: Callable  # from coordinates [(dof,)] to a Motion for each
    kept: dict  # Motions by coordinate (as bytes), to which they are added as long as they are few

    @property
    def residual(self):
        """(component,) that of the Projection."""
        return self.projection.residual

    def of(self, causes):
        """The Projected of causes in some shapes."""
        groups, columns, size = {}, {}, self.projection.near.motion.amplitude.size
        for one in causes:
            row = acts_on(one, self.structure)
            groups.setdefault(row.tobytes(), (row, []))[1].append(one)
        groups, together = [*groups.items()], max(1, MOTIONS_AT_ONCE // size)
        for part in (groups[first : first + together] for first in range(0, len(groups), together)):
            new = {key: row for key, (row, _) in part if key not in self.kept}
            motions = dict(zip(new, self.motions_on([*new.values()]), strict=True)) if new else {}
            if size * (len(self.kept) + len(new)) <= MOTIONS_KEPT:
                self.kept.update(motions)
            some = [(alike, motions.get(key) or self.kept[key]) for key, (_, alike) in part]
            columns |= self.projection.of_groups(some).columns
        return Projected(self.residual, columns, self.projection.theta)


def scan(
    work: Search,
    fitted: Fit,
    chosen: list[Candidate],
    without: tuple[str, ...] = (),
    free: Sequence = (),
    plain: Fit | None = None,
    away: np.ndarray | None = None,
    most: int | None = None,
) -> list[tuple[Candidate, Screened]]:
    """The causes in the shapes at which their columns explain most, at the best places of each effect, judged there.

    fitted  : without the causes
    chosen  : one for each effect, place and alternative
    without : amplitudes of the fit that are taken out, at whose motion the causes are judged
    free    : as of `Projection`
    plain   : the same fit without errors that the speeds have in common, by which motions are found
    away    : point (option,) of the shape of a cause in the fit; only shapes that face another side are considered
    most    : how many shapes of each place are returned, each the best one in its part of the ranges
    returns : by default the best shape of each place, for a crack also the best that faces the other side; without
              those whose plugin fails, which is recorded as broken
    """
    projection, motions, coarse = Projection(fitted, work.spectrum, without, free), {}, {}
    for cause in chosen:
        one = _Scan(work, cause, projection, plain or fitted, motions, bool(without), away)
        if best := work.tried([cause], one.first):
            coarse.setdefault(cause.effect, []).append((one, best))
    found, whole = [], float(projection.residual @ projection.residual)
    for places in coarse.values():
        places.sort(key=lambda place: -place[1][0].screened.evidence)
        for one, best in places[:REFINED]:
            if away is not None or most or best[0].screened.explained > LEAST_SEEN * whole:
                found += work.tried([one.cause], one.refined, best, most, otherwise=[])
    return found


class _Judged(NamedTuple):
    """A cause in one shape, judged; point : (option,) its options as fractions of their ranges."""

    point: np.ndarray
    cause: Candidate
    screened: Screened


class _Scan(NamedTuple):
    """The scan of one cause."""

    work: Search
    cause: Candidate
    projection: Projection  # of a fit without the cause
    plain: Fit  # the same fit without errors that the speeds have in common
    motions: dict[bytes, Motion]  # the Motion with a free force, for each coordinate (as bytes) for which it is known
    has_motion: bool  # whether the motion of the fit is the one on which the cause acts
    away: np.ndarray | None  # point (option,) that shapes face away from

    @property
    def ranges(self):
        """Option -> ShapeRange."""
        return ranges_of(self.work, self.cause)

    def judged(self, points, kept=False):
        """The shapes at some points (shape, option), the best first, without those in which the cause cannot act.

        kept : whether the motions are kept, as all scans and alternatives of the cause begin at these points
        """
        judge = self._judge(kept)
        causes, rows = self._shapes(judge).reshaped(points, self.cause.term.label)
        if not causes:
            raise NoSteadyState(f"{self.cause.effect} cannot act with any of {len(points)} shapes")
        found = list(map(_Judged, points[rows], causes, screen_each(judge.of(causes), causes)))
        found = [one for one in found if self.away is None or self._turn(one.point, self.away) > ANOTHER_SIDE]
        return sorted(found, key=lambda one: -one.screened.evidence)

    def _shapes(self, judge):
        """The HeldShapes of the cause, of which nothing is held."""
        return HeldShapes(self.work, judge, self.cause, self.ranges, ())

    def _motions(self, rows):
        """The Motions with a free force on coordinates."""
        if self.has_motion:
            return [self.projection.near.motion] * len(rows)
        return motions_by_free_forces(self.plain, self.work.spectrum, rows, self.projection.near)

    def first(self):
        """The best of shapes over the whole range, from which `refined` starts; to turn a crack, itself turned."""
        from scipy.stats import qmc

        if self.away is not None and not self.cause.where:
            around = np.array([ends.goes_around for ends in self.ranges.values()])
            return self.judged((self.away + 0.5 * around)[None])
        options = len(self.ranges)
        count = FIRST_SAMPLES[options] * self._more
        found = self.judged(qmc.Sobol(options, scramble=False).random(count), kept=True)
        return self._distinct(found)[: STARTS * self._more]

    @property
    def _more(self):
        """Factor of the number of shapes: more are tried where the position on the shaft is an option, too."""
        return 1 if self.cause.where else MORE_ALONG_SHAFT

    def _distinct(self, found):
        """The best of judged shapes in each part of the ranges, the best first."""
        parts = np.array([HALVES if ends.goes_around else PARTS for ends in self.ranges.values()])
        best = {}
        for one in found:
            best.setdefault(tuple((parts * one.point % parts).astype(int)), one)
        return list(best.values())

    def refined(self, starts, most=None):
        """The best shapes, judged, that Gauss-Newton steps from some find; see `scan`."""
        shapes = self._shapes(self._judge(False))
        begun = starts
        if self.away is None or self.cause.where:  # a turned crack is near its best shape already
            begun = self.judged(shapes.searched(np.array([one.point for one in starts])))
        sizes = np.array([one.screened.start for one in begun])
        found = self.judged(shapes.fitted(np.array([one.point for one in begun]), sizes, reach=np.inf).points)
        found = sorted([*starts, *begun, *found], key=lambda one: -one.screened.evidence)
        best = self._distinct(found)[:most] if most else (found[0], *self._facing(found))
        return [(reshaped(self.work, self.cause, one.point), one.screened) for one in best]

    def _judge(self, kept):
        """What judges the cause; kept : whether the motions are; those of a node are, as all shapes there share it."""
        kept = self.motions if kept or self.cause.where else {}
        return AtOwnMotions(self.projection, self.work.rig.structure, self._motions, kept)

    def _facing(self, found):
        """The best shape that faces another side than the best one: which side is open decides little at first."""
        if self.away is not None:
            return []
        return [one for one in found if self._turn(one.point, found[0].point) > ANOTHER_SIDE][:1]

    def _turn(self, point, other):
        """The largest angle between two points (option,), as a share of a full turn."""
        around = [ends.goes_around for ends in self.ranges.values()]
        return np.abs((point - other + 0.5) % 1 - 0.5)[around].max(initial=0.0)
