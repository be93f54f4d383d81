import numpy as np

from rotorstudy.plugins import SpectrumMethod, fit_basis, rotating_basis, spectral_lines, white_noise_covariance

HUBER, TUKEY = 1.345, 4.685  # clipping in standard deviations, for 95 % efficiency under normal noise
STEPS = 8, 20  # at most, of each; a step reduces the error to a fifth or less
SIGNALS_AT_ONCE = 25  # fit into the processor's cache
CONVERGED = 1e-4  # convergence tolerance, in standard deviations of an amplitude


@SpectrumMethod(
    source="Huber and Ronchetti, Robust Statistics, 2009, ch. 7; Yohai 1987, Ann. Statist. 15 (two stages)",
    checked="variance under normal noise 1/0.95 of least squares (Maronna et al., Robust Statistics, 2006, ch. 2)",
    any_length=True,
    tolerates_outliers=True,
)
def robust_regression(signal, time, speed, harmonics):
    """Robust regression of x and of y: Huber's estimate, then Tukey's, which ignores spikes.

    Solved with modified residuals: r is replaced by psi(r / s) s / mean(psi'), s from the median of |r|. Harmonics that
    are not requested act as noise and do not cancel exactly over whole revolutions: request all that are present.
    """
    basis = rotating_basis(time - time[0], speed, harmonics)
    flat = np.reshape(signal, (-1, len(time)))
    parts = [_fit(flat[i : i + SIGNALS_AT_ONCE], basis) for i in range(0, len(flat), SIGNALS_AT_ONCE)]
    lead = np.shape(signal)[:-1]
    amplitude, modified = (np.concatenate(part).reshape(*lead, -1) for part in zip(*parts, strict=True))
    inverse = fit_basis(flat[:1], basis)[2]
    return amplitude, white_noise_covariance(modified, inverse, spectral_lines(time, speed, harmonics))


def _fit(signal, basis):
    """Amplitude (signal, harmonic) and modified residual (signal, time)."""
    amplitude, _, inverse = fit_basis(signal, basis)
    gain = (inverse @ basis.conj()).T
    for counted, steps in zip((_huber, _tukey), STEPS, strict=True):
        for _ in range(steps):
            residual = signal - amplitude @ basis
            if counted is _huber:
                x, y = (_spread(part) + 1e-14 * np.abs(signal).max() for part in (residual.real, residual.imag))
            modified = x * counted(residual.real / x) + 1j * y * counted(residual.imag / y)
            step = modified @ gain
            amplitude = amplitude + step
            if np.all(np.abs(step) <= CONVERGED * np.hypot(x, y) / np.sqrt(basis.shape[-1])):
                break
    return amplitude, modified


def _spread(residual):
    """Standard deviation (..., 1) of normal noise, from the median of its magnitude; never exactly zero."""
    return np.median(np.abs(residual), axis=-1, keepdims=True) / 0.6745 + np.finfo(float).tiny


def _huber(t):
    return np.clip(t, -HUBER, HUBER) / np.mean(np.abs(t) < HUBER, axis=-1, keepdims=True)


def _tukey(t):
    square = (t / TUKEY) ** 2
    inside = np.where(square < 1, 1 - square, 0.0)
    return t * inside**2 / np.mean(inside * (1 - 5 * square), axis=-1, keepdims=True)
