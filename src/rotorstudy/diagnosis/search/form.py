"""The error of form: no fault has exactly the form in which the library writes it.

What a cause changes, c, is taken to be c (1 + d). The relative error d is complex; there is one for each harmonic and
direction of whirl, the same at all nodes, as a force that acts where the ideal one does moves all of them by its own
receptances. Over the speeds d is a Gaussian process: partly constant, partly slowly varying, for the smallest part
free. Its standard deviation is unknown, with a prior over some orders of magnitude up to `Settings.form_error`, or that
of the effect where published forms of it differ by more (`Effect.form_error`).

So the data have errors in common, of low rank: the columns c of each harmonic. They serve in the fit, its evidence and
its intervals alike, for one cause or several. A second cause is then worth its prior odds only if it explains what the
first one cannot in any form near its own (M. C. Kennedy and A. O'Hagan, Bayesian calibration of computer models, J. R.
Stat. Soc. B 63 (2001) 425-464).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.free_forces import shown_forces
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.search.places import places_of
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.response.neighbourhood import Motion, Neighbourhood

SCALES = np.append(0.0, 2.0 ** np.arange(-5, 1))  # of the largest standard deviation of the error, equally likely
# shares of its variance: the same at all speeds, slowly varying, independent; a form that depends on the motion changes
# where the motion does, others do not: equally likely
SHARES = ((0.9, 0.1, 0.0), (0.7, 0.28, 0.02), (0.4, 0.5, 0.1), (0.1, 0.3, 0.6))
LENGTH = 0.2  # of the slow part, in the logarithm of the speed: resonances are seldom closer
ACROSS = 0.1  # of the rms change over the harmonics, by which the error of a small one may exceed it: laws leak
ROUND_OFF = 1e-9  # of a change: what is below it has no direction
LEAST_MODE = 1e-4  # variance over the speeds, beside 1, of a mode that changes nothing
LEAST = 1e-2  # standard deviations of the data, below which a column changes nothing


class Change(NamedTuple):
    """What a fault changes: (speed, harmonic, sensor), m.

    inexactness : largest error of its form, relative to `Settings.form_error`
    forces : (force, speed, harmonic, sensor) what free forces at its place show; none where it acts at several places
    forced : (force,) position of the harmonic of each
    """

    change: np.ndarray
    inexactness: float = 1.0
    forces: np.ndarray | None = None
    forced: np.ndarray | None = None


def largest_error(effect: str, usual: float) -> float:
    """Largest standard deviation of the error of the form of an effect, as a fraction of what it changes."""
    return max(registry().get("effect", effect).form_error, usual)


def changes_of(
    causes: Sequence[Candidate], values: dict, motion: Motion, forces: "LocalForces", largest: float
) -> list[Change]:
    """The Change of each fault on the rotor: what its force at a motion shows.

    values  : of the amplitudes, by name
    motion  : with all the causes
    largest : `Settings.form_error`
    """
    found = []
    for parts in faults_of(causes).values():
        own = [u for c in parts if not c.term.acts_on_output for u in c.term.unknowns]
        if own:
            change = forces.near.changes_by_forces([(own, motion)]) @ np.array([values[u.name] for u in own])
            inexactness = max(largest_error(c.effect, largest) for c in parts) / largest
            found.append(Change(change, inexactness, *forces.beside(parts)))
    return found


class LocalForces:
    """What free forces at one place show, of the rig at some values.

    Parameters
    ----------
    fitted : Fit
    spectrum : Spectrum
    structure : Structure
    """

    def __init__(self, fitted: Fit, spectrum: Spectrum, structure: Structure):
        order = carried_order(spectrum, fitted.model)
        self.near = Neighbourhood(fitted.model, spectrum.speed, spectrum.harmonics, fitted.theta, order=order)
        self.spectrum, self.known = spectrum, {}
        self.places = []  # (dofs, rows) of nodes, then of elements
        for (kind, number, _), rows in places_of(structure):
            dofs = {i for i, (node, _) in enumerate(structure.dofs) if node == number} if kind == "node" else None
            self.places.append((dofs or set(np.flatnonzero(np.abs(rows).any(axis=0)).tolist()), rows, kind))

    def beside(self, parts: Sequence[Candidate]) -> tuple[np.ndarray | None, np.ndarray | None]:
        """`Change.forces` and `Change.forced` of the parts of a fault; None if they act at several places."""
        acted = {dof for c in parts for u in c.term.unknowns for dof in _acted(u)}
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


def _acted(unknown):
    """Positions of the coordinates on which an unknown acts."""
    if unknown.force:
        return np.flatnonzero(unknown.force.matrix.any(axis=0)).tolist()
    return {int(row) for entry in unknown.entries for row in entry.nonzero[0]}


def form_errors(speed: np.ndarray, changes: list[Change], shares: tuple) -> np.ndarray:
    """What the errors of the form of some faults change, of the largest size and relative to `Settings.form_error`.

    Of a fault at one place they are forces there, of the size that shows as much as the fault at each harmonic.

    Parameters
    ----------
    speed : array (speed,)
        In rad/s.
    changes : list of Change
    shares : tuple of float
        One of `SHARES`.

    Returns
    -------
    array (error, speed, harmonic, sensor)
        Complex, m; the errors are independent, of unit variance.
    """
    modes, found = over_speeds(speed, shares), []
    for change, inexactness, forces, forced in changes:
        size = np.linalg.norm(change, axis=-1)  # (speed, harmonic)
        whole = np.linalg.norm(size, axis=-1, keepdims=True)
        larger = np.sqrt(size**2 + (ACROSS * whole) ** 2)
        if forces is None:
            seen = size > ROUND_OFF * whole
            moved = change * np.where(seen, larger / np.where(seen, size, 1.0), 0.0)[..., None]
            shown = np.zeros((2 * size.shape[1], *change.shape), complex)
            for h in np.flatnonzero(seen.any(axis=0)):
                shown[2 * h, :, h], shown[2 * h + 1, :, h] = moved[:, h], 1j * moved[:, h]
        else:
            of_unit = np.linalg.norm(forces, axis=(2, 3))  # (force, speed)
            shown = forces * (larger[:, forced].T / np.where(of_unit > 0, of_unit, np.inf))[..., None, None]
        errors = modes[:, None, :, None, None] * shown[None]
        found.append(inexactness * errors.reshape(-1, *change.shape))
    return np.concatenate(found) if found else np.zeros((0, 0, 0, 0))


def over_speeds(speed: np.ndarray, shares: tuple) -> np.ndarray:
    """Functions (mode, speed) whose sum, each with an independent amplitude of unit variance, is such a process.

    That of the real and of the imaginary part, each of half the variance.
    """
    distance = np.subtract.outer(np.log(speed), np.log(speed)) / LENGTH
    constant, slow, free = shares
    covariance = constant + slow * np.exp(-0.5 * distance**2) + free * np.eye(len(speed))
    size, modes = np.linalg.eigh(covariance / 2)
    kept = size > LEAST_MODE
    return (modes[:, kept] * np.sqrt(size[kept])).T


def largest_errors(spectrum: Spectrum, change: np.ndarray, largest: float) -> np.ndarray:
    """Columns (component, error), whitened, of the largest error of the form of a cause that changes the records so.

    spectrum : without such an error;  change : (speed, harmonic, sensor), m
    """
    return _columns(spectrum, [Change(change)], SHARES[1], largest)


def _columns(spectrum, changes, shares, largest):
    """Columns (component, error) of errors of form, whitened, that change anything."""
    errors = largest * form_errors(spectrum.speed, changes, shares)
    columns = spectrum.whitened(errors).T if len(errors) else np.zeros((spectrum.data_count, 0))
    return columns[:, np.linalg.norm(columns, axis=0) > LEAST]


class FormError(NamedTuple):
    """An error of the form of the causes of an explanation, the most probable one.

    shares, scale : of `SHARES` and `SCALES`;  columns : (component, error) what it changes, whitened
    mean_std : expected standard deviation, relative
    more     : logarithm of the mean evidence over all shares and scales, less that of these
    """

    shares: tuple[float, float, float]
    scale: float
    columns: np.ndarray
    mean_std: float
    more: float

    def evidence(self, off: np.ndarray, jacobian: np.ndarray, known: np.ndarray) -> float:
        """Log evidence of a fit with this error; arguments as for `most_probable_form`."""
        pull = self.columns.T @ np.column_stack([off[: len(jacobian)], jacobian])
        within = np.eye(len(pull)) + self.columns.T @ self.columns
        solved = np.linalg.solve(within, pull)
        normal = jacobian.T @ jacobian + known.T @ known - pull[:, 1:].T @ solved[:, 1:]
        size = np.sqrt(np.diag(normal))
        narrowed = np.linalg.slogdet(normal / np.outer(size, size))[1] + 2 * np.log(size).sum()
        narrowed += np.linalg.slogdet(within)[1] - 2 * np.linalg.slogdet(known)[1]
        return float(self.more - 0.5 * (off @ off - pull[:, 0] @ solved[:, 0] + narrowed))


def most_probable_form(
    spectrum: Spectrum, changes: list[Change], off: np.ndarray, jacobian: np.ndarray, known: np.ndarray, largest: float
) -> FormError:
    """The most probable error of form at the values of a fit, linearised.

    Parameters
    ----------
    spectrum : Spectrum
        Without such an error.
    changes : list of Change
    off : array (component + parameter,)
        Residual, followed by the distance of the parameters from their prior.
    jacobian : array (component, parameter)
    known : array (parameter, parameter)
        Whitener of the prior.
    largest : float
        Standard deviation of the error of scale 1.

    Returns
    -------
    FormError
    """
    count = len(jacobian)
    data, rest = np.column_stack([off[:count], jacobian]), np.column_stack([off[count:], known])
    gram, prior, found = data.T @ data + rest.T @ rest, 2 * np.linalg.slogdet(known)[1], []
    for shares in SHARES if changes else SHARES[:1]:
        columns = _columns(spectrum, changes, shares, largest)
        along, variance = _principal(columns)
        turned = along.T @ data
        found += [(_evidence(gram, turned, x**2 * variance, prior), shares, x, x * columns) for x in SCALES]
    evidence = np.array([one[0] for one in found])
    best = found[int(np.argmax(evidence))]
    weights = np.exp(evidence - evidence.max())
    mean = weights @ [one[2] for one in found] / weights.sum()
    inexact = largest * max((one.inexactness for one in changes), default=0.0)
    return FormError(*best[1:], float(mean * inexact), float(np.log(weights.mean())))


def _principal(columns):
    """Orthonormal directions (component, error) of columns, and their variances (error,)."""
    if columns.shape[1] > len(columns):
        variance, along = np.linalg.eigh(columns @ columns.T)
    else:
        variance, along = np.linalg.eigh(columns.T @ columns)
        along = columns @ (along / np.sqrt(np.maximum(variance, np.finfo(float).tiny)))
    kept = variance > ROUND_OFF * variance.max(initial=0.0)
    return along[:, kept], variance[kept]


def _evidence(gram, turned, variance, prior):
    """Log evidence of linearised data with errors in common.

    gram   : products of residual and derivatives, with those of the prior;  turned : both along the errors
    prior  : log determinant of the precision of the prior
    """
    less = gram - turned.T @ (turned * (variance / (1 + variance))[:, None])
    size = np.sqrt(np.diag(less)[1:])
    normal, right = less[1:, 1:] / np.outer(size, size), less[1:, 0] / size
    gain = right @ np.linalg.solve(normal, right)
    narrowed = np.linalg.slogdet(normal)[1] + 2 * np.log(size).sum() - prior
    return -0.5 * (less[0, 0] - gain + narrowed + np.log1p(variance).sum())
