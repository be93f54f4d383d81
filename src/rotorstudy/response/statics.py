"""Static deflection of the rotor on its bearings, about which displacements are measured.

Bearings carry the weight. Where their stiffness is an unknown, the deflection depends on it, and with the deflection
the force of a weight-dominant crack and the static cross force of internal damping.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.response.factorised import factorised

NUMBERS_AT_ONCE = 1e7  # complex numbers in the matrices of the speeds taken together, 0.2 GB


class Deflection(NamedTuple):
    """Static deflection and its derivatives.

    value   : (dof,) or (..., speed, dof) complex, m (rad for tilts)
    changes : position in `theta` of each amplitude that carries load -> derivative (..., speed, dof), m per unit
    """

    value: np.ndarray
    changes: dict

    def at(self, speeds: slice) -> "Deflection":
        """That at some of the speeds."""
        value = self.value if self.value.ndim == 1 else self.value[..., speeds, :]
        return Deflection(value, {p: change[..., speeds, :] for p, change in self.changes.items()})


class Load(NamedTuple):
    """Static force of the shaft on a bearing: its node and label; N, complex, real part downward."""

    node: int
    label: str
    force: complex


def static_loads(model, deflection, speed):
    """Static loads of the bearings.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    deflection : array (dof,)
        Static deflection, m (rad).
    speed : float
        rad/s, for bearings that depend on it.

    Returns
    -------
    list of Load
    """
    dofs = model.structure.dofs
    moves = np.flatnonzero([motion == "translation" for _, motion in dofs])
    found = []
    for term in (term for term in model.terms if term.carries and not term.is_bearing_number):
        springs = [_springs(unknown, [speed], len(dofs)) for unknown in term.unknowns]
        force = sum(
            value * (on_z[0] @ deflection + on_conj[0] @ deflection.conj())
            for value, (on_z, on_conj) in zip(term.theta, springs, strict=True)
        )
        loaded = moves[np.argmax(np.abs(force[moves]))]
        found.append(Load(dofs[loaded][0], term.label, -complex(force[moves].sum())))
    return found


def static_deflection(model, speed, theta, *, jacobian=False):
    """Deflection under the static load, (K + K_bearings) q = f.

    speed : (speed,) rad/s, for bearings that depend on it
    theta : (..., parameter), of which only the amplitudes that carry load matter
    raises : NoSteadyState if the bearings do not carry the load
    """
    model, theta = model.at(theta)
    structure, varied, held = model.structure, model.varied, model.held_deflection
    if held is not None:
        return Deflection(held, {})
    if not structure.static_load.any() or not (model.is_carried or (varied and structure.is_supported)):
        return Deflection(structure.static_deflection, {})
    matrices = model.matrices(theta)
    carrying = [p for p, unknown in enumerate(model.rotor_unknowns) if unknown.carries]
    dof, speeds = len(structure.dofs), np.asarray(speed, float)
    entries = [entry for p in carrying for entry in model.rotor_unknowns[p].entries]
    speed = speeds if any(entry.gain for entry in entries) else speeds[:1]  # the springs are those at every speed
    if len(speed) > 1 and theta[..., 0].size * len(speed) * (2 * dof) ** 2 > NUMBERS_AT_ONCE:
        half = [static_deflection(model, part, theta, jacobian=jacobian) for part in np.array_split(speed, 2)]
        changes = {p: np.concatenate([one.changes[p] for one in half], axis=-2) for p in half[0].changes}
        return Deflection(np.concatenate([one.value for one in half], axis=-2), changes)
    springs = {p: _springs(model.rotor_unknowns[p], speed, dof) for p in carrying}  # on z and on conj(z)
    shape = (*theta.shape[:-1], len(speed), dof, dof)
    on_z = np.broadcast_to(matrices.stiffness[..., None, :, :], shape).astype(complex)
    on_conj = np.zeros_like(on_z)
    for p, (direct, mirrored) in springs.items():
        amount = theta[..., p, None, None, None]
        on_z, on_conj = on_z - amount * direct, on_conj - amount * mirrored
    upper, lower = np.concatenate([on_z, on_conj], axis=-1), np.concatenate([on_conj.conj(), on_z.conj()], axis=-1)
    matrix = np.concatenate([upper, lower], axis=-2)
    beside_conjugate = np.arange(2 * dof).reshape(2, dof).T.ravel()  # in this order that of a slender shaft has a band
    systems = factorised(matrix, beside_conjugate)

    def solve(forces):  # (..., speed, dof, force)
        try:
            return systems(np.concatenate([forces, forces.conj()], axis=-2))[..., :dof, :]
        except np.linalg.LinAlgError:
            raise NoSteadyState("the bearings do not carry the rotor: their stiffness matrix is singular") from None

    def at_every_speed(found):  # (..., speed, dof)
        return np.broadcast_to(found, (*found.shape[:-2], len(speeds), dof))

    value = solve(matrices.static_load[..., None, :, None].astype(complex))[..., 0]
    if not jacobian:
        return Deflection(at_every_speed(value), {})
    forces = {p: _times(direct, value) + _times(mirrored, value.conj()) for p, (direct, mirrored) in springs.items()}
    if varied:
        slopes = varied.variation.slopes_at(theta[..., varied.positions])
        more = slopes.static_load[..., None, :] - np.einsum("...pij,...sj->...psi", slopes.stiffness, value)
        forces |= dict(zip(varied.positions, np.moveaxis(more, -3, 0), strict=True))
    changes = solve(np.stack(list(forces.values()), axis=-1))
    changes = {p: at_every_speed(change) for p, change in zip(forces, np.moveaxis(changes, -1, 0), strict=True)}
    return Deflection(at_every_speed(value), changes)


def _springs(unknown, speed, dof):
    """Minus the stiffness on z and on conj(z), each (speed, dof, dof), of one unit of an amplitude."""
    found = {"z": np.zeros((len(speed), dof, dof), complex), "conj": np.zeros((len(speed), dof, dof), complex)}
    for entry in unknown.entries:
        if entry.reads_motion and entry.order == 0 and entry.shift == 0:
            found[entry.on] += entry.gain_at(speed, 0)[:, None, None] * entry.matrix
    return found["z"], found["conj"]


def _times(matrix, vector):
    return np.einsum("sij,...sj->...si", matrix, vector)
