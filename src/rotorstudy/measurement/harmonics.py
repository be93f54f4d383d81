"""Harmonics of a record against the angle of the shaft, and their covariance from repeat blocks."""

from itertools import pairwise

import numpy as np

from rotorstudy.measurement.angle_fit import Fit, fit_amplitude, fit_basis, fit_harmonics, without
from rotorstudy.measurement.findings import node_facts
from rotorstudy.measurement.lines import LEAST_POWER, Line, line_basis, orders_of_lines
from rotorstudy.measurement.spectrum import along_probe, seen_rows
from rotorstudy.response.series import rotating_basis

MOST_BLOCKS = 32
MOST_OTHERS = 16  # orders that are not asked for
SLOWEST = 64  # records: noise of power 1/f is taken to reach down to this period
WHITE = (0.5, 0.99)  # prior probability that a record has no noise of power 1/f: of the mean, of another harmonic
CORNERS = 12  # between white noise and noise of power 1/f
ROUND_OFF = 1e-9  # rad, by which samples that are locked to the shaft may miss the begin of a revolution
FEWEST_BLOCKS = 6  # with fewer their scatter is too uncertain; the noise floor is used instead


def spectral_lines(time, speed, harmonics):
    """(harmonic,) line of the discrete Fourier transform nearest to each harmonic."""
    revolutions = speed * (time[1] - time[0]) * len(time) / (2 * np.pi)
    return np.rint(np.asarray(harmonics) * revolutions).astype(int) % len(time)


def noise_power(residual, lines, window=1.0):
    """(...) m^2 variance of white noise: the median of the periodogram of the residual (..., time) of a fit.

    So other lines (harmonics not fitted, mains hum) do not count; lines (harmonic,) of those fitted are left out.
    """
    samples = residual.shape[-1]
    rest = np.delete(np.fft.fft(residual * window, axis=-1), lines, axis=-1)
    return np.median(np.abs(rest) ** 2, axis=-1) / (np.log(2) * np.sum(np.broadcast_to(window, samples) ** 2))


def circular_covariance(hermitian):
    """(..., component, component) of real parts, then imaginary parts, of circular noise (..., harmonic, harmonic)."""
    real, imag = hermitian.real, hermitian.imag
    return np.block([[real, -imag], [imag, real]]) / 2


def white_noise_covariance(residual, inverse_normal, lines):
    """(..., component, component) m^2 of harmonics fitted to a record, for white circular noise; see `noise_power`."""
    return noise_power(residual, lines)[..., None, None] * circular_covariance(inverse_normal)


def shared_error_covariance(change, covariance):
    """(..., component, component) m^2 by the error of quantities; change : (..., harmonic, quantity) complex."""
    slope = np.concatenate([change.real, change.imag], axis=-2)
    return slope @ covariance @ np.swapaxes(slope, -1, -2)


def estimate(signal, angle, revolutions, harmonics, direction=np.nan, fit=None, drift=None):
    """NodeFacts of a record of whole revolutions.

    The mean is harmonic 0. Its drift, a straight line in the angle, other harmonics and lines that are not synchronous,
    all of which would leak into these, are fitted together with them: other harmonics cancel in whole revolutions, but
    a block is whole only to the nearest sample. The covariance is that of the blocks of whole revolutions without them,
    shrunk (`shrunk_covariance`), divided by the number of blocks in the record, with noise that is slower than a block
    (`with_slow_noise`).

    signal : (time,) complex, m; NaN where missing;  angle : (time,) rad, increasing;  harmonics : (harmonic,)
    direction : rad, of the only probe of the node, along which the signal is; NaN for an orbit
    fit, drift : Fit of the signal, and of the angle from its mean, to the harmonics alone, if they are known
    """
    harmonics, channels = np.asarray(harmonics), 2 if np.isnan(direction) else 1
    usable = np.isfinite(signal)
    fit = fit_harmonics(signal[usable], angle[usable], harmonics) if fit is None else fit
    turned = angle - angle[usable].mean()
    if drift is None or not usable.all():
        drift = fit_harmonics(turned[usable], angle[usable], harmonics)
    slope, fit = _without_drift(fit, drift)
    others = _others(fit.residual, usable, revolutions, harmonics)
    every = np.concatenate([harmonics, others])
    if len(others):
        amplitude, _ = fit_amplitude((signal - slope * turned)[usable], angle[usable], every)
        signal = without(signal, amplitude[len(harmonics) :], angle, others)
        slope, fit = _without_drift(fit_harmonics(signal[usable], angle[usable], harmonics), drift)
    orders = orders_of_lines(signal[usable] - slope * turned[usable], angle[usable], harmonics, fit.residual)
    widened, lines = 1.0, ()
    if len(orders):
        lines_of_signal, slope, widened, lines = _lines(signal, angle, usable, harmonics, orders)
        signal = signal - lines_of_signal
        fit = fit_harmonics(signal[usable] - slope * turned[usable], angle[usable], harmonics)
    signal = signal - slope * turned
    amplitude, residual, inverse = fit
    freedom = max(1, usable.sum() - len(every))
    noise_std = float(np.sqrt(np.sum(np.abs(residual) ** 2) / freedom / channels))
    length = max(1, int(np.ceil(revolutions / MOST_BLOCKS)))  # of a block, in revolutions
    count = revolutions // length
    edges = np.searchsorted(angle - angle[0], 2 * np.pi * length * np.arange(count + 1) - ROUND_OFF)
    pieces = [np.flatnonzero(usable[a:b]) + a for a, b in pairwise(edges)]
    sizes = np.array([len(piece) for piece in pieces])
    full = np.flatnonzero(sizes >= 0.8 * (2 * np.pi * length) / np.median(np.diff(angle)))
    full = full[sizes[full] > 2 * len(harmonics)]
    if len(full) < FEWEST_BLOCKS:
        at = np.unique(np.rint(every * revolutions).astype(int) % len(residual))
        covariance = white_noise_covariance(residual, inverse, at) * widened * 2 / channels
        covariance = along_probe(covariance, harmonics, direction)
        return node_facts(amplitude, covariance, harmonics, noise_std, (1, 1), lines)
    blocks = np.array([fit_amplitude(signal[c], angle[c], harmonics)[0] for c in (pieces[b] for b in full)])
    blocks[:, harmonics == 0] += [[slope * turned[pieces[b]].mean()] for b in full]
    parts = np.concatenate([blocks.real, blocks.imag], axis=1)
    rows = seen_rows(harmonics, direction)
    seen, own, covariance = rows.any(axis=1), parts @ rows.T, np.zeros(rows.shape)  # of the data: all parts of an orbit
    covariance[np.ix_(seen, seen)], shrinkage = shrunk_covariance(own[:, seen])
    covariance = rows.T @ with_slow_noise(covariance, own, harmonics, seen) @ rows
    share = sizes[full].mean() / usable.sum()  # of a block in the record, by which the variance of the whole is smaller
    return node_facts(amplitude, covariance * share * widened, harmonics, noise_std, shrinkage, lines, blocks)


def _without_drift(fit, drift):
    """The slope of a straight line in the angle that is fitted with the harmonics, and the Fit without it."""
    power = np.vdot(drift.residual, drift.residual).real
    slope = np.vdot(drift.residual, fit.residual) / power
    inverse = fit.inverse + np.outer(drift.amplitude, drift.amplitude.conj()) / power
    return slope, Fit(fit.amplitude - slope * drift.amplitude, fit.residual - slope * drift.residual, inverse)


def _others(residual, usable, revolutions, harmonics):
    """Harmonics (other,) besides those fitted that the residual of the usable samples of whole revolutions shows."""
    orders = np.arange(1, int(np.ceil(len(usable) / 2 / revolutions)))
    if revolutions < FEWEST_BLOCKS:
        return orders[:0]
    whole = np.zeros(len(usable), complex)
    whole[usable] = residual
    power = np.abs(np.fft.fft(whole * np.sin(np.pi * (np.arange(len(whole)) + 0.5) / len(whole)) ** 2)) ** 2
    size = power[np.rint(np.multiply.outer([1, -1], orders) * revolutions).astype(int)].max(axis=0)
    strongest = np.argsort(-size, kind="stable")[:MOST_OTHERS]
    shown = orders[strongest[size[strongest] > LEAST_POWER * np.median(power) / np.log(2)]]
    return np.setdiff1d([*shown, *-shown], harmonics)


def _lines(signal, angle, usable, harmonics, orders):
    """The lines of some orders (line,) in a signal; slope of its drift; factor of the covariance; the Lines."""
    basis = rotating_basis(angle, 1.0, harmonics)
    both = np.concatenate([basis, line_basis(angle, orders), [angle - angle[usable].mean()]])
    amplitude, _, inverse = fit_basis(signal[usable], both[:, usable])
    alone = np.linalg.inv(basis[:, usable].conj() @ basis[:, usable].T)
    count = len(basis)
    wider = np.tile(np.sqrt((np.diag(inverse)[:count] / np.diag(alone)).real), 2)
    forward, backward = np.split(np.abs(amplitude[count:-1]), 2)
    lines = tuple(map(Line, orders.tolist(), forward.tolist(), backward.tolist()))
    return amplitude[count:-1] @ both[count:-1], amplitude[-1], np.outer(wider, wider), lines


def with_slow_noise(covariance, draws, harmonics, seen):
    """Covariance of draws (draw, component) that includes noise slower than a draw, which their scatter does not show.

    The power of the draws at line k of their Fourier transform is B (1 + c / k): white noise plus noise of power 1/f,
    down to one period in SLOWEST records. The variance of their mean, times their number, is then B times the integral
    of (1 + c / |x|) sinc^2 x. It is averaged over the corner c, with the prior WHITE that there is no such noise; B is
    marginalised (exponentially distributed powers). A line within a cycle of a harmonic is seen as slow noise of it.

    seen : (component,) whether a component is a datum; the others are zero
    """
    count, size = len(draws), len(harmonics)
    lines = np.arange(1, (count - 1) // 2 + 1)
    power = np.abs(np.fft.fft(draws, axis=0)[lines]) ** 2 / count
    power = power.reshape(len(lines), 2, size)  # real and imaginary parts have levels of their own
    white, variance = np.diag(covariance).reshape(2, size), np.maximum(power.mean(axis=0), np.finfo(float).tiny)
    corners = np.geomspace(1.0, 2.0 * count, CORNERS)
    shape = 1 + np.concatenate([[0.0], corners])[:, None] / lines  # (corner, line)
    level = np.mean(power / shape[..., None, None], axis=1)  # (corner, part, harmonic)
    level = np.maximum(level, np.finfo(float).tiny)
    data = seen.reshape(2, size)
    evidence = -data.sum(axis=0) * np.log(shape).sum(axis=1)[:, None]
    evidence = evidence - len(lines) * (data * np.log(level / variance)).sum(axis=1)
    prior = np.where(harmonics == 0, *WHITE)
    known = np.concatenate([[prior], np.broadcast_to((1 - prior) / CORNERS, (CORNERS, size))])
    weight = known * np.exp(evidence - evidence.max(axis=0))
    weight = weight / weight.sum(axis=0)
    slow = 3 - 2 * np.euler_gamma - 2 * np.log(2 * np.pi / SLOWEST)  # integral of sinc^2 x / |x| beyond 1 / SLOWEST
    found = weight[0] * white + np.einsum("ch,cph->ph", weight[1:] * (1 + slow * corners)[:, None], level[1:])
    wider = np.sqrt(np.maximum(found / np.maximum(white, np.finfo(float).tiny), 1)).ravel()
    return covariance * np.outer(wider, wider)


def shrunk_covariance(draws):
    """Covariance of draws (draw, component), shrunk towards white noise: equal variances, no correlation.

    The sample covariance of few draws is singular, and its smallest variances are biased low. The variances are shrunk
    towards a common value (`shrunk_variances`), the correlations towards zero with the weight of Schäfer and Strimmer
    (2005): the sum of their sampling variances over the sum of their squares. The weight is 1 for white noise, and
    small for noise that clearly differs between harmonics or is correlated.

    returns : (component, component) in the squared unit of the draws; weights of common variance and zero correlation
    """
    count, size = draws.shape
    freedom = count - 1
    centred = draws - draws.mean(axis=0)
    variance = np.sum(centred**2, axis=0) / freedom
    if not variance.any():
        return np.zeros((size, size)), (1.0, 1.0)
    variance = np.maximum(variance, 1e-24 * variance.max())
    shrunk, pull = shrunk_variances(variance, freedom)
    scaled = centred / np.sqrt(variance)
    products = scaled[:, :, None] * scaled[:, None, :]
    mean = products.mean(axis=0)
    correlation = mean * count / freedom
    scatter = count / freedom**3 * np.sum((products - mean) ** 2, axis=0)
    off = ~np.eye(size, dtype=bool)
    loosen = float(min(1.0, np.sum(scatter[off]) / max(np.sum(correlation[off] ** 2), 1e-300)))
    correlation = (1 - loosen) * correlation
    np.fill_diagonal(correlation, 1.0)
    return correlation * np.sqrt(np.outer(shrunk, shrunk)), (pull, loosen)


def shrunk_variances(variance, freedom):
    """Sample variances (component,) shrunk towards a common value, and its weight d0 / (d0 + freedom).

    Empirical Bayes (Smyth 2004): the true variances have a scaled inverse chi-square distribution with d0 degrees of
    freedom; d0 follows from the variance of the logarithms less their sampling variance trigamma(freedom / 2).
    """
    from scipy.optimize import brentq
    from scipy.special import digamma, polygamma

    logs = np.log(variance) - digamma(freedom / 2) + np.log(freedom / 2)
    spread = logs.var(ddof=1) - polygamma(1, freedom / 2)
    narrowest, widest = polygamma(1, 1e4), polygamma(1, 0.05)
    if spread <= narrowest:
        return np.full_like(variance, variance.mean()), 1.0
    half = brentq(lambda x: polygamma(1, x) - min(spread, widest), 0.05, 1e4)
    common = np.exp(logs.mean() + digamma(half) - np.log(half))
    pull = float(2 * half / (2 * half + freedom))
    return (1 - pull) * variance + pull * common, pull


def with_phase_noise(amplitude, covariance, harmonics, variance):
    """Covariance (..., component, component) m^2 with the error of the phase mark, rad^2, which turns nX n times."""
    turned = 1j * np.asarray(harmonics) * amplitude
    return covariance + shared_error_covariance(turned[..., None], np.asarray(variance)[..., None, None])


def trend(blocks):
    """Change (harmonic,), m, over blocks (block, harmonic) by a linear trend; p-value of the largest, if steady."""
    from scipy.special import fdtrc

    parts = np.concatenate([blocks.real, blocks.imag], axis=1)
    place = np.arange(len(parts)) - (len(parts) - 1) / 2
    centred = parts - parts.mean(axis=0)
    slope = place @ centred / (place @ place)
    explained = slope**2 * (place @ place)
    left = np.sum(centred**2, axis=0) - explained
    freedom = len(parts) - 2
    ratio = explained / np.maximum(left / freedom, 1e-300)
    lowest = fdtrc(1, freedom, ratio).min()
    change = np.hypot(*np.split(slope, 2)) * len(blocks)
    return change, float(min(1.0, lowest * len(ratio)))  # Bonferroni: the largest of all components
