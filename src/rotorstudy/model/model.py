"""A model: base structure, terms on the rotor and on the output, and the values of their amplitudes."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RigError
from rotorstudy.model.assembled import Assembled
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Term


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
