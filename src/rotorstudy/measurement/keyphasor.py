"""Keyphasor pulses: detected with hysteresis, checked, counted, and converted to the angle of the shaft.

`count_revolutions` repairs and reports irregular pulses; `mark_times`, for spectrum methods, refuses them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorstudy.errors import RotorstudyError

PULSE_OVER_NOISE = 8.0  # least height of a pulse, in standard deviations of the rest of the signal
NEAR = 0.15  # revolutions by which a mark may differ from the prediction of the marks before it
FEW_MISSING = 3.0  # revolutions without a mark, over which the speed of a sweep hardly changes
ODD, LEAST_ODD = 4.0, 0.02  # times the offset that nine in ten marks do not exceed, and revolutions; below it: jitter
LONGEST_PULSE = 0.4  # of a revolution: beyond it the pulse cannot be distinguished from the gap
MARK_TOLERANCE = 0.05  # revolutions by which a pulse may differ from the others where none is repaired
LABEL_TOLERANCE = 0.1  # relative, of the stated speed, for methods that take the speed from the pulses
PIECE_REVOLUTIONS = 10  # between knots of the spline: slower drift is followed, jitter is averaged
KNOTS = (10, 5, 3, 2)  # marks from knot to knot of the spline of a run-up


@dataclass(frozen=True)
class Pulses:
    """Pulses at time (pulse,), s, a share `duty` of all; resolution : of an instant, s, by the sampling.

    opposite : height of pulses of the other sign over that of these
    """

    time: np.ndarray
    polarity: int = 1
    duty: float = 0.0
    resolution: float = 0.0
    opposite: float = 0.0


def pulses_of(record, settings):
    """The Pulses of a record: at its own marks, else those of its keyphasor; None if it has neither."""
    if record.marks is not None:
        return Pulses(np.asarray(record.marks, float))
    return None if record.keyphasor is None else find_pulses(record.keyphasor, record.time, settings)


def find_pulses(signal, time, settings):
    """Pulses of a keyphasor signal (time,) V, or None: from threshold + hysteresis upward to threshold - hysteresis."""
    usable = np.isfinite(signal)
    signal, time = np.asarray(signal, float)[usable], np.asarray(time, float)[usable]
    if len(signal) < 3:
        return None
    base = np.median(signal)
    up_to, down_to = signal.max() - base, base - signal.min()
    towards = 1 if up_to >= down_to else -1
    height = max(up_to, down_to)
    noise = 1.4826 * np.median(np.abs(signal - base))
    if height <= PULSE_OVER_NOISE * noise or height == 0:
        return None
    polarity = {"positive": 1, "negative": -1, "auto": towards}[settings.polarity]
    level = base + towards * height / 2 if settings.threshold_V is None else settings.threshold_V
    shown = polarity * (signal - level)  # positive inside a pulse
    margin = settings.hysteresis * height / 2
    state = np.where(shown > margin, 1, np.where(shown < -margin, -1, 0))
    state[[0, -1]] = np.sign(shown[[0, -1]])  # a record that begins or ends on an edge
    decided = np.flatnonzero(state)
    before = decided[:-1][np.diff(state[decided]) != 0]
    begins, up = _crossings(shown, time, before[state[before] < 0])
    ends, down = _crossings(-shown, time, before[state[before] > 0])
    steps = np.concatenate([up, down]) / height
    duty = float(np.mean(shown > 0))
    # an edge within one sample has a uniform error; one over several samples is interpolated the better
    part = min(1.0, float(np.median(steps))) if len(steps) else 1.0
    resolution = float(part**3 * np.median(np.diff(time)) / np.sqrt(12))
    opposite = max(0.0, float(min(up_to, down_to) - PULSE_OVER_NOISE * noise) / height)
    if settings.edge != "center":  # of the voltage, whatever the polarity
        instants = begins if (settings.edge == "rising") == (polarity > 0) else ends
        return Pulses(instants, polarity, duty, resolution, opposite)
    ends = ends[ends > begins[0]] if len(begins) else ends
    pairs = min(len(begins), len(ends))
    return Pulses((begins[:pairs] + ends[:pairs]) / 2, polarity, duty, resolution / np.sqrt(2), opposite)


def _crossings(signal, time, after):
    """Times at which a signal first rises through zero after each of some samples, and its steps there."""
    rises = np.flatnonzero((signal[:-1] <= 0) & (signal[1:] > 0))
    at = rises[np.searchsorted(rises, after)]
    step = signal[at + 1] - signal[at]
    return time[at] - signal[at] / step * (time[at + 1] - time[at]), step


@dataclass(frozen=True)
class Turning:
    """Angle of the shaft over time."""

    revolutions: object  # BSpline over time, s: the revolutions since the first mark
    marks: np.ndarray  # (mark,) s
    counts: np.ndarray  # (mark,) revolution that each begins
    missing: int = 0  # pulses
    doubled: int = 0  # extra pulses
    jitter_rad: float = 0.0  # standard deviation of the marks about it
    resolution_s: float = 0.0  # of a mark, limited by the sampling

    def angle(self, time):
        """(time,) rad since the first mark."""
        return 2 * np.pi * self.revolutions(time)

    def speed(self, time):
        """(time,) rad/s."""
        return 2 * np.pi * self.revolutions(time, 1)

    def extended(self, time, rate):
        """(...) rad, also before the first mark, where the speed changed at a rate (rad/s^2), and at the last speed."""
        first, last = self.marks[[0, -1]]
        beyond = time - np.clip(time, first, last)
        drift = np.where(beyond < 0, self.speed(first) + rate / 2 * beyond, self.speed(last))
        return self.angle(time - beyond) + drift * beyond

    @property
    def first_rate(self):
        """Rate of the speed, rad/s^2, over the first ten marks."""
        first = self.marks[[0, min(PIECE_REVOLUTIONS, len(self.marks) - 1)]]
        return float(np.diff(self.speed(first))[0] / np.diff(first)[0])

    @property
    def whole_marks(self):
        """(revolution,) s when the mark passed, missing ones interpolated."""
        return np.interp(np.arange(self.counts[0], self.counts[-1] + 1), self.counts, self.marks)

    @cached_property
    def ends(self):
        """Times, s, of the marks at the lowest and the highest speed, the earlier one first: those of a sweep."""
        speed = self.speed(self.marks)
        return sorted([float(self.marks[speed.argmin()]), float(self.marks[speed.argmax()])])

    def is_followed(self, time):
        """(time,) whether the marks before and after are ten revolutions apart at most."""
        apart = np.diff(self.counts, prepend=self.counts[0], append=self.counts[-1])
        return apart[np.searchsorted(self.marks, time)] <= PIECE_REVOLUTIONS

    def rate(self, time):
        """(time,) rad/s^2, mean over ten revolutions on either side: a spline's second derivative shows its knots."""
        half = PIECE_REVOLUTIONS * 2 * np.pi / self.speed(np.asarray(time))
        early, late = np.maximum(time - half, self.marks[0]), np.minimum(time + half, self.marks[-1])
        return (self.speed(late) - self.speed(early)) / (late - early)


def count_revolutions(pulses, resolution_s=0.0, swept=False):
    """The Turning from pulses (pulse,) s, one a revolution but for missing and extra ones; None without two marks.

    Marks are followed one by one from one of the first pulses, of a run-up from one of the last ones, where the period
    changes least: a pulse near a whole number of revolutions after the last mark is a mark (more than one revolution if
    pulses are missing), any other is an extra pulse, and so is a mark that is far from between its neighbours. The
    start with the most marks is taken. The angle is a least-squares parabola in time (a line for fewer than six marks),
    which follows a steady change of speed and averages jitter; of a run-up or coast-down (`swept`) a cubic spline whose
    knots are as far apart as predicts marks best (generalised cross-validation), so that it follows any.
    """
    from scipy.interpolate import make_lsq_spline

    if len(pulses) < 2:
        return None
    runs_up = swept and 2 * np.median(pulses) > pulses[0] + pulses[-1]
    back = slice(None, None, -1 if runs_up else 1)
    run = np.abs(pulses - pulses[back][0])[back]
    of_period = [run[i : i + 6] if swept else run for i in range(min(5, len(run) - 1))]
    followed = [_follow(run, i, np.median(np.diff(some)), swept) for i, some in enumerate(of_period)]
    kept, counts = (part[back] for part in max(followed, key=lambda found: len(found[0])))
    if len(kept) < 2:
        return None
    marks, counts = pulses[back][kept], np.abs(counts - counts[0])
    in_place = _in_place(marks, counts)
    marks, counts, degree = marks[in_place], counts[in_place], 3 if swept else 2 if len(kept) >= 6 else 1
    fits = []
    for apart in KNOTS if swept else [len(marks)]:
        knots = np.concatenate([[marks[0]] * (degree + 1), marks[apart:-apart:apart], [marks[-1]] * (degree + 1)])
        revolutions = make_lsq_spline(marks, counts.astype(float), knots, degree)
        left, freedom = np.sum((counts - revolutions(marks)) ** 2), len(marks) - len(revolutions.c)
        fits.append((left / max(freedom, 1) ** 2, left / max(freedom, 1), revolutions))
    _, variance, revolutions = min(fits, key=lambda fit: fit[0])
    jitter = 2 * np.pi * np.sqrt(variance) if freedom > 0 else 0.0
    missing, doubled = int(counts[-1] + 1 - len(marks)), len(pulses) - len(marks)
    return Turning(revolutions, marks, counts, missing, doubled, float(jitter), resolution_s)


def _follow(pulses, start, period, swept):
    """Marks (position) from pulse `start` on, and the revolution of each; the period of a sweep is that of the last."""
    kept, counts, gain = [start], [0], 1.0 if swept else 0.2
    for i in range(start + 1, len(pulses)):
        since = pulses[i] - pulses[kept[-1]]
        passed = since / period
        if swept and passed > FEW_MISSING and len(kept) > 1:
            beside = np.diff(pulses[kept[-6:]]), np.diff(pulses[i : i + 6])
            passed = since * np.mean([1 / np.median(one) for one in beside]) if len(beside[1]) else 0.0  # not known
        whole = round(passed)
        if whole >= 1 and abs(passed - whole) < NEAR:
            period += gain * (since / whole - period)
            kept.append(i)
            counts.append(counts[-1] + whole)
    return np.array(kept), np.array(counts)


def _in_place(marks, counts):
    """(mark,) whether a mark is where its neighbours predict it; of several wrong ones in a row the worst is not.

    While the speed changes, all marks lie off the middle of their neighbours by about as much; a wrong one by another.
    """
    if len(marks) < 6:
        return np.ones(len(marks), bool)
    before, after = np.diff(counts)[:-1], np.diff(counts)[1:]
    off = (marks[1:-1] - (marks[:-2] * after + marks[2:] * before) / (before + after)) / np.diff(marks)[1:]
    beside = np.pad(off, 1, "reflect")
    off = np.pad(np.abs(2 * off - beside[:-2] - beside[2:]) / 3, 1)  # of a single odd one, by how much it is
    farthest = (off >= np.roll(off, 1)) & (off >= np.roll(off, -1))
    return ~farthest | (off <= max(ODD * np.quantile(off, 0.9), LEAST_ODD))


def steady_turning(speed, time):
    """The Turning of a shaft known to run at `speed` rad/s with its mark at the first sample."""
    from scipy.interpolate import make_interp_spline

    ends = time[[0, -1]]
    counts = speed * (ends - time[0]) / (2 * np.pi)
    return Turning(make_interp_spline(ends, counts, 1), ends, counts)


def mark_times(record, drifting=False):
    """(revolution,) s when the phase mark of a Record passed: its own marks, or the centres of its keyphasor pulses.

    drifting : take the speed from the pulses, so that it may drift and its label may be wrong
    raises   : RotorstudyError if there is no keyphasor, or if its pulses are not one a revolution
    """
    if record.marks is None and record.keyphasor is None:
        raise RotorstudyError(f"{record.where}: no keyphasor; record one, or use a reference signal")
    from rotorstudy.measurement.conventions import Keyphasor  # late: pydantic, which plugins load without

    pulses = pulses_of(record, Keyphasor())
    found = np.zeros(0) if pulses is None else pulses.time
    expected = record.speed * (record.time[-1] - record.time[0]) / (2 * np.pi)
    regular = _follow_each_other(record, found) if drifting else _keep_to_the_speed(record, found, expected)
    if not regular:
        odd = f" (look at {found[np.abs(np.diff(found, 2)).argmax() + 1]:g} s)" if len(found) > 2 else ""
        raise RotorstudyError(
            f"{record.where}: {len(found)} keyphasor pulses in {expected:.1f} revolutions at the stated "
            f"{record.speed:g} rad/s, or uneven ones{odd}; there must be one a revolution. Correct the speed, remove "
            "spurious pulses, restore missing ones, or cut the record"
        )
    return found


def _keep_to_the_speed(record, found, expected):
    """Whether pulses (pulse,) s come once a revolution of the stated speed; one may be missing."""
    if not len(found) or abs(len(found) - expected) > 1.5:
        return False
    angle = np.exp(1j * record.speed * found)
    usual = np.median(angle.real) + 1j * np.median(angle.imag)
    return np.abs(np.angle(angle * np.conj(usual))).max() <= 2 * np.pi * MARK_TOLERANCE


def _follow_each_other(record, found):
    """Whether pulses (pulse,) s are midway between their neighbours, at about the stated speed, up to both ends."""
    if len(found) < 2:
        return False
    period = np.median(np.diff(found))
    ends = max(found[0] - record.time[0], record.time[-1] - found[-1])
    even = np.abs(np.diff(found, 2)).max(initial=0.0) <= 2 * MARK_TOLERANCE * period
    as_stated = abs(2 * np.pi / period / record.speed - 1) <= LABEL_TOLERANCE
    return even and as_stated and ends <= (1 + 2 * MARK_TOLERANCE) * period


def shaft_angle(marks, time):
    """Angle of the shaft from its phase marks: a least-squares cubic spline with knots every ten revolutions.

    It is fitted rather than interpolated (Fyfe and Munck 1997), as the scatter of marks about a slow drift is jitter.

    marks   : (revolution,) s;  time : (time,) s
    returns : angle (time,) rad, derivatives (time, coefficient) by the spline's coefficients, their covariance
    """
    from scipy.interpolate import BSpline

    count = len(marks)
    degree = min(max((count - 1) // 2, 1), 3)
    middle = marks.mean()
    ends = np.linspace(marks[0], marks[-1], max(1, (count - 1) // PIECE_REVOLUTIONS) + 1) - middle
    knots = np.concatenate([[ends[0]] * degree, ends, [ends[-1]] * degree])

    def spline(instants):
        return BSpline(knots, np.eye(len(knots) - degree - 1), degree, extrapolate=True)(instants - middle)

    at_marks, turned = spline(marks), 2 * np.pi * np.arange(count)
    coefficients = np.linalg.lstsq(at_marks, turned, rcond=None)[0]
    freedom = count - len(coefficients)
    variance = np.sum((turned - at_marks @ coefficients) ** 2) / freedom if freedom else 0.0
    slope = spline(time)
    return slope @ coefficients, slope, variance * np.linalg.inv(at_marks.T @ at_marks)


def phase_at_start(marks, start, harmonics):
    """Phases psi_n = n * shaft angle at time `start` (harmonic,) rad, and their covariance, from the marks alone."""
    angle, slope, covariance = shaft_angle(marks, np.array([start]))
    n = np.asarray(harmonics)
    return np.angle(np.exp(1j * n * angle[0])), (slope @ covariance @ slope.T)[0, 0] * np.outer(n, n)


def phase_from_keyphasor(record, harmonics):
    """Phases psi_n = -n w t_mark (harmonic,) rad of a mark that passes at t_mark, and their covariance."""
    marks = mark_times(record) - record.time[0]
    revolutions = np.rint((marks - marks[0]) * record.speed / (2 * np.pi))
    offsets = marks - revolutions * 2 * np.pi / record.speed
    variance = offsets.var(ddof=1) / len(offsets) if len(offsets) > 1 else 0.0
    rate = -np.asarray(harmonics) * record.speed
    return np.angle(np.exp(1j * rate * offsets.mean())), variance * np.outer(rate, rate)
