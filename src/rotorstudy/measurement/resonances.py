"""Critical speeds and amplification factors of 1X over speed, also where the vectors beat as in a fast run-up.

Near a mode with the critical speed w_k and the decay rate d_k (half the half-power bandwidth) a vector of 1X is
proportional to 1 / (d_k + j (w - w_k)) at steady speeds, and in a sweep at the rate a to the integral over tau > 0 of
exp(-(d_k + j (w - w_k)) tau + j a tau^2 / 2), an error function. Other modes add what changes linearly over the range.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from rotorstudy.measurement.findings import told
from rotorstudy.measurement.run_up import FAST, peaks
from rotorstudy.units import number, quantity, um

MOST_MODES = 2
FEWEST_SPEEDS = 20
START_RATES = (0.3, 1.0, 3.0)  # over the square of half the bandwidth that shows
START_SHIFTS = (0.0, 0.5, 1.0)  # of a critical speed below the speed of the peak, in bandwidths
START_APART = (-1.0, -0.5, 0.5, 1.0)  # of a second mode, in bandwidths
FIRST_STEPS, REFINED, LAST_STEPS = 8, 3, 100  # of all starts, of the best ones
WIDEST = 4.0  # in ln, of a decay rate from that of the bandwidth that shows
MUCH = 10.0  # in BIC, by which a mode or a sweep must improve the fit
NEGLIGIBLE = 0.01  # of the largest amplitude: a smaller vector is noise
LEAST_FACTOR = 2.5  # amplification factor of a critical speed by API 617; a lower one is no resonance


@dataclass(frozen=True)
class Resonances:
    """Modes fitted to 1X: speed, decay (mode,), rad/s, 1/s; rate of sweep, rad/s^2; noise: rms of the residual, m."""

    speed: np.ndarray
    decay: np.ndarray
    rate: float
    covariance: np.ndarray  # (parameter, parameter) of rate, speed, ln decay (without the rate if that is zero)
    noise: float

    @property
    def amplification(self):
        """(mode,) critical speed over half-power bandwidth."""
        return self.speed / (2 * self.decay)

    @property
    def std(self):
        """Standard deviations of the rate, of the speeds (mode,), and of the amplification factors (mode,)."""
        count = len(self.speed)
        covariance = self.covariance[-2 * count :, -2 * count :]
        slope = np.hstack([np.diag(1 / self.speed), -np.eye(count)])
        relative = np.sqrt(np.diag(slope @ covariance @ slope.T))
        rate = np.sqrt(self.covariance[0, 0]) if self.rate else 0.0
        return float(rate), np.sqrt(np.diag(covariance))[:count], self.amplification * relative


def vectors_1x(spectrum):
    """{name: (speed,) complex m} of 1X, but the negligible: forward and backward of orbits, of a single probe its own.

    All of them lag with the force of e^{jwt}: the backward one is conj(R_-1), as R_-1 itself is the factor of e^{-jwt}.
    """
    order, found = list(spectrum.harmonics), {}
    for s, node in enumerate(spectrum.sensors):
        forward, backward = (spectrum.amplitude[:, order.index(n), s] for n in (1, -1))
        if node in spectrum.single_probes:
            found[f"probe, node {node}"] = 2 * np.exp(-1j * spectrum.directions[s]) * forward
        else:
            found |= {f"forward, node {node}": forward, f"backward, node {node}": backward.conj()}
    largest = max(np.abs(vector).max() for vector in found.values())
    return {name: vector for name, vector in found.items() if np.abs(vector).max() > NEGLIGIBLE * largest}


def check_resonances(spectrum, swept, where):
    """Findings on the critical speeds that 1X over speed shows, and on a sweep that its vectors were measured in."""
    if not {1, -1} <= set(spectrum.harmonics.tolist()):
        return
    order, vectors = np.argsort(spectrum.speed), list(vectors_1x(spectrum).values())
    found = find_resonances(spectrum.speed[order], np.array(vectors)[:, order], swept) if vectors else None
    if found is None:
        return
    rate_std, speed_std, factor_std = found.std
    each = [
        f"{quantity(speed, 'rad/s', std)} (amplification factor {quantity(factor, '1', spread)})"
        for speed, std, factor, spread in zip(found.speed, speed_std, found.amplification, factor_std, strict=True)
        if factor >= LEAST_FACTOR
    ]
    if each:
        yield told("critical speeds", where, each=" and ".join(each), residual=um(found.noise))
    ratio = abs(found.rate) / (2 * found.decay.min()) ** 2
    if each and ratio > FAST:
        rate = quantity(found.rate, "1", rate_std)
        yield told("sweep too fast (vectors)", where, rate=rate, times=number(ratio, 2))


def modal_passage(offset, decay, rate):
    """(...) response of a mode in a sweep, over 1 / decay rate. offset : speed less critical speed; rate : rad/s^2."""
    from scipy.special import wofz

    s = decay + 1j * offset
    if rate == 0:
        return decay / s
    root = np.sqrt(-0.5j * rate + 0j)
    return decay * np.sqrt(np.pi) / (2 * root) * wofz(0.5j * s / root)


def find_resonances(speed, vectors, swept):
    """The Resonances of 1X (vector, speed), m: one or two modes by the Bayesian information criterion, or None."""
    if len(speed) < FEWEST_SPEEDS:
        return None
    resonances = peaks(speed, np.sqrt(np.sum(np.abs(vectors) ** 2, axis=0)))
    if not resonances:
        return None
    *shown, height = max(resonances, key=lambda one: one[2])
    vectors, found = vectors / height, {}  # as the tolerances of the fit are absolute
    for modes in range(1, MOST_MODES + 1):
        for rates in [False, True] if swept else [False]:
            found[modes, rates] = _fitted(speed, vectors, modes, rates, *shown)
    best = min(found.values(), key=lambda fit: fit.cost)
    count = 2 * vectors.size * _independent(best.fun.reshape(2, *vectors.shape))
    chosen = None
    for (modes, rates), fit in sorted(found.items()):
        complexity = len(fit.x) + 2 * len(vectors) * (2 + modes)
        score = count * np.log(fit.cost) + complexity * np.log(count)
        if chosen is None or score < chosen[0] - MUCH:
            chosen = score, complexity, fit, modes, rates
    _, complexity, fit, modes, rates = chosen
    size, linear = 2 * vectors.size, np.vstack([np.ones_like(speed), speed - speed.mean()]).T
    left = np.linalg.lstsq(linear, vectors.T, rcond=None)[1].sum() / 2  # by a linear change over the range alone
    more = complexity - 4 * len(vectors)  # than that has
    if size * np.log(left / fit.cost) < more * np.log(size) + MUCH:
        return None
    variance = 2 * fit.cost / (count * (1 - complexity / size))
    covariance = variance * np.linalg.inv(fit.jac.T @ fit.jac)
    order = np.argsort(fit.x[-2 * modes : -modes])
    place = [*range(rates), *(rates + order), *(rates + modes + order)]
    values, covariance = fit.x[place], covariance[np.ix_(place, place)]
    noise = float(height * np.sqrt(2 * fit.cost / (size - complexity)))
    rate = float(values[0]) if rates else 0.0
    return Resonances(values[rates : rates + modes], np.exp(values[rates + modes :]), rate, covariance, noise)


def _fitted(speed, vectors, modes, rates, peak, bandwidth):
    """Least-squares fit of the rate (if it is free), speeds and ln decay rates, from the best of some starts."""
    from scipy.optimize import least_squares

    middle, half, stacked = speed.mean(), np.ptp(speed) / 2, vectors.T

    def residual(values):
        where, decay = values[-2 * modes : -modes, None], np.exp(values[-modes:, None])
        shapes = (speed / peak) ** 2 * modal_passage(speed - where, decay, values[0] if rates else 0.0)
        basis = np.vstack([np.ones_like(speed), (speed - middle) / half, shapes]).T
        left = (stacked - basis @ np.linalg.lstsq(basis, stacked, rcond=None)[0]).T
        return np.concatenate([left.real.ravel(), left.imag.ravel()])

    decay = np.log(bandwidth / 2)
    low = np.array([*([-np.inf] * rates), *([speed[0]] * modes), *([decay - WIDEST] * modes)])
    high = np.array([*([np.inf] * rates), *([speed[-1]] * modes), *([decay + WIDEST] * modes)])

    def fit(start, steps):
        return least_squares(residual, np.clip(start, low, high), bounds=(low, high), x_scale="jac", max_nfev=steps)

    tried = [fit(start, FIRST_STEPS) for start in _starts(modes, rates, peak, bandwidth)]
    tried.sort(key=lambda one: one.cost)
    return min((fit(one.x, LAST_STEPS) for one in tried[:REFINED]), key=lambda one: one.cost)


def _starts(modes, rates, peak, bandwidth):
    """Values from which fits begin: the peak lies beyond a critical speed that is passed fast."""
    signs = [sign * r for r in START_RATES for sign in (1, -1)] if rates else [0.0]
    shifts, apart = START_SHIFTS if rates else START_SHIFTS[:1], START_APART if modes > 1 else [0.0]
    for sign, shift, second in product(signs, shifts, apart):
        first = peak - np.sign(sign) * shift * bandwidth
        where = [first, first + second * bandwidth][:modes]
        yield [*[sign * (bandwidth / 2) ** 2] * rates, *where, *[np.log(bandwidth / 2)] * modes]


def _independent(residual):
    """Share of independent values in a residual (..., speed), by its correlation from speed to speed."""
    beside = np.sum(residual[..., 1:] * residual[..., :-1]) / np.sum(residual**2)
    return float((1 - max(beside, 0)) / (1 + max(beside, 0)))
