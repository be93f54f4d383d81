"""Spectral lines beside the harmonics of the spin speed: whirl, subharmonics, hum, natural frequencies."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.measurement.angle_fit import fit_harmonics
from rotorstudy.response.series import rotating_basis

MOST_LINES = 6
LEAST_POWER = 35.0  # of a line over the noise around it; noise alone exceeds that once in 1e4 records
LEAST_SHARE = 1e-4  # of the rms vibration; a smaller line does not matter
LEAST_CYCLES = 5.0  # in the record; slower motion is drift
BESIDE_HARMONIC = 3.0  # cycles in the record within which a line may be a modulated harmonic
NARROW, WIDE = 4, 12  # lines on either side from which the noise at a line follows, of slow and of other lines
LONG = 100_000  # samples of a record whose number is made one that is quick to transform
LINES_AT_ONCE = 4096  # whose noise is computed together
STEPS = 4  # Gauss-Newton, from within half a line


@dataclass(frozen=True)
class Line:
    """A line that is not synchronous: frequency over the spin speed, amplitudes (m) of its circular parts."""

    order: float
    forward: float
    backward: float


def orders_of_lines(signal, angle, harmonics, residual=None):
    """Orders (line,) beside the harmonics of a record (time,), m, most power first; residual : of their fit."""
    synchronous, found, left_out = None, np.zeros(0), np.zeros(0)
    cycle = 2 * np.pi / (angle[-1] - angle[0])
    left = fit_harmonics(signal, angle, harmonics).residual if residual is None else residual
    for _ in range(MOST_LINES):
        order = _strongest(left, angle, np.append(found, left_out), LEAST_SHARE * signal.std())
        if order is None:
            break
        synchronous = rotating_basis(angle, 1.0, harmonics) if synchronous is None else synchronous
        refined = _refined(signal, angle, synchronous, np.append(found, order))
        beside = np.concatenate([found, [np.rint(refined[-1])]])
        if np.abs(refined[-1] - beside).min() <= BESIDE_HARMONIC * cycle:  # the skirt of another line
            left_out = np.append(left_out, order)
            continue
        found = refined
        left = _without(signal, np.concatenate([synchronous, line_basis(angle, found)]))
    return found


def line_basis(angle, orders):
    """(2 * line, time) forward parts of all lines, then backward parts."""
    forward = np.exp(1j * np.multiply.outer(orders, angle))
    return np.concatenate([forward, forward.conj()])


def _without(signal, basis):
    """A signal (..., time) without its least-squares fit on a basis (column, time)."""
    return signal - np.linalg.solve(basis.conj() @ basis.T, basis.conj() @ signal.T).T @ basis


def _strongest(residual, angle, known, least):
    """Order of the strongest line in a residual, above an amplitude (m) and beside known ones, or None.

    The transform has a Hann window. The noise at a line is the median of the power around it, which it does not change.
    """
    from scipy.fft import fft, prev_fast_len

    if len(residual) > LONG:  # without a few last samples the transform takes a tenth of the time
        kept = prev_fast_len(len(residual))
        residual, angle = residual[:kept], angle[:kept]
    samples = len(residual)
    revolutions = samples * (angle[-1] - angle[0]) / (samples - 1) / (2 * np.pi)
    window = np.sin(np.pi * (np.arange(samples) + 0.5) / samples) ** 2
    power = np.abs(fft(residual * window)) ** 2
    cycles = np.fft.fftfreq(samples, 1 / samples)
    strong = np.flatnonzero((power > (least * window.sum()) ** 2) & (np.abs(cycles) >= LEAST_CYCLES))
    orders, others = cycles[strong] / revolutions, np.concatenate([[np.inf], known, -known])
    apart = np.minimum(np.abs(orders - np.rint(orders)), np.abs(orders[:, None] - others).min(axis=1)) * revolutions
    top = _above_noise(power, cycles, strong[apart > BESIDE_HARMONIC])
    if top is None:
        return None
    below, here, above = np.log(power[[top - 1, top, (top + 1) % samples]])
    offset = 0.5 * (below - above) / (below - 2 * here + above)
    return abs(cycles[top] + float(np.clip(offset, -0.5, 0.5))) / revolutions


def _above_noise(power, cycles, lines):
    """The line (position) of most power among some, of those whose power exceeds the noise around it; None if none."""
    lines = lines[np.argsort(-power[lines], kind="stable")]
    for first in range(0, len(lines), LINES_AT_ONCE):
        some = lines[first : first + LINES_AT_ONCE]
        around = [power[(some[:, None] + np.arange(-width, width + 1)) % len(power)] for width in (NARROW, WIDE)]
        medians = [np.partition(beside, beside.shape[1] // 2)[:, beside.shape[1] // 2] for beside in around]
        noise = np.where(np.abs(cycles[some]) < 2 * WIDE, *medians) / np.log(2)
        above = np.flatnonzero(power[some] / np.maximum(noise, np.finfo(float).tiny) > LEAST_POWER)
        if len(above):
            return some[above[0]]
    return None


def _refined(signal, angle, synchronous, orders):
    """Orders (line,) that minimise the residual of harmonics and lines, by Gauss-Newton steps."""
    line = 2 * np.pi / (angle[-1] - angle[0])
    start = orders
    for _ in range(STEPS):
        lines = line_basis(angle, orders)
        basis = np.concatenate([synchronous, lines])
        amplitude = np.linalg.solve(basis.conj() @ basis.T, basis.conj() @ signal)
        forward, backward = np.split((1j * amplitude[len(synchronous) :, None] * lines), 2)
        columns = _without((forward - backward) * (angle - angle.mean()), basis)
        off = signal - amplitude @ basis
        normal, right = (columns.conj() @ columns.T).real, (columns.conj() @ off).real
        step = np.linalg.lstsq(normal, right, rcond=1e-12)[0]
        orders = np.clip(orders + step, start - line, start + line)
    return orders
