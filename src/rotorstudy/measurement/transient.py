"""The steady harmonics of a sweep, from the impulse responses that explain those tracked in it.

Where natural frequencies do not depend on the speed, harmonic n at the angle A(t) of the shaft is the integral over the
delay s of h(s) exp(-jn (A(t) - A(t - s))), whatever the course of the speed, and at the steady speed w of
h(s) exp(-jnws). (A force that grows with w^2 is, with the tangential one of the accelerated unbalance, a second
derivative of exp(jA), and so within h.) What the windows show of h, and with it the difference of the two, is known
from the angles before and in them. So h is estimated, as a Gaussian process that fades as exp(-ds), beside a polynomial
in the speed, with the rate d of largest evidence; what it says of the difference corrects the tracked harmonics. The
variance is that of the noise and of what is left unknown of h, in gaps and beyond the ends. Where natural frequencies
change by a share g of the speed, g times the sweep rate over d^2 of a peak is left, which a single sweep cannot show.

Before the record the shaft is taken to have turned at its first speed, or to have accelerated as there; speeds for
which it matters are not known.
"""

import numpy as np

PLACES = np.linspace(-0.5, 0.5, 17)[1:-1]  # in a window, at which angles are compared
DEGREE = 3  # of the polynomial
REPEATED = 1.5  # ranges of speed after which what is not the polynomial repeats: delays are discrete
LONGEST = 4 * np.pi  # delay, over that by which the speed changes by the inverse of a window
RATES = 0.35 * 2.0 ** np.arange(6)  # of fading, that are tried, over the root of the sweep rate
BETWEEN = 2.0 ** np.array([-0.5, 0, 0.5])  # the best of them, over which is tried then
ALLOWED = 4.0  # variance of a coefficient of the polynomial, over the mean square of the harmonic
UNKNOWN = 0.5  # share of the variance by what is not known of h, above which a harmonic is not known
HIDDEN = 0.5  # standard deviations between the two courses before the record from which a harmonic is not known
FADED, LEAST_VARIANCE = 40.0, 1e-300  # exponent from which a variance is zero; m^2


def hann(place):
    """Weights of a Hann window of which a place is -0.5 ... 0.5."""
    return np.where(np.abs(place) < 0.5, np.cos(np.pi * place) ** 2, 0.0)


def steady_harmonic(shown, variance, least, grid, there, n):
    """Steady harmonic n (node, step), m, from the one shown in a sweep; its variance; whether it is known.

    variance : (node, step) m^2, of the noise;  least : (node,) m^2, part of it that windows which overlap do not share
    there : (step, place) share of the samples that are there
    """
    turning, root = grid.turning, np.mean(grid.rate**2) ** 0.25
    delay = LONGEST / (abs(n) * root)
    before = [0.0] if grid.time.min() - delay > turning.marks[0] else [0.0, turning.first_rate]
    models, shared = [_model(grid, there, n, delay, rate) for rate in before], _shared_noise(grid)
    found, wider, known = shown.copy(), variance.copy(), np.ones(shown.shape, bool)
    for s in range(len(shown)):
        rate, std = root, np.sqrt(variance[s] - least[s])
        noise = shared * np.outer(std, std) + least[s] * np.eye(len(std))
        for tried in (RATES, BETWEEN):
            rate = max(rate * tried, key=lambda one: _explained(shown[s], noise, *models[0], one)[0])
        found[s], wider[s], left = _corrected(shown[s], noise, *models[0], rate)
        known[s] = left <= UNKNOWN * wider[s]
        for model in models[1:]:
            other = _corrected(shown[s], noise, *model, rate)[0]
            known[s] &= np.abs(found[s] - other) <= HIDDEN * np.sqrt(wider[s])
    return found, wider, known


def _model(grid, there, n, longest, before):
    """What windows show (step, unknown), and steady harmonics, of unit coefficients and responses; (unknown,) delays.

    before : rate, rad/s^2, at which the shaft accelerated before the record
    """
    middle, half = grid.speed.mean(), max(np.ptp(grid.speed) / 2, 1e-9)
    delay = np.arange(0, longest, 2 * np.pi / (abs(n) * 2 * REPEATED * half))
    window = hann(PLACES) * there
    moments = [(window * PLACES**power).sum(axis=1)[:, None] for power in range(3)]
    window = window * (moments[2] - moments[1] * PLACES) / (moments[0] * moments[2] - moments[1] ** 2)
    shown = 0.0
    for place, weight in zip(PLACES, window.T, strict=True):
        time = grid.time + place * grid.length
        angle, (off, rate) = grid.turning.angle(time), (grid.turning.speed(time) - middle, grid.turning.rate(time))
        turned = angle[:, None] - grid.turning.extended(time[:, None] - delay, before) - middle * delay
        powers = [np.ones(len(time)), off, off**2 - 1j * rate / n, off**3 - 3j * rate * off / n]
        powers = np.transpose([power / half**k for k, power in enumerate(powers)])
        shown = shown + weight[:, None] * np.hstack([powers, np.exp(-1j * n * turned)])
    off = (grid.speed - middle)[:, None]
    return shown, np.hstack([(off / half) ** np.arange(DEGREE + 1), np.exp(-1j * n * off * delay)]), delay


def _shared_noise(grid):
    """Correlation (step, step) of the noise of windows that overlap."""
    time = np.arange((grid.time - grid.length / 2).min(), (grid.time + grid.length / 2).max(), grid.length.min() / 16)
    window = hann((time - grid.time[:, None]) / grid.length[:, None])
    window /= np.linalg.norm(window, axis=1)[:, None]
    return window @ window.T


def _explained(shown, noise, model, steady, delay, rate):
    """Evidence of a rate of fading, variance of the coefficients, Cholesky factor, what is shown (step,) by it."""
    from scipy.linalg import cho_factor, cho_solve

    fading, size = np.exp(-2 * rate * delay[2 * rate * delay < FADED]), max(np.mean(np.abs(shown) ** 2), LEAST_VARIANCE)
    prior = size * np.concatenate([np.full(DEGREE + 1, ALLOWED), fading / fading.sum()])
    model = model[:, : len(prior)]
    factor = cho_factor((model * prior) @ model.conj().T + noise, lower=True)
    explained = cho_solve(factor, shown)
    return -np.vdot(shown, explained).real - 2 * np.log(np.diag(factor[0]).real).sum(), prior, factor, explained


def _corrected(shown, noise, model, steady, delay, rate):
    """Steady harmonic (step,), its variance, and that by what is not known of the response."""
    from scipy.linalg import cho_solve

    _, prior, factor, explained = _explained(shown, noise, model, steady, delay, rate)
    model, steady = model[:, : len(prior)], steady[:, : len(prior)]
    gain = np.eye(len(shown)) + cho_solve(factor, (model * prior) @ (steady - model).conj().T).conj().T
    left = (np.abs(gain @ model - steady) ** 2) @ prior
    variance = left + np.sum(gain @ noise * gain.conj(), axis=1).real
    wider = max(1.0, np.vdot(shown, explained).real / len(shown))
    return gain @ shown, variance * wider, left * wider
