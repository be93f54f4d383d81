"""Harmonics coupled by coefficients that rotate with the shaft, solved on the few coordinates that these touch.

A crack couples every harmonic with every other, but only through the coordinates of one element. With the receptances
of the rotor without the turning coefficients, which couple n with -n at most, the unknowns are the harmonics x of these
coordinates: x = x0 + G K x, where x0 is the motion without them, K x their force, and G the receptances. K and G act on
real and imaginary parts, as conj(x) enters.
"""

from functools import lru_cache

import numpy as np


def turning(model, theta, speed, harmonics, solved, adjoint=False):
    """Function that adds turning coefficients to a motion (..., speed, harmonic, dof, column) solved without them."""
    touched = model.table.turned
    own, other = replies(np.eye(len(model.structure.dofs))[touched], (*theta.shape[:-1], len(speed)), harmonics, solved)
    force = _force_matrix(model, theta, speed, harmonics)
    force = np.swapaxes(force, -1, -2) if adjoint else force
    receptance = _components(_replied(own[..., touched, :], other[..., touched, :], force))
    closed = np.eye(force.shape[-1]) - receptance

    def with_turning(found):
        motion = np.linalg.solve(closed, _components(found[..., touched, :]))
        return found + _replied(own, other, force @ motion)

    return with_turning


def replies(rows, lead, harmonics, solved):
    """Motion (*lead, harmonic, dof, part * row) at harmonic n by unit forces along rows (row, dof) at n, and at -n."""
    unit = np.zeros(
        (len(harmonics), rows.shape[1], 2, 2, len(rows)), complex
    )  # on n >= 0, or n < 0; real, or imaginary
    for sign, here in enumerate((harmonics >= 0, harmonics < 0)):
        unit[here, :, sign] = rows.T[:, None] * np.array([1, 1j])[:, None]
    unit = unit.reshape(len(harmonics), rows.shape[1], -1)
    positive, negative = np.split(solved(np.broadcast_to(unit, (*lead, *unit.shape))), 2, axis=-1)
    at = harmonics[:, None, None]
    return np.where(at >= 0, positive, negative), np.where(at > 0, negative, positive) * (at != 0)


def _force_matrix(model, theta, speed, harmonics):
    """(..., speed or 1, component, component) real, N/m: from harmonics of motion to those of the turning forces."""
    entries = [pattern.entry for pattern in model.table.turning_patterns]
    alike = all(entry.gain is None and entry.order == 0 for entry in entries)
    given = tuple(speed.tolist())[: 1 if alike else None]
    weights = _force_weights(model.table, given, tuple(harmonics.tolist()))
    own = theta[..., [p for p, _ in model.acting]]
    size = 2 * len(harmonics) * len(model.table.turned)
    found = weights @ own.reshape(-1, own.shape[-1]).T
    return found.T.reshape(*own.shape[:-1], len(given), size, size)


@lru_cache(maxsize=16)
def _force_weights(table, speed, harmonics):
    """Sparse (elements of the matrix at every speed, amplitude): the force matrix by one unit of each amplitude."""
    from scipy.sparse import coo_array

    touched, speed, harmonics = table.turned, np.array(speed), np.array(harmonics)
    at, (order, count) = np.zeros(table.size, int), (len(harmonics) // 2, len(touched))
    at[touched] = np.arange(count)
    size, parts = len(harmonics) * count, []
    for pattern in table.turning_patterns:
        entry, element, unknown, value = pattern.entry, pattern.element, pattern.unknown, pattern.weight
        i, j = at[pattern.row[element]], at[pattern.column[element]]
        n = harmonics[np.abs(harmonics - entry.shift) <= order]
        factor = entry.gain_at(speed[:, None], n) * (1j * (n - entry.shift) * speed[:, None]) ** entry.order
        seen = (n - entry.shift) * (-1 if entry.is_conjugate else 1)
        row, column = (n + order)[:, None] * count + i, (seen + order)[:, None] * count + j  # (harmonic, element)
        found = factor[..., None] * value  # (speed, harmonic, element)
        sign = -1 if entry.is_conjugate else 1  # of the imaginary part of the motion
        for down, right, part in (
            (0, 0, found.real),
            (1, 0, found.imag),
            (0, 1, -sign * found.imag),
            (1, 1, sign * found.real),
        ):
            place = (row + down * size) * 2 * size + column + right * size
            place = np.arange(len(speed))[:, None, None] * (2 * size) ** 2 + place
            parts.append((place.ravel(), np.broadcast_to(unknown, part.shape).ravel(), part.ravel()))
    place, unknown, value = (np.concatenate(part) for part in zip(*parts, strict=True))
    shape = (len(speed) * (2 * size) ** 2, len(table.unknowns))
    return coo_array((value, (place, unknown)), shape).tocsr()


def _components(motion):
    """(..., harmonic, coordinate, column) complex as (..., component, column) real."""
    flat = motion.reshape(*motion.shape[:-3], -1, motion.shape[-1])
    return np.concatenate([flat.real, flat.imag], axis=-2)


def _replied(own, other, force):
    """Motion (..., harmonic, dof, column) by forces (..., component, column), which are real."""
    harmonics = own.shape[-3]
    parts = force.reshape(*force.shape[:-2], 2, harmonics, -1, force.shape[-1])
    parts = np.moveaxis(parts, -4, -3)  # (..., harmonic, part, coordinate, column)
    parts = parts.reshape(*parts.shape[:-3], -1, force.shape[-1])
    return own @ parts + other @ parts[..., ::-1, :, :]
