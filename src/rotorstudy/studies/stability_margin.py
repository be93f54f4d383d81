"""Stability at one speed as API 617 asks for it: decrement of the first forward mode, and what it can bear."""

from typing import NamedTuple

import numpy as np

from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.whirl import Modes, damped_modes, is_in_time, synchronous, time_invariant, without_rotation

LEAST_DECREMENT = 0.1  # API 617, 8th edition, part 1, 4.8.5
FORWARD = 0.2  # direction of a mode above which it is forward whirl
OSCILLATING = 0.9  # damping ratio of a mode that still whirls: its logarithmic decrement is 13
ROUNDS, SETTLED = 20, 1e-6  # of the frequency at which a measured foundation is taken; relative change of the last one
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

    mode, structure = whirl_mode(model, speed), model.structure
    if mode is None:
        return None
    heaviest = max(structure.discs, key=lambda disc: disc.mass, default=None)
    node = heaviest.node if heaviest else max(structure.nodes, key=structure.mass_share)
    here = structure.unit(node)
    swirl = Parameter("swirl", "N/m", (Entry(1j * np.outer(here, here)),), 1.0)

    def growth(size):
        term = Term("swirl", (swirl,), {"swirl": size}, label="stability margin")
        return whirl_mode(model.plus(term), speed, _least_stable).real

    largest, found = LARGEST * structure.scales.stiffness(node), None
    if growth(0.0) > 0:
        found = 0.0
    elif growth(largest) > 0:
        found = float(brentq(growth, 0.0, largest, rtol=1e-6))
    on_films = any(e.gain for u in time_invariant(model).rotor_unknowns if u.carries for e in u.entries)
    decrement = float(log_decrement(-mode.real / abs(mode)))
    return StabilityMargin(speed, mode.imag, decrement, node, found, on_films)


def whirl_mode(model: Model, speed: float, choose=None) -> complex | None:
    """Eigenvalue, 1/s, of the first forward mode at a speed, or of one that is chosen; None without.

    What is stated in frequency only acts on a motion that decays as on one of its frequency that does not: exact where
    the decrement is zero, and off by its square elsewhere. It is taken at the frequency of the mode, round by round.

    choose : function(Modes at one speed, speed) -> position, among the modes of what has a form in time
    source : the p-k method of flutter, Hassig 1971, J. Aircraft 8(11)
    """
    still, found = time_invariant(model), None
    for _ in range(ROUNDS):
        modes = damped_modes(still, [speed], 2 * len(still.structure.dofs))
        value, direction = modes.eigenvalue[0], modes.direction[0]
        if found is None:
            i = (choose or _first_forward)(modes, speed)
            turning = 0.0 if i is None else direction[i]
        else:  # the same mode, not its neighbour that whirls the other way
            i = np.nanargmin(np.where(np.abs(direction - turning) < 1, np.abs(value - found), np.inf))
        if i is None:
            return None
        before, found = found, complex(value[i])
        if acts_in_time(model) or (before and abs(found - before) < SETTLED * abs(found)):
            break
        still = synchronous(without_rotation(model), found.imag)
    return found


def acts_in_time(model: Model) -> bool:
    """Whether all that whirl does not leave out has a form in time."""
    return all(is_in_time(term) for term in without_rotation(model).terms if not term.acts_on_output)


def decrement_over_speed(model: Model, speed: np.ndarray, modes: Modes) -> np.ndarray:
    """Logarithmic decrement (speed,) of the first forward mode, NaN without; modes : of what has a form in time."""
    if acts_in_time(model):
        ratio, direction = modes.damping_ratio, modes.direction
        chosen = [first_forward(*one) for one in zip(modes.frequency, ratio, direction, speed, strict=True)]
        ratio = np.array([np.nan if i is None else ratio[k, i] for k, i in enumerate(chosen)])
    else:
        found = [whirl_mode(model, w) or np.nan for w in speed]
        ratio = -np.real(found) / np.abs(found)
    return log_decrement(ratio)


def _first_forward(modes, speed):
    return first_forward(modes.frequency[0], modes.damping_ratio[0], modes.direction[0], speed)


def _least_stable(modes, _):
    return int(np.nanargmax(modes.eigenvalue[0].real))


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
