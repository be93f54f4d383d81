"""Whirl over speed: Campbell diagram and critical speeds; peaks of an amplitude and separation margins (API 684)."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NotHeld
from rotorstudy.model.terms import with_entries
from rotorstudy.response.few_shapes import few_shapes
from rotorstudy.response.stability import eigenvalues, state_matrix

CREEPING = 0.1  # imaginary part over modulus: below it a motion creeps back instead of whirling (damping ratio 0.995)
JUMP = 1e-6  # of the highest speed: what an eigenvalue misses the line by where it jumps across it
OVERDAMPED = 1e-6  # imaginary part over modulus of an eigenvalue; a smaller one is round-off of a motion without whirl
HALF_POWER = np.sqrt(0.5)
SAME = 1e-6  # relative difference of whirl frequencies that are equal
RESONANT = 0.5  # damping ratio up to which a critical speed shows as a resonance
UNHELD = 1e-6  # of the lowest natural frequency: eigenvalue of a motion that nothing holds
UNCRITICAL = 2.5  # amplification factor below which a resonance is critically damped and needs no margin


def time_invariant(model):
    """The model without what is nonlinear, varies with the rotation (a crack) or is stated in frequency only.

    If nothing else holds the rotor, what is stated in frequency only is kept as it acts at the spin speed.
    """
    steady = without_rotation(model)
    if is_held_in_frequency(steady):
        return synchronous(steady)
    terms = tuple(term if is_in_time(term) else _in_time(term) for term in steady.terms)
    return replace(steady, terms=tuple(term for term in terms if any(u.entries for u in term.unknowns)))


def is_held_in_frequency(model):
    """Whether the rotor is held by bearings that are all stated in frequency only, such as flexible pedestals."""
    held = [term for term in model.terms if any(unknown.carries for unknown in term.unknowns)]
    in_time = any(any(u.carries and u.entries for u in _in_time(term).unknowns) for term in held)
    return bool(held) and not in_time and not model.structure.is_supported


def synchronous(model, frequency=None):
    """The model with what is stated in frequency only as at the spin speed: exact for critical speeds of unbalance.

    frequency : rad/s, at which it is taken instead: exact for an undamped whirl there
    """

    split = partial(_stiffness_and_damping, frequency=frequency)
    return replace(model, terms=tuple(with_entries(term, split) for term in model.terms))


def _stiffness_and_damping(entry, frequency):
    """An entry stated in frequency only as two with a form in time, g = k + j w c both at w and at -w; else itself."""
    if not (entry.reads_motion and entry.frequency_only):
        return [entry]

    def gain(order, speed):
        whirl = speed if frequency is None else frequency + 0 * speed
        ahead, behind = (entry.gain(speed, sign * whirl / speed) for sign in (1, -1))
        return (ahead - behind) / (2j * whirl) if order else (ahead + behind) / 2

    given = {"gain": partial(gain, 0), "frequency_only": False}
    return [replace(entry, **given), replace(entry, **given | {"gain": partial(gain, 1), "order": entry.order + 1})]


def without_rotation(model):
    """The model without nonlinear forces, and without the terms that vary with the rotation, such as a crack."""
    turning = [t.kind for t in model.terms for u in t.unknowns for e in u.entries if e.reads_motion and e.shift]
    return linear(model.without(turning))


def linear(model):
    """The model without nonlinear forces."""
    terms = (replace(t, parameters=tuple(p for p in t.parameters if not p.force)) for t in model.terms)
    return replace(model, terms=tuple(term for term in terms if term.parameters))


def check_held(model, speed):
    """Raise NotHeld if a rotor without nonlinear forces can move at a speed (rad/s) without a restoring force."""
    if model.nonlinear_forces:
        return
    still = time_invariant(model)
    slowest = np.abs(eigenvalues(still, [speed], shapes=few_shapes(still))).min()
    if slowest < UNHELD * still.structure.scales.frequency:
        raise NotHeld("the bearings and feet do not hold the rotor: no linear force restores it; add some")


def is_in_time(term):
    """Whether all that a term adds to the equations of motion has a form in time."""
    return not any(e.reads_motion and e.frequency_only for u in term.unknowns for e in u.entries)


def _in_time(term):
    """A term without its entries that are stated in frequency only, such as the stiffness of a squeeze film."""
    return with_entries(term, lambda entry: [] if entry.reads_motion and entry.frequency_only else [entry])


def without_damping(model):
    """Amplitudes (parameter,) of a model, in its units, with every damping set to zero."""
    return np.where(["damping" in name for name in model.names], 0.0, model.theta)


class Modes(NamedTuple):
    """Damped whirl modes of a rotor, q(t) = forward e^{pt} + backward e^{conj(p) t}, in order of frequency."""

    eigenvalue: np.ndarray  # (speed, mode) p, 1/s, imaginary part > 0; NaN where there are fewer modes
    forward: np.ndarray  # (speed, mode, dof) complex; the largest component of both is 1
    backward: np.ndarray  # (speed, mode, dof) complex
    direction: np.ndarray  # (speed, mode) 1 for forward circles, 0 for straight lines, -1 for backward circles

    @property
    def frequency(self):
        """Damped whirl frequency (speed, mode), rad/s."""
        return self.eigenvalue.imag

    @property
    def damping_ratio(self):
        """Share of critical damping (speed, mode), 1; negative if unstable."""
        return -self.eigenvalue.real / np.abs(self.eigenvalue)


def damped_modes(model, speed, count):
    """The lowest damped whirl Modes of a time-invariant model over speed (rad/s); overdamped motions are left out."""
    dof, moves = len(model.structure.dofs), model.structure.along > 0
    unknown, shapes = np.full((2, len(speed), count), np.nan), np.full((2, len(speed), count, dof), np.nan * 1j)
    found = Modes(unknown[0] * 1j, *shapes, unknown[1])
    for i, w in enumerate(speed):
        values, shapes = whirl_modes(model, w)
        if shapes.shape[1] == dof:  # isotropic: a backward mode has a negative frequency
            backwards = values.imag[:, None] < 0
            shapes = np.concatenate([np.where(backwards, 0, shapes), np.where(backwards, shapes.conj(), 0)], axis=1)
            values = np.where(values.imag < 0, values.conj(), values)
        whirls = np.flatnonzero(values.imag > OVERDAMPED * np.abs(values))
        lowest = whirls[np.argsort(values[whirls].imag, kind="stable")][:count]
        here = slice(0, len(lowest))
        ahead, behind = shapes[lowest, :dof], shapes[lowest, dof:].conj()
        found.eigenvalue[i, here], found.forward[i, here], found.backward[i, here] = values[lowest], ahead, behind
        power = [np.sum(np.abs(part[:, moves]) ** 2, axis=1) for part in (ahead, behind)]
        found.direction[i, here] = (power[0] - power[1]) / np.maximum(power[0] + power[1], np.finfo(float).tiny)
    return found


def whirl_modes(model, speed, theta=None):
    """Eigenvalues (mode,), 1/s, by frequency, and shapes (mode, dof); (mode, 2 dof) on anisotropic bearings."""
    few = few_shapes(model, theta)
    values, vectors = np.linalg.eig(state_matrix(model, [speed], theta, few)[0])
    order = np.argsort(values.imag)
    shapes = vectors[: len(values) // 2, order].T
    if few is not None:
        shapes = (shapes.reshape(-1, few.shape[1]) @ few.T).reshape(len(values), -1)
    tallest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    return values[order], shapes / tallest


def critical_speeds(model, up_to, orders=(1,), theta=None, speeds=None):
    """Critical speeds (critical,), rad/s, of a time-invariant model for each order n, n > 0 forward."""
    from scipy.optimize import brentq

    speeds = np.geomspace(1e-4 * up_to, up_to, 600) if speeds is None else speeds
    shapes = few_shapes(model, theta)
    values = eigenvalues(model, speeds, theta, shapes)
    for i in range(1, len(speeds)):
        values[i] = values[i][_followed(values[i - 1], values[i])]

    def value(w, i, mode):
        """The eigenvalue at a speed between two others that continues a mode."""
        here = eigenvalues(model, [w], theta, shapes)[0]
        if len(here) < values.shape[1]:  # bearings that are isotropic at this speed, and not at others
            here = np.concatenate([here, here.conj()])
        share = (w - speeds[i]) / (speeds[i + 1] - speeds[i])
        return here[np.abs(here - (1 - share) * values[i, mode] - share * values[i + 1, mode]).argmin()]

    def meeting(order):
        change, found = np.diff(values.imag > order * speeds[:, None], axis=0), []
        for i, mode in np.argwhere(change):
            off = partial(lambda i, mode, w: value(w, i, mode).imag - order * w, i, mode)
            at = brentq(off, *speeds[i : i + 2], xtol=1e-9 * up_to)
            there = value(at, i, mode)
            if abs(there.imag) > CREEPING * abs(there) and abs(there.imag - order * at) < JUMP * up_to:
                found.append(at)
        return np.sort(np.array(found))

    return [meeting(order) for order in orders]


class Critical(NamedTuple):
    """A critical speed, rad/s; direction : 1 forward circles, 0 straight lines, -1 backward circles"""

    speed: float
    damping_ratio: float
    direction: float


def critical_at(still, speed):
    """The Critical at a critical speed, rad/s, of a time-invariant model."""
    modes = damped_modes(still, [speed], 2 * len(still.structure.dofs))
    near = np.abs(modes.frequency[0] - speed) < np.nanmin(np.abs(modes.frequency[0] - speed)) + SAME * speed
    nearest = int(np.argmax(np.where(near, modes.direction[0], -np.inf)))  # unbalance drives a forward whirl
    return Critical(float(speed), float(modes.damping_ratio[0, nearest]), float(modes.direction[0, nearest]))


def first_resonance(model, up_to):
    """The lowest critical speed up to another speed, rad/s, that shows as a resonance; None without one."""
    still, speeds = time_invariant(model), np.linspace(0.02 * up_to, up_to, 100)
    criticals = (critical_at(still, one) for one in critical_speeds(still, up_to, speeds=speeds)[0])
    return next((one.speed for one in criticals if one.damping_ratio <= RESONANT), None)


def _followed(before, after):
    """Order (mode,) of eigenvalues in which each continues that at the speed below: by frequency some change places."""
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(before[:, None] - after) / (np.abs(before)[:, None] + np.abs(after) + np.finfo(float).tiny)
    return linear_sum_assignment(distance)[1]


class Peak(NamedTuple):
    """A resonance in an amplitude over speed, rad/s; amplification is NaN where a half-power point is not reached."""

    speed: float
    amplitude: float
    amplification: float


def peaks(speed, amplitude):
    """The Peaks of an amplitude over closely spaced speeds; amplification N_c / (N_2 - N_1), API RP 684, Figure 1-1."""
    apart = np.flatnonzero(np.append(True, np.diff(amplitude)))  # where it rests, the first point
    rises, found = np.diff(amplitude[apart]) > 0, []
    for top in apart[1:-1][rises[:-1] & ~rises[1:]]:
        below = _crossing(speed[: top + 1][::-1], amplitude[: top + 1][::-1])
        above = _crossing(speed[top:], amplitude[top:])
        found.append(Peak(float(speed[top]), float(amplitude[top]), float(speed[top] / (above - below))))
    return found


def _crossing(speed, amplitude):
    """Speed at which the amplitude first falls to 1/sqrt(2) of its first value; NaN if it rises again before."""
    rises = np.flatnonzero(np.diff(amplitude) > 0)
    end = rises[0] + 1 if len(rises) else len(amplitude)
    low = np.flatnonzero(amplitude[:end] <= HALF_POWER * amplitude[0])
    if not len(low):
        return np.nan
    i = low[0]
    return np.interp(HALF_POWER * amplitude[0], amplitude[[i, i - 1]], speed[[i, i - 1]])


def separation_margin(speed, operating):
    """Distance of a critical speed, rad/s, from the operating range, relative to its nearer end; 0 inside it."""
    lowest, highest = operating
    return max((lowest - speed) / lowest, (speed - highest) / highest, 0.0)


def required_margin(peak, operating):
    """Separation margin that API 617 (8th ed., part 1, 4.8.2.10) asks for; 0 for AF < 2.5, NaN if not known.

    17 (1 - 1/(AF - 1.5)) %, at most 16 %, below the range of operation; 10 % more above it
    """
    if np.isnan(peak.amplification):
        return np.nan
    if peak.amplification < UNCRITICAL:
        return 0.0
    share = 17 * (1 - 1 / (peak.amplification - 1.5))
    return min(share, 16) / 100 if peak.speed < operating[0] else min(10 + share, 26) / 100
