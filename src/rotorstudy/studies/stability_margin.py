"""Stability at one speed as API 617 asks for it: decrement of the first forward mode, and what it can bear."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.whirl import Modes, damped_modes, is_in_time, synchronous, time_invariant, without_rotation

LEAST_DECREMENT = 0.1  # API 617, 8th edition, part 1, 4.8.5
LINE = 1e-6  # largest direction, by round-off, of a motion along a line, which has no sense of whirl
OSCILLATING = 0.9  # damping ratio of a mode that still whirls: its logarithmic decrement is 13
ROUNDS, SETTLED = 20, 1e-6  # of the frequency at which a measured foundation is taken; relative change of the last one
ROUND_OFF = 1e-9  # of an eigenvalue: real part of an undamped mode due to round-off, 5e-11 with up to 96 elements
LARGEST, HALVINGS = (
    10.0,
    12,
)  # times the local stiffness: up to which the margin is looked for, and its steps


class StabilityMargin(NamedTuple):
    """The first forward mode at a speed (rad/s), see `first_forward`: its frequency (rad/s) and decrement."""

    speed: float
    frequency: float
    log_decrement: float
    node: int  # of the heaviest disc, where a fluid is most likely to swirl
    cross_coupling: float | None  # there, N/m, that takes the decrement to zero; None: none does, 0: it has none left
    on_films: bool  # whether bearings depend on the speed, as films do


def stability_margin(model: Model, speed: float) -> StabilityMargin | None:
    """The StabilityMargin of a rotor at a speed by API 617 (8th ed., part 1, 4.8.5), or None without forward whirl."""
    from scipy.optimize import brentq

    mode, structure = whirl_mode(model, speed, first_forward), model.structure
    if mode is None:
        return None
    heaviest = max(structure.discs, key=lambda disc: disc.mass, default=None)
    node = heaviest.node if heaviest else max(structure.nodes, key=structure.mass_share)
    here = structure.unit(node)
    swirl = Parameter("swirl", "N/m", (Entry(1j * np.outer(here, here)),), 1.0)

    def growth(size):
        term = Term("swirl", (swirl,), {"swirl": size}, label="stability margin")
        swirled = whirl_mode(model.plus(term), speed, first_forward)  # others that lack damping do not answer for it
        return swirled.real - ROUND_OFF * abs(swirled)

    sizes = LARGEST * structure.scales.stiffness(node) * 2.0 ** np.arange(-HALVINGS, 1)  # so that it is the same mode
    found, ratio = None, -mode.real / abs(mode)
    decrement = float(log_decrement(ratio)) if abs(ratio) > ROUND_OFF else 0.0
    if not decrement or growth(0.0) > 0:
        found = 0.0
    elif above := next((size for size in sizes if growth(size) > 0), None):
        found = float(brentq(growth, above / 2 if above > sizes[0] else 0.0, above, rtol=1e-6))
    on_films = any(e.gain for u in time_invariant(model).rotor_unknowns if u.carries for e in u.entries)
    return StabilityMargin(speed, mode.imag, decrement, node, found, on_films)


def decrement_over_speed(model: Model, speed: np.ndarray, modes: Modes) -> np.ndarray:
    """Logarithmic decrement (speed,) of the first forward mode, NaN without; modes : of what has a form in time."""
    at_each = zip(speed, (Modes(*one) for one in zip(*modes, strict=True)), strict=True)
    found = np.array([whirl_mode(model, w, first_forward, one) or np.nan for w, one in at_each])
    return log_decrement(-found.real / np.abs(found))


def whirl_mode(model: Model, speed: float, choose: Callable, modes: Modes | None = None) -> complex | None:
    """Eigenvalue, 1/s, of a mode at a speed, None without.

    What is stated in frequency only acts on a motion that decays as on one of its frequency that does not: exact where
    the decrement is zero, and off by its square elsewhere. It is taken at the frequency of the mode, round by round.

    choose : function(Modes at the speed, speed) -> position, None without, among those of what has a form in time
    modes  : these Modes, if they are known
    source : the p-k method of flutter, Hassig 1971, J. Aircraft 8(11)
    """
    steady, found = without_rotation(model), None
    in_time = all(is_in_time(term) for term in steady.terms if not term.acts_on_output)
    for _ in range(ROUNDS):
        if modes is None:
            still = synchronous(steady, found.imag) if found else time_invariant(model)
            modes = Modes(*(part[0] for part in damped_modes(still, [speed], 2 * len(still.structure.dofs))))
        if found is None:
            i = choose(modes, speed)
            if i is None:
                return None
            turning = modes.direction[i]
        else:  # the same mode, not its neighbour that whirls the other way
            off = np.where(np.abs(modes.direction - turning) < 1, np.abs(modes.eigenvalue - found), np.inf)
            i = off.argmin()
        before, found, modes = found, complex(modes.eigenvalue[i]), None
        if in_time or (before and abs(found - before) < SETTLED * abs(found)):
            break
    return found


def first_forward(modes: Modes, speed: float) -> int | None:
    """Position of the least damped forward mode below the speed, else of the lowest one; None without.

    Forward is what is not backward: also a thin ellipse, as of a shaft on supports of two stiffnesses, or a line.
    """
    frequency, ratio = modes.frequency, modes.damping_ratio
    forward = np.flatnonzero((modes.direction > -LINE) & (ratio < OSCILLATING))
    if not len(forward):
        return None
    below = forward[frequency[forward] < speed]
    return int(below[ratio[below].argmin()] if len(below) else forward[frequency[forward].argmin()])


def log_decrement(ratio: np.ndarray) -> np.ndarray:
    """Logarithmic decrement (...) of damping ratios (...)."""
    return 2 * np.pi * ratio / np.sqrt(np.maximum(1 - np.square(ratio), 1e-12))
