"""Order tracking of run-ups and coast-downs: the steady harmonics over speed that a sweep shows.

Window. At the speed w with the rate a, harmonics and their linear change are fitted by least squares to a Hann window
of T = 1 / sqrt(a), or of four revolutions if that is longer. The curvature R'' (over speed) of a harmonic biases the
fit by a^2 T^2 R'' / 61, which at the peak of a mode of decay rate d is (a / d^2) / 30 of it, while the variance is
that of white noise over 2 T / 3: a longer window gains noise with its root and loses bias with its square. A shorter
one gains nothing, as a sweep excites all frequencies within sqrt(a) together.

Transient. In a sweep harmonic n is not the steady R_n(w) but, for a constant rate, exp(-(j a / 2n) d^2/dw^2) R_n: each
part of the impulse response, tau old, was excited with the phase of an earlier speed, off by n a tau^2 / 2. Over tau
(the Fourier transform over w) this is a factor of modulus one, so the steady harmonics follow by its inverse without
amplifying noise; the response of the Hann window, known in tau as well, is divided out down to one half. For a force
that grows with w^2 the expression holds with the tangential force of the accelerated unbalance, -j a / w^2 of it. It
is exact where natural frequencies do not depend on the speed; where they change by a share g of it, g a / d^2 is left.

Gaps. The inverse reaches as far as the motion remembers, so what is not recorded, in a gap or beyond an end, spoils
speeds whose windows do not touch it. It is filled in two ways; speeds at which these differ are not stated.

Source: Markert and Seidler 2001, Analytically based estimation of the maximum amplitude during passage through
resonance (the passage); Fyfe and Munck 1997 (order tracking by resampled angle).
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.harmonics import circular_covariance, fit_basis, noise_power, with_phase_noise
from rotorstudy.measurement.spectrum import along_probe
from rotorstudy.response.series import rotating_basis
from rotorstudy.response.whirl import HALF_POWER

LEAST_REVOLUTIONS = 4.0  # in a window, so that neighbouring harmonics are separated
STEPS = 4  # of speed in a window, on the grid of the correction
LEAST_APART = 2e-3  # relative, of the speeds that are given: nearer ones count as repeats of one speed
APART = 3  # steps between the speeds that are given: the noise of windows 3/4 apart is uncorrelated (1 %)
HANN_VARIANCE = 1 / 12 - 1 / (2 * np.pi**2)  # of time under a Hann window, in squared lengths
LEAST_PASSED = 0.5  # share that a window must pass of a part of the response for it to be restored
# degrees of the polynomials that fill gaps and continue the ends: of the result, and of what it is compared with
FILLED, CONTINUED = (5, 3), (3, 4)
EXACT = 1e-5  # of the greatest motion: least standard deviation, as of 16 bits; what the correction leaves is smaller
HIDDEN = 0.5  # standard deviations between the two from which a harmonic is not known
PEAK = 3.0  # ratio of a resonance to the lowest response on either side
SWEPT = 0.2  # relative change of the speed over a record from which it is a run-up or a coast-down
FEWEST_MARKS = 40  # of a sweep
FAST, LOST = 0.1, 0.5  # rate over the squared half-power bandwidth: beats show; they cannot be corrected


class Grid(NamedTuple):
    """Time, speed, its rate and the window length at steps (step,) of a sweep; given : steps that are given."""

    time: np.ndarray
    speed: np.ndarray
    rate: np.ndarray
    length: np.ndarray
    given: np.ndarray


def speed_grid(sweep):
    """The Grid of the Turning of a run-up or coast-down: even in speed, with windows within the record."""
    start, end = sweep.ends
    time = np.linspace(start, end, 4000)
    speed = sweep.speed(time)
    rising = speed[-1] > speed[0]
    speed = np.maximum.accumulate(speed if rising else speed[::-1])
    time = time if rising else time[::-1]
    usual = abs(speed[-1] - speed[0]) / (end - start)
    count = max(8, int(np.ceil(STEPS * (speed[-1] - speed[0]) / np.sqrt(usual))))
    at = np.interp(np.linspace(speed[0], speed[-1], count), speed + 1e-9 * np.arange(len(speed)), time)
    rate = sweep.rate(at)
    shortest = LEAST_REVOLUTIONS * 2 * np.pi / sweep.speed(at)
    length = np.maximum(1 / np.sqrt(np.maximum(np.abs(rate), 0.25 * usual)), shortest)
    inside = (at - length / 2 >= start) & (at + length / 2 <= end)
    at, rate, length = at[inside], rate[inside], length[inside]
    speed = sweep.speed(at)
    chosen = [0]
    for i in range(1, len(at)):
        last = chosen[-1]
        apart = abs(at[i] - at[last]) >= APART / STEPS * max(length[i], length[last])
        if apart and abs(speed[i] - speed[last]) >= LEAST_APART * speed[i]:
            chosen.append(i)
    return Grid(at, speed, rate, length, np.array(chosen))


def track(signals, time, angle, grid, harmonics, directions, mark_variance):
    """Harmonics (node, speed, harmonic), m, of signals (node, time), m; covariance; noise (node, speed) of a sample, m.

    Gaps are filled and both ends continued in two ways. Speeds at which the harmonics depend on the way are NaN.

    directions : (node,) rad of single probes, NaN for orbits
    """
    harmonics, degrees = np.asarray(harmonics), FILLED if np.isnan(signals).any() else FILLED[:1]
    fits = [
        _fitted(_filled(signals, time, angle, grid, harmonics, one), time, angle, grid, harmonics) for one in degrees
    ]
    ways = zip((fits[0][0], fits[-1][0]), CONTINUED, strict=True)
    found = [[[_steady(fit[:, h], grid, n, one) for h, n in enumerate(harmonics)] for fit in own] for own, one in ways]
    steady, other = np.swapaxes(found, 2, 3)[:, :, grid.given]
    covariance, noise = fits[0][1][:, grid.given] * _noise_gain(), fits[0][2][:, grid.given]
    least = EXACT * np.abs(steady[..., harmonics != 0]).max(axis=(1, 2), initial=0.0)
    covariance += least[:, None, None, None] ** 2 / 2 * np.eye(2 * len(harmonics))
    for s, direction in enumerate(directions):
        channels = 2 if np.isnan(direction) else 1
        covariance[s] = along_probe(covariance[s] * 2 / channels, harmonics, direction)
        noise[s] /= np.sqrt(channels)
    covariance = with_phase_noise(steady, covariance, harmonics, mark_variance)
    variance = np.diagonal(covariance, axis1=-2, axis2=-1).reshape(*steady.shape[:2], 2, -1).sum(axis=2)
    steady[:, (np.abs(steady - other) > HIDDEN * np.sqrt(variance)).any(axis=(0, 2))] = np.nan
    return steady, covariance, noise


def _filled(signals, time, angle, grid, harmonics, degree):
    """Signals (node, time) with the samples that windows lack: harmonics that change as polynomials of a degree."""
    there = np.isfinite(signals).all(axis=0)
    known, filled = np.flatnonzero(there), signals.copy()
    for middle, length in zip(grid.time, grid.length, strict=True):
        first, last = np.searchsorted(time, [middle - length / 2, middle + length / 2])
        lost = first + np.flatnonzero(~there[first:last])
        if len(lost):
            at, count = np.searchsorted(known, (first + last) // 2), last - first
            near = known[max(at - count, 0) : at + count]
            here = np.concatenate([near, lost])
            place, steady = (time[here] - middle) / np.ptp(time[here]), rotating_basis(angle[here], 1.0, harmonics)
            basis = np.concatenate([place**power * steady for power in range(degree + 1)])
            found = np.linalg.lstsq(basis[:, : len(near)].T, signals[:, near].T)[0]
            filled[:, lost] = found.T @ basis[:, len(near) :]
    return filled


def _fitted(signals, time, angle, grid, harmonics):
    """Harmonics (node, step, harmonic) of signals (node, time); at steps that are given covariance and noise, too."""
    nodes = len(signals)
    amplitude = np.zeros((nodes, len(grid.time), len(harmonics)), complex)
    covariance = np.zeros((nodes, len(grid.time), 2 * len(harmonics), 2 * len(harmonics)))
    noise = np.zeros((nodes, len(grid.time)))
    given = set(grid.given.tolist())
    for k, (middle, length) in enumerate(zip(grid.time, grid.length, strict=True)):
        here = np.arange(*np.searchsorted(time, [middle - length / 2, middle + length / 2]))
        place = (time[here] - middle) / length
        window = np.cos(np.pi * place) ** 2
        steady = rotating_basis(angle[here], 1.0, harmonics)
        basis = np.concatenate([steady, place * steady])
        found, residual, inverse = fit_basis(signals[:, here], basis, window)
        amplitude[:, k] = found[:, : len(harmonics)]
        if k in given:
            gain = inverse[: len(harmonics)] @ (basis.conj() * window)
            lines = np.unique(np.rint(harmonics * (angle[here[-1]] - angle[here[0]]) / (2 * np.pi)).astype(int))
            power = noise_power(residual, lines % len(here), window)
            covariance[:, k] = power[:, None, None] * circular_covariance(gain @ gain.conj().T)
            noise[:, k] = np.sqrt(power)
    return amplitude, covariance, noise


def _passed(lines):
    """Share of a part of the response that a Hann window passes. lines : its frequency times the window's length."""
    return np.sinc(lines) + (np.sinc(lines - 1) + np.sinc(lines + 1)) / 2


def _noise_gain():
    """Factor of the variance of white noise by the restored response of the window."""
    lines = np.linspace(0, STEPS / 2, 2000)
    passed = _passed(lines)
    return float(np.sum((passed / np.maximum(passed, LEAST_PASSED)) ** 2) / np.sum(passed**2))


def _steady(tracked, grid, n, degree):
    """(step,) steady harmonic n, from that tracked in a sweep (step,).

    The transform repeats the range of speeds. So a polynomial with the values, slopes and curvatures of both ends is
    treated apart, by the series of the same operators, and what it leaves is continued by reflection at its ends.

    degree : of the polynomials by which these are known
    """
    if n == 0:
        return tracked
    count = len(tracked)
    step = (grid.speed[-1] - grid.speed[0]) / (count - 1)
    turned, widened = 0.5j * grid.rate / n, HANN_VARIANCE / 2 * (grid.rate * grid.length) ** 2
    trend = _between_its_ends(tracked, step, degree)
    place = step * np.arange(count)
    left = tracked - trend(place)
    beyond = min(count - 1, max(16, count // 4))
    fading = np.cos(np.pi / 2 * np.arange(1, beyond + 1) / (beyond + 1)) ** 2
    whole = np.concatenate([-(left[1 : beyond + 1] * fading)[::-1], left, -left[-2 : -beyond - 2 : -1] * fading])
    tau = 2 * np.pi * np.fft.fftfreq(len(whole), step)
    lag = np.exp(1j * np.outer(place + beyond * step, tau) - np.outer(turned, tau**2))
    passed = _passed(np.outer(grid.rate * grid.length, tau) / (2 * np.pi))
    found = (lag / np.maximum(passed, LEAST_PASSED)) @ np.fft.fft(whole) / len(whole)
    return found + trend(place) + (turned - widened) * trend(place, 2) + turned**2 / 2 * trend(place, 4)


def _between_its_ends(tracked, step, degree):
    """Polynomial of the fifth degree with the value, slope and curvature of a curve (step,) at both its ends."""
    from scipy.interpolate import BPoly

    part = min(len(tracked), degree * STEPS + 1)
    place = step * np.arange(part)
    first = np.polyfit(place, tracked[:part], degree)[::-1][:3] * [1, 1, 2]
    last = np.polyfit(place - place[-1], tracked[-part:], degree)[::-1][:3] * [1, 1, 2]
    return BPoly.from_derivatives([0, step * (len(tracked) - 1)], [first, last])


def peaks(speed, size):
    """[(speed, half-power bandwidth, height)] of what exceeds the lowest response on either side by the factor PEAK."""
    from scipy.signal import find_peaks, peak_widths

    at, found = find_peaks(size, prominence=0)
    at = at[found["prominences"] >= (1 - 1 / PEAK) * size[at]]
    of_zero = size[at], np.zeros(len(at), int), np.full(len(at), len(size) - 1)
    *_, left, right = peak_widths(size, at, 1 - HALF_POWER, of_zero)
    low, high = (np.interp(ends, np.arange(len(size)), speed) for ends in (left, right))
    return list(zip(speed[at].tolist(), (high - low).tolist(), size[at].tolist(), strict=True))


def is_swept(pulses):
    """Whether pulses (pulse,) s belong to a run-up or coast-down."""
    if len(pulses) < FEWEST_MARKS:
        return False
    period = np.diff(pulses)
    some = max(5, len(period) // 20)
    ends = sorted([np.median(period[:some]), np.median(period[-some:]), np.median(period)])
    return bool(ends[-1] > (1 + SWEPT) * ends[0])
