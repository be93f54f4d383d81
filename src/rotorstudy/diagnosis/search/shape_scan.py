"""The shape of a cause from its columns at a known motion: many shapes at once, without a fit.

A force that depends on the motion (a contact, a resonant support, a crack) is a known function of time once the motion
where it acts is known, whatever causes it, and linear in its amplitude. That motion follows from the records and the
receptances of the rotor with a free force there. Each shape is then judged by least squares, as in `screen`; the best
one is refined by sampling about it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.free_forces import motions_by_free_forces
from rotorstudy.diagnosis.search.screening import Projection, Screened, screen_each
from rotorstudy.diagnosis.search.shape_fit import ranges_of, reshaped
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.model.registry import registry
from rotorstudy.response.neighbourhood import Motion

FIRST_SAMPLES = (0, 16, 32, 64, 128)  # shapes over the whole range, by the number of options
STARTS = 3  # best of these, about which closer ones are tried: a force at one instant has several near-equal shapes
MORE_ALONG_SHAFT = 4  # times as many shapes and starts where the position on the shaft is one of the options
PARTS = 6  # of the range of an option, then; each has a start, as a crack elsewhere may explain nearly as much
HALVES = 2  # of a full turn, likewise
ANOTHER_SIDE = 0.25  # of a turn
SAMPLES = 9  # shapes per round and option about the best ones
REFINED = 2  # places of each effect at which the best shape is refined
LEAST_SEEN = 0.01  # share of the cost that the best coarse shape of a place explains, if it is refined
SPREADS = (0.12, 0.05, 0.02, 0.008, 0.003)  # standard deviation of the shapes of each round, as a share of the range
COARSE = 3  # rounds that are always made
MOTIONS_AT_ONCE = 4_000_000  # numbers of the motions that are kept at a time, 64 MB
STILL_GAINS = 0.1  # log odds gained by a round, from which the next one is made: a fit finds the rest


class Scanned(NamedTuple):
    """A Candidate with the best shape found, and its Screened."""

    cause: Candidate
    screened: Screened


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
    row, column, value = unknown.entries[0].nonzero
    here, found = row == np.argmax(np.bincount(row, value.real**2)), np.zeros(len(structure.dofs))
    found[column[here]] = value.real[here]
    return found


def scan(
    work: Search,
    fitted: Fit,
    chosen: list[Candidate],
    without: tuple[str, ...] = (),
    plain: Fit | None = None,
) -> list[Scanned]:
    """The shapes of causes at which their columns explain most, at the best places of each effect.

    fitted  : without the causes
    chosen  : one for each effect, place and alternative; those that `can_be_scanned` are considered
    without : amplitudes of the fit that are taken out, at whose motion the causes are judged
    plain   : the same fit without errors that the speeds have in common, by which motions are found
    returns : the best shape of each place, for a crack also the best that faces the other side; without those whose
              plugin fails, which is recorded as broken
    """
    projection, motions, coarse = Projection(fitted, work.spectrum, without), {}, {}
    for cause in filter(can_be_scanned, chosen):
        try:
            one = _Scan(work, fitted, projection, cause, motions, bool(without), plain)
            best = one.first()
            if best:
                coarse.setdefault(cause.effect, []).append((one, best))
        except NoSteadyState:
            continue
        except Exception as error:
            work.note_broken([cause], error)
    found, whole = [], float(projection.residual @ projection.residual)
    for places in coarse.values():
        places.sort(key=lambda place: -place[1][0].screened.evidence)
        for one, best in places[:REFINED]:
            found += one.refined(best) if best[0].screened.explained > LEAST_SEEN * whole else []
    return found


class _Judged(NamedTuple):
    """A cause in one shape, judged; point : (option,) its options as fractions of their ranges."""

    point: np.ndarray
    cause: Candidate
    screened: Screened


class _Scan(NamedTuple):
    """The scan of one cause.

    fitted     : Fit without the cause;  projection : of that fit
    motions    : the Motion with a free force, for each coordinate (as bytes) for which it is known
    has_motion : whether the motion of the fit is the one on which the cause acts
    plain      : Fit without errors that the speeds have in common
    """

    work: Search
    fitted: Fit
    projection: Projection
    cause: Candidate
    motions: dict[bytes, Motion]
    has_motion: bool = False
    plain: Fit | None = None

    @property
    def ranges(self):
        """Option -> ShapeRange."""
        return ranges_of(self.work, self.cause)

    def judged(self, points, kept=False):
        """The shapes at some points (shape, option), the best first, without those in which the cause cannot act.

        kept : whether the shapes and motions are kept, as all scans and alternatives of the cause begin at these
               points; only those are judged that are at a place where a force may explain enough
        """
        groups = self._over_the_range(points) if kept else self._grouped(points)
        if not groups:
            raise NoSteadyState(f"{self.cause.effect} cannot act with any of {len(points)} shapes")
        groups, found = list(groups.values()), []
        together = max(1, MOTIONS_AT_ONCE // self.projection.near.motion.amplitude.size)
        for first in range(0, len(groups), together):
            rows, points, causes = zip(*groups[first : first + together], strict=True)
            motions = self._motions(rows, kept and len(groups) <= together)
            projected = self.projection.of_groups(list(zip(causes, motions, strict=True)))
            chosen = [one for some in causes for one in some]
            found += map(_Judged, [one for some in points for one in some], chosen, screen_each(projected, chosen))
        return sorted(found, key=lambda one: -one.screened.evidence)

    def _over_the_range(self, points):
        """What `_grouped` returns, formed once for all scans of a search: the shapes first tried are the same."""
        name = self.cause.cause, *self.cause.variant.items(), self.cause.term.label
        if name not in self.work.shapes:
            self.work.shapes[name] = self._grouped(points)
        return self.work.shapes[name]

    def _grouped(self, points):
        """{coordinate in bytes: (coordinate, points, causes in the shapes there)} of those that can act."""
        groups, ranges = {}, self.ranges
        for i, point in enumerate(points):
            try:
                cause = reshaped(self.work, self.cause, point, f"{self.cause.term.label} {i}", ranges)
            except CannotAct:  # such as a crack in a hollow part of the shaft
                continue
            row = acts_on(cause, self.work.rig.structure)
            groups.setdefault(row.tobytes(), (row, [], []))
            groups[row.tobytes()][1].append(point)
            groups[row.tobytes()][2].append(cause)
        return groups

    def _motions(self, rows, kept):
        """The Motions with a free force on coordinates; that of a node is kept, as all shapes there share it."""
        if self.has_motion:
            return [self.projection.near.motion] * len(rows)
        known = {row.tobytes(): row for row in rows if row.tobytes() not in self.motions}
        spectrum = replace(self.work.spectrum, shared_error=None) if self.plain else self.work.spectrum
        found = motions_by_free_forces(self.plain or self.fitted, spectrum, list(known.values()), self.projection.near)
        known = dict(zip(known, found, strict=True))
        if kept or self.cause.where:
            self.motions.update(known)
        return [(self.motions | known)[row.tobytes()] for row in rows]

    def first(self):
        """The best of shapes over the whole range, from which `refined` starts."""
        from scipy.stats import qmc

        options = len(self.ranges)
        count = FIRST_SAMPLES[options] * self._more
        found = self.judged(qmc.Sobol(options, scramble=False).random(count), kept=True)
        return self._distinct(found)[: STARTS * self._more]

    @property
    def _more(self):
        """Factor of the number of shapes: more are tried where the position on the shaft is an option, too."""
        return 1 if self.cause.where else MORE_ALONG_SHAFT

    def _distinct(self, found):
        """Judged shapes, the best first; where the position is an option, only the best of each part of the ranges."""
        if self.cause.where:
            return found
        parts = np.array([HALVES if ends.goes_around else PARTS for ends in self.ranges.values()])
        best = {}
        for one in found:
            best.setdefault(tuple((parts * one.point % parts).astype(int)), one)
        return list(best.values())

    def refined(self, starts):
        """List of Scanned, found by rounds of ever closer shapes about fewer and fewer of the best ones."""
        random = np.random.default_rng(0)  # the same numbers for the same records
        for number, spread in enumerate(SPREADS):
            before = starts[0].screened.evidence
            count = SAMPLES * len(self.ranges) * self._more // len(starts)
            about = [one.point + spread * random.standard_normal((count, len(self.ranges))) for one in starts]
            closer = self.judged(np.concatenate(about))
            kept = 1 if spread == SPREADS[-1] else max(len(starts) - 1, 1)
            found = sorted([*starts, *closer], key=lambda one: -one.screened.evidence)
            starts = self._distinct(found)[:kept]
            gained = found[0].screened.evidence - before
            is_done = self._is_fitted_closely and gained < STILL_GAINS
            if number + 1 >= COARSE and is_done:
                break
        best = (*starts, *self._facing(found))
        return [Scanned(reshaped(self.work, self.cause, one.point), one.screened) for one in best]

    @property
    def _is_fitted_closely(self):
        """Whether a fit finds the best shape near a good one: several of a crack or a contact are nearly equal."""
        return bool(self.cause.where) and not any(u.force for u in self.cause.term.unknowns)

    def _facing(self, found):
        """The best shape that faces another side than the best one: which side is open decides little at first."""
        around = [i for i, ends in enumerate(self.ranges.values()) if ends.goes_around]
        if self.cause.where or not around:
            return []
        apart = [abs((one.point[around[0]] - found[0].point[around[0]] + 0.5) % 1 - 0.5) for one in found]
        return [one for one, turn in zip(found, apart, strict=True) if turn > ANOTHER_SIDE][:1]
