"""What the amplitudes of a model act on, as the response takes it: tables of entries, matrices, coordinates."""

from dataclasses import replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RigError
from rotorstudy.model.entry_table import EntryTable
from rotorstudy.model.rig_numbers import with_bearings_at
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import NonlinearForce, Term, Unknown
from rotorstudy.model.variation import Matrices, Variation


class Varied(NamedTuple):
    """The numbers of the rotor that are parameters: positions (number,) in `rotor_unknowns`, and their Variation."""

    positions: tuple[int, ...]
    variation: Variation


class Assembled:
    """What a Model gives to the response, from these of its fields."""

    structure: Structure
    terms: tuple[Term, ...]
    sensors: tuple[int, ...]
    held_deflection: np.ndarray | None
    before: frozenset[str] | None

    @cached_property
    def rotor_unknowns(self) -> tuple[Unknown, ...]:
        """Amplitudes of the terms that act on the rotor, first in `theta`."""
        return tuple(u for term in self.terms if not term.acts_on_output for u in term.unknowns)

    @cached_property
    def varied(self) -> Varied | None:
        """The numbers of the rotor that are parameters; None if all are known."""
        for term in self.terms:
            if term.variation:
                first = self.names.index(term.unknowns[0].name)
                return Varied(tuple(range(first, first + len(term.unknowns))), term.variation)
        return None

    @cached_property
    def acting(self) -> tuple[tuple[int, Unknown], ...]:
        """(position in `rotor_unknowns`, Unknown) of the amplitudes of effects, cracks and bearings."""
        own = self.varied.positions if self.varied else ()
        return tuple((p, unknown) for p, unknown in enumerate(self.rotor_unknowns) if p not in own)

    @cached_property
    def table(self) -> EntryTable:
        """The EntryTable of the amplitudes in `acting`."""
        return EntryTable(tuple(unknown for _, unknown in self.acting), len(self.structure.dofs))

    @cached_property
    def output_table(self) -> tuple[list[int], EntryTable]:
        """Positions in `theta` and EntryTable of the amplitudes that the measured output is linear in."""
        first = len(self.rotor_unknowns)
        linear = [(p, u) for p, u in enumerate(self.output_unknowns, start=first) if not u.exact]
        return [p for p, _ in linear], EntryTable(tuple(u for _, u in linear), len(self.sensors))

    def matrices(self, theta: np.ndarray) -> Matrices:
        """Matrices of the rotor at amplitudes (..., parameter); without leading dimensions if no number is one."""
        if self.varied is None:
            return self.structure.matrices
        return self.varied.variation.at(theta[..., self.varied.positions])

    def at(self, theta=None):
        """The model with the bearings that it has at amplitudes (parameter,), by default its own, and these.

        Bearings are not linear in their numbers: they are built anew, and the amplitudes of the numbers are then zero,
        their entries the derivatives. NoSteadyState if there is no bearing with these numbers.
        """
        theta = np.asarray(self.theta if theta is None else theta, float)
        if not self.bearing_numbers:
            return self, theta
        theta = theta.copy()
        carrying = [p for p, unknown in enumerate(self.rotor_unknowns) if unknown.carries]
        placed = self._placed(tuple((self.names[p], float(theta[p])) for p in carrying))
        theta[list(self.bearing_numbers)] = 0.0
        return placed, theta

    @cached_property
    def bearing_numbers(self) -> tuple[int, ...]:
        """Positions (number,) in `theta` of the numbers of bearings that are parameters."""
        names = {unknown.name for term in self.terms if term.is_bearing_number for unknown in term.unknowns}
        return tuple(p for p, name in enumerate(self.names) if name in names)

    @cached_property
    def _placed(self):
        """The Model with its bearings at (name, value) of the amplitudes that carry load, kept for the last few."""
        latest = []

        @lru_cache(maxsize=4)
        def placed(values):
            terms = with_bearings_at(self.structure, self.terms, dict(values))
            settled = (replace(t, is_bearing_number=False) if t.is_bearing_number else t for t in terms)
            found = replace(self, terms=tuple(settled))
            found.__dict__["output_table"] = self.output_table  # bearings do not act on the output
            if latest:
                found.__dict__["table"] = latest[0].with_gains_of(unknown for _, unknown in found.acting)
            latest[:] = [found.table]
            return found

        return placed

    @cached_property
    def earlier(self):
        """The machine in the earlier state from whose displacements the sensors count; None if there is none."""
        if self.before is None:
            return None
        there = tuple(term for term in self.terms if all(unknown.name in self.before for unknown in term.unknowns))
        return replace(self, terms=there, before=None)

    @cached_property
    def recent(self) -> dict:
        """Responses of the machine computed last, keyed by their inputs; an earlier state is asked for often."""
        return {}

    @cached_property
    def nonlinear_forces(self) -> tuple[tuple[int, NonlinearForce], ...]:
        """(position in `rotor_unknowns`, NonlinearForce) of the amplitudes that multiply a force in time."""
        return tuple((p, u.force) for p, u in enumerate(self.rotor_unknowns) if u.force)

    @cached_property
    def output_unknowns(self) -> tuple[Unknown, ...]:
        """Amplitudes of the terms that act on the measured output, last in `theta`."""
        return tuple(u for term in self.terms if term.acts_on_output for u in term.unknowns)

    @cached_property
    def measured(self) -> np.ndarray:
        """Positions (sensor,), int, of the measured translations among the coordinates."""
        return np.array([self.structure.index(node) for node in self.sensors])

    @cached_property
    def _riding(self):
        """Positions (sensor,) among the sensors of those on housings, and of these among the coordinates."""
        riding, sensors = self.structure.riding, list(self.sensors)
        here = [node for node in sensors if node in riding]
        return [sensors.index(node) for node in here], [self.structure.index(riding[n], "housing") for n in here]

    def seen(self, motion: np.ndarray, axis: int = -1) -> np.ndarray:
        """Motion at the sensors, of those on a housing against it, of motions that have coordinates along an axis."""
        motion = np.moveaxis(motion, axis, -1)
        found, (here, housings) = motion[..., self.measured], self._riding
        if here:
            found[..., here] -= motion[..., housings]
        return np.moveaxis(found, -1, axis)

    @cached_property
    def involved(self) -> np.ndarray:
        """Positions (coordinate,), int, of the coordinates that are measured, or that a term depends or acts on."""
        seen = np.zeros(len(self.structure.dofs), bool)
        seen[self.measured] = True
        seen[self._riding[1]] = True
        for entry in (e for _, u in self.acting for e in u.entries):
            row, column, _ = entry.nonzero
            seen[row] = True
            if not entry.is_constant:
                seen[column] = True
        for _, force in self.nonlinear_forces:
            seen |= np.any(force.matrix, axis=0)
        return np.flatnonzero(seen | (self.static_residual != 0))

    @cached_property
    def is_carried(self) -> bool:
        """Whether bearings carry the static load, alone or together with rigid supports."""
        return any(unknown.carries for unknown in self.rotor_unknowns)

    @cached_property
    def static_residual(self) -> np.ndarray:
        """Static load (dof,) that the static deflection does not balance, N; an error if nothing carries it."""
        structure = self.structure
        if self.is_carried or self.held_deflection is not None or structure.is_supported:
            return np.zeros(len(structure.dofs))
        springs = (
            e
            for _, u in self.acting
            for e in u.entries
            if e.reads_motion and not (e.is_conjugate or e.order or e.shift)
        )
        if structure.static_load.any() and not any(springs):
            raise RigError("nothing carries the weight of the rotor; add bearings or rigid supports")
        return structure.static_load
