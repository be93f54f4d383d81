"""A model in the time domain: force of a term, free vibration, and integration of the equations of motion."""

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import check_speed, forced_harmonics
from rotorstudy.response.floquet import time_matrices
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.series import rotating_basis
from rotorstudy.response.stability import state_matrix
from rotorstudy.response.statics import static_deflection

RELATIVE_TOLERANCE = 1e-10  # of the integrator (DOP853, order 8); the harmonics then agree to about 1e-8
ABSOLUTE_TOLERANCE = 1e-16  # m and m/s; displacements here are micrometres


def force_in_time(entries, speed, time, displacement, velocity=None, acceleration=None, deflection=None):
    """Force (time, row), N, of the entries of an effect at a motion (time, dof), m, deflection (dof,) included."""
    motion = (displacement, velocity, acceleration)
    total = 0
    for entry in entries:
        if entry.frequency_only:
            raise RotorstudyError("an effect is defined in the frequency domain only; it has no force in time")
        turning = (np.exp(1j * entry.shift * speed * time) * entry.gain_at(speed, 0))[:, None]
        if entry.is_constant:
            total = total + turning * np.asarray(entry.matrix)
        elif not entry.reads_motion:
            still = np.conj(deflection) if entry.is_conjugate else deflection
            total = total + turning * (np.asarray(entry.matrix) @ still)
        else:
            source = motion[entry.order].conj() if entry.is_conjugate else motion[entry.order]
            total = total + turning * (source @ np.asarray(entry.matrix).T)
    return total


def time_response(
    model: Model,
    speed: float,
    time: ArrayLike,
    theta: ArrayLike | None = None,
    *,
    start: tuple[ArrayLike, ArrayLike] | None = None,
    relative_tolerance: float = RELATIVE_TOLERANCE,
    absolute_tolerance: float = ABSOLUTE_TOLERANCE,
) -> np.ndarray:
    """Integrate the equations of motion from rest at the static deflection, or from `start`.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : float
        Spin speed in rad/s.
    time : array (time,)
        In s, increasing; integration starts at time 0 with the transient.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.
    start : two arrays (dof,), optional
        Displacement in m (rad) from the static deflection, and velocity in m/s (rad/s), at time 0.
    relative_tolerance : float, optional
        Of the integrator.
    absolute_tolerance : float, optional
        Of the integrator, m and m/s.

    Returns
    -------
    array (time, dof)
        Complex displacement from the static deflection, m (rad for tilts).

    Raises
    ------
    RotorstudyError
        For an effect without a time-domain form, a prescribed static deflection, or if the integration fails.
    """
    from scipy.integrate import solve_ivp

    speed = check_speed(speed)[0]
    model, theta = model.at(theta)
    dof = len(model.structure.dofs)
    if model.held_deflection is not None:
        raise RotorstudyError("a prescribed static deflection is no equilibrium: it cannot be integrated in time")
    reference = np.broadcast_to(static_deflection(model, [speed], theta).value, (1, dof))[0]
    shifts, table, accelerated = _equations(model, theta, speed, reference)
    rates, one = 1j * shifts * speed, np.ones(1)

    def derivative(t, state):
        position, velocity, turns = state[:dof] + reference, state[dof:], np.exp(rates * t)
        turned = (turns @ table).reshape(dof, -1)
        force = turned @ np.concatenate([position, position.conj(), velocity, velocity.conj(), one])
        for p, local in model.nonlinear_forces:
            seen = [(local.matrix @ vector)[None] for vector in (position, velocity, reference)]
            force = force + theta[p] * (local.at(*seen, [speed * t])[0] @ local.matrix)
        return np.concatenate([velocity, accelerated(force, turns)])

    initial = np.zeros(2 * dof, complex) if start is None else np.concatenate(start).astype(complex)
    given = {"rtol": relative_tolerance, "atol": absolute_tolerance, "max_step": 2 * np.pi / speed / 8}
    solution = solve_ivp(derivative, (0.0, float(time[-1])), initial, method="DOP853", t_eval=time, **given)
    if not solution.success:
        raise RotorstudyError(f"time integration at {speed:g} rad/s failed: {solution.message}")
    return solution.y[:dof].T


def _equations(model, theta, speed, reference):
    """Shifts, forces (shift, dof * column) by z, conj(z), their derivatives and 1, and function to acceleration."""
    own, dof = model.matrices(theta), len(model.structure.dofs)
    load = own.static_load + model.constant_force
    constant, stiffness, damping, mass = time_matrices(model, theta, speed, reference)
    none = np.zeros((dof, dof))
    parts = [one[on] for one in (stiffness, damping, mass) for on in ("z", "conj")]
    shifts = np.array(sorted({*constant, *(shift for part in parts for shift in part), 0}))
    table = np.array([np.hstack([part.get(shift, none) for part in parts]) for shift in shifts], complex)
    own_parts = (-own.stiffness, none, 1j * speed * own.gyroscopic, none, -own.mass, none)
    table[shifts == 0] += np.hstack(own_parts)
    still = np.array([constant.get(shift, np.zeros(dof)) for shift in shifts]) + (shifts == 0)[:, None] * load
    force, inertia = np.split(table, [4 * dof], axis=-1)
    force = np.concatenate([force, still[..., None]], axis=-1)
    return shifts, force.reshape(len(shifts), -1), _accelerated(-inertia, shifts)


def _accelerated(inertia, shifts):
    """The function from force and turns to acceleration; inertia : (shift, dof, 2 dof), on z and conj(z)."""
    dof = inertia.shape[1]
    if not inertia[shifts != 0].any() and not inertia[..., dof:].any():
        inverse = np.linalg.inv(inertia[shifts == 0][0, :, :dof])
        return lambda force, turns: inverse @ force

    def accelerated(force, turns):
        on_z, on_conj = np.split(np.tensordot(turns, inertia, axes=1), 2, axis=-1)
        both = np.block([[on_z, on_conj], [on_conj.conj(), on_z.conj()]])
        return np.linalg.solve(both, np.concatenate([force, force.conj()]))[:dof]

    return accelerated


def transient_response(model, speed, time):
    """Exact motion (time, dof), m, of a time-invariant model from rest: steady state plus whirl modes."""
    speed = float(check_speed(speed)[0])
    harmonics, dof = forced_harmonics(model), len(model.structure.dofs)
    values, modes = np.linalg.eig(state_matrix(model, [speed])[0])
    amplitude = harmonic_response(model, [speed], harmonics)[0]  # (harmonic, dof)
    displacement, velocity = -amplitude.sum(axis=0), -(1j * speed * harmonics) @ amplitude
    if len(values) == 4 * dof:  # with entries on conj(z)
        displacement, velocity = (np.concatenate([part, part.conj()]) for part in (displacement, velocity))
    share = np.linalg.solve(modes, np.concatenate([displacement, velocity]))
    steady = rotating_basis(time, speed, harmonics).T @ amplitude
    return steady + np.exp(np.multiply.outer(time, values)) @ (share[:, None] * modes[:dof].T)
