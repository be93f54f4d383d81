"""Steady-state harmonic response of the rotor and its derivatives with respect to the amplitudes.

All speeds, harmonics and trials go through one batched solve. Nonlinear forces are then added speed by speed (see
`alternating`).
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.model import Model
from rotorstudy.response.alternating import nonlinear_columns, seen_coordinates, steady_states
from rotorstudy.response.banded import solve_systems
from rotorstudy.response.coupling import (
    COUPLED_ORDER,
    check_harmonics,
    check_speed,
    gather,
    layout,
    layout_without_turning,
    linked_members,
    mirrored_unknown,
)
from rotorstudy.response.statics import static_deflection
from rotorstudy.response.turning import turning

NUMBERS_AT_ONCE = 5e7  # complex numbers in the matrices of one solve, 0.8 GB; above it, speeds are split into parts
FEWER_BY = 2  # harmonics are coupled on the coordinates that turn if that takes less than a half of the operations
CONDENSED_AT_MOST = 1e4  # ratio of the condensed part to the stiffness; above it four of sixteen digits would be lost


class Linearised(NamedTuple):
    """A response and its derivatives with respect to the amplitudes.

    response : (..., speed, harmonic, dof or sensor) complex, m (rad for tilts)
    jacobian : (..., speed, harmonic, dof or sensor, parameter) complex, m per unit of each amplitude
    """

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
    speed, harmonics, theta, blocks = response_inputs(model, speed, harmonics, theta, order)
    found, _ = carried_response(model, speed, theta, blocks, False)
    return found[..., positions(harmonics, blocks), :]


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
    speed, harmonics, theta, blocks = response_inputs(model, speed, harmonics, theta, order)
    found, derivatives = carried_response(model, speed, theta, blocks, True)
    chosen = positions(harmonics, blocks)
    return Linearised(found[..., chosen, :], derivatives[..., chosen, :, :])


def response_inputs(model, speed, harmonics, theta, order):
    """Speeds (speed,), harmonics (harmonic,) and amplitudes (..., parameter) as arrays, and their Layout."""
    speed, harmonics = check_speed(speed), check_harmonics(harmonics)
    theta = np.asarray(model.theta if theta is None else theta, float)
    return speed, harmonics, theta, layout(model, harmonics, order)


def positions(harmonics, blocks):
    """Positions (harmonic,) of harmonics among those carried."""
    return np.searchsorted(blocks.harmonics, harmonics)


def operator(model, theta, speed, blocks, kept=None, *, turning=True):
    """Dynamic stiffness D of each group, D q = force; without the coefficients that turn, unless `turning`.

    theta   : (..., rotor parameter)
    speed   : (speed,) rad/s
    kept    : positions of the coordinates kept (default: all); the others, on which no force acts, are condensed
    returns : list of (..., speed, block, member * dof, member * dof) complex
    raises  : LinAlgError if the condensed coordinates resonate by themselves, so that digits would be lost
    """
    structure, carried, matrices = model.structure, blocks.harmonics, model.matrices(theta)
    kept = np.arange(len(structure.dofs)) if kept is None else kept
    count, dof = len(carried), len(kept)
    speed = np.asarray(speed, float)
    result = []
    for group in blocks.groups:
        n = np.where(group < count, carried[group % count], -carried[group % count])  # harmonic of the equation
        base = _uncoupled(matrices, n, speed[:, None, None])
        base = _condensed(base, kept, np.diag(structure.stiffness))
        if not np.all(group < count):
            base = np.where((group < count)[..., None, None], base, base.conj())
        full = np.zeros((*theta.shape[:-1], len(speed), *group.shape, dof, group.shape[1], dof), complex)
        for m in range(group.shape[1]):
            full[..., m, :, m, :] = base[..., m, :, :]
        result.append(full)
    at = np.zeros(len(structure.dofs), int)
    at[kept] = np.arange(dof)
    own = theta[..., [p for p, _ in model.acting]]
    for pattern in [*model.table.patterns, *(model.table.turning_patterns if turning else ())]:
        entry, i, j = pattern.entry, pattern.row, pattern.column
        value = pattern.values(own)[..., None, None, :]  # (..., speed, link, place)
        for full, (n, is_w, block, row, column) in zip(
            result, linked_members(blocks, entry.is_conjugate, entry.shift), strict=True
        ):
            if not len(n):
                continue
            factor = entry.gain_at(speed[:, None], n) * (1j * (n - entry.shift) * speed[:, None]) ** entry.order
            both = factor[..., None] * value
            full[..., block, row, at[i], column, at[j]] -= np.where(is_w[:, None], both.conj(), both)
    return [full.reshape(*full.shape[:-4], full.shape[-4] * dof, full.shape[-4] * dof) for full in result]


def _uncoupled(matrices, n, speed):
    """Dynamic stiffness (..., harmonics and speeds, dof, dof) of the rotor alone; n and speed broadcast together."""
    nw = n * speed
    lead = (..., *[None] * nw.ndim, slice(None), slice(None))
    base = matrices.stiffness[lead] - (nw**2)[..., None, None] * matrices.mass[lead]
    return base + (nw * speed)[..., None, None] * matrices.gyroscopic[lead]


def _condensed(matrix, kept, stiffness):
    """Dynamic stiffness (..., kept, kept), the others condensed; `stiffness` (dof,) is its static diagonal."""
    if len(kept) == matrix.shape[-1]:
        return matrix
    gone = np.setdiff1d(np.arange(matrix.shape[-1]), kept)
    rows, columns = matrix[..., kept, :], matrix[..., gone, :]
    passed = rows[..., gone] @ np.linalg.solve(columns[..., gone], columns[..., kept])
    size = np.abs(np.diagonal(passed, axis1=-2, axis2=-1)) / stiffness[kept]
    if not np.all(size < CONDENSED_AT_MOST):
        raise np.linalg.LinAlgError
    return rows[..., kept] - passed


def solver(model, theta, speed, blocks, kept=None):
    """Function from force to motion, both (..., speed, harmonic, dof, column), and the coordinates where it is nonzero.

    theta : (..., rotor parameter);  speed : (speed,) rad/s;  kept : see `operator`; all coordinates by default
    """
    dof = len(model.structure.dofs)
    kept = np.arange(dof) if kept is None else kept
    touched = model.table.turned
    whole = sum(len(group) * (group.shape[1] * len(kept)) ** 3 for group in blocks.groups)
    # complex numbers take four times as long as the real ones of the coordinates touched
    few = len(touched) and FEWER_BY * (2 * len(blocks.harmonics) * len(touched)) ** 3 < 4 * whole
    own = layout_without_turning(model, blocks) if few else blocks
    try:
        matrices = operator(model, theta, speed, own, kept, turning=not few)
    except np.linalg.LinAlgError:
        kept = np.arange(dof)
        matrices = operator(model, theta, speed, own, turning=not few)

    def solved(force):
        if len(kept) == dof:
            return solve(matrices, force, own, speed)
        found = np.zeros(force.shape, complex)
        found[..., kept, :] = solve(matrices, force[..., kept, :], own, speed)
        return found

    if not few:
        return solved, kept
    coupled = turning(model, theta, speed, blocks.harmonics, solved)

    def solved_with_turning(force):
        try:
            found = coupled.added_to(solved(force))
        except np.linalg.LinAlgError:
            found = np.array(np.nan)
        return _checked_motion(found, speed)

    return solved_with_turning, kept


def reference_of(unknown, deflection):
    """The static deflection that an amplitude acts on: none for bearings, whose static force balances the load."""
    return None if unknown.carries else deflection


def static_force(model, theta, speed, carried, deflection, *, constant=True):
    """Force harmonics (..., speed, harmonic, dof), N, at the static deflection (dof,) or (..., speed, dof).

    constant : whether those that do not depend on the deflection are included
    """
    own = theta[..., [p for p, _ in model.acting]]
    return model.table.static_force(own, speed, carried, deflection, constant=constant)


def carried_response(model, speed, theta, blocks, jacobian, kept=None):
    """Harmonics (..., speed, harmonic, dof) and derivatives (None unless asked for), zero except at those `kept`."""
    dof = len(model.structure.dofs)
    kept = np.arange(dof) if kept is None or model.nonlinear_forces else kept
    trials, links = np.prod(theta.shape[:-1]), sum(g.size * g.shape[1] for g in blocks.groups)
    numbers = len(speed) * links * max(trials * len(kept) ** 2, dof**2)
    if numbers > NUMBERS_AT_ONCE and len(speed) > 1 and np.ndim(model.held_deflection) < 2:
        half = len(speed) // 2
        parts = [carried_response(model, part, theta, blocks, jacobian, kept) for part in (speed[:half], speed[half:])]
        found, derivatives = zip(*parts, strict=True)
        return np.concatenate(found, axis=-3), np.concatenate(derivatives, axis=-4) if jacobian else None
    rotor = theta[..., : len(model.rotor_unknowns)]
    solved, kept = solver(model, rotor, speed, blocks, kept)
    deflection, moved = static_deflection(model, speed, rotor, jacobian=jacobian)
    force = static_force(model, rotor, speed, blocks.harmonics, deflection)
    if model.static_residual.any():
        load = model.matrices(rotor).static_load
        force[..., blocks.harmonics == 0, :] += load if load.ndim == 1 else load[..., None, None, :]
    found = solved(force[..., None])[..., 0]
    tangents = None
    if model.nonlinear_forces:
        found, tangents = _with_nonlinear_forces(model, rotor, speed, blocks, solved, deflection, found)
    if not jacobian:
        return found, None
    columns = np.empty((*found.shape, rotor.shape[-1]), complex)
    acting = [p for p, _ in model.acting]
    columns[..., acting] = model.table.dense_columns(found, speed, blocks.harmonics, deflection)
    if model.varied:
        own = _columns_of_the_rotor(model, rotor, speed, blocks.harmonics, found, kept)
        columns[..., model.varied.positions] = np.moveaxis(own, 0, -1)
    if model.nonlinear_forces:
        place, local = zip(*model.nonlinear_forces, strict=True)
        columns[..., place] = nonlinear_columns(local, found, speed, blocks.harmonics, deflection)
    if moved:
        forces = static_force(model, rotor, speed, blocks.harmonics, np.stack(list(moved.values())), constant=False)
        columns[..., list(moved)] += np.moveaxis(np.broadcast_to(forces, (len(moved), *found.shape)), 0, -1)
    derivatives = np.zeros((*found.shape, theta.shape[-1]), complex)
    changes = solved(columns)
    if tangents is not None:
        for trial, tangent in np.ndenumerate(tangents):
            changes[trial] = tangent.response(changes[trial])
    derivatives[..., : columns.shape[-1]] = changes
    return found, derivatives


def _columns_of_the_rotor(model, theta, speed, carried, found, kept):
    """Derivatives (number, ..., speed, harmonic, dof) of the force by the numbers of the rotor; zero except at `kept`.

    Coordinates that are condensed follow the others; what acts on them is passed on to the others.
    """
    varied, gone = model.varied, np.setdiff1d(np.arange(found.shape[-1]), kept)
    slopes = varied.variation.slopes_at(theta[..., varied.positions])
    if len(gone):
        rows = _uncoupled(model.matrices(theta), carried, speed[:, None])[..., gone, :]
        inner, outer = rows[..., gone], rows[..., kept]
        found = found.copy()
        found[..., gone] = -np.linalg.solve(inner, outer @ found[..., kept, None])[..., 0]
    nw = (speed[:, None] * carried)[..., None]
    pairs = ((slopes.stiffness, -1.0), (slopes.mass, nw**2), (slopes.gyroscopic, -nw * speed[:, None, None]))
    columns = sum(np.einsum("...pij,...shj->p...shi", slope, factor * found) for slope, factor in pairs)
    if model.static_residual.any():
        columns[..., carried == 0, :] += np.moveaxis(slopes.static_load, -2, 0)[..., None, None, :]
    if len(gone):  # the matrices of a rotor are symmetric
        passed = np.linalg.solve(inner, np.moveaxis(columns[..., gone], 0, -1))
        columns[..., kept] -= np.moveaxis(np.swapaxes(outer, -1, -2) @ passed, -1, 0)
        columns[..., gone] = 0
    return columns


def solve(matrices, force, blocks, speed):
    """Solve D q = force in every group; force and result (..., speed, harmonic, dof, column)."""
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            found = _solve_groups(matrices, force, blocks)
    except np.linalg.LinAlgError:
        found = np.array(np.nan)
    return _checked_motion(found, speed)


def _checked_motion(found, speed):
    """The motion, or NoSteadyState unless it is finite."""
    if not np.isfinite(found).all():
        raise NoSteadyState(
            f"no steady state at one of {_some(speed)} rad/s: a harmonic coincides with an undamped natural "
            "frequency, or a parameter is not finite; add damping or leave that speed out"
        )
    return found


def _some(speed):
    return ", ".join(f"{w:g}" for w in speed[:5]) + (" ..." if len(speed) > 5 else "")


def _solve_groups(matrices, force, blocks):
    count, dof = len(blocks.harmonics), force.shape[-2]
    if not blocks.doubled and len(blocks.groups) == 1 and blocks.groups[0].shape == (count, 1):
        return force / matrices[0] if dof == 1 else solve_systems(matrices[0], force)
    result = np.zeros_like(force)
    columns = np.moveaxis(force, -1, 0)
    for matrix, group, mirror in zip(matrices, blocks.groups, blocks.mirrors, strict=True):
        right = np.moveaxis(gather(columns, group, count, blocks.harmonics), 0, -1)
        solved = solve_systems(matrix, right)
        solved = solved.reshape(*solved.shape[:-2], group.shape[1], dof, solved.shape[-1])
        direct = group < count
        result[..., group[direct], :, :] = solved[..., direct, :, :]
        if mirror:
            result[..., mirrored_unknown(group[~direct], blocks.harmonics), :, :] = solved[..., ~direct, :, :].conj()
    return result


def _with_nonlinear_forces(model, theta, speed, blocks, solved, deflection, linear):
    """Harmonics (..., speed, harmonic, dof) with the nonlinear forces, and Tangents (...), None if none acts."""
    carried, dof = blocks.harmonics, len(model.structure.dofs)
    acting = [(p, force) for p, force in model.nonlinear_forces if np.any(theta[..., p])]
    if not acting:
        return linear, None
    seen = seen_coordinates([force for _, force in acting])
    unit = np.zeros((len(carried), len(seen), len(carried), dof), complex)
    unit[range(len(carried)), :, range(len(carried))] = seen
    unit = np.moveaxis(unit.reshape(-1, len(carried), dof), 0, -1)
    unit = np.broadcast_to(np.concatenate([unit, 1j * unit], axis=-1), (*linear.shape, 2 * unit.shape[-1]))
    reply = solved(unit)
    deflection = np.broadcast_to(deflection, (*linear.shape[:-2], dof))
    found, tangents = np.empty_like(linear), np.empty(linear.shape[:-3], object)
    for trial in np.ndindex(tangents.shape):
        forces = [(theta[(*trial, p)], force) for p, force in acting]
        found[trial], tangents[trial] = steady_states(
            forces, speed, carried, deflection[trial], linear[trial], reply[trial]
        )
    return found, tangents
