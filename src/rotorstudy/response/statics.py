"""Static deflection of the rotor on its bearings, about which displacements are measured.

Bearings carry the weight. Where their stiffness is an unknown, the deflection depends on it, and with the deflection
the force of a weight-dominant crack and the static cross force of internal damping.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.response.factorised import factorised, factorised_bands, has_narrow_band

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
        springs = [_springs(unknown, [speed]) for unknown in term.unknowns]
        pairs = [(value, spring) for value, own in zip(term.theta, springs, strict=True) for spring in own]
        # a shift of the whole rotor shows where the bearing acts, also where it carries nothing (vertical shafts)
        force, shifted = (
            sum(value * spring.force(motion[None])[0] for value, spring in pairs)
            for motion in (deflection, model.structure.along.astype(complex))
        )
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
    carrying = [p for p, unknown in enumerate(model.rotor_unknowns) if unknown.carries]
    dof, speeds = len(structure.dofs), np.asarray(speed, float)
    entries = [entry for p in carrying for entry in model.rotor_unknowns[p].entries]
    speed = speeds if any(entry.gain for entry in entries) else speeds[:1]  # the springs are those at every speed
    if len(speed) > 1 and theta[..., 0].size * len(speed) * (2 * dof) ** 2 > NUMBERS_AT_ONCE:
        half = [static_deflection(model, part, theta, jacobian=jacobian) for part in np.array_split(speed, 2)]
        changes = {p: np.concatenate([one.changes[p] for one in half], axis=-2) for p in half[0].changes}
        return Deflection(np.concatenate([one.value for one in half], axis=-2), changes)
    matrices = model.matrices(theta)
    springs = {p: _springs(model.rotor_unknowns[p], speed) for p in carrying}
    systems = _systems(matrices.stiffness, springs, theta, len(speed))

    def solve(forces):  # (..., speed, dof, force)
        beside_conjugate = np.stack([forces, forces.conj()], axis=-2)
        beside_conjugate = beside_conjugate.reshape(*forces.shape[:-2], 2 * dof, forces.shape[-1])
        try:
            return systems(beside_conjugate)[..., ::2, :]
        except np.linalg.LinAlgError:
            raise NoSteadyState("the bearings do not carry the rotor: their stiffness matrix is singular") from None

    def at_every_speed(found):  # (..., speed, dof)
        return np.broadcast_to(found, (*found.shape[:-2], len(speeds), dof))

    value = solve(matrices.static_load[..., None, :, None].astype(complex))[..., 0]
    forces = {p: sum(spring.force(value) for spring in own) for p, own in springs.items() if own and jacobian}
    if varied and jacobian:
        slopes = varied.variation.slopes_at(theta[..., varied.positions])
        more = slopes.static_load[..., None, :] - np.einsum("...pij,...sj->...psi", slopes.stiffness, value)
        forces |= dict(zip(varied.positions, np.moveaxis(more, -3, 0), strict=True))
    if not forces:
        return Deflection(at_every_speed(value), {})
    changes = solve(np.stack(list(forces.values()), axis=-1))
    changes = {p: at_every_speed(change) for p, change in zip(forces, np.moveaxis(changes, -1, 0), strict=True)}
    return Deflection(at_every_speed(value), changes)


class _Spring(NamedTuple):
    """Force at rest by one unit of an amplitude: `value` (speed, element), N/m, at row and column (element,)."""

    row: np.ndarray
    column: np.ndarray
    value: np.ndarray
    is_conjugate: bool

    def force(self, deflection):
        """Force (..., speed, dof), N, at a deflection (..., speed, dof)."""
        seen = deflection.conj() if self.is_conjugate else deflection
        shape = np.broadcast_shapes(deflection.shape, (len(self.value), deflection.shape[-1]))
        found = np.zeros(shape, complex)
        np.add.at(found, (..., self.row), self.value * seen[..., self.column])
        return found


def _springs(unknown, speed):
    """The _Spring of every entry of an amplitude that carries load."""
    at_rest = [entry for entry in unknown.entries if entry.reads_motion and entry.order == 0 and entry.shift == 0]
    found = []
    for entry in at_rest:
        row, column, value = entry.nonzero
        found.append(_Spring(row, column, entry.gain_at(speed, 0)[:, None] * value, entry.is_conjugate))
    return found


def _systems(stiffness, springs, theta, speeds):
    """Function that solves for deflections, each coordinate beside its conjugate: a slender shaft has a band."""
    count = 2 * stiffness.shape[-1]
    row, column = np.nonzero(np.any(stiffness != 0, axis=tuple(range(stiffness.ndim - 2))))
    every = [spring for own in springs.values() for spring in own]
    places = [(row, column), *((spring.row, spring.column) for spring in every)]
    band = 2 * max(np.abs(i - j).max(initial=0) for i, j in places) + 1
    is_banded = has_narrow_band(band, count)
    matrix = np.zeros((*theta.shape[:-1], speeds, 2 * band + 1 if is_banded else count, count), complex)

    def add(row, column, value):
        matrix[..., band + row - column if is_banded else row, column] += value

    for side in (0, 1):
        add(2 * row + side, 2 * column + side, stiffness[..., None, row, column])
    for p, own in springs.items():
        for row, column, value, is_conjugate in own:
            value = -theta[..., p, None, None] * value
            add(2 * row, 2 * column + is_conjugate, value)
            add(2 * row + 1, 2 * column + 1 - is_conjugate, value.conj())
    return factorised_bands(matrix) if is_banded else factorised(matrix)
