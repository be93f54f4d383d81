"""A fault that the library lacks: a force at one place of the rotor, of any law.

Whatever a fault is, it acts by a force. If it acts at one place, the motion at all probes follows from that force by
the receptances of the rotor. The force is complex, free at every harmonic, and over the speeds as smooth as the error
of a form (`form.SHARES`); its size at each harmonic is the most probable one. Its many amplitudes cost it as much
evidence as the data narrow them, so that it is as likely as a cause of the library only where that leaves much more.
"""

from collections.abc import Callable
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
    count: int  # of data
    fitted: Fit | None = None  # of the rig with it, of the amplitude `FREE_FORCE`; None but at the best places
    force: np.ndarray | None = None  # (row, speed, harmonic), N, of that fit


class _Posterior(NamedTuple):
    """The most probable force (row, speed, harmonic), N, and values of the rig (parameter,), of a linearised model."""

    evidence: float
    force: np.ndarray
    free: np.ndarray
    left: float
    shares: tuple  # of `SHARES`
    errors: Callable  # () -> columns (component, amplitude) of the force by independent amplitudes of unit variance


def free_forces(work) -> list[FreeForce]:
    """A force at every place of the rotor, the most likely one first; none without a steady state.

    work : Search with its base fit
    """
    spectrum = work.spectrum
    _check_memory(spectrum)
    rows_of, stated = dict(places_of(work.rig.structure)), fit(work.model, spectrum, work.prior, steps=0)
    fits = {}
    try:
        shown_by, rig = _shown_by(stated, spectrum), _linearised(stated, spectrum)
        # first by the least smooth shares, which any force can follow; by all of them where that may matter
        known = {one: _posterior(rig, spectrum, shown_by(rows), every=SHARES[-1:]) for one, rows in rows_of.items()}
        least = max(one.evidence for one in known.values()) - BY_SHARES * spectrum.data_count
        for one in (one for one in known if known[one].evidence > least):
            known[one] = _posterior(rig, spectrum, shown_by(rows_of[one]))
    except NoSteadyState:
        return []
    for one in sorted(known, key=lambda one: -known[one].evidence)[:REFITTED]:
        for _ in range(AGAIN):
            try:
                force = known[one].force
                fitted = _with_forces(work, known[one].free, {FREE_FORCE: (rows_of[one], force)})
                fits[one] = fitted, force
                columns = _shown_by(fitted, spectrum)(rows_of[one])
                again = _posterior(_linearised(fitted, spectrum), spectrum, columns, [(columns, force)])
            except NoSteadyState:
                break
            if again.evidence <= known[one].evidence:
                break
            known[one] = again
    prior, base = np.log(PRIOR / len(rows_of)), work.base.evidence
    found, count = [], spectrum.data_count
    for one, at in known.items():
        kind, number, motion = one
        odds = at.evidence - base + prior
        found.append(FreeForce({kind: number}, motion, odds, at.left, count, *fits.get(one, ())))
    return sorted(found, key=lambda one: -one.log_odds)


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
        shown_by, rig = _shown_by(fitted, spectrum), _linearised(fitted, spectrum)
        columns = {place: shown_by(rows[place]) for place in pair}
        added = [(columns[place], pair[place].force) for place in pair]
        for place, beside in ((one, other), (other, one)):
            pair[place] = _posterior(rig, spectrum, columns[place], added, pair[beside].errors(), shares)
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
    kept, fitted, before = (kind, number, first.motion), first.fitted, None
    shown_by, rig = _shown_by(fitted, spectrum), _linearised(fitted, spectrum)
    columns = shown_by(rows[kept])
    added = [(columns, first.force)]
    at = _posterior(rig, spectrum, columns, added)
    shares = [at.shares]

    def beside(place, errors):
        return _posterior(rig, spectrum, shown_by(rows[place]), added, errors, shares)

    for _ in range(EXCHANGES):
        errors = at.errors()
        found = {place: beside(place, errors) for place in rows if place != kept}
        other = max(found, key=lambda place: found[place].evidence)
        if other == before:
            break
        before, kept, at = kept, other, found[other]
    return {kept: at, before: beside(before, at.errors())}, shares


def _shown_by(fitted, spectrum):
    """Function of rows: what sensors show of forces there, at the motion of a fit, as `free_force_columns`."""
    near = neighbourhood(fitted.model, spectrum, fitted.theta)
    return partial(free_force_columns, near, spectrum.without_common_error())


class _Linearised(NamedTuple):
    """A Fit to a spectrum without its common errors, whose speeds are then independent."""

    fitted: Fit
    common: np.ndarray  # (component, error) what these errors change


def _linearised(fitted, spectrum):
    """The _Linearised model of a Fit."""
    if spectrum.common_error is None:
        return _Linearised(fitted, np.zeros((spectrum.data_count, 0)))
    apart = spectrum.without_common_error()
    fitted = fit(fitted.model, apart, fitted.prior, start=fitted.theta, steps=0)
    return _Linearised(fitted, apart.whitened(spectrum.common_error).T)


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


def _posterior(rig: _Linearised, spectrum, columns, forces=(), beside=None, every=SHARES) -> _Posterior:
    """The _Posterior about a Fit of the rig.

    columns : (row, speed, component, part and harmonic) of `free_force_columns`
    forces  : (columns, force (row, speed, harmonic)) of each force of the fit, which are taken out
    beside  : columns (component, amplitude), of unit variance, of what else may act
    every   : shares that are tried
    """
    fitted = rig.fitted
    rows, speeds, parts, harmonics = len(columns), columns.shape[1], 2, len(spectrum.harmonics)
    columns = columns.reshape(rows, speeds, -1, parts, harmonics).transpose(1, 2, 0, 3, 4)
    columns = columns.reshape(speeds, -1, rows * parts * harmonics)  # speed, component, (row part harmonic)
    own = np.array([name not in (FREE_FORCE, OTHER_FORCE) for name in fitted.names], bool)
    jacobian, free = fitted.jacobian[:, own], fitted.free[own]
    mean, whitener = fitted.prior.mean[own], fitted.prior.whitener[np.ix_(own, own)]
    data = (fitted.residual + jacobian @ (free - mean)).reshape(speeds, -1)
    for shown, force in forces:
        data = data + np.einsum("rscp,rsp->sc", shown, np.concatenate([force.real, force.imag], axis=2))
    scaled = np.linalg.solve(whitener.T, jacobian.T).T  # by parameters of unit variance
    scaled = np.hstack([scaled, rig.common] if beside is None else [scaled, rig.common, beside])
    inner = np.eye(scaled.shape[1]) + scaled.T @ scaled
    turned = columns.transpose(0, 2, 1)
    within = (turned @ columns).reshape(speeds, -1)  # of each speed alone, so that time is linear in their number
    on_data, on_rig = (
        (turned @ data[..., None])[..., 0],
        (turned @ scaled.reshape(speeds, len(scaled) // speeds, -1)),
    )
    best = None
    for shares in every:
        modes = over_speeds(spectrum.speed, shares)  # (mode, speed)
        count = len(modes) * columns.shape[-1]  # of amplitudes (mode row part harmonic)
        by_harmonic = np.arange(count) % harmonics
        pairs = (modes[:, None] * modes).reshape(-1, speeds) @ within
        pairs = pairs.reshape(len(modes), len(modes), columns.shape[-1], -1).swapaxes(1, 2).reshape(count, count)
        on_modes = (modes @ on_data).reshape(1, count)
        along = np.column_stack([scaled.T @ data.ravel(), np.tensordot(modes, on_rig, 1).reshape(count, -1).T])
        gram = np.block([[np.atleast_2d(np.sum(data**2)), on_modes], [on_modes.T, pairs]])
        gram -= along.T @ np.linalg.solve(inner, along)
        sizes = _sizes(gram, by_harmonic, harmonics)
        size = sizes[by_harmonic]
        precision = np.eye(len(size)) + size[:, None] * gram[1:, 1:] * size
        found = np.linalg.solve(precision, size * gram[1:, 0])
        log_scale = _log_prior(sizes, gram, by_harmonic) - np.log(len(SHARES))
        explained = (size * gram[1:, 0]) @ found
        evidence = 0.5 * (explained - gram[0, 0] - np.linalg.slogdet(precision)[1] - np.linalg.slogdet(inner)[1])
        if best is None or evidence + log_scale > best.evidence:
            moved = modes.T @ (size * found).reshape(len(modes), -1)  # speed, (row part harmonic)
            off = (data - (columns @ moved[..., None])[..., 0]).ravel()
            moved = moved.reshape(speeds, rows, parts, harmonics).swapaxes(0, 1)
            known = np.linalg.solve(inner, scaled.T @ off)
            free, rest, others = (
                mean + np.linalg.solve(whitener, known[: len(mean)]),
                off - scaled @ known,
                known[len(mean) :],
            )
            left = rest @ rest + others @ others
            errors = partial(_errors, columns, modes, size[: columns.shape[-1]])
            force = moved[:, :, 0] + 1j * moved[:, :, 1]
            best = _Posterior(evidence + log_scale, force, free, float(left), shares, errors)
    # of data whitened by the common errors too, as the evidence of a Fit is
    return best._replace(evidence=best.evidence + spectrum.log_common_volume / 2)


def _errors(columns, modes, size):
    """Columns (component, amplitude) of a force; columns : (speed, component, force);  size : (force,)."""
    every = modes.T[:, None, :, None] * (columns * size)[:, :, None]
    return every.reshape(columns.shape[0] * columns.shape[1], -1)


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
