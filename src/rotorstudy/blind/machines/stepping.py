"""Step-by-step integration with state-dependent forces, to the steady state.

Within a step the linear machine (gyroscopic, circulatory and all) and its harmonic forces are propagated exactly by the
matrix exponential; state-dependent forces vary linearly over the step and are found at its end by Newton's method in
their few local coordinates (exponential trapezoidal rule, second order: Hochbruck and Ostermann, Acta Numerica 19
(2010) 209-286). All speeds advance together, each with the same steps of angle. The steady state is the fixed point of
the map over one revolution, found by Newton's method with the exact derivative of the stepped map (shooting; Nayfeh and
Balachandran, Applied Nonlinear Dynamics (1995), section 6.5), whose eigenvalues (Floquet multipliers) tell whether it
is stable; then free revolutions must repeat it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, eigh, expm, solve_triangular

TOLERANCE = 1e-8  # relative change over a revolution


class NoSteadyState(Exception):
    """No motion repeats from turn to turn (unstable, subharmonic or quasi-periodic), or a law has no solution."""


@dataclass(frozen=True)
class Steady:
    """Steady motion: displacement and velocity (speeds, steps, coordinates) over one revolution, in m and rad.

    `angle` (steps,) of the shaft in rad; `multipliers` (speeds,): largest magnitude of a Floquet multiplier; `change`
    (speeds,): largest change over the last free revolution relative to the largest motion.
    """

    speed: np.ndarray
    angle: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    multipliers: np.ndarray
    change: np.ndarray

    def whirl(self, node, k):
        """Complex amplitude of exp(j k angle) of x + j y at a node, (speeds,)."""
        z = self.displacement[:, :, 4 * node] + 1j * self.displacement[:, :, 4 * node + 1]
        return np.mean(z * np.exp(-1j * k * self.angle), axis=1)

    def harmonics(self, nodes, orders):
        """The same of some nodes and orders, (speeds, order, node)."""
        return np.moveaxis([[self.whirl(node, k) for node in nodes] for k in orders], 2, 0)


def basis(machine, modes=None):
    """Lowest modes (None: all) and static shapes of all forces, (coordinates, r), and their frequencies, rad/s."""
    factor = cholesky(machine.mass, lower=True)
    stiffness = (machine.stiffness + machine.stiffness.T) / 2
    squares, shapes = eigh(stiffness, machine.mass)
    if modes is not None and modes < machine.size:
        vectors = [f for force in machine.harmonic.values() for f in (force.real, force.imag)]
        vectors += [column for force in machine.local for column in force.selection.T]
        for bearing in machine.rotor.bearings:
            vectors += list(np.eye(machine.size)[4 * bearing.node : 4 * bearing.node + 2])
        static = np.linalg.solve(stiffness, np.array(vectors).T)
        kept = shapes[:, :modes]
        rest = factor.T @ static
        rest = rest / np.maximum(np.linalg.norm(rest, axis=0), 1e-300)
        low = factor.T @ kept
        for _ in range(2):
            rest = rest - low @ (low.T @ rest)
        left, values, _ = np.linalg.svd(rest, full_matrices=False)
        left = left[:, values > 1e-7]
        both = solve_triangular(factor.T, np.hstack([low, left]))
        squares, turn = eigh(both.T @ stiffness @ both)
        shapes = both @ turn
    return shapes, np.sqrt(np.maximum(squares, 0.0))


def times(matrix, vector):
    """Matrix times vector, one of each a speed."""
    return (matrix @ vector[..., None])[..., 0]


class Stepper:
    """The stepped map of a machine at several speeds, rad/s, by steps of a revolution, on the shapes of `basis`."""

    def __init__(self, machine, speeds, steps=512, modes=None):
        self.speed, self.steps = np.atleast_1d(np.asarray(speeds, float)), steps
        self.angle = 2 * np.pi * np.arange(steps) / steps
        self.shapes, frequency = basis(machine, modes)
        count, r = len(self.speed), self.shapes.shape[1]
        # the state is (scale * modal coordinate, modal velocity), so that both are of one size
        self.scale = np.maximum(frequency, np.min(np.abs(self.speed)))
        a, step = np.zeros((count, 2 * r, 2 * r)), 2 * np.pi / steps / self.speed
        a[:, range(r), range(r, 2 * r)] = self.scale
        for number, speed in enumerate(self.speed):
            _, damping, stiffness = machine.linear(speed)
            a[number, r:, :r] = -(self.shapes.T @ stiffness @ self.shapes) / self.scale
            a[number, r:, r:] = -self.shapes.T @ damping @ self.shapes
        self.forces, self.widths = machine.local, [force.selection.shape[1] for force in machine.local]
        p = sum(self.widths)
        select = np.hstack([np.zeros((machine.size, 0))] + [force.selection for force in machine.local])
        local = self.shapes.T @ select
        self.read_y = np.hstack([(local / self.scale[:, None]).T, np.zeros((p, r))])
        self.read_v = np.hstack([np.zeros((p, r)), local.T])
        size = 2 * r + 2 * p
        block = np.zeros((count, size, size))
        block[:, : 2 * r, : 2 * r] = a * step[:, None, None]
        block[:, r : 2 * r, 2 * r : 2 * r + p] = local * step[:, None, None]
        block[:, range(2 * r, 2 * r + p), range(2 * r + p, size)] = 1.0
        exponential = expm(block)
        self.propagate = np.ascontiguousarray(exponential[:, : 2 * r, : 2 * r])
        self.new = np.ascontiguousarray(exponential[:, : 2 * r, 2 * r + p :])
        self.new_y, self.new_v = self.read_y @ self.new, self.read_v @ self.new
        self.old = exponential[:, : 2 * r, 2 * r : 2 * r + p] - self.new
        self.increments = np.zeros((steps, count, 2 * r))
        for (k, power), vector in machine.harmonic.items():
            source = np.zeros((count, 2 * r), complex)
            source[:, r:] = (self.shapes.T @ vector) * self.speed[:, None] ** power
            turn = np.exp(1j * k * 2 * np.pi / steps)
            right = turn * source - times(self.propagate, source)
            gain = np.linalg.solve(1j * k * self.speed[:, None, None] * np.eye(2 * r) - a, right[..., None])[..., 0]
            self.increments += (gain * np.exp(1j * k * self.angle)[:, None, None]).real

    def displacement(self, state):
        """Coordinates of the machine, m and rad, of states (..., 2 r)."""
        return state[..., : len(self.scale)] / self.scale @ self.shapes.T

    def velocity(self, state):
        """Their rates, m/s and rad/s."""
        return state[..., len(self.scale) :] @ self.shapes.T

    def local_force(self, angle, y, v):
        """Forces (speeds, p) of all laws and their derivatives by y and by v (speeds, p, p)."""
        force = np.zeros_like(y)
        by_y, by_v = np.zeros((2, *y.shape, y.shape[1]))
        first = 0
        for local, width in zip(self.forces, self.widths, strict=True):
            part = slice(first, first + width)
            result = local.law(angle, y[:, part], v[:, part], self.speed)
            force[:, part], by_y[:, part, part], by_v[:, part, part] = result
            first += width
        return force, by_y, by_v

    def step(self, number, state, force):
        """State and local force at the end of step `number` of a revolution, with the derivatives of that force."""
        angle = 2 * np.pi * (number + 1) / self.steps
        known = times(self.propagate, state) + self.increments[number % self.steps]
        if not self.forces:
            return known, force, None, None
        known = known + times(self.old, force)
        y, v = known @ self.read_y.T, known @ self.read_v.T
        to_y, to_v, identity = self.new_y, self.new_v, np.eye(y.shape[1])
        for _ in range(40):
            law, by_y, by_v = self.local_force(angle, y + times(to_y, force), v + times(to_v, force))
            wrong = force - law
            if np.all(np.abs(wrong) <= 1e-10 * np.abs(law).max(axis=1, keepdims=True) + 1e-300):
                break
            force = force - times(np.linalg.inv(identity - by_y @ to_y - by_v @ to_v), wrong)
        else:
            raise NoSteadyState("the forces within a step were not found: take more steps a revolution")
        return known + times(self.new, force), force, by_y, by_v

    def revolution(self, state, tangent=False):
        """States (steps, speeds, 2 r) over a revolution, the state after it, and its derivative if asked."""
        states = np.empty((self.steps, *state.shape))
        force, by_y, by_v = self.local_force(0.0, state @ self.read_y.T, state @ self.read_v.T)
        slope = np.broadcast_to(np.eye(state.shape[1]), (*state.shape, state.shape[1])) if tangent else None
        if tangent and not self.forces:
            slope = np.linalg.matrix_power(self.propagate, self.steps)
        for number in range(self.steps):
            states[number] = state
            if tangent and self.forces:
                through = by_y @ (self.read_y @ slope) + by_v @ (self.read_v @ slope)
                slope = self.propagate @ slope + self.old @ through
            state, force, by_y, by_v = self.step(number, state, force)
            if tangent and self.forces:
                gain = by_y @ self.read_y + by_v @ self.read_v
                inner = np.eye(gain.shape[1]) - gain @ self.new
                slope = slope + self.new @ np.linalg.solve(inner, gain @ slope)
        return states, state, slope


def steady_state(machine, speeds, steps=512, modes=None, most=60):
    """Steady motion of a machine at speeds (rad/s), stable and checked over free revolutions; else NoSteadyState.

    modes : kept beside the static shapes; None: all;  most : steps of Newton's method
    """
    stepper = Stepper(machine, speeds, steps, modes)
    state = np.zeros((len(stepper.speed), stepper.propagate.shape[1]))
    identity, last = np.eye(state.shape[1]), np.inf
    for trial in range(most):
        _, end, slope = stepper.revolution(state, tangent=True)
        wrong = np.linalg.norm(end - state, axis=1) / np.maximum(np.linalg.norm(end, axis=1), 1e-300)
        if not np.all(np.isfinite(wrong)):
            raise NoSteadyState("the motion grows without bound")
        if np.all(wrong < TOLERANCE):
            break
        move = np.linalg.solve(identity - slope, (end - state)[..., None])[..., 0]
        if trial > 5 and np.max(wrong) > 0.5 * last:  # Newton does not settle: let it swing, and take part of the way
            move = move * (0.3 + 0.4 * (trial % 3))
            state = end if trial % 4 == 0 else state + move
        else:
            state = state + move
        last = np.max(wrong)
    else:
        raise NoSteadyState(f"no periodic motion found at {stepper.speed[wrong >= TOLERANCE]} rad/s")
    multipliers = np.max(np.abs(np.linalg.eigvals(slope)), axis=1)
    if np.any(multipliers >= 1.0):
        raise NoSteadyState(f"unstable at {stepper.speed[multipliers >= 1.0]} rad/s")
    first, end, _ = stepper.revolution(end)
    states, end, _ = stepper.revolution(end)
    change = np.max(np.abs(states - first), axis=(0, 2)) / np.max(np.abs(states), axis=(0, 2))
    if np.any(change > 100 * TOLERANCE):
        raise NoSteadyState(f"the motion differs from turn to turn at {stepper.speed[change > 100 * TOLERANCE]} rad/s")
    states = np.swapaxes(states, 0, 1)
    motion = stepper.displacement(states), stepper.velocity(states)
    return Steady(stepper.speed, stepper.angle, *motion, multipliers, change)
