"""Entries of the table of an effect: the equation of one entry, and the force of several at a motion.

With complex nodal coordinates q (z = u_x + j u_y, tilt dz/ds), spin speed w and harmonics q_n of e^{jnwt}
(n > 0 forward, n < 0 backward), a parameter theta adds to the right-hand side of the equations of motion

    theta * sum over entries of   e^{j*shift*w*t} * gain(w) * matrix @ (d/dt)^order x,

x = q, conj(q), 1, or the static deflection or its conjugate.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError

LARGE = 60  # coordinates from which on a matrix is kept as its elements


class LocalMatrix:
    """A matrix or vector by its few elements that are not zero; numpy takes it as an array."""

    __array_priority__ = 1.0  # of a product with a number of numpy, which would make an array of it

    def __init__(self, shape: tuple[int, ...], elements: tuple[np.ndarray, np.ndarray, np.ndarray]):
        self.shape, self.ndim, self.elements = shape, len(shape), elements

    def __array__(self, dtype=None, copy=None):
        row, column, value = self.elements
        dense = np.zeros(self.shape, value.dtype if dtype is None else dtype)
        dense[(row, column)[: self.ndim]] = value
        return dense

    def __getitem__(self, place):
        return np.asarray(self)[place]

    def __mul__(self, factor):
        if getattr(factor, "ndim", 0):
            return factor * np.asarray(self)
        row, column, value = self.elements
        return LocalMatrix(self.shape, (row, column, factor * value))

    __rmul__ = __mul__

    def __add__(self, other):
        mine, others = self.elements[:2], getattr(other, "elements", ())[:2]
        if others and all(a is b or np.array_equal(a, b) for a, b in zip(mine, others, strict=True)):
            return LocalMatrix(self.shape, (*self.elements[:2], self.elements[2] + other.elements[2]))
        return np.asarray(self) + np.asarray(other)

    __radd__ = __add__

    def __neg__(self):
        return self * -1.0

    def __truediv__(self, divisor):
        return self * (1 / divisor)

    def __matmul__(self, vector):
        return np.asarray(self) @ vector


def outer(row: np.ndarray) -> np.ndarray | LocalMatrix:
    """Matrix (dof, dof) of a force along a row of coordinates (dof,) by the motion along it."""
    return np.outer(row, row) if len(row) < LARGE else local_outer(row)


def local_outer(row: np.ndarray) -> LocalMatrix:
    """`outer` as its elements, whatever its size."""
    here = np.flatnonzero(row)
    places = np.repeat(here, len(here)), np.tile(here, len(here))
    return LocalMatrix((len(row), len(row)), (*places, np.outer(row[here], row[here]).ravel()))


class Evaluated:
    """What follows from the fields of an Entry."""

    @property
    def reads_motion(self) -> bool:
        """Whether the force depends on the motion."""
        return self.on in ("z", "conj")

    @property
    def is_constant(self) -> bool:
        """Whether the force depends neither on the motion nor on the static deflection."""
        return self.on == "one"

    @cached_property
    def is_conjugate(self) -> bool:
        """Whether it acts on the conjugate, of the motion or of the static deflection."""
        return self.on.endswith("conj")

    @cached_property
    def kind(self) -> tuple:
        """All but its matrix; equal for entries whose matrices may be added."""
        return self.on, self.order, self.shift, self.gain, self.frequency_only

    @cached_property
    def nonzero(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns (0 of a vector) and values (element,) of the elements that are not zero."""
        if isinstance(self.matrix, LocalMatrix):
            return self.matrix.elements
        matrix = np.asarray(self.matrix).reshape(len(self.matrix), -1)
        row, column = np.nonzero(matrix)
        return row, column, matrix[row, column]

    def gain_at(self, speed: np.ndarray, harmonic: np.ndarray) -> np.ndarray:
        """Gain at speeds, rad/s, and harmonics broadcast with them; PluginError if of another shape or not finite."""
        shape = np.broadcast_shapes(np.shape(speed), np.shape(harmonic))
        if self.gain is None:
            return np.ones(shape)
        speed = np.asarray(speed, float)
        if self.frequency_only:
            speed, harmonic = np.broadcast_arrays(speed, np.asarray(harmonic))
        found = self.gain(speed, harmonic) if self.frequency_only else self.gain(speed)
        try:
            found = found + 0 * speed
        except TypeError:
            self._refuse_gain(found, speed)
        if np.shape(found) != speed.shape or not np.isfinite(found).all():
            self._refuse_gain(found, speed)
        return np.broadcast_to(found, shape)

    def _refuse_gain(self, found, speed):
        """Raise for a gain of a wrong shape or that is not finite, with the file and line of its function."""
        code = getattr(self.gain, "__code__", None)
        who = f"the gain of an entry ({code.co_filename}:{code.co_firstlineno})" if code else f"the gain {self.gain!r}"
        if np.asarray(found).dtype.kind not in "biufc":
            raise PluginError(f"{who} gives {type(found).__name__}; it must give numbers")
        if np.shape(found) != speed.shape:
            raise PluginError(f"{who} has shape {np.shape(found)} for speeds of shape {speed.shape}; give that one")
        at = ", ".join(f"{w:g}" for w in np.unique(speed[~np.isfinite(found)])[:3])
        raise PluginError(f"{who} is not finite at {at} rad/s")

    def times(self, factor: complex):
        """The same entry with its matrix multiplied by a factor."""
        is_local = isinstance(self.matrix, LocalMatrix)
        return replace(self, matrix=factor * (self.matrix if is_local else np.asarray(self.matrix)))


@dataclass(frozen=True)
class Entry(Evaluated):
    """One product e^{j*shift*w*t} * gain(w) * matrix @ (d/dt)^order x.

    matrix : (dof, dof) acting on the coordinates, or (dof,) where `on` is "one"
    on     : "z" the coordinates, "conj" their complex conjugates, "one" the constant 1, "static" the static deflection,
             "static conj" its complex conjugate (weight-dominant effects)
    gain   : function of the spin speed in rad/s (array in, array out); of (speed, harmonic) if `frequency_only`
    frequency_only : True if the effect has no time-domain form (hysteretic damping, a measured receptance)
    """

    matrix: np.ndarray
    on: Literal["z", "conj", "one", "static", "static conj"] = "z"
    order: int = 0
    shift: int = 0
    gain: Callable | None = None
    frequency_only: bool = False


class Basis:
    """Entries of which those of several amplitudes are multiples; see `Multiples`.

    They are forces along a row of coordinates (dof,), at some shifts of each kind: a stiffness times the motion along
    that row, times its conjugate, and a constant load.
    """

    def __init__(self, row: np.ndarray, stiffness: float, load: float, shifts: Sequence[int]):
        self.whole_row, self._stiffness, self._load = row, stiffness, load
        self.here, self.shifts = np.flatnonzero(row), np.array(shifts)
        self.row = row[self.here]
        self.kinds = [(on, 0, int(shift)) for on in ("z", "conj", "one") for shift in shifts]

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """One of each kind; most shapes of a cause are judged without them, by `forces`."""
        pattern = self._stiffness * local_outer(self.whole_row)
        own = LocalMatrix(self.whole_row.shape, (self.here, 0 * self.here, self._load * self.row))
        return tuple(Entry(own if on == "one" else pattern, on=on, shift=shift) for on, _, shift in self.kinds)

    @cached_property
    def _parts(self):
        """(entry,) count of elements of the entries and the first one of each, and their rows, columns and values."""
        parts = [entry.nonzero for entry in self.entries]
        count = np.array([len(row) for row, _, _ in parts])
        return count, np.cumsum(count) - count, [np.concatenate(part) for part in zip(*parts, strict=True)]

    def elements(self, factor: np.ndarray) -> tuple[np.ndarray, ...]:
        """Amplitude, entry, row, column and value (element,) of the multiples by factors (amplitude, entry)."""
        amplitude, entry = factor.nonzero()
        counts, first, elements = self._parts
        count = counts[entry]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        amplitude, entry = np.repeat(amplitude, count), np.repeat(entry, count)
        row, column, value = (part[first[entry] + within] for part in elements)
        return amplitude, entry, row, column, factor[amplitude, entry] * value

    def forces(self, amplitudes, deflection, harmonics) -> np.ndarray:
        """Force (..., speed, harmonic, entry) along the row by each entry, at a motion (..., speed, harmonic, dof), m.

        deflection : (..., speed, dof), m, not in `amplitudes`
        """
        harmonics = np.asarray(harmonics)
        reach = np.abs(harmonics).max() + np.abs(self.shifts).max()
        at_rest = deflection[..., self.here] @ self.row
        moving = np.zeros((*at_rest.shape, 2 * reach + 1), complex)  # from the harmonic -reach on
        moving[..., reach + harmonics] = amplitudes[..., self.here] @ self.row
        moving[..., reach] += at_rest
        moving, source = self._stiffness * moving, harmonics[:, None] - self.shifts
        loaded = np.broadcast_to(self._load * (source == 0), (*at_rest.shape, *source.shape))
        return np.concatenate([moving[..., reach + source], moving[..., reach - source].conj(), loaded], axis=-1)


class Multiples(Sequence):
    """A table of entries that are multiples of those of a Basis, but for those of which the factor is zero.

    So the tables of a crack of any depth at any angle share those of its position.

    factor : (entry,) complex
    """

    def __init__(self, basis: Basis, factor: np.ndarray):
        self.basis, self.factor = basis, factor

    @property
    def unscaled(self) -> list[Entry]:
        """The entries without their factors."""
        return [self.basis.entries[i] for i in self.factor.nonzero()[0].tolist()]

    @property
    def kinds(self) -> list[tuple]:
        """On, order and shift of each."""
        return [self.basis.kinds[i] for i in self.factor.nonzero()[0].tolist()]

    @cached_property
    def _entries(self):
        return tuple(e.times(x) for e, x in zip(self.unscaled, self.factor[self.factor != 0], strict=True))

    def __len__(self):
        return np.count_nonzero(self.factor)

    def __getitem__(self, place):
        return self._entries[place]

    def __add__(self, others):
        return (*self, *others) if others else self


def unscaled(entries: Sequence[Entry]) -> Sequence[Entry]:
    """The entries of a table, but for factors of their matrices."""
    return entries.unscaled if isinstance(entries, Multiples) else entries


def on_real_parts(on_z: np.ndarray, on_conj: np.ndarray) -> np.ndarray:
    """Matrix (..., 2 row, 2 column) from real, then imaginary parts of z to those of on_z z + on_conj conj(z)."""
    plus, minus = on_z + on_conj, on_z - on_conj
    return np.block([[plus.real, -minus.imag], [plus.imag, minus.real]])


def compacted(entry):
    """The same entry with a large matrix as a LocalMatrix: a search has many, each at one place of a long shaft."""
    shape = np.shape(entry.matrix)
    return replace(entry, matrix=LocalMatrix(shape, entry.nonzero)) if shape[0] >= LARGE else entry


def planar_entries(direction, matrix, order=0, gain=None, *, frequency_only=False):
    """Entries of the force along a due to the motion along b, for direction "ab": "xx", "xy", "yx" or "yy".

    They follow from x = (z + conj z) / 2 and y = (z - conj z) / 2j; the matrix (dof, dof) is real. A complex gain of
    (speed, harmonic) must be conjugate at -harmonic, so that the force is real.
    """
    on_z, on_conj = {"xx": (0.5, 0.5), "xy": (-0.5j, 0.5j), "yx": (0.5j, 0.5j), "yy": (0.5, -0.5)}[direction]
    return (
        Entry(on_z * matrix, order=order, gain=gain, frequency_only=frequency_only),
        Entry(on_conj * matrix, on="conj", order=order, gain=gain, frequency_only=frequency_only),
    )


def film_entries(unit, coefficients, angle=0.0):
    """Entries of a bearing whose stiffness and damping depend on the speed; no film at rest is an error.

    unit         : (dof,) one at its coordinate
    coefficients : function(speed, rad/s) -> (2, 2) stiffness and (2, 2) damping, N/m and N s/m, of a load along x
    angle        : of the load from x, rad
    """
    here, turn = -outer(unit), np.exp(2j * angle)

    @lru_cache(maxsize=4096)
    def gains(speed):
        """Of the motion and of its conjugate, by order; complex, so that the four directions are one entry."""
        if not speed > 0:
            raise RotorstudyError(f"speed {speed:g} rad/s: a journal must rotate to have a film")
        return [
            ((xx + yy + 1j * (yx - xy)) / 2, turn * (xx - yy + 1j * (yx + xy)) / 2)
            for (xx, xy), (yx, yy) in (np.asarray(part).tolist() for part in coefficients(speed))
        ]

    def gain(order, conjugate):
        return lambda speed: np.reshape([gains(w)[order][conjugate] for w in np.ravel(speed).tolist()], np.shape(speed))

    pairs = ((order, conjugate) for order in (0, 1) for conjugate in (False, True))
    return tuple(Entry(here, "conj" if other else "z", order, gain=gain(order, other)) for order, other in pairs)


def apply_entries(entries, amplitudes, speed, harmonics, reference=None):
    """Force harmonics (..., speed, harmonic, row), N per unit of the amplitude, of the entries of an effect.

    reference : static deflection (dof,) or (..., speed, dof), not in `amplitudes`; None if it has no force
    """
    order, speed = tuple(np.asarray(harmonics).tolist()), np.asarray(speed, float)[:, None]
    lead = np.broadcast_shapes(amplitudes.shape[:-3], np.shape(reference)[:-2])
    rows = np.shape(entries[0].matrix)[0] if entries else amplitudes.shape[-1]
    force = np.zeros((*lead, *amplitudes.shape[-3:-1], rows), complex)
    for entry in entries:
        matrix, here = np.asarray(entry.matrix).T, [n == entry.shift for n in order]
        if entry.reads_motion:
            row, column, n = harmonics_seen(entry.shift, entry.is_conjugate, order)
            seen = amplitudes[..., column, :]
            factor = entry.gain_at(speed, np.array(order)[row]) * (1j * n * speed) ** entry.order
            if len(entry.nonzero[0]) == 1:  # of one coordinate
                (i,), (j,), (value,) = entry.nonzero
                seen = seen[..., j].conj() if entry.is_conjugate else seen[..., j]
                force[..., row, i] += value * factor * seen
            else:
                seen = factor[..., None] * (seen.conj() if entry.is_conjugate else seen)
                flat = seen.reshape(-1, len(matrix)) @ matrix  # faster than a product for each speed
                force[..., row, :] += flat.reshape(*seen.shape[:-1], rows)
        if entry.is_constant or (reference is not None and entry.order == 0):
            still = np.conj(reference) if entry.is_conjugate else reference
            at_rest = entry.gain_at(speed, entry.shift) * (matrix if entry.is_constant else still @ matrix)
            force[..., here, :] += at_rest[..., None, :]
    return force


@lru_cache(maxsize=4096)
def harmonics_seen(shift: int, mirrored: bool, harmonics: tuple[int, ...]):
    """Positions (slice or array) of force harmonics and of the motion harmonics they depend on, and the latter."""
    source = np.array(harmonics) - shift
    where = {n: i for i, n in enumerate(harmonics)}
    pairs = [(i, where[n]) for i, n in enumerate((-source if mirrored else source).tolist()) if n in where]
    row, column = np.array(pairs, int).reshape(-1, 2).T
    every = slice(0, len(harmonics))
    if len(row) == len(harmonics) and (row == column).all():
        return every, every, source
    return row, column, source[row]
