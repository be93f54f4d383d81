"""Static deflection of the rotor on its bearings, about which displacements are measured.

Bearings carry the weight. Where their stiffness is an unknown, the deflection depends on it, and with the deflection
the force of a weight-dominant crack and the static cross force of internal damping.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState


class Deflection(NamedTuple):
    """Static deflection and its derivatives.

    value   : (dof,) or (..., speed, dof) complex, m (rad for tilts)
    changes : position in `theta` of each amplitude that carries load -> derivative (..., speed, dof), m per unit
    """

    value: np.ndarray
    changes: dict


def static_deflection(model, speed, theta, *, jacobian=False):
    """Deflection under the static load, (K + K_bearings) q = f.

    speed : (speed,) rad/s, for bearings that depend on it
    theta : (..., parameter), of which only the amplitudes that carry load matter
    raises : NoSteadyState if the bearings do not carry the load
    """
    structure = model.structure
    if model.held_deflection is not None or not model.is_carried or not structure.static_load.any():
        held = model.held_deflection
        return Deflection(structure.static_deflection if held is None else held, {})
    carrying = [p for p, unknown in enumerate(model.rotor_unknowns) if unknown.carries]
    dof, speed = len(structure.dofs), np.asarray(speed, float)
    springs = {p: _springs(model.rotor_unknowns[p], speed, dof) for p in carrying}  # on z and on conj(z)
    on_z = np.broadcast_to(structure.stiffness, (*theta.shape[:-1], len(speed), dof, dof)).astype(complex)
    on_conj = np.zeros_like(on_z)
    for p, (direct, mirrored) in springs.items():
        amount = theta[..., p, None, None, None]
        on_z, on_conj = on_z - amount * direct, on_conj - amount * mirrored
    upper, lower = np.concatenate([on_z, on_conj], axis=-1), np.concatenate([on_conj.conj(), on_z.conj()], axis=-1)
    matrix = np.concatenate([upper, lower], axis=-2)

    def solve(forces):  # (..., speed, dof, force)
        both = np.concatenate([forces, forces.conj()], axis=-2)
        try:
            return np.linalg.solve(matrix, np.broadcast_to(both, (*matrix.shape[:-1], both.shape[-1])))[..., :dof, :]
        except np.linalg.LinAlgError:
            raise NoSteadyState("the bearings do not carry the rotor: their stiffness matrix is singular") from None

    value = solve(structure.static_load.astype(complex)[:, None])[..., 0]
    if not jacobian:
        return Deflection(value, {})
    forces = [_times(direct, value) + _times(mirrored, value.conj()) for direct, mirrored in springs.values()]
    changes = solve(np.stack(forces, axis=-1))
    return Deflection(value, dict(zip(springs, np.moveaxis(changes, -1, 0), strict=True)))


def _springs(unknown, speed, dof):
    """Minus the stiffness on z and on conj(z), each (speed, dof, dof), of one unit of an amplitude."""
    found = {"z": np.zeros((len(speed), dof, dof), complex), "conj": np.zeros((len(speed), dof, dof), complex)}
    for entry in unknown.entries:
        if entry.reads_motion and entry.order == 0 and entry.shift == 0:
            found[entry.on] += entry.gain_at(speed, 0)[:, None, None] * entry.matrix
    return found["z"], found["conj"]


def _times(matrix, vector):
    return np.einsum("sij,...sj->...si", matrix, vector)
