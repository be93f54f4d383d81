"""Checks of one record. Each returns findings; a good record has none."""

from itertools import permutations
from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.angle_fit import fit_each, in_cosines
from rotorstudy.measurement.findings import told
from rotorstudy.measurement.harmonics import FEWEST_BLOCKS, trend
from rotorstudy.measurement.keyphasor import LONGEST_PULSE
from rotorstudy.units import RAD_PER_S, spin, um

LABEL_OFF = 0.02  # relative error of a stated speed
DRIFT = (0.005, 0.05)  # relative change of the speed over the record: warning, error
IRREGULAR = 0.2  # fraction of missing or extra pulses up to which they are repaired
JITTER_RAD = 0.05  # 3 degrees, 15 at 5X
OPPOSITE = 0.4  # height of the other pulses; undershoot of a filter, or another groove, is taken for the mark
GAP = (0.0, 0.05)  # fraction of missing samples: warning, error
BESIDE_ZERO = 0.1  # of the range of 90 % of the samples, and SPIKE steps: larger than that, beside 0 as a missing one
SPIKE = 5.0  # times half the range of 90 % of the samples; white noise stays within it but for one in 1e15
HELD = 4  # times more samples of one value than 99 % of all values have follow each other: more than by rounding
HELD_BESIDE, FEWEST_BESIDE = 20, 20  # lengths on either side with which a held value is compared; stretches there
RESTING = 0.1  # share of these that may move by less than BESIDE_ZERO of the range
EMPTY = 0.5  # fraction of missing samples above which a probe is not connected
LOUD = 15.0  # power of a harmonic over its expectation in pure noise; p-value 3e-7
FLAT_SAMPLES, FLAT_STEPS = 6, 2  # samples at the top; levels with which they are compared
FLAT_RATIO = 3.2  # of these numbers: of a parabola it is 1.4, of a maximum of fourth order, as flat as any motion, 3.2
FLAT_SHARE = 8e-4  # of the samples; fewer share the greatest value by accident
WEAK = 0.01  # of the motion at the other probes of the node
DEAD = 10.0  # times what a probe resolves, or times all that the others show; flatter orbits are rare
SIGNIFICANT = 5.0  # standard deviations
STEADY = 1e-4  # p-value below which a trend over the blocks is significant
CHANGE = 0.01  # of the largest fluctuating harmonic: a smaller change over the record does not matter
LIKELY_WRONG = (  # speed by the marks over the stated one, and a likely reason; the last that fits is told
    *((marks, f"{marks} marks a revolution? Only one may be seen") for marks in range(2, 10)),
    (0.5, "every second pulse missing?"),
    *((RAD_PER_S[a] / RAD_PER_S[b], f"the label is in {a}, and stated in {b}?") for a, b in permutations(RAD_PER_S, 2)),
    (1e-3, "time in ms, or a sampling rate in kHz? ('time_unit', 'sample_rate_Hz')"),
    (1e3, "time in s, or a sampling rate in Hz? ('time_unit', 'sample_rate_Hz')"),
)


def check_pulses(pulses, turning, asked, where):
    """Findings on the regularity of the keyphasor, by its Pulses and the Turning of them."""
    if pulses.duty > LONGEST_PULSE:
        stated = f" if they are {asked}, as in the rig file" * (asked != "auto")
        severity = "error" if stated else "warning"
        yield told("keyphasor polarity", where, severity, duty=100 * pulses.duty, asked=stated)
    elif asked == "auto" and pulses.opposite > OPPOSITE:
        sign, share = ("positive", "negative")[pulses.polarity < 0], 100 * pulses.opposite
        yield told("keyphasor polarity (both)", where, share=share, sign=sign)
    marks = len(turning.marks)
    for count, name in ((turning.missing, "missing pulses"), (turning.doubled, "doubled pulses")):
        if count:
            many = " (many)" * (count > IRREGULAR * marks)
            yield told(f"{name}{many}", where, count=count, marks=marks, every=marks + count)
    if turning.jitter_rad > JITTER_RAD:
        scatter, usual = np.rad2deg([turning.jitter_rad, JITTER_RAD])
        yield told("keyphasor jitter", where, scatter=scatter, usual=usual)


def check_speed_label(label, speed, where):
    """Whether the stated speed is within 2 % of that of the marks (rad/s)."""
    if label is not None and abs(label / speed - 1) > LABEL_OFF:
        likely = (why for ratio, why in LIKELY_WRONG if abs(speed / label / ratio - 1) < LABEL_OFF)
        *_, hint = ("correct the label", *likely)
        said = {"off": 100 * (speed / label - 1), "allowed": 100 * LABEL_OFF, "hint": hint}
        yield told("speed label", where, label=spin(label, 6), speed=spin(speed, 6), **said)


def check_drift(drift, where):
    """Whether the speed is steady. drift : its relative change over the record."""
    if abs(drift) > DRIFT[0]:
        severity = "error" if abs(drift) > DRIFT[1] else "warning"
        yield told("speed drift", where, severity, drift=100 * drift, steady=100 * DRIFT[0])


def check_gaps(part, irregular, where):
    """Whether samples are missing. part : fraction that is NaN;  irregular : longest over median time step."""
    if part > GAP[0]:
        yield told("gaps", where, "error" if part > GAP[1] else "warning", part=100 * part, most=100 * GAP[1])
    if irregular > 1.5:
        yield told("time steps", where, steps=irregular)


def spikes(readings, pieces):
    """(time,) whether a sample of a probe lies far outside the range of the others, as no motion of a shaft does."""
    found, large = np.zeros((2, len(readings)), bool)
    for part in np.array_split(np.flatnonzero(np.isfinite(readings)), pieces):
        if len(part):
            low, middle, high = np.quantile(readings[part], [GAP[1], 0.5, 1 - GAP[1]])
            found[part] = (high > low) & (np.abs(readings[part] - middle) > SPIKE * (high - low) / 2)
            steps = np.abs(np.diff(readings[part]))
            usual = np.median(steps[steps > 0]) if steps.any() else 0.0
            large[part] = np.abs(readings[part]) > max(BESIDE_ZERO * (high - low), SPIKE * usual)
    return found | _zeros(readings, large) | _held(readings)


def _zeros(readings, large):
    """(time,) whether samples are exactly 0 beside a large one (time,), as missing ones are written.

    A single one may be a zero crossing, unless it is between two large ones of one sign.
    """
    others, zeros, found = np.flatnonzero(readings), np.flatnonzero(readings == 0), np.zeros(len(readings), bool)
    if len(others):
        place = np.searchsorted(others, zeros)
        before, after = (others[np.clip(place - one, 0, len(others) - 1)] for one in (1, 0))
        both, one = large[before] & large[after], large[before] | large[after]
        alone = np.bincount(place)[place] == 1
        found[zeros] = np.where(alone, both & (readings[before] * readings[after] > 0), one)
    return found


class Seen(NamedTuple):
    """What a probe shows, rms in m: harmonics; noise; the least harmonic that exceeds it; the greatest harmonic."""

    moving: float
    noise: float
    resolved: float
    greatest: float


def seen_by(readings, angle, harmonics):
    """The Seen of each probe. readings : (probe, time) m, whole revolutions;  angle : (time,) rad."""
    orders = np.arange(1, max(abs(int(n)) for n in harmonics) + 1)
    both = np.concatenate([[0], orders, -orders])
    enough = np.isfinite(readings).sum(axis=-1) > 2 * len(harmonics)
    fits = fit_each(readings, angle, both, in_cosines)
    return [_seen(fit) if ok else Seen(0.0, 0.0, 0.0, 0.0) for fit, ok in zip(fits, enough, strict=True)]


def _seen(fit):
    lines, samples = np.hypot(*np.split(fit.amplitude[1:], 2)) / np.sqrt(2), len(fit.residual)
    noise = np.sqrt(np.sum(fit.residual**2) / max(1, samples - len(fit.amplitude)))
    return Seen(np.linalg.norm(lines), noise, np.sqrt(2 * LOUD / samples) * noise, lines.max())


def check_channels(raw, chosen, angle):
    """Findings on each probe by some samples (time,) mask of a RawRecord, and the dead ones {(node, channel)}."""
    channels, findings, dead = sorted(raw.channels, key=lambda channel: channel.node), [], set()
    readings = np.array([channel.readings[chosen] for channel in channels])
    both = list(zip(channels, seen_by(readings, angle, raw.conventions.harmonics), strict=True))
    for values, (channel, seen) in zip(readings, both, strict=True):
        others = [one for other, one in both if other.node == channel.node and other is not channel]
        found = list(_check_channel(values, seen, others, place_of(raw.where, channel.node, channel.name)))
        findings += found
        dead |= {(channel.node, channel.name) for one in found if one.name == "dead probe"}
    return findings, frozenset(dead)


def place_of(where, node, channel):
    """A channel of a record in words."""
    return f"{where}, node {node}, channel '{channel}'"


def _check_channel(readings, seen, others, place):
    """Findings on a probe, readings (time,), m: dead, weak beside the others (Seen by each) of its node, clipped."""
    missing, readings = float(np.mean(~np.isfinite(readings))), readings[np.isfinite(readings)]
    if missing > EMPTY:
        yield told("dead probe (gaps)", place, missing=100 * missing)
        return
    if np.ptp(readings) <= 1e-9 * max(np.abs(readings).max(), 1e-300):
        yield told("dead probe (constant)", place, value=um(readings[0], 3))
        return
    moving = max((one.moving for one in others), default=0.0)
    shown = max((np.hypot(one.moving, one.noise) for one in others), default=np.inf)
    if seen.greatest < seen.resolved:
        if moving > DEAD * seen.resolved or seen.noise > DEAD * shown:
            yield told("dead probe (noise)", place, noise=um(seen.noise), others=um(moving))
    elif seen.moving < WEAK * moving:
        yield told("weak probe", place, own=um(seen.moving), others=um(moving))
    for side, sign in (("top", 1), ("bottom", -1)):
        if flat_top(sign * readings):
            yield told("clipping", place, side=side, value=um(sign * (sign * readings).max(), 4))


def left_out(dead, where):
    """Warnings on the dead probes {(node, channel)} that are left out."""
    return [told("dead probe (left out)", place_of(where, node, name)) for node, name in sorted(dead)]


def flat_top(values):
    """Whether a signal (time,) stays at its maximum longer than an unclipped vibration, rounded or not, would."""
    swing = np.ptp(values)
    at_top = values >= values.max() - 1e-9 * swing
    if at_top.sum() < max(FLAT_SAMPLES, FLAT_SHARE * len(values)):
        return False
    levels = np.unique(values)
    levels = levels[np.append(np.diff(levels) > 1e-9 * swing, True)]  # one of each revolution if nothing is rounded
    below = ~at_top & (values >= levels[max(len(levels) - 1 - FLAT_STEPS, 0)] - 1e-9 * swing)
    return bool(at_top.sum() > FLAT_RATIO * below.sum())


def _held(readings):
    """(time,) whether samples repeat one value for longer than the motion on both sides of them ever rests."""
    begins, found = np.flatnonzero(np.diff(readings, prepend=np.nan) != 0), np.zeros(len(readings), bool)
    sizes = np.diff(np.append(begins, len(readings)))
    for i in np.flatnonzero(sizes > HELD * (1 + np.quantile(sizes, 0.99))):
        first, end, beside = begins[i], begins[i] + sizes[i], HELD_BESIDE * sizes[i]
        sides = readings[max(first - beside, 0) : first], readings[end : end + beside]
        found[first:end] = all(_always_moves(side[np.isfinite(side)], sizes[i] // 2) for side in sides)
    return found


def _always_moves(signal, span):
    """Whether a signal (time,) moves by much of its range in nearly all stretches of a span, or of shorter ones."""
    span = min(span, len(signal) // FEWEST_BESIDE)
    if span < 2:
        return False
    stretches = np.ptp(signal[: len(signal) // span * span].reshape(-1, span), axis=1)
    low, high = np.quantile(signal, [GAP[1], 1 - GAP[1]])
    return bool(np.quantile(stretches, RESTING) > BESIDE_ZERO * (high - low))


def check_sampling(samples, revolutions, harmonics, where):
    """Whether samples and revolutions suffice for the harmonics: an error, or no finding."""
    needed, highest = 2 * len(harmonics) + 1, max(abs(int(n)) for n in harmonics)
    per_revolution = samples / revolutions
    if samples < needed:
        yield told("too few samples", where, samples=samples, count=len(harmonics), needed=needed)
    elif revolutions < 1:
        yield told("too few revolutions", where, revolutions=revolutions)
    elif per_revolution <= 2 * highest * (1 + 1e-9):
        both = {"there": per_revolution, "possible": max(0, int(np.ceil(per_revolution / 2 - 1e-9)) - 1)}
        yield told("sampling rate", where, highest=highest, needed=2 * highest, **both)


def check_noise(own, harmonics, where):
    """Whether the harmonics (harmonic,) of NodeFacts exceed the noise, and are steady over the blocks."""
    moving = np.asarray(harmonics) != 0
    std = np.sqrt(np.diag(own.covariance).reshape(2, -1).sum(axis=0))
    if np.max(np.abs(own.amplitude[moving]) / np.maximum(std[moving], 1e-300)) <= SIGNIFICANT:
        yield told("noise floor", where)
    if len(own.blocks) < FEWEST_BLOCKS:
        return
    (change, p), scale = trend(own.blocks), np.abs(own.blocks.mean(axis=0))[moving].max()
    if change.max() >= CHANGE * scale and p <= STEADY:
        n = int(np.asarray(harmonics)[change.argmax()])
        yield told("not steady", where, n=n, change=um(change.max()))
