"""How the matrices of a rotor follow relative changes of its numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState

STEP = 1e-7  # relative, of forward differences: errors of a few 1e-7 (d^4) by truncation, 1e-9 by round-off
FAR = 0.5  # relative change at which it is tried whether the matrices are linear
LINEAR = 1e-8  # relative difference up to which they are, by round-off of the slopes


def kept(most):
    """Decorate a method of which the last results, that many, are kept by its arguments."""
    return lambda method: cached_property(lambda self: lru_cache(maxsize=most)(partial(method, self)))


class Matrices(NamedTuple):
    """Mass, stiffness and gyroscopic matrix (..., dof, dof), and static load (..., dof), of a rotor."""

    mass: np.ndarray
    stiffness: np.ndarray
    gyroscopic: np.ndarray
    static_load: np.ndarray


@dataclass(frozen=True, eq=False)
class Variation:
    """Matrices of a rotor at relative changes of `count` numbers, by a function(changes) -> Matrices.

    Modulus, density and masses enter linearly, so that the rotor is built once. With other numbers (lengths, diameters)
    it is built again for every change: the sum of powers of a length is no stiffness that leaves a rigid motion free.
    """

    build: Callable
    count: int

    @cached_property
    def base(self) -> Matrices:
        """Without changes."""
        return self._built((0.0,) * self.count)

    @cached_property
    def slopes(self) -> Matrices:
        """Derivatives (number, dof, dof) and (number, dof) of `base`."""
        return self._differences((0.0,) * self.count)

    @cached_property
    def is_linear(self) -> bool:
        """Whether the matrices are linear in the changes of all numbers together."""
        each = zip(self._built((FAR,) * self.count), self.base, self.slopes, strict=True)
        return all(
            np.abs(far - base - FAR * slope.sum(axis=0)).max() <= LINEAR * np.abs(far).max()
            for far, base, slope in each
        )

    def at(self, change: np.ndarray) -> Matrices:
        """Matrices at relative changes (..., number); NoSteadyState if the plugin builds no rotor of these numbers."""
        return self._linear(change.shape, change.tobytes()) if self.is_linear else _of_each(self._built, change)

    def slopes_at(self, change: np.ndarray) -> Matrices:
        """Their derivatives (..., number, dof, dof) and (..., number, dof) there; raises as `at`."""
        if not self.is_linear:
            return _of_each(self._differences, change)
        return Matrices(*(np.broadcast_to(part, (*change.shape[:-1], *part.shape)) for part in self.slopes))

    @kept(2)  # as a response asks often
    def _linear(self, shape, changes):
        """The Matrices of a linear rotor, not to be changed."""
        change, found = np.frombuffer(changes).reshape(shape), []
        for base, slope in zip(self.base, self.slopes, strict=True):
            found.append(base + (change @ slope.reshape(self.count, -1)).reshape(*shape[:-1], *base.shape))
            found[-1].setflags(write=False)
        return Matrices(*found)

    @kept(16)  # one, and those with each number beside its value
    def _built(self, changes):
        with np.errstate(invalid="ignore"):
            found = self.build(changes)
        if not all(np.isfinite(part).all() for part in found):
            raise NoSteadyState("no rotor with these numbers: its matrices are not finite")
        return found

    @kept(1)  # as a response asks twice
    def _differences(self, changes):
        """The derivatives at some changes."""
        moved = [(*changes[:i], changes[i] + STEP, *changes[i + 1 :]) for i in range(self.count)]
        each = zip(self._built(changes), *map(self._built, moved), strict=True)
        return Matrices(*((np.stack(beside) - here) / STEP for here, *beside in each))


def _of_each(function, changes):
    """Matrices (..., dof, dof) of a function of a tuple, at changes (..., number)."""
    rows = [function(tuple(one)) for one in changes.reshape(-1, changes.shape[-1]).tolist()]
    whole = rows[0] if len(rows) == 1 else map(np.stack, zip(*rows, strict=True))  # one is not copied: it may be large
    return Matrices(*(part.reshape(*changes.shape[:-1], *np.shape(rows[0][i])) for i, part in enumerate(whole)))
