"""Harmonics coupled by coefficients that rotate with the shaft, solved on the few coordinates that these touch.

A crack couples every harmonic with every other, but only through the coordinates of one element. With the receptances
of the rotor without the turning coefficients, which couple n with -n at most, the unknowns are the harmonics x of these
coordinates: x = x0 + G K x, where x0 is the motion without them, K x their force, and G the receptances. K and G act on
real and imaginary parts, as conj(x) enters.
"""

import numpy as np

from rotorstudy.model.entries import harmonics_seen, on_real_parts


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
    # by the sign of the harmonic of the force, and its real or imaginary part
    unit = np.zeros((len(harmonics), rows.shape[1], 2, 2, len(rows)), complex)
    for sign, here in enumerate((harmonics >= 0, harmonics < 0)):
        unit[here, :, sign] = rows.T[:, None] * np.array([1, 1j])[:, None]
    unit = unit.reshape(len(harmonics), rows.shape[1], -1)
    positive, negative = np.split(solved(np.broadcast_to(unit, (*lead, *unit.shape))), 2, axis=-1)
    at = harmonics[:, None, None]
    return np.where(at >= 0, positive, negative), np.where(at > 0, negative, positive) * (at != 0)


def _force_matrix(model, theta, speed, harmonics):
    """(..., speed or 1, component, component) real, N/m: from harmonics of motion to those of the turning forces."""
    patterns, touched = model.table.turning_patterns, model.table.turned
    if all(pattern.entry.gain is None and pattern.entry.order == 0 for pattern in patterns):
        speed = speed[:1]
    own, count = theta[..., [p for p, _ in model.acting]], len(touched)
    # on the motion, and on its conjugate
    both = np.zeros((2, *own.shape[:-1], len(speed), len(harmonics), count, len(harmonics), count), complex)
    for pattern in patterns:
        entry = pattern.entry
        matrix = np.zeros((*own.shape[:-1], 1, 1, count, count), complex)  # (..., speed, harmonic, row, column)
        row, column = (np.searchsorted(touched, places) for places in (pattern.row, pattern.column))
        matrix[..., row, column] = pattern.values(own)[..., None, None, :]
        here, seen, n = harmonics_seen(entry.shift, entry.is_conjugate, tuple(harmonics.tolist()))
        factor = entry.gain_at(speed[:, None], harmonics[here]) * (1j * n * speed[:, None]) ** entry.order
        value = np.moveaxis(factor[..., None, None] * matrix, -3, 0)  # indices on both sides of a slice come first
        both[int(entry.is_conjugate)][..., here, :, seen, :] += value
    size = len(harmonics) * count
    return on_real_parts(*both.reshape(*both.shape[:-4], size, size))


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
