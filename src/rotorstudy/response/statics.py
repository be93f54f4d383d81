"""Static deflection of the rotor on its bearings, about which displacements are measured.

Bearings carry the weight. Where their stiffness is an unknown, the deflection depends on it, and with the deflection
the force of a weight-dominant crack and the static cross force of internal damping.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.entries import apply_entries
from rotorstudy.response.coupling import layout
from rotorstudy.response.solving import solver

NUMBERS_AT_ONCE = 1e7  # complex numbers in the matrices of the speeds taken together, 0.2 GB


class Deflection(NamedTuple):
    """Static deflection (dof,) or (..., speed, dof), m (rad for tilts), and position in `theta` -> its derivative."""

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
    """Static Loads of the bearings at a deflection (dof,), m, and a speed, rad/s, for bearings that depend on it."""
    dofs = model.structure.dofs
    moves = np.flatnonzero([motion == "translation" for _, motion in dofs])
    found = []
    for term in model.terms:
        if not term.carries or term.is_bearing_number or term.is_foundation:
            continue
        # a shift of the whole rotor shows where the bearing acts, also where it carries nothing (vertical shafts)
        motions = np.array([deflection, model.structure.along], complex)[:, None, None]  # (motion, 1, 1, dof)
        pairs = zip(term.theta, term.unknowns, strict=True)
        force, shifted = sum(value * apply_entries(u.springs, motions, [speed], [0])[:, 0, 0] for value, u in pairs)
        loaded = moves[np.argmax(np.abs(shifted[moves]))]
        found.append(Load(dofs[loaded][0], term.label, 0.0 - complex(force[moves].sum())))
    return found


def static_deflection(model, speed, theta, *, jacobian=False):
    """The Deflection under the static load, (K + K_bearings) q = f; NoSteadyState if the bearings do not carry it."""
    model, theta = model.at(theta)
    structure, varied, held = model.structure, model.varied, model.held_deflection
    if held is not None:
        return Deflection(held, {})
    if not structure.static_load.any() or not (model.is_carried or (varied and structure.is_supported)):
        return Deflection(structure.static_deflection, {})
    still, places = model.at_rest
    springs = [(places[p], unknown) for p, unknown in still.acting]
    varying = any(entry.gain for _, unknown in springs for entry in unknown.entries)
    dof, speeds = len(structure.dofs), np.asarray(speed, float)
    speed = speeds if varying else speeds[:1]
    if len(speed) > 1 and theta[..., 0].size * len(speed) * (2 * dof) ** 2 > NUMBERS_AT_ONCE:
        half = [static_deflection(model, part, theta, jacobian=jacobian) for part in np.array_split(speed, 2)]
        changes = {p: np.concatenate([one.changes[p] for one in half], axis=-2) for p in half[0].changes}
        return Deflection(np.concatenate([one.value for one in half], axis=-2), changes)
    solved, lead = solver(still, theta[..., places], speed, layout(still, [0], 0)), (*theta.shape[:-1], len(speed))

    def moved(forces):  # (..., speed, dof, force)
        forces = np.broadcast_to(forces, (*lead, *forces.shape[-2:])).astype(complex)
        try:
            return solved(forces[..., None, :, :])[..., 0, :, :]
        except NoSteadyState:
            raise NoSteadyState(
                "the bearings do not carry the rotor: their stiffness matrix is singular, or not finite"
            ) from None

    def at_every_speed(found):  # (..., speed, dof)
        return np.broadcast_to(found, (*found.shape[:-2], len(speeds), dof))

    value = moved(model.matrices(theta).static_load[..., None, :, None])[..., 0]
    if not jacobian:
        return Deflection(at_every_speed(value), {})
    forces = np.moveaxis(still.table.dense_columns(value[..., None, :], speed, [0])[..., 0, :, :], -1, 0)
    forces = {p: force for (p, unknown), force in zip(springs, forces, strict=True) if unknown.entries}
    if varied:
        slopes = varied.variation.slopes_at(theta[..., varied.positions])
        more = slopes.static_load[..., None, :] - np.einsum("...pij,...sj->...psi", slopes.stiffness, value)
        forces |= dict(zip(varied.positions, np.moveaxis(more, -3, 0), strict=True))
    if not forces:
        return Deflection(at_every_speed(value), {})
    changes = moved(np.stack(list(forces.values()), axis=-1))
    changes = {p: at_every_speed(change) for p, change in zip(forces, np.moveaxis(changes, -1, 0), strict=True)}
    return Deflection(at_every_speed(value), changes)
