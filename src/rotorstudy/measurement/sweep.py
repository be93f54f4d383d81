"""The rotation of a shaft in a run-up or coast-down: angle, speed and its rate from the phase marks."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.measurement.keyphasor import PIECE_REVOLUTIONS, follow_marks

SWEPT = 0.2  # relative change of the speed over a record from which it is a run-up or a coast-down
FEWEST_MARKS = 40  # of a sweep


@dataclass(frozen=True)
class Sweep:
    """Angle of the shaft as a cubic spline of time, fitted to the marks by least squares.

    revolutions : spline, revolutions since the first mark over time, s
    marks : (mark,) s; start, end : s, between which the speed grows or falls throughout
    missing, doubled, jitter_rad, resolution_s : as of `keyphasor.Turning`
    """

    revolutions: object
    marks: np.ndarray
    start: float
    end: float
    missing: int
    doubled: int
    jitter_rad: float
    resolution_s: float

    def angle(self, time):
        """(time,) rad since the first mark."""
        return 2 * np.pi * self.revolutions(time)

    def speed(self, time):
        """(time,) rad/s."""
        return 2 * np.pi * self.revolutions(time, nu=1)

    def rate(self, time):
        """(time,) rad/s^2, mean over ten revolutions on either side: a spline's second derivative shows its knots."""
        half = PIECE_REVOLUTIONS * 2 * np.pi / self.speed(np.asarray(time))
        early, late = np.maximum(time - half, self.start), np.minimum(time + half, self.end)
        return (self.speed(late) - self.speed(early)) / (late - early)


def is_swept(pulses):
    """Whether pulses (pulse,) s belong to a run-up or coast-down."""
    if len(pulses) < FEWEST_MARKS:
        return False
    period = np.diff(pulses)
    some = max(5, len(period) // 20)
    ends = sorted([np.median(period[:some]), np.median(period[-some:]), np.median(period)])
    return bool(ends[-1] > (1 + SWEPT) * ends[0])


def find_sweep(pulses, resolution_s=0.0):
    """The Sweep of pulses (pulse,) s, one a revolution but for missing and extra ones.

    Its spline has a knot every ten revolutions, so that it follows the speed and averages the jitter of the marks. Of
    a record that runs up and down, the part between the lowest and the highest speed is taken.
    """
    from scipy.interpolate import make_lsq_spline

    kept, counts = follow_marks(pulses)
    marks, missing = pulses[kept], int(counts[-1] + 1 - len(kept))
    inner = marks[PIECE_REVOLUTIONS:-PIECE_REVOLUTIONS:PIECE_REVOLUTIONS]
    knots = np.concatenate([[marks[0]] * 4, inner, [marks[-1]] * 4])
    revolutions = make_lsq_spline(marks, counts.astype(float), knots)
    off = counts - revolutions(marks)
    jitter = 2 * np.pi * np.sqrt(np.sum(off**2) / (len(marks) - len(inner) - 4))
    speed = revolutions(marks, nu=1)
    ends = sorted([int(speed.argmin()), int(speed.argmax())])
    start, end = marks[ends]
    return Sweep(
        revolutions, marks, float(start), float(end), missing, len(pulses) - len(marks), float(jitter), resolution_s
    )
