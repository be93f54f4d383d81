"""Growth of the free motion of one rig over speed, and the speed from which it is unstable."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.terms import with_entries
from rotorstudy.response.floquet import periodic_growth_rate, varies_in_time
from rotorstudy.response.stability import SLOWEST_GROWTH, growth_rate, stability_threshold
from rotorstudy.response.whirl import damped_modes, is_in_time, linear

PERIODIC_SPEEDS = 40  # evenly spaced, at which the growth in a rotor with rotating stiffness is integrated
PUMPED_MODES = 4  # the lowest ones, whose parametric resonances are looked at too
PUMPS = (1, 2, 3, 4)  # multiples of the speed at which a rotating stiffness varies
BY_NONLINEAR_FORCES = (1, 2)  # those of the slopes of nonlinear forces
APART = 1e-3  # relative, of two speeds that are both looked at
EDGE = 1e-4  # relative error of the speeds at which a motion begins and ceases to grow


def growth_over_speed(model, still, speeds):
    """The growth rate of the fastest growing free motion over speed, and the speed from which one grows, or None.

    Where the stiffness rotates with the shaft, motions may grow in narrow ranges only: where two whirl frequencies add
    up to a multiple of the speed at which the stiffness varies (Nayfeh and Mook, Nonlinear Oscillations, 1979, ch. 5).
    These speeds are added; the growth rate is in 1/s, NaN without a steady state. still : the Model without what
    rotates, is nonlinear or is stated in frequency only.
    """
    if not varies_in_time(model):
        return speeds, growth_rate(still, speeds), stability_threshold(still, speeds[-1], lowest=speeds[0])
    in_time = replace(model, terms=tuple(t for t in model.terms if t.acts_on_output or is_in_time(t)))
    some = np.linspace(speeds[0], speeds[-1], PERIODIC_SPEEDS)
    some = np.sort(np.concatenate([some, parametric_resonances(in_time, speeds)]))
    some = some[np.append(True, np.diff(some) > APART * some[1:])]
    found = {speed: _growth(in_time, speed) for speed in some}
    found |= _at_edges(in_time, found)
    some, growth = np.array(sorted(found.items())).T
    unstable = some[_grows(growth, some)]
    return some, growth, float(unstable[0]) if len(unstable) else None


def parametric_resonances(model, speeds):
    """Speeds, rad/s, in a range at which a rotating stiffness may make two of the lowest whirl motions grow."""
    turning = {abs(shift) for _, shift in model.couplings if shift}
    turning |= set(BY_NONLINEAR_FORCES) if model.nonlinear_forces else set()
    frequency, found = damped_modes(_mean_over_a_turn(model), speeds, PUMPED_MODES).frequency.T, []
    for i, one in enumerate(frequency):
        for other in frequency[i:]:
            for pump in turning.intersection(PUMPS):
                off = one + other - pump * speeds
                k = np.flatnonzero(off[:-1] * off[1:] <= 0)
                share = off[k] / np.where(off[k] == off[k + 1], 1, off[k] - off[k + 1])
                found.append(speeds[k] + share * (speeds[k + 1] - speeds[k]))
    return np.sort(np.concatenate([[], *found]))


def _mean_over_a_turn(model):
    """The model with the mean of what rotates with the shaft, and without nonlinear forces."""
    terms = (with_entries(t, lambda e: [] if e.reads_motion and e.shift else [e]) for t in model.terms)
    return linear(replace(model, terms=tuple(t for t in terms if any(u.entries for u in t.unknowns))))


def _growth(model, speed):
    """Growth rate at a speed, 1/s; NaN where nonlinear forces leave no steady state."""
    try:
        return periodic_growth_rate(model, [speed])[0]
    except NoSteadyState:
        return np.nan


def _grows(growth, speed):
    return growth * 2 * np.pi / speed > SLOWEST_GROWTH


def _at_edges(model, known):
    """{speed: growth rate} just below and above the speeds, rad/s, at which motions begin or cease to grow."""
    found = {}
    for low, high in pairwise(known):
        ends = {low: known[low], high: known[high]}
        grows_above = _grows(known[high], high)
        while _grows(ends[low], low) != grows_above and high - low > EDGE * high:
            middle = (low + high) / 2
            ends[middle] = _growth(model, middle)
            low, high = (low, middle) if _grows(ends[middle], middle) == grows_above else (middle, high)
        found |= {low: ends[low], high: ends[high]}
    return found
