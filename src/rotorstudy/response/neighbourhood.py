"""The neighbourhood of a model: what forces and output terms that it does not contain add to what the sensors show."""

from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.model.entry_table import Columns, EntryTable
from rotorstudy.response.alternating import nonlinear_columns
from rotorstudy.response.coupling import COUPLED_ORDER, layout
from rotorstudy.response.harmonic import carried_response, positions, response_inputs
from rotorstudy.response.measured import at_sensors
from rotorstudy.response.solving import solver
from rotorstudy.response.statics import static_deflection

SOLVED_AT_ONCE = 8  # coordinates whose receptances are solved together: more take more memory, not less time
TABLES_KEPT, FACTORS_KEPT = 48, 250_000  # tables of unknowns, and numbers of the factors of each of them, 4 MB
MOTION_AT_ONCE = 1_000_000  # numbers of the motions that are taken together
REPLIES_KEPT = 30_000_000  # numbers of the motions by unit forces, 0.5 GB; those shown are all kept, as they are few
FORCES_AT_ONCE = 2_000_000  # numbers of the forces whose motions are solved together, several times 32 MB


@lru_cache(maxsize=TABLES_KEPT)
def _kept_table(unknowns, size, motion):
    """The EntryTable of some unknowns: a search judges the same candidates at one fit after another."""
    return EntryTable(unknowns, size, motion)


class Motion(NamedTuple):
    """A steady motion.

    amplitude  : (speed, harmonic, dof) complex, about the deflection, m; harmonics as carried by `Neighbourhood`
    deflection : (..., dof) static deflection, m
    """

    amplitude: np.ndarray
    deflection: np.ndarray


def carried_motion(model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
    """The Motion of a model at all harmonics that are carried; arguments as for `Neighbourhood`."""
    model, theta = model.at(theta)
    speed, harmonics, theta, _ = response_inputs(model, speed, harmonics, theta, order)
    blocks = layout(model, np.union1d(np.arange(-order, order + 1), harmonics), order)
    deflection = static_deflection(model, speed, theta[: len(model.rotor_unknowns)]).value
    return Motion(carried_response(model, speed, theta, blocks, False)[0], deflection)


class Neighbourhood:
    """The neighbourhood of a model: what forces that it does not contain add to its motion and measured harmonics.

    To first order, as the added motion does not act back on these forces.

    model, speed, harmonics, theta : as for `harmonic_response`;  harmonics -order..order are carried
    """

    def __init__(self, model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
        model, theta = model.at(theta)
        self.model, self.order = model, order
        self.speed, self.harmonics, self.theta, _ = response_inputs(model, speed, harmonics, theta, order)
        self.blocks = layout(model, np.union1d(np.arange(-order, order + 1), self.harmonics), order)
        self.by_coordinate, self.by_shown = {}, {}

    @cached_property
    def motion(self):
        """The Motion of the model itself."""
        return carried_motion(self.model, self.speed, self.harmonics, self.theta, order=self.order)

    @cached_property
    def _solved(self):
        own = self.theta[: len(self.model.rotor_unknowns)]
        return solver(self.model, own, self.speed, self.blocks)[0]

    def replies(self, coordinate):
        """Motion (speed, carried harmonic, dof, component) by a unit force on each harmonic of a coordinate, m/N.

        The components are the real and imaginary part of each carried harmonic. Each coordinate is solved once.
        """
        if coordinate not in self.by_coordinate:
            self._solve_for([coordinate])
        return self.by_coordinate[coordinate]

    def shown_replies(self, coordinate):
        """Measured harmonics (speed, component, harmonic * sensor) by the forces of `replies`, m/N."""
        if coordinate not in self.by_shown:
            self._solve_for([coordinate])
        return self.by_shown[coordinate]

    def moved_by(self, rows, components, force):
        """Motions (row, speed, carried harmonic, dof), m, by a force along each row (row, dof).

        components : (component,) positions of those of `replies` that the force has
        force      : (row, speed, component) real, N
        """
        speeds = len(self.speed)
        moved = np.zeros((speeds, self.motion.amplitude[0].size, len(rows)), complex)
        for i in np.flatnonzero(rows.any(axis=0)):
            reply = self.replies(int(i))[..., components].reshape(speeds, -1, len(components))
            here = np.flatnonzero(rows[:, i])
            moved[..., here] += reply @ np.moveaxis(rows[here, i, None, None] * force[here], 0, -1)
        return np.moveaxis(moved, -1, 0).reshape(len(rows), *self.motion.amplitude.shape)

    def _solve_for(self, coordinates):
        """Keep the replies of some coordinates, several by one factorisation."""
        carried, dof = len(self.blocks.harmonics), len(self.model.structure.dofs)
        for first in range(0, len(coordinates), SOLVED_AT_ONCE):
            part = coordinates[first : first + SOLVED_AT_ONCE]
            force = np.zeros((len(self.speed), carried, dof, len(part), 2 * carried), complex)
            for place, coordinate in enumerate(part):
                force[:, :, coordinate, place] = np.kron(np.eye(carried), [1, 1j])
            found = self._solved(force.reshape(*force.shape[:3], -1)).reshape(force.shape)
            for place, coordinate in enumerate(part):
                reply = np.ascontiguousarray(found[..., place, :])
                seen = self.model.seen(reply[:, positions(self.harmonics, self.blocks)], axis=2)
                seen = seen.reshape(len(self.speed), -1, 2 * carried)
                self.by_shown[coordinate] = np.ascontiguousarray(np.swapaxes(seen, 1, 2))
                while self.by_coordinate and len(self.by_coordinate) * reply.size > REPLIES_KEPT:
                    del self.by_coordinate[next(iter(self.by_coordinate))]
                self.by_coordinate[coordinate] = reply

    def _moved(self, columns, count):
        """Measured harmonics (speed, harmonic, sensor, unknown) by the Columns of a number of unknowns.

        Every force acts on few coordinates, so that the sum goes over the forces on each coordinate.
        """
        acted, shown = np.unique(columns.row).tolist(), positions(self.harmonics, self.blocks)
        carried, speeds = len(self.blocks.harmonics), len(self.speed)
        fresh = [coordinate for coordinate in acted if coordinate not in self.by_shown]
        if 2 * carried * len(fresh) >= count:
            together, dof = max(1, FORCES_AT_ONCE // self.motion.amplitude.size), len(self.model.structure.dofs)
            found = []
            for first in range(0, count, together):
                size = min(together, count - first)
                moved = self._solved(columns.part(first, size).dense(dof, size))[:, shown]
                found.append(self.model.seen(moved, axis=2))
            return np.concatenate(found, axis=-1)
        self._solve_for(fresh)
        found = np.zeros((speeds, count, len(shown) * len(self.model.measured)), complex)
        for coordinate in acted:
            here = columns.row == coordinate
            parts = np.ascontiguousarray(np.moveaxis(columns.value[..., here], -1, 1)).view(float)
            moved = parts @ self.shown_replies(coordinate).view(float)  # real parts by real parts
            found[:, columns.unknown[here]] += moved.view(complex)
        return np.moveaxis(found.reshape(speeds, count, len(shown), -1), 1, -1)

    def changes_by_forces(self, groups):
        """First-order change of the measured harmonics by one unit of amplitudes of forces that the model lacks.

        groups  : list of (list of Unknown, Motion on which they act or None for that of the model); with the motion
                  that results, the change is exact
        returns : (speed, harmonic, sensor, unknown) complex, m per unit; the unknowns of the groups follow one another
        """
        groups = [(unknowns, motion or self.motion) for unknowns, motion in groups if unknowns]
        found, together = [self._no_changes], max(1, MOTION_AT_ONCE // self.motion.amplitude.size)
        for first in range(0, len(groups), together):
            part = groups[first : first + together]
            found.append(self._moved(self._columns(part), sum(len(unknowns) for unknowns, _ in part)))
        return np.concatenate(found, axis=-1)

    def changes_by_output(self, groups):
        """As `changes_by_forces`, of amplitudes that act on the output."""
        carried, shown = self.blocks.harmonics, positions(self.harmonics, self.blocks)
        own, found = self.theta[: len(self.model.rotor_unknowns)], [self._no_changes]
        for unknowns, motion in (group for group in groups if group[0]):
            true, _ = at_sensors(self.model, self.speed, own, carried, (motion or self.motion).amplitude)
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
                value = nonlinear_columns(list(local.values()), motion.amplitude, speed, carried, motion.deflection)
                row, place = np.nonzero(value.any(axis=(0, 1)))
                parts.append(Columns(row, np.array(list(local), int)[place], value[..., row, place]))
        if in_table:
            place, unknowns, at = zip(*in_table, strict=True)
            motions = [motion for _, motion in groups]
            table = _kept_table if len(speed) * len(carried) * len(unknowns) <= FACTORS_KEPT else EntryTable
            found = table(unknowns, motions[0].amplitude.shape[-1], at).columns(
                np.concatenate([motion.amplitude for motion in motions], axis=-1),
                speed,
                carried,
                np.concatenate([motion.deflection for motion in motions], axis=-1),
            )
            parts.append(found._replace(unknown=np.array(place)[found.unknown]))
        return Columns(*(np.concatenate(part, axis=-1) for part in zip(*parts, strict=True)))
