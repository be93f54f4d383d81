"""The signals of one speed as they are in a file, in metres and in the project's axes."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.measurement.conventions import combine, measured_direction

LARGEST_READING = 1e6  # m or V: beyond it a sample is damaged, and counts as missing
SHORTEST_STEP = 1e-12  # s, between samples
LEAST_DIGIT, WHOLE_DIGIT = 1e-6, 1e-3  # steps, to which rounding matters; digits, by which a number may miss them
LARGEST_TIME = 1e12  # s, 30,000 years: the clock of a recorder counts from 1900 at the earliest


@dataclass(frozen=True)
class RawRecord:
    """The signals of one speed in a file."""

    time: np.ndarray  # (time,) s
    channels: list = field(repr=False)  # list of Channel
    label: float | None  # speed in rad/s that the file or the rig file states, or None
    keyphasor: np.ndarray | None  # (time,) V
    marks: np.ndarray | None  # (mark,) s when the phase mark passed
    reference: np.ndarray | None  # (time,)
    where: str  # file and, if it holds several speeds, which one
    conventions: object = field(repr=False)  # used to read it: the rig file's, or the project's own if simulated

    @property
    def nodes(self):
        """(node,) measured."""
        return tuple(sorted({channel.node for channel in self.channels}))

    def at(self, node):
        """Channels of a node."""
        return [channel for channel in self.channels if channel.node == node]

    @cached_property
    def displacement(self):
        """(node, time) complex x + j y in the project's axes, m; NaN where a sample is missing.

        Without its mean if 0X is not wanted: the gap of a probe is hundreds of times its vibration, and no record is a
        whole number of revolutions to the sample, so that it would leak into the harmonics and their covariance.
        """
        channels = [self.at(node) for node in self.nodes]
        found = np.array([combine([c.direction for c in own], [c.readings for c in own]) for own in channels])
        for signal in found if 0 not in self.conventions.harmonics else ():
            there = np.isfinite(signal)
            signal -= signal[there].mean() if there.any() else 0.0
        return found

    @property
    def orders(self):
        """(node,) order of the derivative by time of a displacement, which `displacement` is at a node."""
        return np.array([self.at(node)[0].order for node in self.nodes])

    @property
    def directions(self):
        """(node,) rad, direction that the probes of a node show if it is only one, NaN for orbits."""
        return np.array([measured_direction([c.direction for c in self.at(node)]) for node in self.nodes])


class Channel(NamedTuple):
    """The signal of a probe at an angle from x, rad; order : of the derivative by time that readings (time,) are."""

    name: str
    node: int
    direction: float
    readings: np.ndarray
    order: int = 0


def assemble(readings, conventions, nodes, time, label, keyphasor, marks, reference, where):
    """A RawRecord from readings [(probe, node, (time,) m)]."""
    time = np.asarray(time, float)
    keyphasor = None if keyphasor is None else _within_reach(keyphasor)
    if len(time) < 3:
        raise RotorstudyError(f"{where}: {len(time)} samples; the file is empty or incomplete")
    known = np.abs(time) < LARGEST_TIME
    stops = np.flatnonzero(~(known[:-1] & known[1:] & (np.diff(time) > SHORTEST_STEP)))
    if len(stops):
        late = int(stops[0]) + 1
        cut = "the file is cut off: remove its last line" if late == len(time) - 1 else "check the time channel"
        raise RotorstudyError(
            f"{where}: time does not increase strictly (by {SHORTEST_STEP:g} s or more), from {time[late - 1]:g} s to "
            f"{time[late]:g} s at sample {late + 1} of {len(time)}; {cut}"
        )
    time = _by_the_clock(time)
    reach = np.array([2 * time[0] - time[-1], 2 * time[-1] - time[0]])  # the length of the record beyond its ends
    if marks is not None and len(marks) and not (np.diff([reach[0], *marks, reach[1]]) > 0).all():
        raise RotorstudyError(
            f"{where}: the phase marks do not increase strictly, or lie far outside the record; check phase_mark_time"
        )
    check_known("node", [node for _, node, _ in readings], nodes, f"{where}; the probes must sit at nodes of the rig")
    channels = []
    for probe, node, values in readings:
        direction = float(conventions.direction_rad(probe.angle_deg))
        channels.append(Channel(probe.channel, node, direction, _within_reach(values), probe.order))
    kinds = {(channel.node, channel.order) for channel in channels}
    if len(kinds) > len(dict(kinds)):
        raise RotorstudyError(f"{where}: a node has channels of displacement and of its derivative; number them apart")
    if label is not None and not 0 < label < np.inf:
        said = f"the stated speed is {label:g} rad/s; it must be positive and finite"
        raise RotorstudyError(f"{where}: {said}. Correct it, or leave it out")
    return RawRecord(time, channels, label, keyphasor, marks, reference, where, conventions)


def _by_the_clock(time):
    """Times (time,) s of an even clock, if these are rounded ones of it: whole digits, off by half of one at most."""
    place = np.arange(len(time)) - (len(time) - 1) / 2
    even = time.mean() + place * (place @ time) / (place @ place)
    off = np.abs(time - even).max()
    digit = 10 ** np.ceil(np.log10(max(1.9 * off, LEAST_DIGIT * np.ptp(time) / len(time))))
    rounded = np.abs(time / digit - np.rint(time / digit)).max() < WHOLE_DIGIT
    return even if rounded and off <= digit * (0.5 + 1 / np.sqrt(len(time))) else time


def _within_reach(values):
    """(time,) the samples, NaN for those that no instrument can have given."""
    return np.where(np.abs(values) <= LARGEST_READING, values, np.nan)
