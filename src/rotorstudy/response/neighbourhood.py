"""The neighbourhood of a model: what forces and output terms that it does not contain add to what the sensors show."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.model.entry_table import Columns, EntryTable
from rotorstudy.response.alternating import nonlinear_columns
from rotorstudy.response.coupling import COUPLED_ORDER, layout
from rotorstudy.response.harmonic import carried_response, positions, response_inputs
from rotorstudy.response.measured import at_sensors
from rotorstudy.response.solving import solver
from rotorstudy.response.statics import static_deflection

MOTION_AT_ONCE, COLUMNS_AT_ONCE = 1_000_000, 500_000  # numbers of motions, and of forces, that are taken together
FORCES_AT_ONCE = 2_000_000  # numbers of the forces whose motions are solved together, several times 32 MB


class Motion(NamedTuple):
    """A steady motion: amplitude (speed, harmonic, dof), m, at the harmonics carried, about a deflection (..., dof)."""

    amplitude: np.ndarray
    deflection: np.ndarray


def carried_motion(model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
    """The Motion of a model at all harmonics that are carried; arguments as for `Neighbourhood`."""
    return Neighbourhood(model, speed, harmonics, theta, order=order).motion


class Neighbourhood:
    """What forces that a model does not contain add, to first order, to its motion and to its measured harmonics."""

    def __init__(self, model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
        model, theta = model.at(theta)
        self.model, self.order = model, order
        self.speed, self.harmonics, self.theta, _ = response_inputs(model, speed, harmonics, theta, order)
        self.blocks = layout(model, np.union1d(np.arange(-order, order + 1), self.harmonics), order)

    @cached_property
    def motion(self):
        """The Motion of the model itself."""
        deflection = static_deflection(self.model, self.speed, self._of_rotor).value
        return Motion(carried_response(self.model, self.speed, self.theta, self.blocks, False)[0], deflection)

    @property
    def _of_rotor(self):
        """Amplitudes (rotor parameter,)."""
        return self.theta[: len(self.model.rotor_unknowns)]

    @cached_property
    def _solved(self):
        return solver(self.model, self._of_rotor, self.speed, self.blocks)

    @cached_property
    def shown_by_units(self):
        """Harmonics (coordinate, speed, component, harmonic * sensor) by unit forces, m/N, by one adjoint each."""
        carried, dof, speeds = len(self.blocks.harmonics), len(self.model.structure.dofs), len(self.speed)
        sensors, shown = self.model.seen(np.eye(dof)).T, positions(self.harmonics, self.blocks)
        solved = solver(self.model, self._of_rotor, self.speed, self.blocks, adjoint=True)
        count = len(shown) * len(sensors)
        found = np.empty((dof, speeds, 2 * carried, count), complex)
        together = max(1, FORCES_AT_ONCE // (2 * speeds * carried * dof))
        for first in range(0, count, together):
            columns = np.arange(first, min(first + together, count))
            harmonic, sensor = np.divmod(columns, len(sensors))
            unit = np.zeros((carried, dof, len(columns), 2), complex)
            unit[shown[harmonic], :, np.arange(len(columns))] = sensors[sensor][..., None] * [1, 1j]
            unit = np.broadcast_to(unit.reshape(carried, dof, -1), (speeds, carried, dof, 2 * len(columns)))
            reply = solved(unit).reshape(speeds, carried, dof, len(columns), 2)
            for part, own in enumerate((reply.real, reply.imag)):  # of the force; the last axis is that of the motion
                one = own[..., 0] + 1j * own[..., 1]
                found[:, :, part::2, columns] = np.moveaxis(one, 2, 0)
        return found

    @cached_property
    def largest_shown(self):
        """Largest harmonic (coordinate,), m/N, that a unit force on any coordinate of the same kind shows."""
        size = np.array([np.abs(one).max(initial=0.0) for one in self.shown_by_units])
        kinds = np.array([kind for _, kind in self.model.structure.dofs])
        return np.array([size[kinds == kind].max() for kind in kinds])

    def moved_by(self, force):
        """Motions (force, speed, carried harmonic, dof), m, by forces (force, speed, carried harmonic, dof), N."""
        together = max(1, FORCES_AT_ONCE // self.motion.amplitude.size)
        parts = [force[first : first + together] for first in range(0, len(force), together)]
        return np.concatenate([np.moveaxis(self._solved(np.moveaxis(part, 0, -1)), -1, 0) for part in parts])

    def _moved(self, columns, count):
        """Measured harmonics (speed, harmonic, sensor, unknown) by the Columns of a number of unknowns."""
        speeds = len(self.speed)
        found = np.zeros((speeds, count, len(self.harmonics) * len(self.model.measured)), complex)
        for coordinate in np.unique(columns.row):
            here = columns.row == coordinate
            parts = np.ascontiguousarray(np.moveaxis(columns.value[..., here], -1, 1)).view(float)
            moved = parts @ self.shown_by_units[coordinate].view(float)  # real parts by real parts
            found[:, columns.unknown[here]] += moved.view(complex)
        return np.moveaxis(found.reshape(speeds, count, len(self.harmonics), -1), 1, -1)

    def changes_by_forces(self, groups):
        """Change (speed, harmonic, sensor, unknown), m, of measured harmonics by one unit of forces not in the model.

        groups : [(amplitudes, Motion on which they act, None for that of the model)]; exact at the motion that results
        """
        most = max(1, COLUMNS_AT_ONCE // (len(self.speed) * len(self.blocks.harmonics)))
        together, found, parts = max(1, MOTION_AT_ONCE // self.motion.amplitude.size), [self._no_changes], [[]]
        for unknowns, motion in groups:
            for first in range(0, len(unknowns), most):
                part = unknowns[first : first + most]
                if len(parts[-1]) == together or sum(len(one) for one, _ in parts[-1]) + len(part) > most:
                    parts.append([])
                parts[-1].append((part, motion or self.motion))
        for part in filter(None, parts):
            found.append(self._moved(self._columns(part), sum(len(unknowns) for unknowns, _ in part)))
        return np.concatenate(found, axis=-1)

    def force_of(self, unknowns, sizes):
        """Force (speed, carried harmonic, dof), N, of unknowns of some sizes at the motion of the model."""
        columns = self._columns([(unknowns, self.motion)])
        return columns.dense(self.motion.amplitude.shape[-1], len(unknowns)) @ sizes

    def changes_by_output(self, groups):
        """As `changes_by_forces`, of amplitudes that act on the output."""
        carried, shown, found = self.blocks.harmonics, positions(self.harmonics, self.blocks), [self._no_changes]
        for unknowns, motion in (group for group in groups if group[0]):
            true, _ = at_sensors(self.model, self.speed, self._of_rotor, carried, (motion or self.motion).amplitude)
            found.append(EntryTable(unknowns, true.shape[-1]).dense_columns(true, self.speed, carried)[:, shown])
        return np.concatenate(found, axis=-1)

    @property
    def _no_changes(self):
        return np.zeros((len(self.speed), len(self.harmonics), len(self.model.sensors), 0), complex)

    def _columns(self, groups):
        """Columns of groups of unknowns that act on the rotor, each at its Motion."""
        speed, carried, first, parts, in_table = self.speed, self.blocks.harmonics, 0, [], []
        for at, (unknowns, motion) in enumerate(groups):
            local = {p: u.force for p, u in enumerate(unknowns, start=first) if u.force}
            in_table += [(p, u, at) for p, u in enumerate(unknowns, start=first) if not u.force]
            first += len(unknowns)
            if local:
                own = nonlinear_columns(list(local.values()), motion.amplitude, speed, carried, motion.deflection)
                parts.append(own._replace(unknown=np.array(list(local), int)[own.unknown]))
        if in_table:
            place, unknowns, at = zip(*in_table, strict=True)
            motions = [motion for _, motion in groups]
            amplitude, deflection = (np.concatenate(one, axis=-1) for one in zip(*motions, strict=True))
            table = EntryTable(unknowns, motions[0].amplitude.shape[-1], at)
            found = table.columns(amplitude, speed, carried, deflection)
            parts.append(found._replace(unknown=np.array(place)[found.unknown]))
        return Columns.together(parts)
