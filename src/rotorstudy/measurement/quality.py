"""Is this record what it says? Each check gives findings; a good record gives none."""

import numpy as np

from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.harmonics import FEWEST_BLOCKS, fit_basis, trend_probability
from rotorstudy.measurement.keyphasor import LONGEST_PULSE
from rotorstudy.response.series import rotating_basis
from rotorstudy.units import METRES, um

LABEL_OFF = 0.02  # of the speed: the issue's own limit
DRIFT = (0.005, 0.05)  # of the speed over the record: warning, error
IRREGULAR = 0.2  # part of the pulses that may be missing or beside and still be repaired
JITTER_RAD = 0.05  # 3 degrees, 15 at 5X
GAP = (0.0, 0.05)  # part of the samples missing: warning, error
LOUD = 15.0  # power of a harmonic over its expectation in pure noise; chance 3e-7
FLAT_SAMPLES, FLAT_RATIO = 6, 4.0  # at the top: samples, and times those one step below it
WEAK = 0.01  # of the motion the other probes of the node see
BACKWARD = 2.0  # times the forward 1X
HUGE_M, TINY_M = 5e-3, 1e-9  # no shaft vibrates more between its bearings, no probe sees less
SCALE = 20.0  # times, or part of, the motion the rig expects; mil taken as µm is 25
APART = 3.0  # times what the shaft moves and hangs through: a mean further off than this is hardly the shaft's
STEADY = 1e-4  # chance below which a change over the blocks is real
CHANGE = 0.01  # of the largest fluctuating harmonic: a smaller change over the record does not matter


def check_pulses(pulses, turning, asked_polarity, where):
    """Findings on how regular the keyphasor is. pulses : Pulses or None if the file gave the mark times."""
    found = []
    if pulses is not None and pulses.duty > LONGEST_PULSE:
        said = "" if asked_polarity == "auto" else f" if they are {asked_polarity}, as the rig file says"
        text = (
            f"pulses last {100 * pulses.duty:.0f} % of the time{said}; the polarity is reversed, or threshold_V is "
            "wrong. Correct 'keyphasor: polarity' or 'threshold_V': the phase is off by up to half a turn otherwise"
        )
        severity = "warning" if asked_polarity == "auto" else "error"
        found.append(Finding(severity, "keyphasor polarity", where, text))
    marks = len(turning.marks)
    for count, name, what in (
        (turning.missing, "missing pulses", "did not come; the turns were counted without them"),
        (turning.doubled, "doubled pulses", "came beside the marks; they were left out"),
    ):
        if count > IRREGULAR * marks:
            text = f"{count} pulses beside {marks} good ones; too many to tell which are marks. Check threshold_V"
            found.append(Finding("error", name, where, text))
        elif count:
            found.append(Finding("warning", name, where, f"{count} of {marks + turning.missing} {what}"))
    if turning.jitter_rad > JITTER_RAD:
        text = (
            f"the marks scatter by {np.rad2deg(turning.jitter_rad):.2g} degrees about steady turning (up to "
            f"{np.rad2deg(JITTER_RAD):.2g} is usual); harmonic n scatters n times as much. The covariance has it"
        )
        found.append(Finding("warning", "keyphasor jitter", where, text))
    return found


def check_speed_label(label, speed, where):
    """A speed label more than 2 % off the marks, with what would explain it."""
    if label is None or abs(label / speed - 1) <= LABEL_OFF:
        return []
    hint = "correct the label"
    for ratio, why in (
        (2, "two marks a turn?"),
        (0.5, "every second pulse missing?"),
        (2 * np.pi, "the label is in Hz?"),
        (np.pi / 30, "the label is in rpm?"),
    ):
        if abs(speed / label / ratio - 1) < LABEL_OFF:
            hint = why
    text = (
        f"labelled {label:.6g} rad/s, but the phase mark passes at {speed:.6g} rad/s ({100 * (speed / label - 1):+.2g} "
        f"%, allowed {100 * LABEL_OFF:g} %); {hint}"
    )
    return [Finding("error", "speed label", where, text)]


def check_drift(drift, where):
    """drift : change of speed over the record, relative."""
    if abs(drift) <= DRIFT[0]:
        return []
    severity = "error" if abs(drift) > DRIFT[1] else "warning"
    text = (
        f"the speed changes by {100 * drift:+.2g} % over the record (up to {100 * DRIFT[0]:g} % is steady); the "
        "harmonics are means over these speeds. Take a shorter record, or cut it into pieces"
    )
    return [Finding(severity, "speed drift", where, text)]


def check_gaps(part, irregular, where):
    """part : of the samples that are NaN;  irregular : longest step of time over the usual one."""
    found = []
    if part > GAP[0]:
        severity = "error" if part > GAP[1] else "warning"
        text = (
            f"{100 * part:.2g} % of the samples are missing (up to {100 * GAP[1]:g} % are left out); repair the record"
        )
        found.append(Finding(severity, "gaps", where, text))
    if irregular > 1.5:
        text = f"time jumps by {irregular:.3g} samples; the angle still follows the marks. Check the recorder"
        found.append(Finding("warning", "time steps", where, text))
    return found


def check_channel(name, node, readings, angle, harmonics, largest, where):
    """Findings on one probe: dead, noise only, weak beside the others, clipped.

    readings : (time,) m, whole revolutions;  angle : (time,) rad;  largest : rms motion of any probe of the node, m
    """
    place = f"{where}, node {node}, channel '{name}'"
    usable = np.isfinite(readings)
    readings, angle = readings[usable], angle[usable]
    swing = np.ptp(readings)
    if swing <= 1e-9 * max(np.abs(readings).max(), 1e-300):
        text = f"constant at {um(readings[0], 3)}: the probe is dead or not connected; leave it out or repair it"
        return [Finding("error", "dead probe", place, text)]
    orders = np.arange(1, max(abs(int(n)) for n in harmonics) + 1)
    both = np.concatenate([[0], orders, -orders])
    amplitude, residual, _ = fit_basis(readings.astype(complex), rotating_basis(angle, 1.0, both))
    power = np.sum(np.abs(residual) ** 2) / max(1, len(residual) - len(both)) / len(residual)
    moving = float(np.sqrt(2 * np.sum(np.abs(amplitude[1 : 1 + len(orders)]) ** 2)))  # rms of the harmonics
    found = []
    if np.max(np.abs(amplitude[1 : 1 + len(orders)]) ** 2) < LOUD * power:
        text = "noise only, no harmonic stands out: the probe does not see the shaft, or the shaft does not move"
        found.append(Finding("error", "dead probe", place, text))
    elif moving < WEAK * largest:
        text = (
            f"{um(moving)} rms where another probe of this node sees {um(largest)}: check sensitivity and unit, or "
            "whether the probe sees the shaft"
        )
        found.append(Finding("warning", "weak probe", place, text))
    for side, values in (("top", readings), ("bottom", -readings)):
        if flat_top(values):
            text = f"the signal is flat at its {side}, {um(values.max(), 4)}: clipped by the range of probe or recorder"
            found.append(Finding("error", "clipping", place, text))
    return found


def flat_top(values):
    """Whether a signal stays at its largest value as no vibration does, not even one of few digits."""
    swing = np.ptp(values)
    at_top = values >= values.max() - 1e-9 * swing
    if at_top.sum() < FLAT_SAMPLES:
        return False
    levels = np.unique(values)
    steps = np.diff(levels)
    digit = steps[steps > 1e-9 * swing].min()  # of the recorder; tiny if values are not rounded
    below = (values < values.max() - 0.5 * digit) & (values > values.max() - 1.5 * digit)
    return bool(at_top.sum() > FLAT_RATIO * below.sum())


def check_sampling(samples, revolutions, harmonics, where):
    """Whether a record of so many samples and revolutions holds these harmonics: an error, or none."""
    needed, highest = 2 * len(harmonics) + 1, max(abs(int(n)) for n in harmonics)
    per_revolution = samples / revolutions
    if samples < needed:
        text = f"{samples} samples are too few for {len(harmonics)} harmonics; at least {needed} are needed"
        return [Finding("error", "too few samples", where, text)]
    if revolutions < 1:
        text = f"{revolutions:.2f} revolutions; at least one is needed, and six for a covariance. Take a longer record"
        return [Finding("error", "too few revolutions", where, text)]
    if per_revolution <= 2 * highest * (1 + 1e-9):
        text = (
            f"harmonic {highest} lies above the Nyquist frequency: it needs more than {2 * highest} samples a "
            f"revolution, and there are {per_revolution:.3g}, enough for harmonics up to "
            f"{max(0, int(np.ceil(per_revolution / 2 - 1e-9)) - 1)}. Sample faster, or leave the highest harmonics out"
        )
        return [Finding("error", "sampling rate", where, text)]
    return []


def check_length(revolutions, blocks, where):
    if blocks >= FEWEST_BLOCKS:
        return []
    text = (
        f"{revolutions} whole revolutions; the scatter of repeat blocks needs {FEWEST_BLOCKS}, so the covariance is "
        "that of the noise floor, taken as white. Take a longer record"
    )
    return [Finding("warning", "few revolutions", where, text)]


def check_steadiness(blocks, harmonics, where):
    """Whether the vibration changes over the record: (block, harmonic) complex, m."""
    if len(blocks) < FEWEST_BLOCKS:
        return []
    place = np.arange(len(blocks)) - (len(blocks) - 1) / 2
    change = np.abs(place @ blocks) / (place @ place) * len(blocks)
    scale = np.abs(blocks.mean(axis=0))[np.asarray(harmonics) != 0].max()
    if change.max() < CHANGE * scale or trend_probability(blocks) > STEADY:
        return []
    n = int(np.asarray(harmonics)[change.argmax()])
    text = (
        f"harmonic {n} changes steadily by {um(change.max())} over the record; the stated covariance is that of the "
        "scatter about a constant. Wait for a steady state, or cut the record"
    )
    return [Finding("warning", "not steady", where, text)]


def check_sense(forward, backward, expected_backward, nodes, where):
    """Backward 1X larger than forward, contrary to what a rotor does.

    forward, backward : (speed, node) |R_1|, |R_-1|, m;  expected_backward : (node,) bool, what the rig's model says
    """
    size = np.sqrt(np.sum(forward**2, axis=0)), np.sqrt(np.sum(backward**2, axis=0))
    reversed_nodes = (size[1] > BACKWARD * size[0]) & ~expected_backward
    ratio = size[1] / np.maximum(size[0], 1e-300)
    remedy = (
        "If the shaft does whirl backward here (between the two critical speeds of anisotropic bearings), give the rig "
        "its bearing values, so that this is expected"
    )
    if reversed_nodes.all():
        text = (
            f"backward 1X is {ratio.min():.3g} times forward or more at every node: reversed rotation, or the probes "
            f"of all nodes swapped or of the wrong sign. Correct 'rotation:' or the probes. {remedy}"
        )
        return [Finding("error", "sense of rotation", where, text)]
    return [
        Finding(
            "error",
            "swapped probes",
            f"{where}, node {node}",
            f"backward 1X is {ratio[i]:.3g} times forward, but not at the other nodes: the two probes of this node are "
            f"swapped, or one has the wrong sign. {remedy}",
        )
        for i, node in enumerate(nodes)
        if reversed_nodes[i]
    ]


def check_units(fluctuating, expected, where):
    """Whether amplitudes are of the size of a shaft's vibration.

    fluctuating : (speed, node) rms of the harmonics without the mean, m;  expected : the rig's own size, m, or None
    """
    largest = float(np.max(fluctuating))
    if largest > HUGE_M or largest < TINY_M:
        what = "more than any shaft moves" if largest > HUGE_M else "less than any probe sees"
        text = f"vibration of {um(largest, 3)} rms is {what}; check the units ({_fitting(largest, expected)})"
        return [Finding("error", "units", where, text)]
    if expected and not expected / SCALE < largest < expected * SCALE:
        text = (
            f"vibration of {um(largest, 3)} rms where the rig is expected to move by {um(expected)}; check the units "
            f"({_fitting(largest, expected)})"
        )
        return [Finding("warning", "units", where, text)]
    return []


def check_mean(mean, expected, fluctuating, nodes, where):
    """Whether 0X is where the shaft can be: most proximity probes show their gap as well.

    mean, expected : (speed, node) complex, m, measured and of the rig;  fluctuating : (speed, node) rms of the rest, m
    """
    off = np.median(np.abs(mean - expected), axis=0)
    allowed = APART * (np.abs(np.atleast_2d(expected)).max(axis=0) + fluctuating.max(axis=0))
    return [
        Finding(
            "warning",
            "probe gap",
            f"{where}, node {node}",
            f"the mean is {um(off[i])} from where the rig says the shaft hangs, but the shaft vibrates by "
            f"{um(fluctuating[:, i].max())} rms: the gap of the probes? It would be taken for a preload. Zero the "
            "probes with the shaft at rest, leave 0 out of 'measurement: harmonics:', or give the rig the effect "
            "sensor_gap",
        )
        for i, node in enumerate(nodes)
        if off[i] > allowed[i]
    ]


def _fitting(size, expected):
    """Which unit mistaken for another would bring a size nearest to what is expected."""
    pairs = {(a, b): METRES[a] / METRES[b] for a in METRES for b in METRES if a != b}
    off = {pair: abs(np.log(size * factor / (expected or 5e-5))) for pair, factor in pairs.items()}
    nearest = [f"{a} taken as {b}?" for (a, b), one in off.items() if one < min(off.values()) + 1e-6]
    return " ".join(nearest)


def check_noise(amplitude, std, where):
    """Whether anything but the mean stands out of the noise. amplitude, std : (harmonic,) without the mean, m"""
    if np.max(np.abs(amplitude) / np.maximum(std, 1e-300)) > 5:
        return []
    text = "no harmonic but the mean exceeds five times its standard deviation; take a longer record or a faster speed"
    return [Finding("warning", "noise floor", where, text)]
