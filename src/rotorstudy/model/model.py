"""A model: base structure, terms on the rotor and on the output, values of their amplitudes, and what follows."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import MissingValue, RigError, RotorstudyError, check_known
from rotorstudy.model.bearings import springs_at_rest
from rotorstudy.model.entry_table import EntryTable
from rotorstudy.model.rig_numbers import is_number, with_bearings_at
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import NonlinearForce, Parameter, Term, share_of
from rotorstudy.model.variation import Matrices, Variation, kept

ROUND_OFF = 1e-9  # relative, of a sum of stiffnesses


class Uncertainty(NamedTuple):
    """Names (parameter,) of amplitudes and their joint covariance (parameter, parameter), in the units of the model."""

    names: tuple[str, ...]
    covariance: np.ndarray


class Varied(NamedTuple):
    """The numbers of the rotor that are parameters: positions (number,) in `rotor_unknowns`, and their Variation."""

    positions: tuple[int, ...]
    variation: Variation


@lru_cache(maxsize=16)  # of models on the same bearings, which differ in their effects
def _with_bearings_at(structure, carrying, values):
    """{term: at (name, value) of the amplitudes that carry load}, no more to be placed, of those that have any."""
    placed = zip(carrying, with_bearings_at(structure, carrying, dict(values)), strict=True)
    return {term: replace(at, is_bearing_number=False) if at.is_bearing_number else at for term, at in placed}


class Assembled:
    """What a Model tells of its amplitudes, and gives to the response, from its fields."""

    @cached_property
    def unknowns(self) -> tuple[Parameter, ...]:
        """Real amplitudes of all terms, in the order of `theta`."""
        return tuple(unknown for term in self.terms for unknown in term.unknowns)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the amplitudes, in the order of `theta`."""
        return tuple(unknown.name for unknown in self.unknowns)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Units of the amplitudes, in the order of `theta`."""
        return tuple(unknown.unit for unknown in self.unknowns)

    @cached_property
    def typical(self) -> np.ndarray:
        """Usual sizes (parameter,) of the amplitudes, in their units."""
        return np.array([unknown.typical for unknown in self.unknowns])

    @cached_property
    def stated(self) -> np.ndarray:
        """Values (parameter,) of the amplitudes in their units, NaN where the rig states none; read-only."""
        found = np.concatenate([np.zeros(0), *(term.theta for term in self.terms)])
        found.setflags(write=False)
        return found

    @cached_property
    def nominal(self) -> np.ndarray:
        """Values (parameter,) of the amplitudes, typical where the rig states none."""
        return np.where(np.isnan(self.stated), self.typical, self.stated)

    def filled(self, names: Iterable[str], values: np.ndarray) -> np.ndarray:
        """Values (..., parameter) of all amplitudes as stated, but for those of some names (..., name)."""
        found = np.broadcast_to(self.stated, (*np.shape(values)[:-1], len(self.stated))).copy()
        found[..., self.position(names)] = values
        return found

    @property
    def unstated(self) -> tuple[str, ...]:
        """Names of the amplitudes of which the rig states no value."""
        return tuple(name for name, value in zip(self.names, self.stated, strict=True) if np.isnan(value))

    @cached_property
    def theta(self) -> np.ndarray:
        """Values (parameter,) of the amplitudes in their units; a missing value is an error."""
        self.require_values()
        return self.stated.copy()

    def require_values(self) -> None:
        """Raise MissingValue, which names them, if amplitudes have no value."""
        if self.unstated:
            raise MissingValue(f"no value for {', '.join(self.unstated)}; give one in the rig file to simulate")

    def position(self, names: Iterable[str]) -> np.ndarray:
        """Positions (name,) of amplitudes in `theta`, int; RotorstudyError for an unknown name."""
        check_known("parameter", names, self._places, "this model")
        return np.array([self._places[name] for name in names], int)

    @cached_property
    def _places(self):
        return {name: place for place, name in enumerate(self.names)}

    def unknown_names(self, wanted: Iterable[str] | None = None) -> tuple[str, ...]:
        """Names of the real amplitudes to estimate: those wanted (without a label, of all), or without a value."""
        if wanted is None:
            if not self.names:
                raise RotorstudyError("the model has no parameters to estimate; add effects or a crack to the rig")
            if not self.unstated:
                known = ", ".join(self.names)
                raise RotorstudyError(f"the rig gives every parameter a value; name the unknowns (among {known})")
            return self.unstated
        found = tuple(name for one in wanted for name in self.amplitudes_of(one) or [one])
        self.position(found)
        return found

    def amplitudes_of(self, parameter: str) -> tuple[str, ...]:
        """Names of the real amplitudes of a parameter, of all terms if it has no label; empty if there is none."""
        found = []
        for term in self.terms:
            for p in term.parameters:
                full = term.full_name(p)
                if parameter in (p.name, full):
                    found += [f"{full}_real", f"{full}_imag"] if p.is_complex else [full]
        return tuple(found)

    def reported_units(self, names: Iterable[str]) -> list[str]:
        """Units of amplitudes as `magnitude_and_phase` names them: a magnitude has its own, a phase rad."""
        known = dict(zip(self.names, self.units, strict=True))
        return ["rad" if n.endswith("_phase") else known.get(n, known.get(f"{n}_real")) for n in names]

    def acting_alike(self, unknown: Parameter, on_output: bool) -> dict[str, float]:
        """{name: factor} of the amplitudes that act as an unknown does, so that they add up."""
        if unknown.force or not unknown.entries:
            return {}
        there = self.output_unknowns if on_output else self.rotor_unknowns
        shares = {known.name: share_of(unknown, known) for known in there if unknown.kinds <= known.kinds}
        return {name: share for name, share in shares.items() if share > 0}

    def least_possible(self, theta: np.ndarray) -> dict[str, float]:
        """Least value of a size, of a number, and of what cannot be negative, together with what acts alike at values.

        theta : (parameter,) values;  what the rig states as negative has no least value
        """
        values, stated = (dict(zip(self.names, known, strict=True)) for known in (theta, self.stated))
        found = {}
        for term in self.terms:
            found |= {term.full_name(p): 0.0 for p in term.parameters if p.is_complex}
            for one in term.unknowns:
                if one.positive and not stated[one.name] < 0:
                    alike = self.acting_alike(one, term.acts_on_output)
                    found[one.name] = -sum(share * values[n] for n, share in alike.items() if n != one.name)
                elif is_number(one.name):
                    found[one.name] = -1.0
        return found

    @cached_property
    def rotor_unknowns(self) -> tuple[Parameter, ...]:
        """Amplitudes of the terms that act on the rotor, first in `theta`."""
        return tuple(u for term in self.terms if not term.acts_on_output for u in term.unknowns)

    @cached_property
    def couplings(self) -> frozenset[tuple[bool, int]]:
        """(whether with its conjugate, shift) of the entries by which the rotor couples harmonics of its motion."""
        return frozenset((e.is_conjugate, e.shift) for u in self.rotor_unknowns for e in u.unscaled if e.reads_motion)

    @cached_property
    def varied(self) -> Varied | None:
        """The numbers of the rotor that are parameters; None if all are known."""
        for term in self.terms:
            if term.variation:
                first = self.names.index(term.unknowns[0].name)
                return Varied(tuple(range(first, first + len(term.unknowns))), term.variation)
        return None

    @cached_property
    def acting(self) -> tuple[tuple[int, Parameter], ...]:
        """(position in `rotor_unknowns`, Parameter) of the amplitudes of effects, cracks and bearings."""
        own = self.varied.positions if self.varied else ()
        return tuple((p, unknown) for p, unknown in enumerate(self.rotor_unknowns) if p not in own)

    @cached_property
    def table(self) -> EntryTable:
        """The EntryTable of the amplitudes in `acting`."""
        return EntryTable(tuple(unknown for _, unknown in self.acting), len(self.structure.dofs))

    @cached_property
    def output_table(self) -> tuple[list[int], EntryTable]:
        """Positions in `theta` and EntryTable of the amplitudes that the measured output is linear in."""
        linear = [(p, u) for p, u in enumerate(self.output_unknowns, start=len(self.rotor_unknowns)) if not u.exact]
        return [p for p, _ in linear], EntryTable(tuple(u for _, u in linear), len(self.sensors))

    def matrices(self, theta: np.ndarray) -> Matrices:
        """Matrices of the rotor at amplitudes (..., parameter); without leading dimensions if no number is one."""
        if self.varied is None:
            return self.structure.matrices
        return self.varied.variation.at(theta[..., self.varied.positions])

    def at(self, theta=None):
        """The model with the bearings that it has at amplitudes (parameter,), by default its own, and these.

        Bearings are not linear in their numbers: they are built anew, and the numbers are zero, with derivatives.
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
        names = {u.name for term in self.terms if term.is_bearing_number for u in term.unknowns if u.carries}
        return tuple(p for p, name in enumerate(self.names) if name in names)

    @kept(4)
    def _placed(self, values):
        """The Model with its bearings at (name, value) of the amplitudes that carry load."""
        carrying = tuple(term for term in self.terms if any(unknown.carries for unknown in term.unknowns))
        placed = _with_bearings_at(self.structure, carrying, values)
        found, given = replace(self, terms=tuple(placed.get(term, term) for term in self.terms)), dict(values)
        loading = (u for _, u in self.acting if u.carries)
        forces = ((given[u.name], e) for u in loading for e in u.entries if e.is_constant and not e.gain)
        force = sum((size * np.asarray(e.matrix) for size, e in forces), self.constant_force)
        found.__dict__["constant_force"] = force
        found.__dict__["output_table"] = self.output_table  # bearings do not act on the output
        return found

    @cached_property
    def constant_force(self) -> np.ndarray:
        """Force (dof,), N, of the constant forces that load films, once the films are those at their load."""
        return np.zeros(len(self.structure.dofs))

    @cached_property
    def earlier(self):
        """The machine in the earlier state from whose displacements the sensors count; None if there is none."""
        if self.before is None:
            return None
        there = tuple(term for term in self.terms if all(unknown.name in self.before for unknown in term.unknowns))
        return replace(self, terms=there, before=None)

    @cached_property
    def at_rest(self):
        """The Model of the rotor on the springs of its bearings alone, and positions of its amplitudes in `theta`."""
        own = [term for term in self.terms if term.variation]
        carrying = [(p, unknown) for p, unknown in enumerate(self.rotor_unknowns) if unknown.carries]
        springs = tuple(replace(u, entries=u.springs) for _, u in carrying)
        places = [*(self.varied.positions if self.varied else ()), *(p for p, _ in carrying)]
        return replace(self, terms=(*own, Term("springs", springs)), before=None), places

    @cached_property
    def nonlinear_forces(self) -> tuple[tuple[int, NonlinearForce], ...]:
        """(position in `rotor_unknowns`, NonlinearForce) of the amplitudes that multiply a force in time."""
        return tuple((p, u.force) for p, u in enumerate(self.rotor_unknowns) if u.force)

    @cached_property
    def output_unknowns(self) -> tuple[Parameter, ...]:
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
    def is_carried(self) -> bool:
        """Whether bearings carry the static load, alone or together with rigid supports."""
        return any(unknown.carries for unknown in self.rotor_unknowns)

    @cached_property
    def static_residual(self) -> np.ndarray:
        """Static load (dof,) that the static deflection does not balance, N; an error if nothing carries it."""
        structure = self.structure
        if self.is_carried or self.held_deflection is not None or structure.is_supported:
            return np.zeros(len(structure.dofs))
        along, acting = structure.along, (term for term in self.terms if not term.acts_on_output)
        springs = sum((springs_at_rest(structure, term)[0, :, 0] for term in acting), 0 * structure.mass)
        held, largest = along @ springs @ along, np.abs(np.diag(springs) * along).max(initial=0.0)
        is_held = held > ROUND_OFF * largest  # damping of the shaft does not hold it
        if structure.static_load.any() and not is_held:
            raise RigError("nothing carries the weight of the rotor; add bearings or rigid supports")
        return structure.static_load


@dataclass(frozen=True, eq=False)  # hashed by identity, so that what follows from a model can be kept
class Model(Assembled):
    """Structure and terms; displacements are measured from the static deflection (see `statics`), unless stated.

    sensors : nodes where the translation is measured (all by default)
    held_deflection : (dof,) or (..., speed, dof) prescribed static deflection, m, instead of the computed one
    uncertainty : covariance of the values of some amplitudes, if stated
    from_unloaded_line : whether the sensors count from the unloaded line, so that they show the static deflection too
    before : names of the amplitudes that act in the earlier state of the machine from whose displacements the sensors
             count, in a comparison of two states; None if they count from rest
    theta   : (parameter,) real amplitudes in the order of `names`, rotor terms first, then output terms
    """

    structure: Structure
    terms: tuple[Term, ...] = ()
    sensors: tuple[int, ...] = ()
    held_deflection: np.ndarray | None = None
    uncertainty: Uncertainty | None = None
    from_unloaded_line: bool = False
    before: frozenset[str] | None = None

    def __post_init__(self):
        if not self.sensors:
            object.__setattr__(self, "sensors", self.structure.nodes)
        for node in self.sensors:
            self.structure.index(node)
        object.__setattr__(self, "terms", tuple(sorted(self.terms, key=lambda term: term.acts_on_output)))
        if len(set(self.names)) < len(self.names):
            doubled = [name for name in self.names if self.names.count(name) > 1]
            raise RigError(f"two items share the parameter {doubled[0]!r}; give each its own 'label:'")

    def without(self, kinds: Iterable[str]) -> "Model":
        """The model without the terms of some kinds.

        Parameters
        ----------
        kinds : names
            Of plugins.

        Returns
        -------
        Model
        """
        return replace(self, terms=tuple(term for term in self.terms if term.kind not in kinds))

    def plus(self, *terms: Term) -> "Model":
        """The model extended by terms.

        Parameters
        ----------
        *terms : Term
            To be added.

        Returns
        -------
        Model

        Raises
        ------
        RigError
            For a term that was made for a rotor with another number of coordinates.
        """
        of_rotor = (term for term in terms if not term.acts_on_output)
        sizes = {np.shape(e.matrix)[0] for term in of_rotor for u in term.unknowns for e in u.unscaled}
        if sizes - {len(self.structure.mass)}:
            raise RigError(
                f"a term for a rotor of {max(sizes - {len(self.structure.mass)})} coordinates, and this one has "
                f"{len(self.structure.mass)}; make it for this rotor's structure"
            )
        found = replace(self, terms=self.terms + terms)
        if self.before is not None and not any(u.name in self.before for term in terms for u in term.unknowns):
            found.__dict__["earlier"] = self.earlier  # the same machine, whose tables are then formed once
        return found
