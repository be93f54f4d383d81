"""The amplitudes of a model: their names, units and values, and which of them are to be estimated."""

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from rotorstudy.errors import MissingValue, RotorstudyError, unknown_name
from rotorstudy.model.terms import Term, Unknown


class Amplitudes:
    """What a Model tells about the amplitudes of its terms."""

    terms: tuple[Term, ...]

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
