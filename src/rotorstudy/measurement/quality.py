"""Checks of one record. Each returns findings; a good record has none."""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.angle_fit import fit_each
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.harmonics import FEWEST_BLOCKS, trend_probability
from rotorstudy.measurement.keyphasor import LONGEST_PULSE
from rotorstudy.units import RAD_PER_S, um

LABEL_OFF = 0.02  # relative error of a stated speed
USUAL_SPEED = 1.0, 5e4  # rad/s: turning gears are slower, no machine is faster
DRIFT = (0.005, 0.05)  # relative change of the speed over the record: warning, error
IRREGULAR = 0.2  # fraction of missing or extra pulses up to which they are repaired
JITTER_RAD = 0.05  # 3 degrees, 15 at 5X
GAP = (0.0, 0.05)  # fraction of missing samples: warning, error
EMPTY = 0.5  # fraction of missing samples above which a probe is not connected
LOUD = 15.0  # power of a harmonic over its expectation in pure noise; p-value 3e-7
FLAT_SAMPLES, FLAT_RATIO = 6, 4.0  # samples at the top, and their ratio to those one step below
FLAT_SHARE = 8e-4  # of the samples; fewer share the greatest value by accident
WEAK = 0.01  # of the motion at the other probes of the node
DEAD = 10.0  # times what a probe resolves, or times all that the others show; flatter orbits are rare
SIGNIFICANT = 5.0  # standard deviations
STEADY = 1e-4  # p-value below which a trend over the blocks is significant
CHANGE = 0.01  # of the largest fluctuating harmonic: a smaller change over the record does not matter


def check_pulses(pulses, turning, asked_polarity, where):
    """Findings on the regularity of the keyphasor. pulses : Pulses, or None if the file has the mark times."""
    found = []
    if pulses is not None and pulses.duty > LONGEST_PULSE:
        said = "" if asked_polarity == "auto" else f" if they are {asked_polarity}, as in the rig file"
        text = (
            f"pulses last {100 * pulses.duty:.0f} % of the time{said}; the polarity is reversed, or threshold_V is "
            "wrong. Correct 'keyphasor: polarity' or 'threshold_V': the phase is off by up to half a revolution"
        )
        severity = "warning" if asked_polarity == "auto" else "error"
        found.append(Finding(severity, "keyphasor polarity", where, text))
    marks = len(turning.marks)
    for count, name, repair in (
        (turning.missing, "missing pulses", f"{turning.missing} of {marks + turning.missing}; counted without them"),
        (turning.doubled, "doubled pulses", f"{turning.doubled} extra pulses beside {marks} marks; left out"),
    ):
        if count > IRREGULAR * marks:
            text = f"{count} for {marks} regular pulses, too many to identify the marks. Check threshold_V"
            found.append(Finding("error", name, where, text))
        elif count:
            found.append(Finding("warning", name, where, repair))
    if turning.jitter_rad > JITTER_RAD:
        text = (
            f"the marks scatter by {np.rad2deg(turning.jitter_rad):.2g} degrees about steady rotation (up to "
            f"{np.rad2deg(JITTER_RAD):.2g} is usual), harmonic n by n times as much. The covariance includes it"
        )
        found.append(Finding("warning", "keyphasor jitter", where, text))
    return found


def check_speed_label(label, speed, where):
    """Whether the stated speed is within 2 % of that of the marks (rad/s), with a likely reason.

    Without a stated speed, whether machines run at such a speed.
    """
    if label is None:
        return _unusual_speed(speed, where)
    if abs(label / speed - 1) <= LABEL_OFF:
        return []
    hint = "correct the label"
    for ratio, why in (
        (2, "two marks a revolution?"),
        (0.5, "every second pulse missing?"),
        (2 * np.pi, "the label is in Hz?"),
        (np.pi / 30, "the label is in rpm?"),
        (1 / 60, "the label is in rpm, and stated in Hz?"),
        (60, "the label is in Hz, and stated in rpm?"),
        (30 / np.pi, "the label is in rad/s, and stated in rpm?"),
        (0.5 / np.pi, "the label is in rad/s, and stated in Hz?"),
        (1e-3, "time in ms, or a sampling rate in kHz? ('time_unit', 'sample_rate_Hz')"),
        (1e3, "time in s, or a sampling rate in Hz? ('time_unit', 'sample_rate_Hz')"),
    ):
        if abs(speed / label / ratio - 1) < LABEL_OFF:
            hint = why
    text = (
        f"labelled {label:.6g} rad/s, but the phase mark passes at {speed:.6g} rad/s ({100 * (speed / label - 1):+.3g} "
        f"%, allowed {100 * LABEL_OFF:g} %); {hint}"
    )
    return [Finding("error", "speed label", where, text)]


def _unusual_speed(speed, where):
    if USUAL_SPEED[0] <= speed <= USUAL_SPEED[1]:
        return []
    text = (
        f"the phase mark passes at {speed:.3g} rad/s ({speed / RAD_PER_S['rpm']:.3g} rpm), unusual for a machine "
        f"beyond its turning gear; check the time channel, 'time_unit' and 'sample_rate_Hz'"
    )
    return [Finding("warning" if speed > USUAL_SPEED[1] else "note", "unusual speed", where, text)]


def check_drift(drift, where):
    """Whether the speed is steady. drift : its relative change over the record."""
    if abs(drift) <= DRIFT[0]:
        return []
    severity = "error" if abs(drift) > DRIFT[1] else "warning"
    text = (
        f"the speed changes by {100 * drift:+.2g} % over the record (up to {100 * DRIFT[0]:g} % is steady); the "
        "harmonics are averages over these speeds. Take a shorter record, or cut it into pieces"
    )
    return [Finding(severity, "speed drift", where, text)]


def check_gaps(part, irregular, where):
    """Whether samples are missing. part : fraction that is NaN;  irregular : longest over median time step."""
    found = []
    if part > GAP[0]:
        severity = "error" if part > GAP[1] else "warning"
        text = (
            f"{100 * part:.2g} % of the samples are missing (up to {100 * GAP[1]:g} % are tolerated); repair the record"
        )
        found.append(Finding(severity, "gaps", where, text))
    if irregular > 1.5:
        text = f"time jumps by {irregular:.3g} samples; the shaft angle is not affected. Check the recorder"
        found.append(Finding("warning", "time steps", where, text))
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
    fits = fit_each(readings, angle, both)
    return [_seen(fit, len(orders)) if ok else Seen(0.0, 0.0, 0.0, 0.0) for fit, ok in zip(fits, enough, strict=True)]


def _seen(fit, orders):
    lines, samples = np.sqrt(2) * np.abs(fit.amplitude[1 : 1 + orders]), len(fit.residual)
    noise = np.sqrt(np.sum(np.abs(fit.residual) ** 2) / max(1, samples - 2 * orders - 1))
    return Seen(np.linalg.norm(lines), noise, np.sqrt(2 * LOUD / samples) * noise, lines.max())


def check_channel(name, node, readings, seen, others, where):
    """Findings on one probe: dead, weak beside the others, clipped.

    A probe that shows no harmonic is dead if the others of its node show a vibration that it would show too, or if its
    noise is far more than all that they show. If none of them shows any, the shaft may be quiet at this speed.

    readings : (time,) m, whole revolutions;  seen : Seen by it;  others : list of Seen by the others of the node
    """
    place, missing = f"{where}, node {node}, channel '{name}'", float(np.mean(~np.isfinite(readings)))
    if missing > EMPTY:
        text = f"{100 * missing:.3g} % of the samples are missing: the probe is dead or not connected"
        return [Finding("error", "dead probe", place, text)]
    readings = readings[np.isfinite(readings)]
    if np.ptp(readings) <= 1e-9 * max(np.abs(readings).max(), 1e-300):
        text = f"constant at {um(readings[0], 3)}: the probe is dead or not connected; leave it out or repair it"
        return [Finding("error", "dead probe", place, text)]
    found, moving = [], max((one.moving for one in others), default=0.0)
    shown = max((np.hypot(one.moving, one.noise) for one in others), default=np.inf)
    if seen.greatest < seen.resolved:
        if moving > DEAD * seen.resolved or seen.noise > DEAD * shown:
            text = (
                f"no harmonic exceeds the noise, {um(seen.noise)} rms, where another probe of this node has "
                f"{um(moving)} rms: the probe does not detect the shaft"
            )
            found.append(Finding("error", "dead probe", place, text))
    elif seen.moving < WEAK * moving:
        text = (
            f"{um(seen.moving)} rms where another probe of this node has {um(moving)}: check sensitivity and unit, and "
            "whether the probe detects the shaft"
        )
        found.append(Finding("warning", "weak probe", place, text))
    for side, values in (("top", readings), ("bottom", -readings)):
        if flat_top(values):
            text = f"the signal is flat at its {side}, {um(values.max(), 4)}: clipped by the probe or the recorder"
            found.append(Finding("error", "clipping", place, text))
    return found


def left_out(dead, where):
    """Warnings on the dead probes {(node, channel)} that are left out."""
    return [
        Finding(
            "warning",
            "dead probe",
            f"{where}, node {node}, channel '{name}'",
            "dead in every record, and left out of all of them. Repair it, or remove it from 'probes:'",
        )
        for node, name in sorted(dead)
    ]


def flat_top(values):
    """Whether a signal (time,) stays at its maximum longer than an unclipped vibration, rounded or not, would."""
    swing = np.ptp(values)
    at_top = values >= values.max() - 1e-9 * swing
    if at_top.sum() < max(FLAT_SAMPLES, FLAT_SHARE * len(values)):
        return False
    levels = np.unique(values)
    steps = np.diff(levels)
    digit = steps[steps > 1e-9 * swing].min()  # resolution of the recorder; tiny if values are not rounded
    below = (values < values.max() - 0.5 * digit) & (values > values.max() - 1.5 * digit)
    return bool(at_top.sum() > FLAT_RATIO * below.sum())


def check_sampling(samples, revolutions, harmonics, where):
    """Whether samples and revolutions suffice for the harmonics: an error, or no finding."""
    needed, highest = 2 * len(harmonics) + 1, max(abs(int(n)) for n in harmonics)
    per_revolution = samples / revolutions
    if samples < needed:
        text = f"{samples} samples are too few for {len(harmonics)} harmonics; at least {needed} are needed"
        return [Finding("error", "too few samples", where, text)]
    if revolutions < 1:
        text = (
            f"{revolutions:.2f} revolutions; at least one is needed, six for a block covariance. Take a longer record"
        )
        return [Finding("error", "too few revolutions", where, text)]
    if per_revolution <= 2 * highest * (1 + 1e-9):
        text = (
            f"harmonic {highest} lies above the Nyquist frequency: it needs more than {2 * highest} samples per "
            f"revolution, and there are {per_revolution:.3g}, enough for harmonics up to "
            f"{max(0, int(np.ceil(per_revolution / 2 - 1e-9)) - 1)}. Sample faster, or leave the highest harmonics out"
        )
        return [Finding("error", "sampling rate", where, text)]
    return []


def check_length(revolutions, blocks, where):
    """Whether a record has enough blocks of whole revolutions for its covariance."""
    if blocks >= FEWEST_BLOCKS:
        return []
    text = (
        f"{revolutions} whole revolutions; the scatter of repeat blocks needs {FEWEST_BLOCKS}, so the covariance is "
        "that of white noise at the noise floor. Take a longer record"
    )
    return [Finding("warning", "few revolutions", where, text)]


def check_steadiness(blocks, harmonics, where):
    """Whether the vibration changes over the record. blocks : (block, harmonic) complex, m."""
    if len(blocks) < FEWEST_BLOCKS:
        return []
    place = np.arange(len(blocks)) - (len(blocks) - 1) / 2
    change = np.abs(place @ blocks) / (place @ place) * len(blocks)
    scale = np.abs(blocks.mean(axis=0))[np.asarray(harmonics) != 0].max()
    if change.max() < CHANGE * scale or trend_probability(blocks) > STEADY:
        return []
    n = int(np.asarray(harmonics)[change.argmax()])
    text = (
        f"harmonic {n} changes steadily by {um(change.max())} over the record; the covariance assumes "
        "a constant. Wait for a steady state, or shorten the record"
    )
    return [Finding("warning", "not steady", where, text)]


def check_noise(amplitude, std, where):
    """Whether any harmonic exceeds the noise. amplitude, std : (harmonic,) without the mean, m."""
    if np.max(np.abs(amplitude) / np.maximum(std, 1e-300)) > SIGNIFICANT:
        return []
    text = "no harmonic but the mean exceeds five times its standard deviation; take a longer record or another speed"
    return [Finding("warning", "noise floor", where, text)]
