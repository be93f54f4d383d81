"""How the matrices of a rotor follow relative changes of its numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState, RotorstudyError

STEP = 1e-7  # relative, of forward differences: errors of a few 1e-7 (d^4) by truncation, 1e-9 by round-off
FAR = 0.5  # relative change at which it is tried whether the matrices are linear
LINEAR = 1e-8  # relative difference up to which they are, by round-off of the slopes


def kept(most):
    """Decorate a method whose last results are kept by its arguments; most : a number, or a function of the object."""

    def of(method):
        def bound(self):
            return lru_cache(maxsize=most(self) if callable(most) else most)(partial(method, self))

        return cached_property(bound)

    return of


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
    def base(self) -> np.ndarray:
        """(component,) matrices and load without changes, one after the other."""
        return self._built((0.0,) * self.count)

    @cached_property
    def slopes(self) -> np.ndarray:
        """(number, component) derivatives of `base`."""
        return self._differences((0.0,) * self.count)

    @cached_property
    def is_linear(self) -> bool:
        """Whether the matrices are linear in the changes of all numbers together."""
        far = self._built((FAR,) * self.count)
        off = _unpacked(far - self.base - FAR * self.slopes.sum(axis=0))
        return all(np.abs(a).max() <= LINEAR * np.abs(b).max() for a, b in zip(off, _unpacked(far), strict=True))

    def at(self, change: np.ndarray) -> Matrices:
        """Matrices at relative changes (..., number); NoSteadyState if the plugin builds no rotor of these numbers."""
        if self.is_linear:
            return self._linear(change.shape, change.tobytes())
        return _unpacked(_of_each(self._built, change))

    def slopes_at(self, change: np.ndarray) -> Matrices:
        """Their derivatives (..., number, dof, dof) and (..., number, dof) there; raises as `at`."""
        if self.is_linear:
            return _unpacked(np.broadcast_to(self.slopes, (*change.shape[:-1], *self.slopes.shape)))
        return _unpacked(_of_each(self._differences, change))

    @kept(2)  # as a response asks often
    def _linear(self, shape, changes):
        """The Matrices of a linear rotor, not to be changed."""
        found = self.base + np.frombuffer(changes).reshape(shape) @ self.slopes
        found.setflags(write=False)
        return _unpacked(found)

    @kept(lambda self: 4 + 2 * self.count)
    def _built(self, changes):
        """The components (component,) of a rotor."""
        try:
            with np.errstate(invalid="ignore"):
                found = np.concatenate([part.ravel() for part in self.build(changes)])
            if not np.isfinite(found).all():
                raise RotorstudyError("its matrices are not finite")
        except RotorstudyError as error:
            raise NoSteadyState(f"no rotor with these numbers: {error}") from None
        found.setflags(write=False)
        return found

    @kept(1)  # as a response asks twice
    def _differences(self, changes):
        """The derivatives (number, component) at some changes."""
        moved = [(*changes[:i], changes[i] + STEP, *changes[i + 1 :]) for i in range(self.count)]
        found = np.array([self._built(one) for one in moved])
        found -= self._built(changes)
        found /= STEP
        found.setflags(write=False)
        return found


def _of_each(function, changes):
    """(..., value) of a function of a tuple, at changes (..., number)."""
    rows = [function(tuple(one)) for one in changes.reshape(-1, changes.shape[-1]).tolist()]
    whole = rows[0] if len(rows) == 1 else np.array(rows)  # one is not copied, as it may be large
    return whole.reshape(*changes.shape[:-1], *rows[0].shape)


def _unpacked(components):
    """The Matrices of components (..., component): three matrices and a vector."""
    size = round((np.sqrt(12 * components.shape[-1] + 1) - 1) / 6)
    square = [components[..., i * size**2 : (i + 1) * size**2] for i in range(3)]
    return Matrices(*(part.reshape(*part.shape[:-1], size, size) for part in square), components[..., 3 * size**2 :])
