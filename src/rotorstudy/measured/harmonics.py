"""Harmonics of a record against the angle of the shaft, and their covariance from repeat blocks."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.records import white_noise_covariance

MOST_BLOCKS = 32
FEWEST_BLOCKS = 6  # fewer say too little of their own scatter; the noise floor is taken instead


@dataclass(frozen=True)
class Harmonics:
    """Harmonics of one node at one speed.

    amplitude  : (harmonic,) complex, m
    covariance : (component, component) m^2, real parts then imaginary parts
    blocks     : (block, harmonic) complex, m; empty if there were too few revolutions
    noise_std  : of a sample of x or y, m, from what the harmonics leave
    shrinkage  : weight of the white-noise form in the variances and in the correlations, 0 to 1
    """

    amplitude: np.ndarray
    covariance: np.ndarray
    blocks: np.ndarray
    noise_std: float
    shrinkage: tuple


def fit(signal, angle, harmonics):
    """Least squares of (time,) complex on e^{j n angle}: harmonics, residual, inverse of basis^H basis."""
    basis = np.exp(1j * np.multiply.outer(np.asarray(harmonics), angle))  # (harmonic, time)
    inverse = np.linalg.inv(basis.conj() @ basis.T)
    amplitude = inverse.T @ (basis.conj() @ signal)
    return amplitude, signal - amplitude @ basis, inverse


def block_edges(revolutions):
    """Whole revolutions a block, and the number of blocks: as many as there are revolutions, at most MOST_BLOCKS."""
    length = max(1, int(np.ceil(revolutions / MOST_BLOCKS)))
    return length, revolutions // length


def estimate(signal, angle, revolutions, harmonics):
    """Harmonics of a record of whole revolutions.

    signal : (time,) complex, m; NaN where missing;  angle : (time,) rad, rising from any value
    The mean is a harmonic like the others. The covariance is the scatter of blocks of whole revolutions, shrunk
    (`shrunk_covariance`), and divided by the number of blocks the record holds.
    """
    harmonics = np.asarray(harmonics)
    usable = np.isfinite(signal)
    amplitude, residual, inverse = fit(signal[usable], angle[usable], harmonics)
    freedom = max(1, usable.sum() - len(harmonics))
    noise_std = float(np.sqrt(np.sum(np.abs(residual) ** 2) / freedom / 2))
    length, count = block_edges(revolutions)
    block = ((angle - angle[0]) // (2 * np.pi * length)).astype(int)
    sizes = np.bincount(block[usable], minlength=count)[:count]
    full = np.flatnonzero(sizes >= 0.8 * (2 * np.pi * length) / np.median(np.diff(angle)))
    full = full[sizes[full] > 2 * len(harmonics)]
    if len(full) < FEWEST_BLOCKS:
        lines = np.unique(np.rint(harmonics * revolutions).astype(int) % len(residual))
        return Harmonics(
            amplitude,
            white_noise_covariance(residual, inverse, lines),
            np.zeros((0, len(harmonics))),
            noise_std,
            (1, 1),
        )
    blocks = np.array([fit(signal[c], angle[c], harmonics)[0] for c in (usable & (block == b) for b in full)])
    parts = np.concatenate([blocks.real, blocks.imag], axis=1)
    covariance, shrinkage = shrunk_covariance(parts)
    share = sizes[full].mean() / usable.sum()  # of a block in the record: the variance of the whole fit is that smaller
    return Harmonics(amplitude, covariance * share, blocks, noise_std, shrinkage)


def shrunk_covariance(draws):
    """Covariance of draws (draw, component), shrunk towards white noise: equal variances, no correlation.

    With few draws the sample covariance is singular, and its small variances are too small by chance. As Opgen-Rhein
    and Strimmer (2007) and Schäfer and Strimmer (2005) do, variances are pulled to their common (median) value and
    correlations to zero, each as far as their own scatter between draws says: by the sum of the sampling variances of
    what is pulled over the sum of its squared distances from the target. White noise is pulled all the way; noise that
    clearly differs between harmonics, or is correlated (jitter turns all harmonics together), hardly.

    returns : (component, component), (weight of the target in the variances, in the correlations)
    """
    from scipy.stats import chi2

    count, size = draws.shape
    freedom = count - 1
    centred = draws - draws.mean(axis=0)
    variance = np.sum(centred**2, axis=0) / freedom
    if not variance.any():
        return np.zeros((size, size)), (1.0, 1.0)
    target = np.median(variance) * freedom / chi2.median(freedom)
    squares = centred**2 - np.mean(centred**2, axis=0)
    noise = count / freedom**3 * np.sum(squares**2, axis=0)
    far = np.sum((variance - target) ** 2)
    pull = float(min(1.0, np.sum(noise) / far)) if far > 0 else 1.0
    shrunk = (1 - pull) * variance + pull * target
    scaled = centred / np.sqrt(np.where(variance > 0, variance, 1))
    products = scaled[:, :, None] * scaled[:, None, :]
    mean = products.mean(axis=0)
    correlation = mean * count / freedom
    scatter = count / freedom**3 * np.sum((products - mean) ** 2, axis=0)
    off = ~np.eye(size, dtype=bool)
    loosen = float(min(1.0, np.sum(scatter[off]) / max(np.sum(correlation[off] ** 2), 1e-300)))
    correlation = (1 - loosen) * correlation
    np.fill_diagonal(correlation, 1.0)
    return correlation * np.sqrt(np.outer(shrunk, shrunk)), (pull, loosen)


def with_phase_noise(amplitude, covariance, harmonics, variance):
    """Covariance plus that of a phase mark known to `variance` rad^2, which turns harmonic n by n times its error."""
    turned = 1j * np.asarray(harmonics) * amplitude
    slope = np.concatenate([turned.real, turned.imag])
    return covariance + variance * np.outer(slope, slope)


def trend_probability(blocks):
    """Chance that steady vibration shows so large a steady change over its blocks (block, harmonic) as this does."""
    from scipy.stats import f

    parts = np.concatenate([blocks.real, blocks.imag], axis=1)
    place = np.arange(len(parts)) - (len(parts) - 1) / 2
    centred = parts - parts.mean(axis=0)
    slope = place @ centred / (place @ place)
    explained = slope**2 * (place @ place)
    left = np.sum(centred**2, axis=0) - explained
    freedom = len(parts) - 2
    ratio = explained / np.maximum(left / freedom, 1e-300)
    lowest = f.sf(ratio, 1, freedom).min()
    return float(min(1.0, lowest * len(ratio)))  # the largest of so many components
