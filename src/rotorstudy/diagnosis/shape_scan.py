"""The shape of a cause from its columns at a known motion: many shapes at once, without a fit.

A force that depends on the motion (a contact, a resonant support) is a known function of time once the motion of its
node is known, whatever causes it, and linear in its amplitude. That motion follows from the records and the receptances
of the rotor with a free force at the node. Each shape is then judged by least squares, as in `screen`; the best one is
refined by sampling about it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.candidates import Candidate, shape_ranges, with_shape
from rotorstudy.diagnosis.explanations import Search
from rotorstudy.diagnosis.screening import Projection, Screened, screen_each
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.harmonic import positions
from rotorstudy.response.measured import Motion, Near

FIRST_SAMPLES = (0, 16, 32, 64, 128)  # shapes over the whole range, by the number of options
STARTS = 3  # best of these, about which closer ones are tried: a force at one instant has several near-equal shapes
SAMPLES = 9  # shapes per round and option about the best ones
REFINED = 2  # places of each effect at which the best shape is refined
LEAST_SEEN = 0.01  # of what is left, explained by the best coarse shape of a place that is refined
SPREADS = (0.12, 0.05, 0.02, 0.008, 0.003)  # of those rounds, in shares of the range


class Scanned(NamedTuple):
    """A Candidate with the best shape found, and its Screened."""

    cause: Candidate
    screened: Screened


def can_be_scanned(cause):
    """Whether a cause acts at a node, with a force whose shape is to be found."""
    return bool(cause.shape) and not cause.variant and "node" in cause.where and not cause.term.acts_on_output


def motion_by_a_free_force(fitted: Fit, spectrum: Spectrum, node: int, near: Near | None = None) -> Motion:
    """The Motion of a fitted model with the force at one node, free at every harmonic and speed, that explains most.

    Parameters
    ----------
    fitted : Fit
    spectrum : Spectrum
    node : int
    near : Near, optional
        Of the fitted model at the speeds and harmonics of the spectrum, where it is known.

    Returns
    -------
    Motion
    """
    near = near or Near(fitted.model, spectrum.speed, spectrum.harmonics, fitted.theta, order=carried_order(spectrum))
    place = positions(spectrum.harmonics, near.blocks)
    moved = near.replies(fitted.model.structure.index(node))[..., [2 * i + part for part in (0, 1) for i in place]]
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
        One for each effect and place; those at a node whose effect has shape options are considered.
    refined : int
        Most places of each effect, those where coarse shapes explain most.

    Returns
    -------
    list of Scanned
        Without those whose plugin fails, which is recorded as broken.
    """
    projection, motions, looked = Projection(fitted, work.spectrum), {}, {}
    for cause in filter(can_be_scanned, chosen):
        node = cause.where["node"]
        try:
            if node not in motions:
                motions[node] = motion_by_a_free_force(fitted, work.spectrum, node, projection.near)
            one = _Scan(work, projection, cause, motions[node])
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
    """The scan of one cause at one motion."""

    work: Search
    projection: Projection
    cause: Candidate
    motion: Motion

    @property
    def ranges(self):
        return shape_ranges(self.cause.effect, self.work.rig.structure)

    def with_place(self, place, label):
        """The cause with the shape at a position (option,)."""
        shape = {name: ends.value(x) for (name, ends), x in zip(self.ranges.items(), place, strict=True)}
        labelled = self.cause._replace(term=replace(self.cause.term, label=label))
        return with_shape(self.work.rig, labelled, shape, self.work.settings.prior_width)

    def judged(self, places):
        """Some positions (shape, option), judged, the best first."""
        label = self.cause.term.label
        chosen = [self.with_place(place, f"{label} {i}") for i, place in enumerate(places)]
        projected = self.projection.of(chosen, self.motion)
        found = map(_Judged, places, chosen, screen_each(projected, chosen))
        return sorted(found, key=lambda one: -one.screened.evidence)

    def first(self):
        """The best of shapes over the whole range."""
        from scipy.stats import qmc

        options = len(self.ranges)
        return self.judged(qmc.Sobol(options, scramble=False).random(FIRST_SAMPLES[options]))[:STARTS]

    def refined(self, starts):
        """Scanned, from rounds of ever closer shapes about the best ones, of which the very best remains."""
        random = np.random.default_rng(0)  # the same numbers for the same records
        for spread in SPREADS:
            count = SAMPLES * len(self.ranges) // len(starts)
            about = [one.place + spread * random.standard_normal((count, len(self.ranges))) for one in starts]
            closer = self.judged(np.concatenate(about))
            kept = 1 if spread == SPREADS[-1] else max(len(starts) - 1, 1)
            starts = sorted([*starts, *closer], key=lambda one: -one.screened.evidence)[:kept]
        (best,) = starts
        return Scanned(self.with_place(best.place, self.cause.term.label), best.screened)
