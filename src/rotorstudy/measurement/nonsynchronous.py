"""Findings on spectral lines that are not synchronous: frequency, direction, and what they are likely to be."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.measurement.findings import Finding
from rotorstudy.units import um

MAINS_HZ = (50.0, 60.0)
MOST_MAINS = 6  # multiples of the mains frequency
MAINS_OFF = 0.004  # relative: mains are within 0.2 Hz of 50 Hz
SUBHARMONICS = {"1/2": 1 / 2, "1/3": 1 / 3, "1/4": 1 / 4, "2/3": 2 / 3, "3/2": 3 / 2}
SUBHARMONIC_OFF = 0.002  # of an order, or a fifth of a cycle in the record
WHIRL = (0.38, 0.495)  # orders; Muszynska 2005, Rotordynamics: 0.40 to 0.49 for fluid whirl
CIRCULAR = 2.0  # ratio of forward and backward parts beyond which the sense of a motion is clear
SAME = 0.01  # relative difference of frequencies or orders at different speeds that are the same
APART = 0.03  # relative difference of speeds at which a constant order is not a constant frequency


@dataclass(frozen=True)
class Seen:
    """A line in one record: speed in rad/s, whole revolutions, order, and amplitudes (m) at its largest node."""

    where: str
    speed: float
    revolutions: float
    order: float
    forward: float
    backward: float
    node: int

    @property
    def hertz(self):
        return self.order * self.speed / (2 * np.pi)


def check_lines(facts):
    """Findings on the lines in all records, one for each that is the same at several speeds."""
    return [_finding(group) for group in _groups([seen for one in facts for seen in _seen(one)])]


def _seen(facts):
    """The lines of one record, each at the node where it is largest."""
    found = []
    every = [(line, node) for node, one in facts.nodes.items() for line in one.lines]
    for line, node in sorted(every, key=lambda pair: -max(pair[0].forward, pair[0].backward)):
        if all(abs(line.order - other.order) * facts.revolutions > 1 for other in found):
            of_line = line.order, line.forward, line.backward
            found.append(Seen(facts.where, facts.measured_speed, facts.revolutions, *of_line, node))
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
    text = (
        f"a line at {first.hertz:.5g} Hz, {first.order:.4f} times the speed{across}: forward {um(first.forward)}, "
        f"backward {um(first.backward)} at node {first.node}, {_sense(first)}. {likely_kind(speeds, orders, first)}. "
        "It is fitted together with the harmonics and kept out of their covariance; the diagnosis does not explain it"
    )
    return Finding("warning", "non-synchronous line", first.where, text)


def _sense(seen):
    if seen.forward > CIRCULAR * seen.backward:
        return "forward"
    return "backward" if seen.backward > CIRCULAR * seen.forward else "without a clear sense"


def likely_kind(speeds, orders, seen):
    """A sentence on what a line may be, with the reason."""
    steady = np.ptp(orders * speeds) < SAME * np.mean(orders * speeds)
    tracks = np.ptp(orders) < SAME * np.mean(orders)
    one_speed = np.ptp(speeds) < APART * np.mean(speeds)
    if one_speed:
        steady = tracks = True  # one speed does not tell
    kinds = []
    if steady:
        multiple = next((m for f in MAINS_HZ if (m := _mains(seen.hertz, f))), None)
        if multiple:
            kinds.append(f"hum of the mains: {multiple} at any speed")
        elif not tracks:
            known = "the same frequency at all speeds, not of the mains"
            kinds.append(f"a natural frequency, excited or unstable (whip): {known}")
    if tracks:
        off = max(SUBHARMONIC_OFF, 0.2 / seen.revolutions)
        name = next((name for name, order in SUBHARMONICS.items() if abs(seen.order - order) < off), None)
        if name:
            kinds.append(f"a subharmonic of looseness, rub or another nonlinearity: {name} of the speed to {off:.1g}")
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


def _mains(hertz, mains):
    """'2 x 50 Hz' for a frequency that is a multiple of that of the mains, else ''."""
    multiple = round(hertz / mains)
    near = 1 <= multiple <= MOST_MAINS and abs(hertz / (multiple * mains) - 1) < MAINS_OFF
    return f"{multiple} x {mains:g} Hz" if near else ""
