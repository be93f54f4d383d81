"""Keyphasor pulses: found with hysteresis, counted, and turned into the angle of the shaft."""

from dataclasses import dataclass

import numpy as np

PULSE_OVER_NOISE = 8.0  # height of a pulse over the scatter of the rest, below which there is none
NEAR = 0.15  # turns a pulse may be off where the pulses before it say
LONGEST_PULSE = 0.4  # of a turn: beyond, which of the two levels is the pulse is a guess


@dataclass(frozen=True)
class Pulses:
    """Pulses of a keyphasor: instants (pulse,) s, polarity 1 or -1, the part of the time they last, and how well the
    sampling tells an instant, s: an error that may be the same for all, where the speed fits the sampling rate."""

    time: np.ndarray
    polarity: int
    duty: float
    resolution: float


def find_pulses(signal, time, settings):
    """Pulses of a keyphasor signal (time,) V, or None if it has none.

    settings : `conventions.Keyphasor`.  A pulse begins where the signal passes the threshold on its way beyond
    threshold + hysteresis, and ends where it passes it on its way back beyond threshold - hysteresis.
    """
    usable = np.isfinite(signal)
    signal, time = np.asarray(signal, float)[usable], np.asarray(time, float)[usable]
    if len(signal) < 3:
        return None
    base = np.median(signal)
    up, down = signal.max() - base, base - signal.min()
    towards = 1 if up >= down else -1
    height = max(up, down)
    noise = 1.4826 * np.median(np.abs(signal - base))
    if height <= PULSE_OVER_NOISE * noise or height == 0:
        return None
    polarity = {"positive": 1, "negative": -1, "auto": towards}[settings.polarity]
    level = base + towards * height / 2 if settings.threshold_V is None else settings.threshold_V
    shown = polarity * (signal - level)  # positive inside a pulse
    margin = settings.hysteresis * height / 2
    state = np.where(shown > margin, 1, np.where(shown < -margin, -1, 0))
    decided = np.flatnonzero(state)
    turns = np.flatnonzero(np.diff(state[decided]))
    begins, ends, steps = [], [], []
    for i in turns:
        first, last = decided[i], decided[i + 1]
        rising = state[last] > 0
        crossing, step = _crossing(shown[first : last + 1], time[first : last + 1], rising)
        (begins if rising else ends).append(crossing)
        steps.append(step / height)
    begins, ends = np.array(begins), np.array(ends)
    duty = float(np.mean(shown > 0))
    # an edge within one sample may be anywhere in it; one over several samples is found between them ever better
    part = min(1.0, float(np.median(steps))) if steps else 1.0
    resolution = float(part**3 * np.median(np.diff(time)) / np.sqrt(12))
    if settings.edge == "rising":  # of the voltage, whatever the polarity
        return Pulses(begins if polarity > 0 else ends, polarity, duty, resolution)
    if settings.edge == "falling":
        return Pulses(ends if polarity > 0 else begins, polarity, duty, resolution)
    if len(begins) and len(ends):
        ends = ends[ends > begins[0]]
    pairs = min(len(begins), len(ends))
    return Pulses((begins[:pairs] + ends[:pairs]) / 2, polarity, duty, resolution / np.sqrt(2))


def _crossing(shown, time, rising):
    """When a stretch from one side of zero to the other first passes it, and the step of the signal there."""
    shown = shown if rising else -shown
    i = int(np.flatnonzero((shown[:-1] <= 0) & (shown[1:] > 0))[0])
    step = shown[i + 1] - shown[i]
    return time[i] - shown[i] / step * (time[i + 1] - time[i]), step


@dataclass(frozen=True)
class Turning:
    """How the shaft turned: its angle as a polynomial of time.

    coefficients : of the angle in turns since the first mark, over time minus `middle`, highest power first
    marks, turns : (mark,) s and the turn each begins;  missing, doubled : pulses that did not come, or came beside
    jitter_rad   : standard deviation of the marks from the polynomial
    """

    coefficients: np.ndarray
    middle: float
    marks: np.ndarray
    turns: np.ndarray
    missing: int
    doubled: int
    jitter_rad: float

    def angle(self, time):
        """(time,) rad since the first mark."""
        return 2 * np.pi * np.polyval(self.coefficients, np.asarray(time) - self.middle)

    def speed(self, time):
        """(time,) rad/s."""
        return 2 * np.pi * np.polyval(np.polyder(self.coefficients), np.asarray(time) - self.middle)

    @property
    def phase_variance(self):
        """Variance of the mean angle, rad^2."""
        return self.jitter_rad**2 / len(self.marks)


def count_turns(pulses):
    """The Turning told by pulses (pulse,) s, one a turn but for missing and doubled ones; None if they tell none.

    Marks are followed one by one from a start among the first few: a pulse near a whole number of turns after the last
    is a mark (pulses that did not come leave the number above one), any other is beside. The start that explains most
    pulses is taken. The angle is a parabola in time through all marks (a line through fewer than six), so that a
    steady change of speed is followed and jitter is averaged.
    """
    if len(pulses) < 2:
        return None
    period = np.median(np.diff(pulses))
    followed = [_follow(pulses, start, period) for start in range(min(5, len(pulses) - 1))]
    kept, turns = max(followed, key=lambda found: len(found[0]))
    if len(kept) < 2:
        return None
    marks = pulses[kept]
    middle = marks.mean()
    degree = 2 if len(marks) >= 6 else 1
    coefficients = np.polyfit(marks - middle, turns, degree)
    off = turns - np.polyval(coefficients, marks - middle)
    freedom = len(marks) - degree - 1
    jitter = 2 * np.pi * np.sqrt(np.sum(off**2) / freedom) if freedom > 0 else 0.0
    missing = int(turns[-1] - turns[0] + 1 - len(marks))
    return Turning(coefficients, middle, marks, turns, missing, len(pulses) - len(marks), float(jitter))


def _follow(pulses, start, period):
    """Positions of the pulses that follow `start` turn by turn, and their turns."""
    kept, turns = [start], [0]
    for i in range(start + 1, len(pulses)):
        passed = (pulses[i] - pulses[kept[-1]]) / period
        whole = round(passed)
        if whole >= 1 and abs(passed - whole) < NEAR:
            period += 0.2 * ((pulses[i] - pulses[kept[-1]]) / whole - period)
            kept.append(i)
            turns.append(turns[-1] + whole)
    return np.array(kept), np.array(turns)


def steady_turning(speed, time):
    """The Turning of a shaft known to run at `speed` rad/s with its mark at the first sample."""
    turns = np.array([0, int(speed * (time[-1] - time[0]) / (2 * np.pi))])
    marks = time[0] + turns * 2 * np.pi / speed
    middle = marks.mean()
    rate = speed / (2 * np.pi)
    return Turning(np.array([rate, rate * (middle - time[0])]), middle, marks, turns, 0, 0, 0.0)
