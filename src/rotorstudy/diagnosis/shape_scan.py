"""The shape of a cause from its columns at a known motion: many shapes at once, without a fit.

A force that depends on the motion (a contact, a resonant support, a crack) is a known function of time once the motion
where it acts is known, whatever causes it, and linear in its amplitude. That motion follows from the records and the
receptances of the rotor with a free force there. Each shape is then judged by least squares, as in `screen`; the best
one is refined by sampling about it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.candidates import Candidate, shape_ranges, with_shape
from rotorstudy.diagnosis.explanations import Search
from rotorstudy.diagnosis.screening import Projection, Screened, screen_each
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.registry import registry
from rotorstudy.response.harmonic import positions
from rotorstudy.response.measured import Motion, Near

FIRST_SAMPLES = (0, 16, 32, 64, 128)  # shapes over the whole range, by the number of options
STARTS = 3  # best of these, about which closer ones are tried: a force at one instant has several near-equal shapes
MORE_WITH_PLACE = 4  # times as many shapes where the place is one of the options
PARTS = 6  # of the shaft and, of an angle, HALVES of the turn, each with a start of its own: they may look alike
HALVES = 2
SAMPLES = 9  # shapes per round and option about the best ones
REFINED = 2  # places of each effect at which the best shape is refined
LEAST_SEEN = 0.01  # of what is left, explained by the best coarse shape of a place that is refined
SPREADS = (0.12, 0.05, 0.02, 0.008, 0.003)  # of those rounds, in shares of the range


class Scanned(NamedTuple):
    """A Candidate with the best shape found, and its Screened."""

    cause: Candidate
    screened: Screened


def can_be_scanned(cause):
    """Whether a cause acts on the rotor with a force whose shape is to be found: at a node, or of several options."""
    at_node = "node" in cause.where and not cause.variant
    several = len(registry().get("effect", cause.effect).shape) > 1
    return bool(cause.shape) and not cause.term.acts_on_output and (at_node or several)


def _acts_on(cause, structure):
    """The coordinate (dof,) that a cause acts on: its node, or a deformation of the shaft."""
    if "node" in cause.where:
        return structure.unit(cause.where["node"])
    (unknown,) = cause.term.unknowns
    matrix = unknown.force.matrix if unknown.force else np.real(unknown.entries[0].matrix)
    return matrix[np.argmax(np.linalg.norm(matrix, axis=1))]


def motion_by_a_free_force(fitted: Fit, spectrum: Spectrum, row: np.ndarray, near: Near | None = None) -> Motion:
    """The Motion of a fitted model with a force on one coordinate, free at every harmonic and speed, fitted best.

    Parameters
    ----------
    fitted : Fit
    spectrum : Spectrum
    row : ndarray (dof,)
        The coordinate, by a unit of each of the model: a node, or a deformation of the shaft.
    near : Near, optional
        Of the fitted model at the speeds and harmonics of the spectrum, where it is known.

    Returns
    -------
    Motion
    """
    near = near or Near(fitted.model, spectrum.speed, spectrum.harmonics, fitted.theta, order=carried_order(spectrum))
    place = positions(spectrum.harmonics, near.blocks)
    moved = sum(row[i] * near.replies(int(i)) for i in np.flatnonzero(row))
    moved = moved[..., [2 * i + part for part in (0, 1) for i in place]]
    columns = spectrum.whitened(np.moveaxis(moved[:, place][:, :, fitted.model.measured], -1, 0)).T
    columns = columns.reshape(len(spectrum.speed), -1, moved.shape[-1])
    residual = fitted.residual.reshape(len(spectrum.speed), -1)
    forces = np.array([np.linalg.lstsq(a, b, rcond=1e-9)[0] for a, b in zip(columns, residual, strict=True)])
    return Motion(near.motion.amplitude + np.einsum("whdp,wp->whd", moved, forces), near.motion.deflection)


def scan(work: Search, fitted: Fit, chosen: list[Candidate], refined: int = REFINED) -> list[Scanned]:
    """The shapes of causes at which their columns explain most, at the best places of each effect.

    Parameters
    ----------
    work : Search
    fitted : Fit
        Without the causes.
    chosen : list of Candidate
        One for each effect, place and alternative; those that `can_be_scanned` are considered.
    refined : int
        Most places of each effect, those where coarse shapes explain most.

    Returns
    -------
    list of Scanned
        Without those whose plugin fails, which is recorded as broken.
    """
    projection, motions, looked = Projection(fitted, work.spectrum), {}, {}
    for cause in filter(can_be_scanned, chosen):
        try:
            one = _Scan(work, fitted, projection, cause, motions)
            looked.setdefault(cause.effect, []).append((one, one.first()))
        except NoSteadyState:
            continue
        except Exception as error:
            work.note_broken([cause], error)
    found = []
    for places in looked.values():
        places.sort(key=lambda place: -place[1][0].screened.evidence)
        least = LEAST_SEEN * fitted.cost
        found += [one.refined(best) for one, best in places[:refined] if best[0].screened.explained > least]
    return found


class _Judged(NamedTuple):
    """A shape at a position (option,) in its ranges, judged."""

    place: np.ndarray
    cause: Candidate
    screened: Screened


class _Scan(NamedTuple):
    """The scan of one cause; motions : those known, by the coordinate with the free force."""

    work: Search
    fitted: Fit
    projection: Projection
    cause: Candidate
    motions: dict[bytes, Motion]

    @property
    def ranges(self):
        return shape_ranges(self.cause.effect, self.work.rig.structure)

    def with_place(self, place, label):
        """The cause with the shape at a position (option,)."""
        shape = {name: ends.value(x) for (name, ends), x in zip(self.ranges.items(), place, strict=True)}
        labelled = self.cause._replace(term=replace(self.cause.term, label=label))
        return with_shape(self.work.rig, labelled, shape, self.work.settings.prior_width)

    def judged(self, places):
        """Some positions (shape, option), judged, the best first; those where the cause cannot act are left out."""
        groups = {}
        for i, place in enumerate(places):
            try:
                cause = self.with_place(place, f"{self.cause.term.label} {i}")
            except CannotAct:  # such as a crack in a hollow part of the shaft
                continue
            row = _acts_on(cause, self.work.rig.structure)
            groups.setdefault(row.tobytes(), (row, [], []))
            groups[row.tobytes()][1].append(place)
            groups[row.tobytes()][2].append(cause)
        if not groups:
            raise NoSteadyState(f"{self.cause.effect} cannot act with any of {len(places)} shapes")
        found = []
        for row, there, chosen in groups.values():
            projected = self.projection.of(chosen, self._motion(row))
            found += map(_Judged, there, chosen, screen_each(projected, chosen))
        return sorted(found, key=lambda one: -one.screened.evidence)

    def _motion(self, row):
        """The motion with a free force on a coordinate; those of nodes are kept, as all shapes there share it."""
        if row.tobytes() in self.motions:
            return self.motions[row.tobytes()]
        motion = motion_by_a_free_force(self.fitted, self.work.spectrum, row, self.projection.near)
        if self.cause.where:
            self.motions[row.tobytes()] = motion
        return motion

    def first(self):
        """The best of shapes over the whole range."""
        from scipy.stats import qmc

        options = len(self.ranges)
        count = FIRST_SAMPLES[options] * self._more
        return self._distinct(self.judged(qmc.Sobol(options, scramble=False).random(count)))[: STARTS * self._more]

    @property
    def _more(self):
        """How many times as many shapes are tried where the place is an option of the shape, too."""
        return 1 if self.cause.where else MORE_WITH_PLACE

    def _distinct(self, found):
        """Shapes, the best first; where the place is an option, the best of each part of the shaft and of the turn."""
        if self.cause.where:
            return found
        parts = np.array([HALVES if ends.goes_around else PARTS for ends in self.ranges.values()])
        best = {}
        for one in found:
            best.setdefault(tuple((parts * one.place % parts).astype(int)), one)
        return list(best.values())

    def refined(self, starts):
        """Scanned, from rounds of ever closer shapes about the best ones, of which the very best remains."""
        random = np.random.default_rng(0)  # the same numbers for the same records
        for spread in SPREADS:
            count = SAMPLES * len(self.ranges) * self._more // len(starts)
            about = [one.place + spread * random.standard_normal((count, len(self.ranges))) for one in starts]
            closer = self.judged(np.concatenate(about))
            kept = 1 if spread == SPREADS[-1] else max(len(starts) - 1, 1)
            found = sorted([*starts, *closer], key=lambda one: -one.screened.evidence)
            starts = self._distinct(found)[:kept]
        (best,) = starts
        return Scanned(self.with_place(best.place, self.cause.term.label), best.screened)
