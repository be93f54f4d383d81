"""Harmonics of the shaft angle fitted to long signals, in pieces: the basis of a whole record would fill the memory."""

from typing import NamedTuple

import numpy as np

from rotorstudy.response.series import rotating_basis

PIECE = 4096  # samples, whose basis stays in the cache of a processor


class Fit(NamedTuple):
    """amplitude (..., harmonic), residual (..., time), complex; inverse (harmonic, harmonic) of the normal matrix."""

    amplitude: np.ndarray
    residual: np.ndarray
    inverse: np.ndarray


def rotating(angle, harmonics):
    """e^{jn angle} (harmonic, time)."""
    return rotating_basis(angle, 1.0, harmonics)


def in_cosines(angle, harmonics):
    """cos(n angle) of harmonics n >= 0 and sin(n angle) of n < 0 (harmonic, time): four times less work for probes."""
    turned = rotating_basis(angle, 1.0, range(max(abs(int(n)) for n in harmonics) + 1))
    return np.array([turned[n].real if n >= 0 else turned[-n].imag for n in harmonics])


def fit_basis(signal, basis, window=1.0):
    """Fit of a signal (..., time) on a basis (..., harmonic, time): amplitude, residual, inverse normal matrix."""
    weighted = basis.conj() * window
    inverse = np.linalg.inv(weighted @ np.swapaxes(basis, -1, -2))
    if basis.ndim == 2:
        amplitude = signal @ weighted.T @ inverse.T
        return amplitude, signal - amplitude @ basis, inverse
    amplitude = (inverse @ (weighted @ signal[..., None]))[..., 0]
    return amplitude, signal - (amplitude[..., None, :] @ basis)[..., 0, :], inverse


def fit_harmonics(signal, angle, harmonics, basis=rotating):
    """Least squares of signals (..., time) on a basis of harmonics (harmonic,) of the angle (time,) rad; see `Fit`."""
    amplitude, inverse = fit_amplitude(signal, angle, harmonics, basis)
    return Fit(amplitude, without(signal, amplitude, angle, harmonics, basis), inverse)


def without(signal, amplitude, angle, harmonics, basis=rotating):
    """Signals (..., time) without harmonics of the amplitude (..., harmonic)."""
    left = np.empty(signal.shape, np.result_type(signal, amplitude))
    for piece in _pieces(angle):
        left[..., piece] = signal[..., piece] - amplitude @ basis(angle[piece], harmonics)
    return left


def fit_amplitude(signal, angle, harmonics, basis=rotating):
    """Amplitude and inverse of the Fit of signals, without the residual."""
    normal, right = 0.0, 0.0
    for piece in _pieces(angle):
        columns = basis(angle[piece], harmonics)
        weighted = columns.conj()
        normal = normal + weighted @ columns.T
        right = right + signal[..., piece] @ weighted.T
    inverse = np.linalg.inv(normal)
    return right @ inverse.T, inverse


def _pieces(angle):
    return [slice(start, start + PIECE) for start in range(0, len(angle), PIECE)]


def fit_each(signals, angle, harmonics, basis=rotating):
    """The Fit of each of several signals (signal, time), of the samples that it has; together where none is missing."""
    usable = np.isfinite(signals)
    whole = np.flatnonzero(usable.all(axis=-1))
    together = fit_harmonics(signals[whole], angle, harmonics, basis)
    found = {i: Fit(together.amplitude[k], together.residual[k], together.inverse) for k, i in enumerate(whole)}
    for i in set(range(len(signals))) - set(found):
        if usable[i].sum() > len(harmonics):
            found[i] = fit_harmonics(signals[i, usable[i]], angle[usable[i]], harmonics, basis)
    return [found.get(i) for i in range(len(signals))]
