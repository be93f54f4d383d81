"""Stability at one speed as API 617 asks for it: decrement of the first forward mode, and what it can bear."""

from typing import NamedTuple

import numpy as np

from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.stability import growth_rate
from rotorstudy.response.whirl import damped_modes, is_in_time, time_invariant, without_rotation

LEAST_DECREMENT = 0.1  # API 617, 8th edition, part 1, 4.8.5
FORWARD = 0.2  # direction of a mode above which it is forward whirl
OSCILLATING = 0.9  # damping ratio of a mode that still whirls: its logarithmic decrement is 13
LARGEST = 10.0  # times the local stiffness: cross-coupling up to which the margin is looked for


class StabilityMargin(NamedTuple):
    """The first forward mode at a speed (rad/s), see `first_forward`: its frequency (rad/s) and decrement."""

    speed: float
    frequency: float
    log_decrement: float
    node: int  # of the heaviest disc, where a fluid is most likely to swirl
    cross_coupling: float | None  # there, N/m, that takes the decrement to zero; None: none does, 0: unstable already
    on_films: bool  # whether bearings depend on the speed, as films do


def stability_margin(model: Model, speed: float) -> StabilityMargin | None:
    """The StabilityMargin of a rotor at a speed by API 617 (8th ed., part 1, 4.8.5), or None without forward whirl."""
    from scipy.optimize import brentq

    if not all(is_in_time(term) for term in without_rotation(model).terms if not term.acts_on_output):
        return None
    still = time_invariant(model)
    modes = damped_modes(still, [speed], 2 * len(still.structure.dofs))
    i, structure = first_forward(modes.frequency[0], modes.damping_ratio[0], modes.direction[0], speed), still.structure
    if i is None:
        return None
    heaviest = max(structure.discs, key=lambda disc: disc.mass, default=None)
    node = heaviest.node if heaviest else max(structure.nodes, key=structure.mass_share)
    here = structure.unit(node)
    swirl = Parameter("swirl", "N/m", (Entry(1j * np.outer(here, here)),), 1.0)

    def growth(size):
        term = Term("swirl", (swirl,), {"swirl": size}, label="stability margin")
        return float(growth_rate(still.plus(term), [speed])[0])

    largest, found = LARGEST * structure.scales.stiffness(node), None
    if growth(0.0) > 0:
        found = 0.0
    elif growth(largest) > 0:
        found = float(brentq(growth, 0.0, largest, rtol=1e-6))
    on_films = any(e.gain for u in still.rotor_unknowns if u.carries for e in u.entries)
    decrement = float(log_decrement(modes.damping_ratio[0, i]))
    return StabilityMargin(speed, float(modes.frequency[0, i]), decrement, node, found, on_films)


def first_forward(frequency: np.ndarray, ratio: np.ndarray, direction: np.ndarray, speed: float) -> int | None:
    """Position of the least damped forward mode below the speed, else the lowest forward one; None without."""
    forward = np.flatnonzero((direction > FORWARD) & (ratio < OSCILLATING))
    if not len(forward):
        return None
    below = forward[frequency[forward] < speed]
    return int(below[ratio[below].argmin()] if len(below) else forward[frequency[forward].argmin()])


def log_decrement(ratio: np.ndarray) -> np.ndarray:
    """Logarithmic decrement (...) of damping ratios (...)."""
    return 2 * np.pi * ratio / np.sqrt(np.maximum(1 - np.square(ratio), 1e-12))
