"""Order tracking of run-ups and coast-downs: the steady harmonics over speed that a sweep shows.

At the speed w with the rate a, harmonics and their linear change are fitted by least squares to a Hann window of
T = 1 / sqrt(a), or of four revolutions if that is longer. The variance is that of white noise over 2 T / 3: a longer
window gains noise with its root, and shows less of what beats. A shorter one gains nothing, as a sweep excites all
frequencies within sqrt(a) together. What the windows show is corrected to the steady harmonics (see `transient`).

Source: Markert and Seidler 2001, Analytically based estimation of the maximum amplitude during passage through
resonance (the passage); Fyfe and Munck 1997 (order tracking by resampled angle).
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.harmonics import circular_covariance, fit_basis, noise_power, with_phase_noise
from rotorstudy.measurement.spectrum import along_probe
from rotorstudy.measurement.transient import PLACES, hann, steady_harmonic
from rotorstudy.response.series import rotating_basis
from rotorstudy.response.whirl import HALF_POWER

LEAST_REVOLUTIONS = 4.0  # in a window, so that neighbouring harmonics are separated
STEPS = 4  # of speed in a window, of which the correction is made
LEAST_APART = 2e-3  # relative, of the speeds that are given: nearer ones count as repeats of one speed
APART = 3  # steps between the speeds that are given: the noise of windows 3/4 apart is uncorrelated (1 %)
LEAST_SEEN = 0.95  # of a window must be there
BLOCK, BESIDE = 160, 64  # steps that are corrected together, and steps on either side that tell something about them
EXACT = 1e-5  # of the greatest motion: least standard deviation, as of 16 bits
PEAK = 3.0  # ratio of a resonance to the lowest response on either side
SWEPT = 0.2  # relative change of the speed over a record from which it is a run-up or a coast-down
FEWEST_MARKS = 40  # of a sweep
REMOVED = 0.02  # transient, of the peak, of which a part that is left may count
FAST, LOST = 0.1, 0.5  # rate over the squared half-power bandwidth: beats show; they cannot be corrected


class Grid(NamedTuple):
    """Time, speed, its rate and the window length at steps (step,) of a sweep; given : steps that are given."""

    time: np.ndarray
    speed: np.ndarray
    rate: np.ndarray
    length: np.ndarray
    given: np.ndarray
    turning: object  # Turning

    def at(self, steps):
        """The Grid of some steps."""
        return Grid(*(one[steps] for one in self[:4]), np.arange(0), self.turning)


def speed_grid(sweep):
    """The Grid of the Turning of a run-up or coast-down: even in speed, and before and after it even in time."""
    start, end = sweep.ends
    time = np.linspace(start, end, 4000)
    speed = sweep.speed(time)
    rising = speed[-1] > speed[0]
    speed = np.maximum.accumulate(speed if rising else speed[::-1])
    time = time if rising else time[::-1]
    usual = abs(speed[-1] - speed[0]) / (end - start)
    count = max(8, int(np.ceil(STEPS * (speed[-1] - speed[0]) / np.sqrt(usual))))
    at = np.interp(np.linspace(speed[0], speed[-1], count), speed + 1e-9 * np.arange(len(speed)), time)
    beyond = np.arange(1, BESIDE + 1) * (time[-1] - time[0]) / (end - start) / (STEPS * np.sqrt(usual))
    at = np.concatenate([time[0] - beyond[::-1], at, time[-1] + beyond])
    swept = np.repeat([False, True, False], [BESIDE, count, BESIDE])
    within = np.clip(at, *sweep.marks[[0, -1]])
    rate, shortest = sweep.rate(within), LEAST_REVOLUTIONS * 2 * np.pi / sweep.speed(within)
    length = np.maximum(1 / np.sqrt(np.maximum(np.abs(rate), 0.25 * usual)), shortest)
    inside = (at - length / 2 >= sweep.marks[0]) & (at + length / 2 <= sweep.marks[-1])
    at, rate, length, swept = at[inside], rate[inside], length[inside], swept[inside]
    speed, chosen = sweep.speed(at), []
    for i in np.flatnonzero(swept):
        last = chosen[-1] if chosen else i
        apart = abs(at[i] - at[last]) >= APART / STEPS * max(length[i], length[last])
        if not chosen or (apart and abs(speed[i] - speed[last]) >= LEAST_APART * speed[i]):
            chosen.append(i)
    return Grid(at, speed, rate, length, np.array(chosen, int), sweep)


def track(signals, time, angle, grid, harmonics, directions, mark_variance, shared_variance=0.0):
    """Harmonics (node, speed, harmonic), m, of signals (node, time), m; covariance; noise (node, speed) of a sample, m.

    Last whether those of a speed (speed,) are known: they depend more on what was recorded than on what was not.

    directions : (node,) rad of single probes, NaN for orbits
    mark_variance, shared_variance : rad^2, of the angle by the marks in each window (step,), and by all together
    """
    harmonics = np.asarray(harmonics)
    shown, covariance, noise, there = _fitted(signals, time, angle, grid, harmonics)
    for s, direction in enumerate(directions):
        channels = 2 if np.isnan(direction) else 1
        covariance[s] = along_probe(covariance[s] * 2 / channels, harmonics, direction)
        noise[s] /= np.sqrt(channels)
    least = (EXACT * np.nanmax(np.abs(shown[..., harmonics != 0]), axis=(1, 2), initial=0.0)) ** 2
    covariance = with_phase_noise(shown, covariance, harmonics, mark_variance)
    covariance += least[:, None, None, None] / 2 * np.eye(2 * len(harmonics))
    variance = np.diagonal(covariance, axis1=-2, axis2=-1).reshape(*shown.shape[:2], 2, -1).sum(axis=2)
    steady, wider, known = shown.copy(), variance.copy(), np.zeros(len(grid.time), bool)
    seen = np.flatnonzero(np.isfinite(noise).all(axis=0))
    for core in np.array_split(seen, int(np.ceil(len(seen) / BLOCK))) if len(seen) else ():
        part = seen[(seen >= core[0] - BESIDE) & (seen <= core[-1] + BESIDE)]
        own, block, known[core] = np.isin(part, core), grid.at(part), True
        for h in np.flatnonzero(harmonics):
            own_shown, own_variance, n = shown[:, part, h], variance[:, part, h], int(harmonics[h])
            found = steady_harmonic(own_shown, own_variance, least, block, there[part], n)
            steady[:, core, h], wider[:, core, h], own_known = (one[:, own] for one in found)
            known[core] &= own_known.all(axis=0)
    steady, covariance, noise = steady[:, grid.given], covariance[:, grid.given], noise[:, grid.given]
    wider = np.tile(np.sqrt(wider / variance)[:, grid.given], 2)
    covariance = covariance * wider[..., None] * wider[..., None, :]
    return steady, with_phase_noise(steady, covariance, harmonics, shared_variance), noise, known[grid.given]


def _fitted(signals, time, angle, grid, harmonics):
    """Harmonics (node, step, harmonic) of signals (node, time), covariance, noise; share of samples (step, place).

    NaN where most of a window is missing.
    """
    nodes, usable = len(signals), np.isfinite(signals).all(axis=0)
    amplitude = np.full((nodes, len(grid.time), len(harmonics)), np.nan, complex)
    covariance = np.zeros((nodes, len(grid.time), 2 * len(harmonics), 2 * len(harmonics)))
    noise, there = np.full((nodes, len(grid.time)), np.nan), np.ones((len(grid.time), len(PLACES)))
    for k, (middle, length) in enumerate(zip(grid.time, grid.length, strict=True)):
        every = np.arange(*np.searchsorted(time, [middle - length / 2, middle + length / 2]))
        here = every[usable[every]]
        if len(here) < len(every):
            cells = np.rint((time[every] - middle) / length * (len(PLACES) + 1)) + len(PLACES) // 2
            cells = np.clip(cells, 0, len(PLACES) - 1).astype(int)
            there[k] = np.bincount(cells, usable[every], len(PLACES)) / np.bincount(cells, minlength=len(PLACES))
            if hann(PLACES) @ there[k] < LEAST_SEEN * hann(PLACES).sum():
                continue
        place = (time[here] - middle) / length
        window = hann(place)
        steady = rotating_basis(angle[here], 1.0, harmonics)
        basis = np.concatenate([steady, place * steady])
        found, residual, inverse = fit_basis(signals[:, here], basis, window)
        amplitude[:, k] = found[:, : len(harmonics)]
        gain = inverse[: len(harmonics)] @ (basis.conj() * window)
        lines = np.unique(np.rint(harmonics * (angle[here[-1]] - angle[here[0]]) / (2 * np.pi)).astype(int))
        power = noise_power(residual, lines % len(here), window)
        covariance[:, k] = power[:, None, None] * circular_covariance(gain @ gain.conj().T)
        noise[:, k] = np.sqrt(power)
    return amplitude, covariance, noise, there


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
