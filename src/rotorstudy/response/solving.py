"""The dynamic stiffness of all harmonics that are solved together, and the motion that a force on them gives."""

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.response.banded import solve_systems
from rotorstudy.response.coupling import gather, layout_without_turning, linked_members, mirrored_unknown
from rotorstudy.response.turning import turning

FEWER_BY = 2  # harmonics are coupled on the coordinates that turn if that takes less than a half of the operations
CONDENSED_AT_MOST = 1e4  # ratio of the condensed part to the stiffness; above it four of sixteen digits would be lost


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
        base = uncoupled(matrices, n, speed[:, None, None])
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
        if not value.any():
            continue
        for full, (n, is_w, block, row, column) in zip(
            result, linked_members(blocks, entry.is_conjugate, entry.shift), strict=True
        ):
            if not len(n):
                continue
            factor = entry.gain_at(speed[:, None], n) * (1j * (n - entry.shift) * speed[:, None]) ** entry.order
            both = factor[..., None] * value
            full[..., block, row, at[i], column, at[j]] -= np.where(is_w[:, None], both.conj(), both)
    return [full.reshape(*full.shape[:-4], full.shape[-4] * dof, full.shape[-4] * dof) for full in result]


def uncoupled(matrices, n, speed):
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
