"""Spectral lines beside the harmonics of the spin speed, and what they are likely to be: whirl, hum, subharmonics."""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.angle_fit import fit_basis, fit_harmonics
from rotorstudy.measurement.findings import told
from rotorstudy.response.series import rotating_basis
from rotorstudy.units import um

MOST_LINES = 6
LEAST_POWER = 35.0  # of a line over the noise around it; noise alone exceeds that once in 1e4 records
LEAST_SHARE = 1e-4  # of the rms vibration; a smaller line does not matter
LEAST_CYCLES = 5.0  # in the record; slower motion is drift
BESIDE_HARMONIC = 3.0  # cycles in the record within which a line may be a modulated harmonic
NARROW, WIDE = 4, 12  # lines on either side from which the noise at a line follows, of slow and of other lines
LONG = 100_000  # samples of a record that is cut to a number quick to transform, and needs twice WIDE lines
STEPS = 4
MAINS_HZ = (50.0, 60.0)
MOST_MAINS = 6  # multiples of the mains frequency
MAINS_OFF = 0.004  # relative: mains are within 0.2 Hz of 50 Hz
SUBHARMONICS = {"1/2": 1 / 2, "1/3": 1 / 3, "1/4": 1 / 4, "2/3": 2 / 3, "3/2": 3 / 2}
SUBHARMONIC_OFF = 0.002  # of an order, or a fifth of a cycle in the record
WHIRL = (0.38, 0.495)  # orders; Muszynska 2005, Rotordynamics: 0.40 to 0.49 for fluid whirl
CIRCULAR = 2.0  # ratio of forward and backward parts beyond which the sense of a motion is clear
SAME = 0.01  # relative difference of frequencies or orders at different speeds that are the same
APART = 0.03  # relative difference of speeds at which a constant order is not a constant frequency


class Line(NamedTuple):
    """A line that is not synchronous: frequency over the spin speed, amplitudes (m) of its circular parts.

    Of one in a record also where, the speed in rad/s, the whole revolutions, and the node where it is largest.
    """

    order: float
    forward: float
    backward: float
    where: str = ""
    speed: float = np.nan
    revolutions: float = np.nan
    node: int = 0

    @property
    def hertz(self):
        return self.order * self.speed / (2 * np.pi)


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
        left = fit_basis(signal, np.concatenate([synchronous, line_basis(angle, found)]))[1]
    return found


def line_basis(angle, orders):
    """(2 * line, time) forward parts of all lines, then backward parts."""
    forward = np.exp(1j * np.multiply.outer(orders, angle))
    return np.concatenate([forward, forward.conj()])


def _strongest(residual, angle, known, least):
    """Order of the strongest line in a residual, above an amplitude (m) and beside known ones, or None."""
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
    from scipy.ndimage import median_filter

    widths = NARROW, WIDE * (2 if len(power) > LONG else 1)
    medians = (median_filter(power, 2 * width + 1, mode="wrap")[lines] for width in widths)
    noise = np.where(np.abs(cycles[lines]) < 2 * WIDE, *medians) / np.log(2)
    above = lines[power[lines] / np.maximum(noise, np.finfo(float).tiny) > LEAST_POWER]
    return above[power[above].argmax()] if len(above) else None


def _refined(signal, angle, synchronous, orders):
    """Orders (line,) that minimise the residual of harmonics and lines, by Gauss-Newton steps."""
    line = 2 * np.pi / (angle[-1] - angle[0])
    start = orders
    for _ in range(STEPS):
        lines = line_basis(angle, orders)
        basis = np.concatenate([synchronous, lines])
        amplitude, off, _ = fit_basis(signal, basis)
        forward, backward = np.split((1j * amplitude[len(synchronous) :, None] * lines), 2)
        columns = fit_basis((forward - backward) * (angle - angle.mean()), basis)[1]
        normal, right = (columns.conj() @ columns.T).real, (columns.conj() @ off).real
        step = np.linalg.lstsq(normal, right, rcond=1e-12)[0]
        orders = np.clip(orders + step, start - line, start + line)
    return orders


def check_lines(facts):
    """Findings on the lines in all records, one for each that is the same at several speeds."""
    return [_finding(group) for group in _groups([seen for one in facts for seen in _seen(one)])]


def _seen(facts):
    """The lines of one record, each at the node where it is largest."""
    found, record = [], {"where": facts.where, "speed": facts.measured_speed, "revolutions": facts.revolutions}
    every = [line._replace(node=node, **record) for node, one in facts.nodes.items() for line in one.lines]
    for line in sorted(every, key=lambda line: -max(line.forward, line.backward)):
        if all(abs(line.order - other.order) * facts.revolutions > 1 for other in found):
            found.append(line)
    return found


def _groups(every):
    """Lists of lines with one frequency or one order at different speeds, the longest first."""
    groups, left = [], list(every)
    while left:
        candidates = [
            [other for other in left if abs(value(other) / value(one) - 1) < SAME]
            for one in left
            for value in (lambda seen: seen.hertz, lambda seen: seen.order)
        ]
        largest = max(candidates, key=lambda group: len({seen.where for seen in group}))
        groups.append(largest)
        left = [one for one in left if one not in largest]
    return groups


def _finding(group):
    first = max(group, key=lambda seen: max(seen.forward, seen.backward))
    speeds, hertz, orders = (np.array([getattr(seen, name) for seen in group]) for name in ("speed", "hertz", "order"))
    records = len({seen.where for seen in group})
    across = f" (in {records} records, {np.min(hertz):.5g} to {np.max(hertz):.5g} Hz)" if records > 1 else ""
    line = {"hertz": first.hertz, "order": first.order, "across": across, "node": first.node, "sense": _sense(first)}
    line |= {"forward": um(first.forward), "backward": um(first.backward), "kind": likely_kind(speeds, orders, first)}
    return told("non-synchronous line", first.where, **line)


def _sense(seen):
    if seen.forward > CIRCULAR * seen.backward:
        return "forward"
    return "backward" if seen.backward > CIRCULAR * seen.forward else "without a clear sense"


def likely_kind(speeds, orders, seen):
    """A sentence on what a line may be, with the reason."""
    one_speed, kinds = np.ptp(speeds) < APART * np.mean(speeds), []
    steady, tracks = (one_speed or np.ptp(one) < SAME * np.mean(one) for one in (orders * speeds, orders))
    if steady:
        multiples = [(times, mains) for mains in MAINS_HZ for times in range(1, MOST_MAINS + 1)]
        near = [f"{m} x {mains:g} Hz" for m, mains in multiples if abs(seen.hertz / (m * mains) - 1) < MAINS_OFF]
        if near:
            kinds.append(f"hum of the mains: {near[0]} at any speed")
        elif not tracks:
            known = "the same frequency at all speeds, not of the mains"
            kinds.append(f"a natural frequency, excited or unstable (whip): {known}")
    if tracks:
        off = max(SUBHARMONIC_OFF, 0.2 / seen.revolutions)
        name = next((name for name, order in SUBHARMONICS.items() if abs(seen.order - order) < off), None)
        if name:
            part, whole = name.split("/")
            marks = f", or the true 1X, if the phase mark passes {whole} times a revolution" if part == "1" else ""
            known = f"{name} of the speed to {off:.1g}{marks}"
            kinds.append(f"a subharmonic of looseness, rub or another nonlinearity: {known}")
        if WHIRL[0] < seen.order < WHIRL[1] and _sense(seen) == "forward":
            kinds.append(f"fluid whirl of a bearing or seal: forward, {seen.order:.2f} times the speed")
    if kinds:
        return f"Likely {'; or '.join(kinds)}"
    if one_speed:
        return "Its kind is not clear; a record at another speed tells whether its frequency follows the speed"
    if tracks:
        return (
            f"Its frequency follows the speed, {np.mean(orders):.4g} times it: something that turns at another speed, "
            "as in a rolling bearing, behind a belt or gear, or the field of an induction motor on an inverter"
        )
    return "Its kind is not clear: neither its frequency nor its ratio to the speed is the same in all records"
