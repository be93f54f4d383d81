"""The error of form: no fault has exactly the form in which the library writes it.

What a cause changes, c, is taken to be c (1 + d). The relative error d is complex; there is one for each harmonic and
direction of whirl, the same at all nodes, as a force that acts where the ideal one does moves all of them by its own
receptances. Over the speeds d is a Gaussian process: partly constant, partly slowly varying, partly free. Its standard
deviation is unknown, another one for each harmonic and direction, with a prior over some orders of magnitude up to
`Settings.form_error`, or that of the effect where published forms of it differ by more (`Effect.form_error`).

So the data have errors in common, of low rank: the columns c of each harmonic. They serve in the fit, its evidence and
its intervals alike, for one cause or several. A second cause is then worth its prior odds only if it explains what the
first one cannot in any form near its own (M. C. Kennedy and A. O'Hagan, Bayesian calibration of computer models, J. R.
Stat. Soc. B 63 (2001) 425-464).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.search.places import places_of
from rotorstudy.diagnosis.search.shown_forces import shown_forces
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import LEAK, neighbourhood
from rotorstudy.measurement.spectrum import Spectrum, principal
from rotorstudy.model.entries import unscaled
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.response.neighbourhood import Motion, carried_motion

SCALES = np.append(0.0, 2.0 ** np.arange(-10, 1))  # of the largest standard deviation of the error, equally likely
# shares of its variance: the same at all speeds, slowly varying, independent. The error of a force that the weight
# governs hardly varies; that of others changes where the motion does: equally likely
SLOWLY_VARYING = (0.7, 0.28, 0.02)
SHARES = ((0.99, 0.01, 0.0), (0.9, 0.1, 0.0), SLOWLY_VARYING, (0.4, 0.5, 0.1), (0.1, 0.3, 0.6))
STEADY, STEADY_LENGTH = (0.5, 0.5, 0.0), 1.0  # of a force that does not depend on the motion: by a power of the speed
LENGTH = 0.2  # of the slow part, in the logarithm of the speed: resonances are seldom closer
SWEEPS = 2  # over the harmonics, for their most probable scales
ROUND_OFF = 1e-9  # of a change: what is below it has no direction
LEAST_MODE = 1e-4  # variance over the speeds, beside 1, of a mode that changes nothing
DEFINITE = 1e-13  # added to a unit diagonal, so that round-off leaves the matrix positive definite
LEAST = 1e-2  # standard deviations of the data, below which a column changes nothing


class Change(NamedTuple):
    """What a fault changes: (speed, harmonic, sensor), m."""

    change: np.ndarray
    inexactness: float = 1.0  # largest error of its form, relative to `Settings.form_error`
    steady: bool = False  # whether its error is by a power of the speed
    # (force, speed, harmonic, sensor) what free forces at its place show; none where it acts at several places
    forces: np.ndarray | None = None
    forced: np.ndarray | None = None  # (force,) position of the harmonic of each
    of_motion: bool = True  # whether its forces depend on the motion

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Errors (error, speed, harmonic, sensor), m, as large as the change, and the position of the harmonic of each.

        One in phase with it and one in quadrature at each harmonic, the same at all speeds. Of a fault at one place
        they are forces there, of the size that shows as much as the fault.
        """
        size = np.linalg.norm(self.change, axis=-1)  # (speed, harmonic)
        harmonics = size.shape[1]
        if self.forces is None:
            whole = np.linalg.norm(size, axis=-1, keepdims=True)
            seen = size > ROUND_OFF * whole
            moved = self.change * np.where(seen, _with_leak(size, whole) / np.where(seen, size, 1.0), 0.0)[..., None]
            of_harmonic = np.eye(harmonics)[:, None, :, None] * moved
            both = np.stack([of_harmonic, 1j * of_harmonic], axis=1)
            return both.reshape(-1, *moved.shape), np.repeat(np.arange(harmonics), 2)
        by_unit = np.linalg.norm(self.forces, axis=(2, 3))  # (force, speed)
        shows = by_unit > ROUND_OFF * by_unit.max(initial=0.0)  # a foundation at rest moves with its probes
        rows = len(self.forced) // (2 * harmonics)  # which share the error
        acting = size[:, self.forced].T / np.where(shows, np.sqrt(rows) * by_unit, np.inf)
        by_row = acting.reshape(rows, -1, acting.shape[1])  # a force and a moment have no size in common
        whole = np.sqrt(harmonics * np.mean(by_row**2, axis=1, keepdims=True))
        return self.forces * _with_leak(by_row, whole).reshape(*acting.shape, 1, 1), self.forced


def largest_error(effect: str, parameter: str, usual: float) -> float:
    """Largest standard deviation of the error of the form of an effect, as a fraction of what a parameter changes."""
    stated = registry().get("effect", effect).form_error
    return max(stated.get(parameter, 0.0) if isinstance(stated, dict) else stated, usual)


def changes_of(
    causes: Sequence[Candidate], values: dict, motion: Motion, forces: "LocalForces", largest: float
) -> list[Change]:
    """The Changes of each fault on the rotor: what its forces at a motion show.

    An error that is larger than usual, of forces that do not depend on the motion, is by a power of the speed.

    values  : of the amplitudes, by name
    motion  : with all the causes
    largest : `Settings.form_error`
    """
    found = []
    for parts in faults_of(causes).values():
        inexactness = {False: {}, True: {}}  # of forces that depend on the motion or not: amplitude -> largest error
        for cause in (c for c in parts if not c.term.acts_on_output):
            for unknown, i in zip(cause.term.unknowns, cause.parameter, strict=True):
                parameter = cause.term.parameters[i]
                error = largest_error(cause.effect, parameter.name, largest) / largest
                inexactness[_depends_on_motion(parameter)][unknown] = error
        for of_motion, errors in inexactness.items():
            if errors:
                sizes = np.array([values[unknown.name] for unknown in errors])
                change, most = forces.near.changes_by_forces([([*errors], motion)]) @ sizes, max(errors.values())
                found.append(Change(change, most, not of_motion and most > 1.0, *forces.beside(parts), of_motion))
    return found


def _depends_on_motion(parameter):
    return parameter.force is not None or any(entry.on != "one" for entry in unscaled(parameter.entries))


class LocalForces:
    """What free forces at one place show, of the rig at the values of a fit."""

    def __init__(self, fitted: Fit, spectrum: Spectrum, structure: Structure):
        self.near = neighbourhood(fitted.model, spectrum, fitted.theta)
        self.fitted, self.spectrum, self.structure, self.known = fitted, spectrum, structure, {}
        self.places = []  # (dofs, rows) of nodes, then of elements
        for (kind, number, _), rows in places_of(structure):
            dofs = {i for i, (node, _) in enumerate(structure.dofs) if node == number} if kind == "node" else None
            self.places.append((dofs or set(np.flatnonzero(np.abs(rows).any(axis=0)).tolist()), rows, kind))

    def at(self, spectrum: Spectrum) -> "LocalForces":
        """The same at other speeds."""
        return LocalForces(self.fitted, spectrum, self.structure)

    def motion(self, model: Model, theta: np.ndarray) -> Motion:
        """The Motion of another model at the same speeds and harmonics."""
        near = self.near
        return carried_motion(model, near.speed, near.harmonics, theta, order=near.order)

    def beside(self, parts: Sequence[Candidate]) -> tuple[np.ndarray | None, np.ndarray | None]:
        """`Change.forces` and `Change.forced` of the parts of a fault; None if they act at several places."""
        acted = acted_on(parts)
        key = frozenset(acted)
        if key not in self.known:
            self.known[key] = self._shown(acted)
        return self.known[key]

    def _shown(self, acted):
        for dofs, rows, kind in self.places:
            if acted and acted <= dofs:
                rows = np.eye(rows.shape[1])[sorted(acted)] if kind == "node" else rows
                shown = shown_forces(self.near, self.spectrum, rows)
                forced = np.tile(np.arange(len(self.spectrum.harmonics)), 2 * len(rows))
                return shown.reshape(-1, *shown.shape[2:]), forced
        return None, None


def acted_on(parts: Sequence[Candidate]) -> set[int]:
    """Positions of the coordinates on which the parts of a fault act themselves."""
    return {dof for c in parts for parameter in c.term.parameters for dof in _acted(parameter)}


def _acted(parameter):
    """Positions of the coordinates on which a parameter acts itself, not by films that it loads."""
    if parameter.force:
        return np.flatnonzero(parameter.force.matrix.any(axis=0)).tolist()
    return {int(row) for entry in unscaled(parameter.entries) for row in entry.nonzero[0]}


def form_errors(speed: np.ndarray, changes: list[Change], shares: tuple) -> tuple[np.ndarray, np.ndarray]:
    """What the errors of the form of some faults change, of the largest size and relative to `Settings.form_error`.

    returns : independent errors of unit variance (error, speed, harmonic, sensor), m, and of which harmonic each is
    """
    found, at = [np.zeros((0, len(speed), 0, 0))] * (not changes), [np.zeros(0, int)]
    for one in changes:
        modes = over_speeds(speed, STEADY, STEADY_LENGTH) if one.steady else over_speeds(speed, shares)
        errors, harmonic = one.errors()
        found.append(one.inexactness * (modes[:, None, :, None, None] * errors).reshape(-1, *one.change.shape))
        at.append(np.tile(harmonic, len(modes)))
    return np.concatenate(found), np.concatenate(at)


def _with_leak(size, whole):
    """Sizes with what an error of the law moves to each harmonic from the others, whose root of squares is `whole`."""
    return np.sqrt(size**2 + (LEAK * whole) ** 2)


def over_speeds(speed: np.ndarray, shares: tuple, length: float = LENGTH) -> np.ndarray:
    """Functions (mode, speed) whose sum, each with an independent amplitude of unit variance, is such a process.

    That of the real and of the imaginary part, each of half the variance.
    """
    distance = np.subtract.outer(np.log(speed), np.log(speed)) / length
    constant, slow, free = shares
    covariance = constant + slow * np.exp(-0.5 * distance**2) + free * np.eye(len(speed))
    size, modes = np.linalg.eigh(covariance / 2)
    kept = size > LEAST_MODE
    return (modes[:, kept] * np.sqrt(size[kept])).T


def largest_errors(spectrum: Spectrum, change: np.ndarray, largest: float) -> np.ndarray:
    """Columns (component, error), whitened, of the largest error of the form of a cause that changes the records so.

    spectrum : without such an error;  change : (speed, harmonic, sensor), m
    """
    return _columns(spectrum, [Change(change)], SLOWLY_VARYING, largest)[0]


def _columns(spectrum, changes, shares, largest):
    """Whitened columns (component, error) of errors of form that change anything, and positions of their harmonics."""
    errors, at = form_errors(spectrum.speed, changes, shares)
    if not len(errors):
        return np.zeros((spectrum.data_count, 0)), np.zeros(0, int)
    columns = spectrum.whitened(largest * errors).T
    seen = np.linalg.norm(columns, axis=0) > LEAST
    return columns[:, seen], at[seen]


class FormError(NamedTuple):
    """An error of the form of the causes of an explanation, the most probable one."""

    shares: tuple[float, float, float]  # of `SHARES`
    log_shares: np.ndarray  # (share,) log probability of each of these
    columns: np.ndarray  # (component, error) what it changes, whitened
    weights: np.ndarray  # (harmonic, scale) probability of each of `SCALES`
    std: np.ndarray  # (harmonic,) its expected standard deviation, relative to what the causes change
    mean_std: float  # root mean square of that over what they change
    more: float  # logarithm of the mean evidence over all shares and scales, less that of these
    reached: float  # log evidence with it at the best values of the linearised fit

    def evidence(self, off: np.ndarray, jacobian: np.ndarray, known: np.ndarray) -> float:
        """Log evidence of a fit with this error; arguments as for `most_probable_form`."""
        on_errors = self.columns.T @ np.column_stack([off[: len(jacobian)], jacobian])
        of_errors = np.eye(len(on_errors)) + self.columns.T @ self.columns
        explained = on_errors.T @ np.linalg.solve(of_errors, on_errors)  # by the errors, of residual and derivatives
        normal = jacobian.T @ jacobian + known.T @ known - explained[1:, 1:]
        size = np.sqrt(np.diag(normal))
        narrowed = np.linalg.slogdet(normal / np.outer(size, size))[1] + 2 * np.log(size).sum()
        narrowed += np.linalg.slogdet(of_errors)[1] - 2 * np.linalg.slogdet(known)[1]
        return float(self.more - 0.5 * (off @ off - explained[0, 0] + narrowed))


def most_probable_form(
    spectrum: Spectrum,
    changes: list[Change],
    off: np.ndarray,
    jacobian: np.ndarray,
    known: np.ndarray,
    largest: float,
    by_harmonic: bool = True,
) -> FormError:
    """The most probable error of form at the values of a fit, linearised.

    Each harmonic has a scale of its own, as a law may be exact at one and far off at another (automatic relevance
    determination: D. J. C. MacKay, ASHRAE Trans. 100 (1994) 1053-1062). The shares are the most probable ones with one
    scale for all harmonics; the mean over the scales is taken about the most probable ones, that of one harmonic at a
    time. Without `by_harmonic` all have one scale: far from the best values, one of its own would be off by any size,
    and its data would be lost to the fit.

    spectrum : without such an error;  largest : standard deviation of the error of scale 1
    off      : (component + parameter,) residual, then distance of the parameters from their prior
    jacobian : (component, parameter);  known : (parameter, parameter) whitener of the prior
    """
    count, alike, every = len(jacobian), [], []
    data, rest = np.column_stack([off[:count], jacobian]), np.column_stack([off[count:], known])
    gram, prior = data.T @ data + rest.T @ rest, 2 * np.linalg.slogdet(known)[1]
    for shares in SHARES if changes else SHARES[:1]:
        every.append(_columns(spectrum, changes, shares, largest))
        along, variance = principal(every[-1][0], 0.0, ROUND_OFF)
        alike.append(_by_scale(gram, (along * np.sqrt(variance)).T @ data, variance, -prior))
    by_shares = np.logaddexp.reduce(alike, axis=1)
    best = int(np.argmax(by_shares))
    (columns, at), of_scales = every[best], alike[best]
    scales = np.full(len(spectrum.harmonics), SCALES[int(np.argmax(of_scales))])
    if by_harmonic:
        even = np.full((len(scales), len(SCALES)), -np.log(len(SCALES)))
        scales, weights, reached, gained = _over_scales(gram, columns, data, at, scales, even, prior)
    else:
        reached, gained = of_scales.max(), 0.0
        weights = np.tile(np.exp(of_scales - by_shares[best]), (len(scales), 1))
    more = float(np.log(np.mean(np.exp(by_shares - by_shares.max()))) + gained)
    std = largest * max((one.inexactness for one in changes), default=0.0) * weights @ SCALES
    power = sum((np.abs(one.change) ** 2).sum(axis=(0, 2)) for one in changes) if changes else np.zeros(len(std))
    mean = float(np.sqrt(power @ std**2 / power.sum())) if np.any(power) else 0.0
    likely, scale = by_shares - np.logaddexp.reduce(by_shares), scales[at]
    columns = (columns * scale)[:, scale > 0]
    return FormError(SHARES[best], likely, columns, weights, std, mean, more, float(reached + more))


def log_predictive(
    spectrum: Spectrum,
    changes: list[Change],
    form: FormError,
    off: np.ndarray,
    slopes: np.ndarray,
    largest: float,
) -> float:
    """Log probability density of other speeds, less a constant, by the error of form of a fit.

    Few speeds tell the shares and the scale of one harmonic only roughly; so the mean is taken over all of them, by
    their probabilities.

    spectrum : of these speeds, without such an error;  changes : there
    off      : (component,) measured less predicted, whitened
    slopes   : (component, parameter) of independent parameters of unit variance, whitened
    """
    data = np.column_stack([off, slopes])
    gram = data.T @ data + np.diag(np.append(0.0, np.ones(slopes.shape[1])))
    most_probable = SCALES[form.weights.argmax(axis=1)]
    with np.errstate(divide="ignore"):  # what a fit excludes
        known = np.log(form.weights)

    def by(shares):
        columns, at = _columns(spectrum, changes, shares, largest)
        _, _, best, gained = _over_scales(gram, columns, data, at, most_probable, known, 0.0)
        return best + gained

    return float(np.logaddexp.reduce(form.log_shares + [by(shares) for shares in SHARES]))


def _over_scales(gram, columns, data, at, scales, log_prior, prior):
    """The most probable scale of each harmonic (harmonic,), found one after the other, and what follows.

    gram      : products of residual and derivatives, with those of the prior;  data : (component, ...) these
    columns   : (component, error);  at : (error,) position of the harmonic of each
    scales    : (harmonic,) those to begin with;  log_prior : (harmonic, scale) of their probabilities
    prior     : log determinant of the precision of the prior
    returns   : them; probabilities (harmonic, scale); log evidence with them; that of the mean over all scales, less it
    """
    scales, weights = scales.copy(), np.tile(SCALES == 0.0, (len(scales), 1)).astype(float)
    if not len(at):
        return scales, weights, _by_scale(gram, np.zeros((0, len(gram))), np.zeros(0), -prior)[0], 0.0
    products = columns.T @ np.column_stack([data, columns])
    for _ in range(SWEEPS):
        gained = 0.0
        for n in np.unique(at):
            each = _of_one_harmonic(gram, products, at == n, scales[at], prior)
            both = each + log_prior[n]
            top, whole = int(np.argmax(both)), np.logaddexp.reduce(both)
            scales[n], weights[n], best = SCALES[top], np.exp(both - whole), each[top]
            gained += whole - best
    return scales, weights, best, gained


def _of_one_harmonic(gram, products, own, scale, prior):
    """Log evidence (scale,) with the errors of one harmonic on each of `SCALES`, the others on theirs.

    products : (error, residual and derivatives, then errors);  own : (error,) whether it is of that harmonic
    """
    from scipy.linalg import solve_triangular

    others, count = ~own & (scale > 0), len(gram)
    on_data, on_errors = products[:, :count], products[:, count:]
    size = scale[others, None]
    root = np.linalg.cholesky(np.eye(len(size)) + size * on_errors[np.ix_(others, others)] * size.T)
    on_others = np.hstack([size * on_data[others], size * on_errors[np.ix_(others, own)]])
    half = solve_triangular(root, on_others, lower=True, check_finite=False)
    by_others = half.T @ half  # of the data, then of the own errors
    variance, axes = np.linalg.eigh(on_errors[np.ix_(own, own)] - by_others[count:, count:])
    orthogonal = axes.T @ (on_data[own] - by_others[count:, :count])
    narrowed = 2 * np.log(np.diag(root)).sum() - prior
    return _by_scale(gram - by_others[:count, :count], orthogonal, np.maximum(variance, 0.0), narrowed)


def _by_scale(gram, on_errors, variance, narrowed):
    """Log evidence (scale,) of linearised data with errors in common on each of `SCALES`.

    The Cholesky root of the normal matrix, bordered by the residual, gives its determinant and what a fit leaves.

    gram      : products of residual and derivatives, with those of the prior
    on_errors : (error, ...) products of orthogonal errors with these;  variance : (error,) of the errors
    narrowed  : log determinant of the covariance of other errors, less that of the precision of the prior
    """
    every, whole = SCALES[:, None] ** 2 * variance, gram[0, 0]
    gram, on_errors = np.roll(gram, -1, axis=(0, 1)), np.roll(on_errors, -1, axis=1)  # those of the residual come last
    products = gram - on_errors.T @ ((SCALES[:, None] ** 2 / (1 + every))[..., None] * on_errors)
    left, size = products[:, -1, -1].copy(), np.sqrt(np.diagonal(products, axis1=1, axis2=2))
    size[:, -1] = np.sqrt(whole) or 1.0
    products /= size[:, :, None] * size[:, None]
    np.einsum("sii->si", products)[:] += DEFINITE
    products[:, -1, -1] = 2.0  # the root is then real, also where nothing is left of the residual
    root = np.diagonal(np.linalg.cholesky(products), axis1=1, axis2=2)
    gain = whole * (2 - root[:, -1] ** 2)
    narrowed = narrowed + np.log1p(every).sum(axis=1) + 2 * np.log(root[:, :-1] * size[:, :-1]).sum(axis=1)
    return -0.5 * (left - gain + narrowed)
