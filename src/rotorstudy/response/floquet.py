"""Growth of the free motion about a steady state whose coefficients vary over a revolution: Floquet multipliers.

A crack or an asymmetric shaft has coefficients that turn with the shaft. A force that is not linear in the motion (a
crack opened by the vibration, a contact) has the slopes that it takes along the steady state.
"""

from math import gcd

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RigError, RotorstudyError
from rotorstudy.model.entries import on_real_parts
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import COUPLED_ORDER, check_speed
from rotorstudy.response.few_shapes import shapes
from rotorstudy.response.neighbourhood import carried_motion

TURN_STEPS = 256  # of a revolution, a power of two
FAST = 100  # times the speed: the sum of two faster modes is above all harmonics of the coefficients
ROUND_OFF = 1e-9  # of an eigenvalue: real part of an undamped mode due to the slopes of nonlinear forces
DIFFERENCE = 1e-6  # step of the central differences of a force, relative to the motion
SMALLEST = 1e-12  # m, of the motion, for that step


def varies_in_time(model):
    """Whether the coefficients of the free motion vary over a revolution: a turning stiffness, or nonlinear forces."""
    return bool(model.nonlinear_forces) or any(shift for _, shift in model.couplings)


def periodic_growth_rate(model: Model, speed: ArrayLike, theta: ArrayLike | None = None) -> np.ndarray:
    """Growth rate (speed,), 1/s, of the fastest growing free motion if coefficients vary over a revolution.

    The logarithm of the largest multiplier of one revolution, over its duration. The motion is integrated in x and y by
    the exponential midpoint rule (Hochbruck and Ostermann 2010, Acta Numerica 19, sec. 3). Modes far above the speed
    grow as with the mean coefficients, and follow the others statically; the result is then within 2 % for the rotor of
    Chapter 6 with a crack of 40 %.
    """
    model, theta = model.at(theta)
    return np.array([_growth_of_one_turn(model, float(w), theta) for w in check_speed(speed)])


def _growth_of_one_turn(model, speed, theta):
    from scipy.linalg import expm

    folds, kept = _folds(model), shapes(model, theta)
    steps, duration = TURN_STEPS // folds, 2 * np.pi / speed / folds
    every = np.arange(-COUPLED_ORDER, COUPLED_ORDER + 1)
    along = carried_motion(model, [speed], every, theta) if model.nonlinear_forces else None
    middles = (np.arange(steps) + 0.5) / TURN_STEPS
    rates = _rates(_accelerations(model, theta, speed, middles, kept, along), speed)
    if not np.finfo(float).eps * np.abs(rates).max() < speed:
        raise RigError(
            f"the stability at {speed:g} rad/s cannot be computed: masses or stiffnesses of the rotor differ beyond "
            "the digits of a number; check lengths, diameters and masses"
        )
    slow, fast = _slow_and_fast(rates, FAST * speed)
    with np.errstate(over="ignore", invalid="ignore"):
        turns = expm(duration / steps * slow)
        while len(turns) > 1:
            turns = turns[1::2] @ turns[::2]
    if not np.isfinite(turns).all():  # of a motion that grows beyond all numbers within a revolution
        return np.inf
    with np.errstate(divide="ignore"):  # of a motion that decays below all numbers
        growth = np.log(np.abs(np.linalg.eigvals(turns[0]))) / duration
    return max(growth.max(initial=-np.inf), (fast.real - ROUND_OFF * np.abs(fast)).max(initial=-np.inf))


def _folds(model):
    """How often the coefficients repeat in a revolution, a power of two: twice for a shaft that is stiffer one way."""
    common = 0 if model.nonlinear_forces else gcd(*(shift for _, shift in model.couplings))
    return max(min(common & -common, TURN_STEPS), 1)


def _slow_and_fast(rates, frequency):
    """Matrices (instant, slow, slow) of states below a frequency, and eigenvalues (fast,) of those that follow."""
    from scipy.linalg import schur, solve_sylvester

    mean = rates.mean(axis=0)
    triangular, basis, count = schur(mean, sort=lambda real, imaginary: np.hypot(real, imaginary) < frequency)
    if count == len(mean):
        return rates, np.empty(0)
    slow, fast = triangular[:count, :count], triangular[count:, count:]
    basis[:, count:] += basis[:, :count] @ solve_sylvester(slow, -fast, -triangular[:count, count:])
    apart = np.linalg.inv(basis) @ rates @ basis
    followed = apart[:, :count, count:] @ np.linalg.solve(apart[:, count:, count:], apart[:, count:, :count])
    return apart[:, :count, :count] - followed, np.linalg.eigvals(fast)


def _rates(accelerations, speed):
    """Matrices A (instant, state, state) of s' = A s, of displacements times their natural frequency and velocities."""
    size = accelerations.shape[-2]
    square = np.abs(np.diagonal(accelerations[..., :size].mean(axis=0)))
    frequency = np.sqrt(np.maximum(square, speed**2))
    lower = np.concatenate([accelerations[..., :size] / frequency, accelerations[..., size:]], axis=-1)
    upper = np.concatenate([np.zeros((size, size)), np.diag(frequency)], axis=-1)
    return np.concatenate([np.broadcast_to(upper, lower.shape), lower], axis=-2)


def _accelerations(model, theta, speed, turned, kept, along):
    """Accelerations of x and y by x, y and their velocities, (instant, state / 2, state), at fractions of a revolution.

    kept : (dof, shape) of which the motion consists;  along : the Motion about which nonlinear forces are linearised
    """
    own, still = model.matrices(theta), np.zeros(len(model.structure.dofs))
    _, stiffness, damping, mass = time_matrices(model, theta, speed, still)
    turning = np.multiply.outer(2j * np.pi * turned, np.ones((1, 1)))

    def reduced(matrix):
        return kept.T @ matrix @ kept

    def at(parts, shaft, turning=turning):
        """Real matrices on (x, y) of minus `shaft` plus the entries."""
        none = 0 * reduced(shaft) + 0 * turning
        on_z = sum((np.exp(shift * turning) * reduced(part) for shift, part in parts["z"].items()), none)
        on_z = on_z - reduced(shaft)
        on_conj = sum((np.exp(shift * turning) * reduced(part) for shift, part in parts["conj"].items()), none)
        return on_real_parts(on_z, on_conj)

    is_turning = any(shift for part in mass.values() for shift in part)
    inverse = -np.linalg.inv(at(mass, own.mass, turning if is_turning else turning[:1]))
    lower = [at(stiffness, own.stiffness), at(damping, -1j * speed * own.gyroscopic)]
    for position, force in model.nonlinear_forces if along else ():
        for part, slope in zip(lower, _slopes(force, along, speed, turned, kept), strict=True):
            part += theta[position] * slope
    return inverse @ np.concatenate(lower, axis=-1)


def _slopes(force, along, speed, turned, kept):
    """Slopes (instant, 2 shape, 2 shape) of a NonlinearForce in x and y by displacement (N/m) and velocity, real."""
    amplitude, deflection = along.amplitude[0] @ force.matrix.T, force.matrix @ along.deflection.reshape(-1)
    orders = np.arange(len(amplitude)) - len(amplitude) // 2
    turns = np.exp(2j * np.pi * np.outer(turned, orders))
    displacement = turns @ amplitude + deflection
    velocity = turns @ (1j * speed * orders[:, None] * amplitude)
    size, still, angle = DIFFERENCE * (np.abs(amplitude).max() + SMALLEST), deflection[None], 2 * np.pi * turned

    def slope(step, rate):
        """Derivative (instant, coordinate) of the force by a coordinate, along a step of it and of its velocity."""
        up, down = (force.at(displacement + s * step, velocity + s * rate, still, angle) for s in (size, -size))
        return (up - down) / (2 * size)

    units = [unit * one for unit in (1, 1j) for one in np.eye(amplitude.shape[1])]
    seen, found = np.kron(np.eye(2), force.matrix @ kept), []
    for of_position in (True, False):
        columns = [slope(one, 0) if of_position else slope(0, speed * one) / speed for one in units]
        columns = np.stack(columns, axis=-1)
        found.append(seen.T @ np.concatenate([columns.real, columns.imag], axis=-2) @ seen)
    return found


def time_matrices(model, theta, speed, deflection):
    """Sums by shift of the entries of effects, cracks and bearings, as they act on the right-hand side.

    The constant force {shift: (dof,)}, N, and stiffness, damping and mass, each {"z" or "conj": {shift: (dof, dof)}}.
    Numbers of the rotor are in `model.matrices`, exactly, and not here.
    """
    constant, on_motion = {}, [{"z": {}, "conj": {}} for _ in range(3)]
    for position, unknown in model.acting:
        for entry in unknown.entries:
            if entry.frequency_only:
                raise RotorstudyError(f"{unknown.name!r} exists in the frequency domain only: it has no motion in time")
            amount = theta[position] * entry.gain_at(speed, 0) * np.asarray(entry.matrix)
            if not entry.reads_motion:
                target = constant
                if not entry.is_constant:
                    amount = amount @ (np.conj(deflection) if entry.is_conjugate else deflection)
            else:
                target = on_motion[entry.order][entry.on]
            target[entry.shift] = target.get(entry.shift, 0) + amount
    return constant, *on_motion
