"""Where journals run in their films over speed: the shaft centreline."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding
from rotorstudy.model.bearings import running_position
from rotorstudy.model.model import Model
from rotorstudy.units import number, spin

SAME_SPEED = 0.01  # relative difference
OUTSIDE = 2.0  # clearances from the middle, where no bearing is so worn that its journal runs there
SAME_PLACE = 0.05  # of the clearance: gap voltages drift by that with temperature


class Centreline(NamedTuple):
    """Positions of a journal, complex, m from the middle of its bearing, real part along gravity."""

    node: int
    clearance: float
    predicted: np.ndarray  # (speed,) of the rig, NaN where there is no film
    measured_speed: np.ndarray  # (row,), rad/s, empty if nothing was measured
    measured: np.ndarray  # (row,)
    expected: np.ndarray  # (row,) there, by the rig

    def doubt(self, row):
        """What to check if the journal was measured where it cannot be, else nothing."""
        if abs(self.measured[row]) <= OUTSIDE * self.clearance:
            return ""
        return "outside the bearing: check 'gap_at_rest_V', 'sensitivity_V_per_m' and 'sign' of its probes"


def centrelines(model: Model, speeds: np.ndarray, from_rest: dict) -> list[Centreline]:
    """The Centreline, over speeds (rad/s), of every bearing that knows where its journal runs, measured or not."""
    found = []
    for term in model.terms:
        position = running_position(term.kind, term.options)
        if position is None or term.is_foundation:
            continue
        node, clearance = term.options["node"], term.options["radial_clearance_m"]
        at, moved = from_rest.get(node, (np.zeros(0), np.zeros(0, complex)))
        each = ([_running(position, w) for w in np.asarray(every, float)] for every in (speeds, at))
        predicted, there = (np.array(places, complex) for places in each)
        found.append(Centreline(node, clearance, predicted, at, clearance + moved, there))
    return found


def journals_moved(model: Model, before: dict, after: dict) -> Iterator[Finding]:
    """A note on each journal whose mean position is another at the highest speed measured in both states."""
    for one, other in zip(*(centrelines(model, np.zeros(0), state) for state in (before, after)), strict=True):
        apart = np.abs(one.measured_speed[:, None] / other.measured_speed - 1) <= SAME_SPEED
        if not apart.any():
            continue
        i, k = np.argwhere(apart)[-1]
        places = (f"{number(abs(z) / one.clearance, 2)} of the clearance at {number(np.rad2deg(np.angle(z)) % 360, 2)}°"
                  for z in (one.measured[i], other.measured[k]))  # fmt: skip
        name, told = "journal in place", "load, clearance and oil of this bearing are as before"
        if abs(other.measured[k] - one.measured[i]) > SAME_PLACE * one.clearance:
            name = "journal moved"
            told = "load (alignment), clearance or oil of this bearing changed, whatever the vibration says"
        if doubt := one.doubt(i) or other.doubt(k):
            name, told = "journal out of place", doubt
        where = model.structure.label_at({"node": one.node}) or f"node {one.node}"
        at = f"its mean position at {spin(other.measured_speed[k])} was {' from gravity, and is '.join(places)}"
        yield Finding("warning" if doubt else "note", name, where, f"{at}: {told}")


def _running(position, speed):
    try:
        return position(speed)
    except RotorstudyError:  # no film
        return complex(np.nan)
