"""A model: base structure, terms on the rotor and on the output, and the values of their amplitudes."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import MissingValue, RigError, RotorstudyError, unknown_name
from rotorstudy.model.assembled import Assembled
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Term, Unknown


class Uncertainty(NamedTuple):
    """Names (parameter,) of amplitudes and their joint covariance (parameter, parameter), in the units of the model."""

    names: tuple[str, ...]
    covariance: np.ndarray


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
        ordered = sorted(self.terms, key=lambda term: term.acts_on_output)
        object.__setattr__(self, "terms", tuple(ordered))
        if len(set(self.names)) < len(self.names):
            doubled = [name for name in self.names if self.names.count(name) > 1]
            raise RigError(f"two terms share the amplitude {doubled[0]!r}; give each its own 'label:'")

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
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
        for name in names:
            if name not in self._places:
                raise unknown_name("parameter", name, self.names, "this model")
        return np.array([self._places[name] for name in names], int)

    @cached_property
    def _places(self):
        return {name: place for place, name in enumerate(self.names)}

    def unknown_names(self, wanted: Iterable[str] | None = None) -> tuple[str, ...]:
        """Names of the real amplitudes to estimate: those wanted, by default those without a value.

        The name of a complex amplitude stands for its two parts, a name without a label for all labels.
        """
        if wanted is None:
            if not self.names:
                raise RotorstudyError("the model has no parameters to estimate; add effects or a crack to the rig")
            if not self.unstated:
                raise RotorstudyError(
                    f"the rig gives every parameter a value; name the unknowns (among {', '.join(self.names)})"
                )
            return self.unstated
        found = []
        for name in wanted:
            found += self.amplitudes_of(name) or [name]
        self.position(found)
        if len(set(found)) < len(found):
            raise RotorstudyError(f"unknowns {list(wanted)}: a parameter is named twice")
        return tuple(found)

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
        """
        found = replace(self, terms=self.terms + terms)
        if self.before is not None and not any(u.name in self.before for term in terms for u in term.unknowns):
            found.__dict__["earlier"] = self.earlier  # the same machine, whose tables are then formed once
        return found
