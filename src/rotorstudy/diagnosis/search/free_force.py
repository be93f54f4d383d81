"""A fault that the library lacks: a force at one place of the rotor, of any law.

Whatever a fault is, it acts by a force. If it acts at one place, the motion at all probes follows from that force by
the receptances of the rotor. The force is complex, free at every harmonic, and over the speeds as smooth as the error
of a form (`form.SHARES`); its size at each harmonic is the most probable one. Its many amplitudes cost it as much
evidence as the data narrow them, so that it is as likely as a cause of the library only where that leaves much more.
"""

from contextlib import suppress
from functools import partial
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import SCALES
from rotorstudy.diagnosis.search.form import SHARES, over_speeds
from rotorstudy.diagnosis.search.places import places_of
from rotorstudy.diagnosis.search.shown_forces import free_force_columns
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.prediction import neighbourhood
from rotorstudy.inference.prior import Prior
from rotorstudy.model.entries import Entry
from rotorstudy.model.terms import Parameter, Term

PRIOR = 0.1  # odds of a fault that the library lacks against one that it has, before anything is measured
REFITTED = 3  # places, the best ones, of which the values of the rig are fitted again with the force
AGAIN = 2  # how often
BY_SHARES = 10.0  # log evidence for each datum that other shares may add: no amplitude is narrowed by more than e^10
UPDATES = 30  # of the size at each harmonic
COPIES, MOST_BYTES = 10, 4e9  # of the columns of an error of form at once, and what they may take
SETTLED = 1e-3  # relative change of all sizes
ABSENT = 0.01  # well determined amplitudes of a harmonic, below which no force acts there

EXCHANGES = 4  # searches for one of two places beside the other, at most
FREE_FORCE = "force at one place"  # name of its amplitude in a Fit
OTHER_FORCE = "force at another place"  # of the second one, beside it


class FreeForce(NamedTuple):
    """A force at a place."""

    where: dict  # {kind of place: its number}
    motion: str  # kind of force
    log_odds: float  # that it and nothing else acts, against no fault
    left: float  # misfit with the most probable force
    fitted: Fit | None = None  # of the rig with it, of the amplitude `FREE_FORCE`; None but at the best places
    force: np.ndarray | None = None  # (row, speed, harmonic), N, of that fit


class _Background(NamedTuple):
    """What explains data without a force: parameters of a linearised fit, errors that all data have in common.

    Speeds are independent given its amplitudes, which are independent and of unit variance.
    """

    data: np.ndarray  # (speed, component) measured, less predicted at the mean of the prior; whitened
    columns: np.ndarray  # (component, amplitude)
    prior: Prior  # of the parameters, of which the first amplitudes are

    def beside(self, errors):
        """The same beside what has columns (component, amplitude) of unit variance, such as a second force."""
        return self._replace(columns=np.hstack([self.columns, errors]))


class _Posterior(NamedTuple):
    """The most probable force at a place, and what follows from it."""

    evidence: float
    shares: tuple  # of `SHARES`
    force: np.ndarray  # (row, speed, harmonic), N
    free: np.ndarray  # (parameter,) values of the rig with it
    left: float  # misfit with it
    columns: np.ndarray  # (speed, component, part) what sensors show of each real part of the force, per newton
    modes: np.ndarray  # (mode, speed) functions of the speed of which it consists, see `form.over_speeds`
    std: np.ndarray  # (part,) its standard deviation, N

    def errors(self):
        """Columns (component, amplitude) of the force by independent amplitudes of unit variance."""
        by_mode = self.modes.T[:, None, :, None] * (self.columns * self.std)[:, :, None]
        return by_mode.reshape(self.columns.shape[0] * self.columns.shape[1], -1)


def free_forces(work) -> list[FreeForce]:
    """A force at every place of the rotor, the most likely one first; none without a steady state.

    work : Search with its base fit
    """
    spectrum, rows_of, fits = work.spectrum, dict(places_of(work.rig.structure)), {}
    _check_memory(spectrum)
    stated = fit(work.model, spectrum, work.prior, steps=0)
    try:
        shown_by, rig = _shown_by(stated, spectrum), _background(stated, spectrum)
        # first by the least smooth shares, which any force can follow; by all of them where that may matter
        known = {place: _posterior(rig, spectrum, shown_by(rows), SHARES[-1:]) for place, rows in rows_of.items()}
        least = max(at.evidence for at in known.values()) - BY_SHARES * spectrum.data_count
        for place in (place for place in known if known[place].evidence > least):
            known[place] = _posterior(rig, spectrum, shown_by(rows_of[place]))
    except NoSteadyState:
        return []
    for place in sorted(known, key=lambda place: -known[place].evidence)[:REFITTED]:
        known[place], fits[place] = _refitted(work, rows_of[place], known[place])
    prior = np.log(PRIOR / len(rows_of)) - work.base.evidence
    found = [
        FreeForce({place[0]: place[1]}, place[2], at.evidence + prior, at.left, *fits.get(place, ()))
        for place, at in known.items()
    ]
    return sorted(found, key=lambda one: -one.log_odds)


def _refitted(work, rows, at):
    """The _Posterior about fits with its own force, as long as that raises it; the last Fit and the force in it."""
    last = ()
    with suppress(NoSteadyState):
        for _ in range(AGAIN):
            fitted = _with_forces(work, at.free, {FREE_FORCE: (rows, at.force)})
            last = fitted, at.force
            columns = _shown_by(fitted, work.spectrum)(rows)
            again = _posterior(_background(fitted, work.spectrum, [(columns, at.force)]), work.spectrum, columns)
            if again.evidence <= at.evidence:
                break
            at = again
    return at, last


def two_forces(work) -> list[tuple[Fit, np.ndarray]]:
    """The forces at two places that explain most together: for each a Fit with both, in which it is FREE_FORCE.

    Beside each Fit the columns (component, amplitude) of the other force, which is free. Nothing where no fit has a
    free force, or on a rotor with one place.

    raises : NoSteadyState
    """
    spectrum, rows, best = work.spectrum, dict(places_of(work.rig.structure)), None
    first = next((one for one in work.free_forces if one.fitted is not None), None)
    if first is None or len(rows) < 2:
        return []
    pair, shares = _two_places(spectrum, rows, first)
    one, other = pair
    for _ in range(1 + AGAIN):
        forces = {place: (rows[place], at.force) for place, at in pair.items()}
        fitted = _with_forces(work, pair[other].free, {FREE_FORCE: forces[one], OTHER_FORCE: forces[other]})
        if best and fitted.cost >= best[0].cost:  # from values that the linearised model puts too far
            break
        best = fitted, pair.copy()
        shown_by = _shown_by(fitted, spectrum)
        columns = {place: shown_by(rows[place]) for place in pair}
        rig = _background(fitted, spectrum, [(columns[place], at.force) for place, at in pair.items()])
        for place, beside in ((one, other), (other, one)):
            pair[place] = _posterior(rig.beside(pair[beside].errors()), spectrum, columns[place], shares)
    fitted, pair = best
    forces = {FREE_FORCE: (rows[other], pair[other].force), OTHER_FORCE: (rows[one], pair[one].force)}
    exchanged = _with_forces(work, pair[other].free, forces)
    return [
        (found, spectrum.whitened_by_common(pair[place].errors().T).T)
        for found, place in ((fitted, other), (exchanged, one))
    ]


def _two_places(spectrum, rows, first):
    """The two places whose forces explain most together, each with its _Posterior beside the other; and the shares.

    From the FreeForce that explains most alone, one place after the other is sought beside the one that was found.
    """
    ((kind, number),) = first.where.items()
    kept, before, shown_by = (kind, number, first.motion), None, _shown_by(first.fitted, spectrum)
    columns = shown_by(rows[kept])
    rig = _background(first.fitted, spectrum, [(columns, first.force)])
    at = _posterior(rig, spectrum, columns)
    shares = [at.shares]
    for _ in range(EXCHANGES):
        beside = rig.beside(at.errors())
        found = {place: _posterior(beside, spectrum, shown_by(rows[place]), shares) for place in rows if place != kept}
        other = max(found, key=lambda place: found[place].evidence)
        if other == before:
            break
        before, kept, at = kept, other, found[other]
    return {kept: at, before: _posterior(rig.beside(at.errors()), spectrum, shown_by(rows[before]), shares)}, shares


def _shown_by(fitted, spectrum):
    """Function of rows: what sensors show of forces there at the motion of a fit, as `_Posterior.columns`."""
    near, apart = neighbourhood(fitted.model, spectrum, fitted.theta), spectrum.without_common_error()

    def shown(rows):
        columns = np.moveaxis(free_force_columns(near, apart, rows), 0, 2)  # (speed, component, row, part of one)
        return columns.reshape(*columns.shape[:2], -1)

    return shown


def _background(fitted, spectrum, forces=()):
    """The _Background by a Fit; forces : (columns, force (row, speed, harmonic)) of each that it has, taken out."""
    common = np.zeros((spectrum.data_count, 0))
    if spectrum.common_error is not None:
        apart = spectrum.without_common_error()
        fitted = fit(fitted.model, apart, fitted.prior, start=fitted.theta, steps=0)
        common = apart.whitened(spectrum.common_error).T
    own = [i for i, name in enumerate(fitted.names) if name not in (FREE_FORCE, OTHER_FORCE)]
    prior, jacobian = fitted.prior.part([fitted.names[i] for i in own]), fitted.jacobian[:, own]
    data = (fitted.residual + jacobian @ (fitted.free[own] - prior.mean)).reshape(len(spectrum.speed), -1)
    for columns, force in forces:
        parts = np.swapaxes(np.concatenate([force.real, force.imag], axis=2), 0, 1).reshape(len(data), -1)
        data = data + (columns @ parts[..., None])[..., 0]
    return _Background(data, np.hstack([jacobian @ prior.factor, common]), prior)


def _check_memory(spectrum):
    """RotorstudyError if the errors of form of all speeds and harmonics would not fit into memory."""
    modes, orders = len(over_speeds(spectrum.speed, SHARES[-1])), len(np.unique(np.abs(spectrum.harmonics)))
    needed = COPIES * 8 * spectrum.data_count * modes * orders
    if needed > MOST_BYTES:
        raise RotorstudyError(
            f"{len(spectrum.speed)} speeds, {len(spectrum.harmonics)} harmonics and {len(spectrum.sensors)} nodes need "
            f"{needed / 1e9:.0f} GB of memory, at most {MOST_BYTES / 1e9:g} are used; give fewer speeds, or fewer "
            "harmonics ('measurement: harmonics:')"
        )


def _posterior(rig: _Background, spectrum, columns, every=SHARES) -> _Posterior:
    """The _Posterior of a force with columns (speed, component, part), by those of some shares that explain most."""
    speeds, harmonics = len(columns), len(spectrum.harmonics)
    others = rig.columns.reshape(*rig.data.shape, rig.columns.shape[1])
    # products of each speed alone, so that time is linear in their number
    by_part, known = np.swapaxes(columns, 1, 2), np.concatenate([rig.data[..., None], others], axis=-1)
    of_parts, on_known = by_part @ columns, by_part @ known
    of_known = np.tensordot(known, known, ((0, 1), (0, 1)))
    normal = np.eye(others.shape[-1]) + of_known[1:, 1:]  # of the amplitudes of the background

    def products(modes):
        """Products of data and amplitudes (mode, part), the data first, with the background marginalised."""
        on_amplitudes = np.tensordot(modes, on_known, 1).reshape(-1, len(of_known))
        of_amplitudes = np.tensordot(modes[:, None] * modes, of_parts, 1).swapaxes(1, 2).reshape(len(on_amplitudes), -1)
        gram = np.block([[of_known[:1, :1], on_amplitudes[:, :1].T], [on_amplitudes[:, :1], of_amplitudes]])
        on_others = np.vstack([of_known[:1, 1:], on_amplitudes[:, 1:]])
        gram -= on_others @ np.linalg.solve(normal, on_others.T)
        return gram

    def with_shares(shares):
        modes = over_speeds(spectrum.speed, shares)
        gram = products(modes)
        by_harmonic = np.arange(len(gram) - 1) % harmonics
        sizes = _sizes(gram, by_harmonic, harmonics)
        std = sizes[by_harmonic]
        pull, precision = std * gram[1:, 0], np.eye(len(std)) + std[:, None] * gram[1:, 1:] * std
        amplitude = np.linalg.solve(precision, pull)
        narrowed = np.linalg.slogdet(precision)[1] + np.linalg.slogdet(normal)[1]
        evidence = 0.5 * (pull @ amplitude - gram[0, 0] - narrowed)
        # of data whitened by the common errors too, as the evidence of a Fit is
        evidence += _log_prior(sizes, gram, by_harmonic) - np.log(len(SHARES)) + spectrum.log_common_volume / 2
        parts = modes.T @ (std * amplitude).reshape(len(modes), -1)  # (speed, part)
        off = (rig.data - (columns @ parts[..., None])[..., 0]).ravel()
        found = np.linalg.solve(normal, rig.columns.T @ off)
        own, rest = np.split(found, [len(rig.prior.mean)])
        off -= rig.columns @ found
        real, imaginary = np.moveaxis(parts.reshape(speeds, -1, 2, harmonics), 2, 0).swapaxes(1, 2)
        force, free = real + 1j * imaginary, rig.prior.mean + rig.prior.factor @ own
        left = float(off @ off + rest @ rest)
        return _Posterior(evidence, shares, force, free, left, columns, modes, std[: columns.shape[-1]])

    return max(map(with_shares, every), key=lambda one: one.evidence)


def _sizes(gram, by_harmonic, harmonics):
    """Most probable standard deviation (harmonic,) of a force at each harmonic, by MacKay's fixed-point iteration."""
    from scipy.linalg.lapack import dpotrf, dpotri, dpotrs  # of a positive definite matrix, in half the time

    product, normal = gram[1:, 0], gram[1:, 1:]
    counts = np.bincount(by_harmonic, minlength=harmonics)
    gains = np.bincount(by_harmonic, np.diag(normal), harmonics)
    first = np.bincount(by_harmonic, product**2, harmonics) / np.maximum(gains, np.finfo(float).tiny)
    variance = first / np.maximum(gains / counts, np.finfo(float).tiny) / counts
    for _ in range(UPDATES):
        here = variance[by_harmonic] > 0
        if not here.any():
            break
        size, at = np.sqrt(variance[by_harmonic[here]]), by_harmonic[here]
        factor, _ = dpotrf(np.eye(len(size)) + size[:, None] * normal[np.ix_(here, here)] * size, lower=1)
        mean, _ = dpotrs(factor, size * product[here], lower=1)
        known = np.bincount(at, 1 - np.diag(dpotri(factor, lower=1)[0]), harmonics)  # well determined amplitudes
        power = np.bincount(at, mean**2, harmonics)
        before, variance = variance, np.where(known > ABSENT, variance * power / np.maximum(known, ABSENT), 0.0)
        if np.abs(variance - before).max() <= SETTLED * variance.max(initial=0.0):
            break
    return np.sqrt(variance)


def _log_prior(sizes, gram, by_harmonic):
    """Logarithm of the prior of sizes (harmonic,): as likely as not absent, else one of `SCALES` of the largest.

    So are the harmonics of a cause of the library. One that is absent counts with those too small to be seen.
    """
    counts = np.bincount(by_harmonic)
    gains = np.bincount(by_harmonic, np.diag(gram)[1:]) / counts
    hidden = np.mean((1 + (sizes.max() * SCALES[:, None]) ** 2 * gains) ** (-counts / 2), axis=0)
    return float(np.sum(np.where(sizes > 0, -np.log(2 * len(SCALES)), np.log((1 + hidden) / 2))))


def _with_forces(work, free: np.ndarray, forces: dict) -> Fit:
    """The base model at values (parameter,), with forces name -> (rows, force (row, speed, harmonic)), as a Fit."""
    terms, spectrum = [], work.spectrum
    for name, (rows, force) in forces.items():
        entries = tuple(
            Entry(row, on="one", shift=int(n), gain=partial(np.interp, xp=spectrum.speed, fp=own[:, h]))
            for row, own in zip(rows, force, strict=True)
            for h, n in enumerate(spectrum.harmonics)
        )
        terms.append(Term("force", (Parameter(name, "1", entries, 1.0),), {name: 1.0}))
    model = work.model.plus(*terms)
    prior = work.prior.plus(Prior.independent(dict.fromkeys(forces, (1.0, 1.0))))
    return fit(model, spectrum, prior, start=model.filled(work.prior.names, free), steps=0)
