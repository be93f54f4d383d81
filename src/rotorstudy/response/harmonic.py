"""Steady-state harmonic response of the rotor and its derivatives with respect to the amplitudes.

All speeds, harmonics and trials go through one batched solve. Nonlinear forces are then added speed by speed (see
`alternating`).
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.entry_table import product, sums
from rotorstudy.model.model import Model
from rotorstudy.response.alternating import nonlinear_columns, seen_coordinates, steady_states
from rotorstudy.response.coupling import COUPLED_ORDER, check_harmonics, check_speed, layout, layout_of_forced
from rotorstudy.response.solving import elements_of, solver
from rotorstudy.response.statics import Deflection, static_deflection
from rotorstudy.response.turning import replies

NUMBERS_AT_ONCE = 5e7  # complex numbers in the matrices of one solve, 0.8 GB; above it, speeds are split into parts


class Linearised(NamedTuple):
    """A response (..., speed, harmonic, dof or sensor), m (rad), and its derivatives (..., parameter) per unit."""

    response: np.ndarray
    jacobian: np.ndarray


def harmonic_response(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> np.ndarray:
    """Displacement harmonics of the coordinates about the static deflection.

    They are those of the periodic motion, whether or not the rotor returns to it: see `check_stable`.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Harmonics n of e^{jnwt}, n > 0 forward, n < 0 backward.
    theta : array (..., parameter), optional
        Amplitudes in the units of `model.units`, in the order of `model.names`; the model's own by default.
    order : int, optional
        Harmonics -order..order are carried where the model couples harmonics.

    Returns
    -------
    array (..., speed, harmonic, dof)
        Complex, m for translations, rad for tilts.

    Raises
    ------
    RotorstudyError
        For a speed that is not positive, harmonics that are not whole numbers, or an amplitude without a value.
    NoSteadyState
        If there is no steady state at a speed.
    """
    return _response(model, speed, harmonics, theta, order, False).response


def harmonic_response_and_jacobian(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> Linearised:
    """Displacement harmonics of the coordinates and their derivatives with respect to the amplitudes.

    Parameters
    ----------
    model, harmonics, order
        As for `harmonic_response`.
    speed : array (speed,)
        In rad/s.
    theta : array (..., parameter), optional
        In the units of `model.units`.

    Returns
    -------
    Linearised
        Response (..., speed, harmonic, dof) in m or rad and its derivatives (..., speed, harmonic, dof, parameter) per
        unit of each amplitude.

    Raises
    ------
    RotorstudyError, NoSteadyState
        As `harmonic_response`.
    """
    return _response(model, speed, harmonics, theta, order, True)


def _response(model, speed, harmonics, theta, order, jacobian):
    """The Linearised response of the coordinates, its Jacobian None unless asked for."""

    def response(model, theta):
        at, shown, _, blocks = response_inputs(model, speed, harmonics, theta, order)
        found, derivatives = carried_response(model, at, theta, blocks, jacobian)
        chosen = positions(shown, blocks)
        return Linearised(found[..., chosen, :], derivatives[..., chosen, :, :] if jacobian else None)

    return with_its_bearings(response, model, theta)


def with_its_bearings(response, model, theta):
    """The Linearised response(model, theta) of trials (..., parameter), each of the model with the bearings it has."""
    try:
        theta = np.asarray(model.theta if theta is None else theta, float)
    except (TypeError, ValueError, OverflowError):
        theta = np.empty(0)
    if theta.shape[-1:] != (len(model.names),):
        raise RotorstudyError(f"theta: give the {len(model.names)} amplitudes of `model.names`, real, in its units")
    if not model.bearing_numbers:
        return response(model, theta)
    found = [response(*model.at(one)) for one in theta.reshape(-1, theta.shape[-1])]
    lead, pairs = theta.shape[:-1], zip(*found, strict=True)
    return Linearised(*(None if one[0] is None else np.reshape(one, (*lead, *one[0].shape)) for one in pairs))


def response_inputs(model, speed, harmonics, theta, order):
    """Speeds (speed,), harmonics (harmonic,) and amplitudes (..., parameter) as arrays, and their Layout."""
    speed, harmonics, _ = check_speed(speed), check_harmonics(harmonics), check_harmonics([order], "order")
    theta = np.asarray(model.theta if theta is None else theta, float)
    return speed, harmonics, theta, layout(model, harmonics, order)


def positions(harmonics, blocks):
    """Positions (harmonic,) of harmonics among those carried."""
    return np.searchsorted(blocks.harmonics, harmonics)


def static_force(model, theta, speed, carried, deflection, *, constant=True):
    """Force harmonics (..., speed, harmonic, dof), N, at a static deflection; all, or what it changes."""
    own = theta[..., [p for p, _ in model.acting]]
    found = model.table.static_force(own, speed, carried, deflection, constant=constant)
    if constant and model.constant_force.any():
        found[..., carried == 0, :] += model.constant_force
    return found


def carried_response(model, speed, theta, blocks, jacobian):
    """Harmonics (..., speed, harmonic, dof) and their derivatives, None unless asked for."""
    still = Deflection(np.zeros(len(model.structure.dofs)), {})  # read by no force, unless it is solved
    if model.nonlinear_forces or model.table.reads_deflection(blocks.harmonics):
        still = static_deflection(model, speed, theta[..., : len(model.rotor_unknowns)], jacobian=jacobian)
    forced = layout_of_forced(model, blocks)
    found, derivatives = _carried_about(still, model, speed, theta, forced, jacobian)
    if forced is not blocks:
        at = positions(forced.harmonics, blocks)
        found, part = np.zeros((*found.shape[:-2], len(blocks.harmonics), found.shape[-1]), complex), found
        found[..., at, :] = part
        if jacobian:
            derivatives, part = np.zeros((*found.shape, theta.shape[-1]), complex), derivatives
            derivatives[..., at, :, :] = part
    return found, derivatives


def _carried_about(still, model, speed, theta, blocks, jacobian):
    """The response of `carried_response` about a Deflection; a part of the speeds after another if they are many."""
    dof = len(model.structure.dofs)
    trials, links = np.prod(theta.shape[:-1]), sum(g.size * g.shape[1] for g in blocks.groups)
    numbers = len(speed) * links * max(trials, 1) * dof**2
    if numbers > NUMBERS_AT_ONCE and len(speed) > 1:
        half = len(speed) // 2
        halves = (slice(half), slice(half, None))
        parts = [_carried_about(still.at(s), model, speed[s], theta, blocks, jacobian) for s in halves]
        found, derivatives = zip(*parts, strict=True)
        return np.concatenate(found, axis=-3), np.concatenate(derivatives, axis=-4) if jacobian else None
    rotor, carried, tangents = theta[..., : len(model.rotor_unknowns)], blocks.harmonics, None
    solved = solver(model, rotor, speed, blocks)
    force = static_force(model, rotor, speed, carried, still.value)
    if model.static_residual.any():
        load = model.matrices(rotor).static_load
        force[..., carried == 0, :] += load if load.ndim == 1 else load[..., None, None, :]
    found = solved(force[..., None])[..., 0]
    if model.nonlinear_forces:
        found, tangents = _with_nonlinear_forces(model, rotor, speed, carried, solved, still.value, found)
    if not jacobian:
        return found, None
    changes = solved(_force_columns(still, model, rotor, speed, carried, found, tangents))
    for trial, tangent in () if tangents is None else np.ndenumerate(tangents):
        changes[trial] = tangent.response(changes[trial])
    derivatives = np.zeros((*found.shape, theta.shape[-1]), complex)
    derivatives[..., : changes.shape[-1]] = changes
    return found, derivatives


def _force_columns(still, model, theta, speed, carried, found, tangents):
    """Derivatives (..., speed, harmonic, dof, rotor parameter) of the force at a motion by the amplitudes theta."""
    deflection, moved = still
    columns = np.empty((*found.shape, theta.shape[-1]), complex)
    columns[..., [p for p, _ in model.acting]] = model.table.dense_columns(found, speed, carried, deflection)
    if model.varied:
        own = _columns_of_the_rotor(model, theta, speed, carried, found)
        columns[..., model.varied.positions] = np.moveaxis(own, 0, -1)
    if model.nonlinear_forces:
        place, local = zip(*model.nonlinear_forces, strict=True)
        own = nonlinear_columns(local, found, speed, carried, deflection)
        columns[..., place] = own.dense(found.shape[-1], len(local))
    if moved:
        forces = static_force(model, theta, speed, carried, np.stack(list(moved.values())), constant=False)
        columns[..., list(moved)] += np.moveaxis(np.broadcast_to(forces, (len(moved), *found.shape)), 0, -1)
        at_rest = (*found.shape[:-2], found.shape[-1])
        for trial, tangent in () if tangents is None else np.ndenumerate(tangents):
            own = np.stack([np.broadcast_to(one, at_rest)[trial] for one in moved.values()])
            columns[trial][..., list(moved)] += np.moveaxis(tangent.force_by_deflection(own), 0, -1)
    return columns


def _columns_of_the_rotor(model, theta, speed, carried, found):
    """Derivatives (number, ..., speed, harmonic, dof) of the force by the numbers of the rotor."""
    slopes = model.varied.variation.slopes_at(theta[..., model.varied.positions])
    row, column = elements_of(slopes[:3])
    mass, stiffness, gyroscopic = (np.moveaxis(one[..., row, column], -2, 0)[..., None, None, :] for one in slopes[:3])
    nw, seen, to_rows = (speed[:, None] * carried)[..., None], found[..., column], sums(row, found.shape[-1])
    pairs = zip(mass, stiffness, gyroscopic, strict=True)
    columns = np.stack([product(to_rows, (nw**2 * m - k - nw * speed[:, None, None] * g) * seen) for m, k, g in pairs])
    if model.static_residual.any():
        columns[..., carried == 0, :] += np.moveaxis(slopes.static_load, -2, 0)[..., None, None, :]
    return columns


def _with_nonlinear_forces(model, theta, speed, carried, solved, deflection, linear):
    """Harmonics (..., speed, harmonic, dof) with the nonlinear forces, and Tangents (...), None if none acts."""
    acting = [(p, force) for p, force in model.nonlinear_forces if np.any(theta[..., p])]
    if not acting:
        return linear, None
    reply = _by_unit_forces(model, seen_coordinates([force for _, force in acting]), linear.shape, carried, solved)
    deflection = np.broadcast_to(deflection, (*linear.shape[:-2], linear.shape[-1]))
    found, tangents = np.empty_like(linear), np.empty(linear.shape[:-3], object)
    for trial in np.ndindex(tangents.shape):
        forces = [(theta[(*trial, p)], force) for p, force in acting]
        given = deflection[trial], linear[trial], reply[trial]
        found[trial], tangents[trial] = steady_states(forces, speed, carried, *given)
    return found, tangents


def _by_unit_forces(model, seen, shape, carried, solved):
    """Motions (*shape, component) by unit forces along coordinates (coordinate, dof) at each harmonic.

    component : real or imaginary part, harmonic and coordinate of the force;  shape : (..., speed, harmonic, dof)
    """
    harmonics = range(len(carried))
    if model.table.turning_patterns or (carried != -carried[::-1]).any():
        unit = np.zeros((len(carried), len(seen), *shape[-2:]), complex)
        unit[harmonics, :, harmonics] = seen
        unit = np.moveaxis(unit.reshape(-1, *shape[-2:]), 0, -1)
        unit = np.concatenate([unit, 1j * unit], axis=-1)
        return solved(np.broadcast_to(unit, (*shape, unit.shape[-1])))
    # harmonics are coupled with their negatives alone
    found = replies(seen, shape[:-2], carried, solved)
    own, other = (one.reshape(*shape, 2, len(seen)) for one in found)
    reply = np.zeros((*shape, 2, len(carried), len(seen)), complex)
    for n in harmonics:
        reply[..., n, :, :, n, :] = own[..., n, :, :, :]
        reply[..., n, :, :, -1 - n, :] += other[..., n, :, :, :]
    return reply.reshape(*shape, -1)
