"""Where journals run in their films over speed: the shaft centreline."""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry


class Centreline(NamedTuple):
    """Positions of a journal, complex, m from the middle of its bearing, real part along gravity.

    predicted          : (speed,) of the rig, NaN where there is no film
    measured_speed     : (row,), rad/s, empty if nothing was measured
    measured, expected : (row,) there, and by the rig
    """

    node: int
    clearance: float
    predicted: np.ndarray
    measured_speed: np.ndarray
    measured: np.ndarray
    expected: np.ndarray


def centrelines(model: Model, speeds: np.ndarray, from_rest: dict) -> list[Centreline]:
    """The Centreline of every bearing whose plugin knows where the journal runs.

    speeds    : (speed,) rad/s
    from_rest : {node: (speed (row,), rad/s, position (row,), complex, m, from where the shaft lay at rest)}, which is
                the bottom of the bearing
    """
    bearings, found = registry().plugins["bearing"], []
    for term in model.terms:
        running = getattr(bearings.get(term.kind), "running", None)
        if running is None or term.is_foundation:
            continue
        options = {name: value for name, value in term.options.items() if name != "node"}
        node, clearance = term.options["node"], term.options["radial_clearance_m"]
        at, moved = from_rest.get(node, (np.zeros(0), np.zeros(0, complex)))
        predicted, there = (
            clearance * np.array([_running(running, w, options) for w in np.asarray(every, float)], complex)
            for every in (speeds, at)
        )
        found.append(Centreline(node, clearance, predicted, at, clearance + moved, there))
    return found


def _running(running, speed, options):
    try:
        eccentricity, attitude = running(speed, **options)
    except RotorstudyError:  # no film
        return complex(np.nan)
    return eccentricity * np.exp(1j * attitude)
