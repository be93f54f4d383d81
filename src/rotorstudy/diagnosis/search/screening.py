"""Candidates judged by linearised columns: how much of a residual each explains alone, and each pair together.

The columns of all candidates are computed at once, at the motion of a fit, and the free parameters of that fit are
projected out with their priors. Causes of the fit can be taken out first: what they explain is added to the residual to
first order. As an effect is affine in its amplitude at a given motion, that comparison of other causes with those taken
out is exact where the fit describes the motion, however large they are.
"""

import logging
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import log_possible, log_scales
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.harmonic import positions
from rotorstudy.response.neighbourhood import Motion, Neighbourhood

log = logging.getLogger(__name__)

TIE = 6  # decimals of evidence that count: round-off must not rank equal candidates (an open crack has two sides)


class Screened(NamedTuple):
    """A candidate, or some together, judged by linearised columns."""

    explained: float  # decrease of the cost if it alone is added and the free parameters are fitted again
    evidence: float  # logarithm of its Bayes factor against the model without it
    start: np.ndarray  # (unknown,) its amplitudes there
    detection: np.ndarray  # (unknown,) standard deviation of each amplitude if it alone is fitted


class Projected(NamedTuple):
    """Residual (component,) and columns (component, unknown) by name, free of what the base parameters can explain."""

    residual: np.ndarray
    columns: dict[str, np.ndarray]
    theta: dict[str, float]  # value of every parameter of the fit, without the causes taken out


class Projection:
    """The free parameters of a fit projected out of columns, with their priors.

    without : amplitudes of the fit that are taken out
    free    : more columns (component + parameter,) that are projected out: those of the shapes of other causes, as
              `left` returns them
    answers : whether what is taken out still answers to what acts in its place; false where that acts elsewhere
    """

    def __init__(self, fitted: Fit, spectrum: Spectrum, without=(), free: Sequence = (), *, answers: bool = True):
        self.fitted, self.spectrum = fitted, spectrum
        speed, harmonics = tuple(spectrum.speed.tolist()), tuple(spectrum.harmonics.tolist())
        self.near = _near(fitted, speed, harmonics, carried_order(spectrum), () if answers else without)
        model, values, kept = fitted.model, fitted.values, np.flatnonzero(~np.isin(fitted.names, without))
        on_rotor, on_output = (
            [u for u in some if u.name in without] for some in (model.rotor_unknowns, model.output_unknowns)
        )
        self.gone = on_rotor, [values[u.name] for u in on_rotor]
        taken_out = [*self.gone[1], *(values[u.name] for u in on_output)]
        residual = fitted.residual + self._shown([(on_rotor, None)], [(on_output, None)]) @ taken_out
        whitener = fitted.prior.whitener[np.ix_(kept, kept)]  # causes are independent of the base and of each other
        known = np.vstack([self._at_the_motion(on_rotor)[:, kept], whitener])
        self.rows = len(whitener)
        known = np.column_stack([known, *(column for column in free if np.any(column))])
        self.basis, _ = np.linalg.qr(known / np.linalg.norm(known, axis=0))
        self.residual = self._left(np.concatenate([residual, whitener @ (fitted.prior.mean - fitted.free)[kept]]))
        self.theta = {name: value for name, value in values.items() if name not in without}

    def _at_the_motion(self, gone):
        """The Jacobian (component, parameter) of the fit at its motion, which stays, whatever is taken out.

        That of a fit is of a motion that follows, also by the slope of forces in time. Where these are taken out, all
        but the numbers of rig and bearings has the columns that it would have as a candidate.

        gone : unknowns on the rotor that are taken out
        """
        names, terms = list(self.fitted.names), self.fitted.model.terms
        terms = [t for t in terms if not (t.acts_on_output or t.variation or t.is_bearing_number)]
        own = [u for term in terms for u in term.unknowns if u.name in names]
        if not own or not any(u.force for u in gone):
            return self.fitted.jacobian
        found = self.fitted.jacobian.copy()
        found[:, [names.index(u.name) for u in own]] = self._shown([(own, None)], [([], None)])
        return found

    def left(self, columns: np.ndarray) -> np.ndarray:
        """What is left of columns (component, column) of the data."""
        return self._left(np.vstack([columns, np.zeros((self.rows, columns.shape[1]))]))

    def _left(self, columns):
        return columns - self.basis @ (self.basis.T @ columns)

    def motions_elsewhere(self, rows: Sequence[np.ndarray]) -> list[Motion]:
        """The Motions if what is taken out, which acts on one coordinate, acted on others by what shows as much.

        An element turns by the kink of a crack in it, those beside it do not: where a crack in either shows the same,
        the motions on which they act differ.

        rows : (dof,) each, as of `motions_by_free_forces`
        """
        near, force = self.near, self.near.force_of(*self.gone)
        own = force[..., np.argmax(np.linalg.norm(force, axis=(0, 1))), None]
        gone, *moved = near.moved_by(np.stack([force, *(own * row for row in rows)]))
        seen = near.model.seen(np.array([gone, *moved]))[:, :, positions(near.harmonics, near.blocks)]
        seen, *each = self.spectrum.whitened(seen)
        sizes = [seen @ one / max(one @ one, np.finfo(float).tiny) for one in each]
        still, there = near.motion, zip(sizes, moved, strict=True)
        return [Motion(still.amplitude - gone + size * one, still.deflection) for size, one in there]

    def of(self, chosen: list[Candidate]) -> Projected:
        """The columns of candidates at the motion of the fit, projected; NoSteadyState if it has none."""
        return self.of_groups([(chosen, None)])

    def of_groups(self, groups: list[tuple[list[Candidate], Motion | None]]) -> Projected:
        """The columns of groups of candidates, each at a motion of its own; see `of`."""
        log.debug("comparing causes such as %s", groups[0][0][0].cause if groups and groups[0][0] else "none")
        on_rotor, on_output = [], []
        for chosen, at in groups:
            for own, some in ((on_rotor, False), (on_output, True)):
                own.append(([u for c in chosen if c.term.acts_on_output == some for u in c.term.unknowns], at))
        names = [u.name for unknowns, _ in (*on_rotor, *on_output) for u in unknowns]
        columns = self.left(self._shown(on_rotor, on_output))
        return Projected(self.residual, dict(zip(names, columns.T, strict=True)), self.theta)

    def _shown(self, on_rotor, on_output):
        """Whitened columns (component, unknown) of groups of unknowns on the rotor and of the measuring chain."""
        columns = [self.near.changes_by_forces(on_rotor), self.near.changes_by_output(on_output)]
        return self.spectrum.whitened(np.moveaxis(np.concatenate(columns, axis=-1), -1, 0)).T


@lru_cache(maxsize=1)  # it holds the receptances that all candidates at a fit share
def _near(fitted, speed, harmonics, order, without):
    """The Neighbourhood of a Fit at the speeds and harmonics of a spectrum; at its motion without some amplitudes."""
    near = Neighbourhood(fitted.model, speed, harmonics, fitted.theta, order=order)
    if without:
        there = near.motion
        theta = np.where(np.isin(fitted.model.names, without), 0.0, fitted.theta)
        near = Neighbourhood(fitted.model, speed, harmonics, theta, order=order)
        near.motion = there
    return near


def screen(projected: Projected, *causes: Candidate) -> Screened:
    """Judge a candidate, or several together, by their columns."""
    return _screen_alike(projected, [causes])[0]


def screen_each(
    projected: Projected, causes: Sequence[Candidate], beside: tuple[Candidate, ...] = (), least: float = -np.inf
) -> list[Screened]:
    """Judge candidates by their columns, each alone or together with some others, whose amplitudes come first.

    least : evidence that matters; that of a candidate that cannot reach it is not known, and minus infinity
    """
    alike, found = {}, {}
    for i, cause in enumerate(causes):
        varied = [(tuple(amplitudes), tuple(scales)) for amplitudes, _, scales in cause.widths]
        alike.setdefault((cause.fixed, *cause.parameter.tolist(), *varied), []).append(i)
    for chosen in alike.values():
        found |= zip(chosen, _screen_alike(projected, [[*beside, causes[i]] for i in chosen], least), strict=True)
    return [found[i] for i in range(len(causes))]


def inverted(precision):
    """Inverse and log determinant of I + A^T A (..., unknown, unknown), also if I is lost beside A.

    No eigenvalue is below one; where round-off makes one so, as of dependent columns, it counts as one.
    """
    log_determinant = np.linalg.slogdet(precision)[1]
    if np.all(log_determinant >= 0):
        try:
            return np.linalg.inv(precision), log_determinant
        except np.linalg.LinAlgError:
            pass
    values, vectors = np.linalg.eigh(precision)
    values = np.maximum(values, 1)
    return (vectors / values[..., None, :]) @ np.swapaxes(vectors, -1, -2), np.log(values).sum(axis=-1)


def _screen_alike(projected, sets, least=-np.inf):
    """Screened of each of some sets of candidates whose parameters have the same numbers of amplitudes.

    Arrays begin with (set,). No narrower prior has an evidence above half of what is explained, and what is known to
    be positive doubles it at most; below `least` it is not computed.
    """
    columns = np.array([[projected.columns[n] for c in causes for n in c.names] for causes in sets])
    mean, std = np.moveaxis(np.array([[c.prior[n] for c in causes for n in c.names] for causes in sets]), -1, 0)
    residual = projected.residual
    left = residual - (mean[:, None] @ columns)[:, 0]
    scaled = columns * std[..., None]
    covariance, narrowed = inverted(np.eye(std.shape[-1]) + scaled @ np.swapaxes(scaled, -1, -2))
    off = (covariance @ (scaled @ left[..., None]))[..., 0]  # in standard deviations of the prior
    cost = np.sum((left - (off[:, None] @ scaled)[:, 0]) ** 2, axis=-1) + np.sum(off**2, axis=-1)
    explained = residual @ residual - cost
    start, detection = mean + std * off, std / np.sqrt(1 + np.sum(scaled**2, axis=-1))
    of_signs, limits = _log_of_signs(projected, sets, mean, std, start, covariance)
    evidence, first = 0.5 * (explained - narrowed) + of_signs, 0
    matter = 0.5 * explained + np.log(2) * limits >= least
    for cause in sets[0]:
        for amplitudes, parameter, scales in cause.widths:
            own = first + amplitudes
            within = covariance[np.ix_(matter, own, own)]
            evidence[matter] += log_scales(off[np.ix_(matter, own)], within, parameter, scales)
        first += len(cause.names)
    evidence = np.where(matter, np.round(evidence, TIE), -np.inf)
    return [Screened(*one) for one in zip(explained.tolist(), evidence.tolist(), start, detection, strict=True)]


def _log_of_signs(projected, sets, mean, std, start, covariance):
    """Log Bayes factor (set,) of amplitudes that cannot be negative, as `log_possible`, and how many each set has.

    mean, std  : (set, unknown) of the prior
    start      : (set, unknown) of the posterior;  covariance : of that, in standard deviations of the prior
    """
    each, found = [], np.zeros(len(sets))
    for s, causes in enumerate(sets):
        names = [name for cause in causes for name in cause.names]
        for name, same in ((name, same) for cause in causes for name, same in cause.positive.items()):
            weight = [same.get(other, float(other == name)) for other in names]
            of_fit = sum(factor * projected.theta.get(other, 0.0) for other, factor in same.items())
            each.append((s, names.index(name), weight, of_fit))
    if each:
        s, i, weight, of_fit = (np.array(part) for part in zip(*each, strict=True))
        scaled = weight * std[s]
        variance = np.einsum("li,lij,lj->l", scaled, covariance[s], scaled)
        spread = np.sqrt(np.maximum(variance, np.finfo(float).eps * np.sum(scaled**2, axis=-1)))  # round-off
        stated, total = (np.sum(weight * sizes[s], axis=-1) + of_fit for sizes in (mean, start))
        np.add.at(found, s, log_possible(total, spread, stated / std[s, i]))
    return found, np.bincount([s for s, *_ in each], minlength=len(sets))
