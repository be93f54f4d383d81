"""The error of form: no fault has exactly the form in which the library writes it.

What a cause changes, c, is taken to be c (1 + d). The relative error d is complex; there is one for each harmonic and
direction of whirl, the same at all nodes, as a force that acts where the ideal one does moves all of them by its own
receptances. Over the speeds d is a Gaussian process: partly constant, partly slowly varying, for the smallest part
free. Its standard deviation is unknown, with a prior over some orders of magnitude up to `Settings.form_error`.

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
from rotorstudy.measurement.spectrum import Spectrum

SCALES = (0.06, 0.2, 0.5, 1.0)  # of the largest standard deviation of the error, equally likely: 0.3 to 5 % by default
# the same at least, of a cause with a law: published formulas of one crack differ by several per cent
LEAST_OF_LAWS = 1.0
# shares of its variance: the same at all speeds, slowly varying, independent; a form that depends on the motion changes
# where the motion does, others do not: equally likely
SHARES = ((0.9, 0.1, 0.0), (0.7, 0.28, 0.02), (0.4, 0.5, 0.1))
LENGTH = 0.2  # of the slow part, in the logarithm of the speed: resonances are seldom closer
ACROSS = 0.1  # of the rms change over the harmonics, by which the error of a small one may exceed it: laws leak
ROUND_OFF = 1e-9  # of a change: what is below it has no direction
LEAST_MODE = 1e-4  # variance over the speeds, beside 1, of a mode that changes nothing
LEAST = 1e-2  # standard deviations of the data, below which a column changes nothing


class Change(NamedTuple):
    """What a fault changes: (speed, harmonic, sensor), m; least : scale of the error of its form, at least."""

    change: np.ndarray
    least: float


def changes_of(causes: Sequence[Candidate], values: dict, names: Sequence[str], columns: np.ndarray) -> list[Change]:
    """The Change of each fault on the rotor, to first order in its force.

    values  : of the amplitudes, by name
    columns : (parameter, speed, harmonic, sensor) derivatives by the parameters of some names
    """
    place, found = {name: i for i, name in enumerate(names)}, []
    for parts in faults_of(causes).values():
        own = [name for c in parts if not c.term.acts_on_output for name in c.names]
        if own:
            change = np.tensordot([values[n] for n in own], columns[[place[n] for n in own]], 1)
            has_law = any(c.shape or "element" in c.where for c in parts)
            found.append(Change(change, LEAST_OF_LAWS if has_law else 0.0))
    return found


def form_errors(speed: np.ndarray, changes: list[Change], shares: tuple, scale: float) -> np.ndarray:
    """What the errors of the form of some faults change, relative to the largest standard deviation.

    Parameters
    ----------
    speed : array (speed,)
        In rad/s.
    changes : list of Change
    shares : tuple of float
        One of `SHARES`.
    scale : float
        One of `SCALES`.

    Returns
    -------
    array (error, speed, harmonic, sensor)
        Complex, m; the errors are independent, of unit variance.
    """
    distance = np.subtract.outer(np.log(speed), np.log(speed)) / LENGTH
    constant, slow, free = shares
    covariance = constant + slow * np.exp(-0.5 * distance**2) + free * np.eye(len(speed))
    size, modes = np.linalg.eigh(covariance / 2)  # of the real and of the imaginary part
    kept = size > LEAST_MODE
    over_speed = (modes[:, kept] * np.sqrt(size[kept])).T  # (error, speed)
    found = []
    for change, least in changes:
        size = np.linalg.norm(change, axis=-1)  # (speed, harmonic)
        whole = np.linalg.norm(size, axis=-1, keepdims=True)
        seen = size > ROUND_OFF * whole
        larger = np.where(seen, np.sqrt(size**2 + (ACROSS * whole) ** 2) / np.where(seen, size, 1.0), 0.0)
        moved = max(scale, least) * change * larger[..., None]
        for h in np.flatnonzero(seen.any(axis=0)):
            column = np.zeros((len(over_speed), *change.shape), complex)
            column[:, :, h] = over_speed[..., None] * moved[:, h]
            found += [column, 1j * column]
    return np.concatenate(found) if found else np.zeros((0, 0, 0, 0))


class FormError(NamedTuple):
    """An error of the form of the causes of an explanation, the most probable one.

    shares, scale : of `SHARES` and `SCALES`;  columns : (component, error) what it changes, whitened
    mean_std : expected standard deviation, relative;  evidence : log evidence, mean over all shares and scales
    """

    shares: tuple[float, float, float]
    scale: float
    columns: np.ndarray
    mean_std: float
    evidence: float


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
    gram, prior = data.T @ data + rest.T @ rest, 2 * np.linalg.slogdet(known)[1]
    scales = tuple(dict.fromkeys(max(s, min((c.least for c in changes), default=1.0)) for s in SCALES))
    found = []
    for shares in SHARES if changes and largest else SHARES[:1]:
        alike, base = len({c.least for c in changes}) <= 1, None
        for scale in scales:
            if base is None or not alike:
                errors = largest * form_errors(spectrum.speed, changes, shares, scale)
                columns = spectrum.whitened(errors).T if len(errors) else np.zeros((count, 0))
                columns = columns[:, np.linalg.norm(columns, axis=0) > LEAST * scale]
                base = scale, columns, *_principal(columns)
            factor = scale / base[0] if alike else 1.0
            evidence, beyond = _evidence(gram, base[2].T @ data, factor**2 * base[3], prior)
            found.append((evidence, beyond, shares, scale, factor * base[1]))
    evidence = np.array([one[0] for one in found])
    best = found[int(np.argmax(evidence))]
    weights = np.exp(evidence - evidence.max())
    mean = float(weights @ [one[3] for one in found] / weights.sum()) * largest if changes else 0.0
    return FormError(best[2], best[3], best[4], mean, float(np.log(weights.mean()) + evidence.max() - best[1]))


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
    """Log evidence of linearised data with errors in common, and what the fit leaves beyond its linearised minimum.

    gram   : products of residual and derivatives, with those of the prior;  turned : both along the errors
    prior  : log determinant of the precision of the prior
    """
    less = gram - turned.T @ (turned * (variance / (1 + variance))[:, None])
    size = np.sqrt(np.diag(less)[1:])
    normal, right = less[1:, 1:] / np.outer(size, size), less[1:, 0] / size
    gain = right @ np.linalg.solve(normal, right)
    narrowed = np.linalg.slogdet(normal)[1] + 2 * np.log(size).sum() - prior
    return -0.5 * (less[0, 0] - gain + narrowed + np.log1p(variance).sum()), 0.5 * gain
