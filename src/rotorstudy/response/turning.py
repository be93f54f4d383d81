"""Harmonics coupled by coefficients that turn with the shaft, solved on the few coordinates that these touch.

A crack couples every harmonic with every other, but only through the coordinates of one element. With the receptances
of the rotor without the turning coefficients, which couple n with -n at most, the unknowns are the harmonics x of these
coordinates: x = x0 + G K x, where x0 is the motion without them, K x their force, and G the receptances. K and G act on
real and imaginary parts, as conj(x) enters.
"""

from typing import NamedTuple

import numpy as np


class Turning(NamedTuple):
    """The turning coefficients at given amplitudes; components are real parts, then imaginary parts.

    touched    : (coordinate,) positions of the coordinates
    own, other : (..., speed, harmonic, dof, part * coordinate) motion at harmonic n by a unit force at n, and at -n
    force      : (..., speed, component, component) force by the motion of the coordinates, N/m
    closed     : (..., speed, component, component) identity less receptance times force
    """

    touched: np.ndarray
    own: np.ndarray
    other: np.ndarray
    force: np.ndarray
    closed: np.ndarray

    def added_to(self, found):
        """Motion (..., speed, harmonic, dof, column) with the turning coefficients, from that without them.

        raises : LinAlgError if the rotor resonates
        """
        motion = np.linalg.solve(self.closed, _components(found[..., self.touched, :]))
        return found + _replied(self.own, self.other, self.force @ motion)


def touched_by_turning(model):
    """Positions (coordinate,) of the coordinates that turning coefficients depend or act on."""
    touched = np.zeros(len(model.structure.dofs), bool)
    for _, entry in _turning_entries(model):
        row, column, _ = entry.nonzero
        touched[row] = touched[column] = True
    return np.flatnonzero(touched)


def turning(model, theta, speed, harmonics, touched, solved):
    """The Turning of a model.

    theta     : (..., rotor parameter);  speed : (speed,) rad/s
    harmonics : (harmonic,) carried, -order..order;  touched : see `touched_by_turning`
    solved    : force (..., speed, harmonic, dof, column) -> motion of the rotor without the turning coefficients
    """
    count, dof = len(touched), len(model.structure.dofs)
    unit = np.zeros((len(harmonics), dof, 2, 2, count), complex)  # on harmonics n >= 0, or n < 0; real, or imaginary
    for sign, here in enumerate((harmonics >= 0, harmonics < 0)):
        for i, coordinate in enumerate(touched):
            unit[here, coordinate, sign, :, i] = 1, 1j
    unit = unit.reshape(len(harmonics), dof, -1)
    reply = solved(np.broadcast_to(unit, (*theta.shape[:-1], len(speed), *unit.shape)))
    positive, negative = np.split(reply, 2, axis=-1)
    at = harmonics[:, None, None]
    own, other = np.where(at >= 0, positive, negative), np.where(at > 0, negative, positive) * (at != 0)
    force = _force_matrix(model, theta, speed, harmonics, touched)
    receptance = _components(_replied(own[..., touched, :], other[..., touched, :], force))
    return Turning(touched, own, other, force, np.eye(force.shape[-1]) - receptance)


def _turning_entries(model):
    """(position of the amplitude, entry) of the entries on the motion that turn with the shaft."""
    return [(p, e) for p, u in model.acting for e in u.entries if e.reads_motion and e.shift]


def _force_matrix(model, theta, speed, harmonics, touched):
    """(..., speed, component, component) real, N/m: from harmonics of the motion to those of the turning forces."""
    at = np.zeros(len(model.structure.dofs), int)
    at[touched] = np.arange(len(touched))
    order, count = len(harmonics) // 2, len(touched)
    shape = (*theta.shape[:-1], len(speed), len(harmonics), count, len(harmonics), count)
    on_z, on_conj = np.zeros(shape, complex), np.zeros(shape, complex)
    for p, entry in _turning_entries(model):
        n = harmonics[np.abs(harmonics - entry.shift) <= order]
        i, j, value = entry.nonzero
        i, j = at[i], at[j]
        row, column = (n + order)[:, None], ((n - entry.shift) * (-1 if entry.is_conjugate else 1) + order)[:, None]
        factor = entry.gain_at(speed[:, None], n) * (1j * (n - entry.shift) * speed[:, None]) ** entry.order
        target = on_conj if entry.is_conjugate else on_z
        target[..., row, i, column, j] += theta[..., p, None, None, None] * (factor[..., None] * value)
    size = len(harmonics) * count
    plus, minus = (part.reshape(*shape[:-4], size, size) for part in (on_z + on_conj, on_z - on_conj))
    return np.concatenate(
        [np.concatenate([plus.real, -minus.imag], axis=-1), np.concatenate([plus.imag, minus.real], axis=-1)], axis=-2
    )


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
