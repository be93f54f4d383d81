"""Growth of the free motion about a steady state whose coefficients vary over a revolution: Floquet multipliers.

A crack or an asymmetric shaft has coefficients that turn with the shaft. A force that is not linear in the motion (a
crack opened by the vibration, a contact) has the slopes that it takes along the steady state.
"""

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.response.coefficients import time_matrices
from rotorstudy.response.coupling import COUPLED_ORDER, check_speed
from rotorstudy.response.neighbourhood import carried_motion

# steps of a revolution: a mode at n times the speed loses 4e-4 n^2 of its frequency, and no more than 2e-6 n^3 to
# damping; from n = SLOW of the lowest mode on, there are twice as many for every doubling of n
TURN_STEPS = 256
SLOW = 4
MOST_STEPS = 8192
MEAN_STEPS = 16  # instants of a revolution over which the coefficients are averaged, to find the lowest mode
OSCILLATING = 0.3  # imaginary part over modulus of an eigenvalue whose motion swings through
DIFFERENCE = 1e-6  # step of the central differences of a force, relative to the motion
SMALLEST = 1e-12  # m, of the motion, for that step
ALL_KEPT = 24  # coordinates; with more of them the motion consists of the lowest modes and the static shapes of forces
MODES = 24  # lowest ones: their frequencies are far above those that a rotation can pump


def varies_in_time(model):
    """Whether the coefficients of the free motion vary over a revolution: a turning stiffness, or nonlinear forces."""
    turning = any(e.reads_motion and e.shift for unknown in model.rotor_unknowns for e in unknown.entries)
    return turning or bool(model.nonlinear_forces)


def periodic_growth_rate(model: Model, speed: ArrayLike, theta: ArrayLike | None = None) -> np.ndarray:
    """Growth rate of the fastest growing free motion of a model whose coefficients vary over a revolution.

    The logarithm of the largest multiplier of one revolution, over its duration. The motion is integrated in real x and
    y by the trapezoidal rule with a second-order backward difference (TR-BDF2): stiff modes, of which the shaft has
    many, are damped and need no small steps.
    The steps are chosen for the lowest mode. Far below a higher mode they damp it: in the sound rotor of Chapter 6,
    whose least damped motion decays by 2.1 1/s, the result is -2.9 1/s at 300 rad/s and -10.4 1/s at 40 rad/s. So slow
    growth of a higher mode at a low speed is not seen.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.

    Returns
    -------
    array (speed,)
        In 1/s; unstable if > 0.

    Raises
    ------
    RotorstudyError
        For an effect without a time-domain form.
    NoSteadyState
        If nonlinear forces leave no steady state.

    References
    ----------
    Bank et al., IEEE Trans. Electron Devices 32 (1985) 1992; Hosea and Shampine, Appl. Numer. Math. 20 (1996) 21.
    """
    model, theta = model.at(theta)
    return np.array([_growth_of_one_turn(model, float(w), theta) for w in check_speed(speed)])


def _growth_of_one_turn(model, speed, theta):
    duration, shapes = 2 * np.pi / speed, _shapes(model, theta)
    turn = np.eye(4 * shapes.shape[1])  # of displacements and velocities in x and y
    along = _steady_state(model, theta, speed) if model.nonlinear_forces else None

    def accelerations(turned):
        return _accelerations(model, theta, speed, turned, shapes, along)

    steps = _steps(accelerations, speed)
    try:
        for first in range(0, steps, TURN_STEPS):
            turn = _turned(accelerations, (first + np.arange(TURN_STEPS + 1)) / steps, duration) @ turn
    except np.linalg.LinAlgError:
        raise RotorstudyError(
            f"the stability at {speed:g} rad/s cannot be computed: masses or stiffnesses of the rotor differ beyond "
            "the digits of a number; check lengths, diameters and masses"
        ) from None
    if not np.isfinite(turn).all():  # of a motion that grows beyond all numbers within a revolution
        return np.inf
    return np.log(np.abs(np.linalg.eigvals(turn)).max()) / duration


def _steps(accelerations, speed):
    """Number of steps of a revolution, a power of two."""
    mean = accelerations(np.arange(MEAN_STEPS) / MEAN_STEPS).mean(axis=0)
    values = np.linalg.eigvals(np.concatenate([np.eye(len(mean), 2 * len(mean), len(mean)), mean]))
    frequencies = np.abs(values.imag[np.abs(values.imag) > OSCILLATING * np.abs(values)])
    lowest = frequencies.min(initial=np.inf) / speed
    doubled = np.ceil(np.log2(lowest / SLOW)) if SLOW < lowest < np.inf else 0
    return int(min(TURN_STEPS * 2**doubled, MOST_STEPS))


def _turned(accelerations, turned, duration):
    """States (state, state) after a part of a revolution, of each unit before it.

    turned : (1 + step,) fractions of the revolution, of a power of two steps;  duration : of the revolution, s
    """
    gamma, step = 2 - np.sqrt(2), (turned[1] - turned[0]) * duration
    starts = accelerations(turned)
    between = accelerations(turned[:-1] + gamma * (turned[1] - turned[0]))
    size, weight = starts.shape[-2], gamma / 2 * step
    identity = np.eye(2 * size)
    upper = np.broadcast_to(identity[:size] + weight * identity[size:], starts[:-1].shape)
    explicit = np.concatenate([upper, identity[size:] + weight * starts[:-1]], axis=-2)
    middle = _implicit(between, weight, explicit)
    ahead = (middle - (1 - gamma) ** 2 * identity) / (gamma * (2 - gamma))
    turns = _implicit(starts[1:], weight, ahead)
    while len(turns) > 1:
        turns = turns[1::2] @ turns[::2]
    return turns[0]


def _implicit(accelerations, step, right):
    """Solutions (instant, state, state) of (1 - step A) x = right; the rate of a displacement is a velocity.

    accelerations : (instant, state / 2, state) lower half of A, whose upper half is (0, 1)
    """
    size = accelerations.shape[-2]
    by_displacement, by_velocity = accelerations[..., :size], accelerations[..., size:]
    matrix = np.eye(size) - step * (by_velocity + step * by_displacement)
    upper, lower = right[..., :size, :], right[..., size:, :]
    velocity = np.linalg.solve(matrix, lower + step * by_displacement @ upper)
    return np.concatenate([upper + step * velocity, velocity], axis=-2)


def _shapes(model, theta):
    """Shapes (dof, shape) of which the free motion consists: all coordinates, on a fine mesh the lowest modes and the
    deflections by a unit of each load that effects and bearings exert.
    """
    from scipy.linalg import eigh, orth

    count, own = len(model.structure.dofs), model.matrices(theta)
    if count <= ALL_KEPT:
        return np.eye(count)
    held = model.structure.support if model.structure.support is not None else 0
    stiffness = np.real(own.stiffness + held)
    scale = np.sqrt(np.diag(own.mass))  # translations and tilts have different units
    modes = eigh(stiffness, own.mass, subset_by_index=(0, MODES - 1))[1]
    acting = [np.asarray(e.matrix) for _, u in model.acting for e in u.entries if e.reads_motion]
    touched = [(matrix != 0).any(axis=0) | (matrix != 0).any(axis=1) for matrix in acting]
    touched = np.any([np.zeros(count, bool), *touched], axis=0)
    loads = np.column_stack([np.eye(count)[:, touched], *(force.matrix.T for _, force in model.nonlinear_forces)])
    static = np.linalg.lstsq(stiffness / np.outer(scale, scale), loads / scale[:, None], rcond=1e-12)[0]
    found = np.column_stack([modes * scale[:, None], static / np.linalg.norm(static, axis=0)])
    return orth(found / np.linalg.norm(found, axis=0), rcond=1e-9) / scale[:, None]


def _steady_state(model, theta, speed):
    """The Motion at one speed, all harmonics carried."""
    return carried_motion(model, [speed], np.arange(-COUPLED_ORDER, COUPLED_ORDER + 1), theta)


def _accelerations(model, theta, speed, turned, shapes, along):
    """Accelerations of x and y by x, y and their velocities, (instant, state / 2, state), at fractions of a revolution.

    turned : (instant,);  shapes : (dof, shape) of which the motion consists
    along : the Motion about which nonlinear forces are linearised, None without such forces
    """
    own, still = model.matrices(theta), np.zeros(len(model.structure.dofs))
    _, stiffness, damping, mass = time_matrices(model, theta, speed, still)
    turning = np.multiply.outer(2j * np.pi * turned, np.ones((1, 1)))

    def reduced(matrix):
        return shapes.T @ matrix @ shapes

    def at(parts, shaft):
        """Real matrices on (x, y) of minus `shaft` plus the entries."""
        none = 0 * reduced(shaft) + 0 * turning
        on_z = sum((np.exp(shift * turning) * reduced(part) for shift, part in parts["z"].items()), none)
        on_z = on_z - reduced(shaft)
        on_conj = sum((np.exp(shift * turning) * reduced(part) for shift, part in parts["conj"].items()), none)
        plus, minus = on_z + on_conj, on_z - on_conj
        return np.block([[plus.real, -minus.imag], [plus.imag, minus.real]])

    inverse = np.kron(np.eye(2), np.linalg.inv(reduced(own.mass + np.real(mass))))
    lower = [at(stiffness, own.stiffness), at(damping, -1j * speed * own.gyroscopic)]
    for position, force in model.nonlinear_forces if along else ():
        for part, slope in zip(lower, _slopes(force, along, speed, turned, shapes), strict=True):
            part += theta[position] * slope
    return inverse @ np.concatenate(lower, axis=-1)


def _slopes(force, along, speed, turned, shapes):
    """Slopes (instant, 2 shape, 2 shape) of a force in x and y by displacement (N/m) and by velocity (N s/m), real.

    force : NonlinearForce;  along : Motion;  turned : (instant,) fractions of a revolution;  shapes : (dof, shape)
    """
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
    seen, found = np.kron(np.eye(2), force.matrix @ shapes), []
    for of_position in (True, False):
        columns = [slope(one, 0) if of_position else slope(0, speed * one) / speed for one in units]
        columns = np.stack(columns, axis=-1)
        found.append(seen.T @ np.concatenate([columns.real, columns.imag], axis=-2) @ seen)
    return found
