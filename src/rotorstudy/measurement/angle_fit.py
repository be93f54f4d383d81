"""Harmonics of the shaft angle fitted to long signals, in pieces: the basis of a whole record would fill the memory."""

from typing import NamedTuple

import numpy as np

from rotorstudy.response.series import rotating_basis

PIECE = 4096  # samples, whose basis stays in the cache of a processor


class Fit(NamedTuple):
    """amplitude (..., harmonic) and residual (..., time), complex, in the unit of the signal; inverse (harmonic,
    harmonic) of the normal matrix."""

    amplitude: np.ndarray
    residual: np.ndarray
    inverse: np.ndarray


def fit_harmonics(signal, angle, harmonics):
    """Least squares of signals (..., time) on e^{jn angle}, angle (time,) rad, harmonics (harmonic,); see `Fit`."""
    amplitude, inverse = fit_amplitude(signal, angle, harmonics)
    residual = np.empty(signal.shape, complex)
    for piece in _pieces(angle):
        residual[..., piece] = signal[..., piece] - amplitude @ rotating_basis(angle[piece], 1.0, harmonics)
    return Fit(amplitude, residual, inverse)


def fit_amplitude(signal, angle, harmonics):
    """Amplitude and inverse of the Fit of signals, without the residual."""
    count, lead = len(harmonics), signal.shape[:-1]
    normal, right = np.zeros((count, count), complex), np.zeros((*lead, count), complex)
    for piece in _pieces(angle):
        basis = rotating_basis(angle[piece], 1.0, harmonics)
        weighted = basis.conj()
        normal += weighted @ basis.T
        right += signal[..., piece] @ weighted.T
    inverse = np.linalg.inv(normal)
    return right @ inverse.T, inverse


def _pieces(angle):
    return [slice(start, start + PIECE) for start in range(0, len(angle), PIECE)]


def fit_each(signals, angle, harmonics):
    """The Fit of each of several signals (signal, time), of the samples that it has; together where none is missing."""
    usable = np.isfinite(signals)
    whole = np.flatnonzero(usable.all(axis=-1))
    together = fit_harmonics(signals[whole], angle, harmonics)
    found = {i: Fit(together.amplitude[k], together.residual[k], together.inverse) for k, i in enumerate(whole)}
    for i in set(range(len(signals))) - set(found):
        if usable[i].sum() > len(harmonics):
            found[i] = fit_harmonics(signals[i, usable[i]], angle[usable[i]], harmonics)
    return [found.get(i) for i in range(len(signals))]
