"""The entries of several amplitudes as one table: the forces of all of them by a few array operations.

What depends neither on the motion nor on the values of the amplitudes is arranged once for a table. The forces are
those that `apply_entries` gives for one amplitude after the other.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.model.entries import Entry, Multiples, harmonics_seen
from rotorstudy.model.terms import Parameter
from rotorstudy.model.variation import kept

SMALL = 3000  # elements of a matrix that is multiplied sooner with its zeros
KEPT = 4  # sets of speeds and harmonics for which the factors of a table are kept


class Elements(NamedTuple):
    """Matrix elements of entries, each (element,): amplitude, kind of entry, place in the matrix, value."""

    unknown: np.ndarray
    kind: np.ndarray
    row: np.ndarray
    column: np.ndarray
    value: np.ndarray


class Pattern(NamedTuple):
    """Entries on the motion that differ in their matrix alone, of which `entry` is one."""

    entry: Entry
    row: np.ndarray  # (element,) int, place in the matrix
    column: np.ndarray  # (element,) likewise
    element: np.ndarray  # (part,) element that an amplitude adds to
    unknown: np.ndarray  # (part,) the amplitude
    weight: np.ndarray  # (part,) what one unit of it adds

    def values(self, theta: np.ndarray) -> np.ndarray:
        """Elements (..., element) of the matrix of all these entries at amplitudes (..., amplitude)."""
        found = np.zeros((*theta.shape[:-1], len(self.row)), complex)
        np.add.at(found, (..., self.element), self.weight * theta[..., self.unknown])
        return found


def multiples_of(unknowns: Sequence[Parameter], motion: Sequence[int]) -> tuple[dict, list[int]]:
    """Positions of the unknowns with Multiples of a (Basis, whether it carries, motion), and of the others."""
    tables, others = {}, []
    for u, (unknown, at) in enumerate(zip(unknowns, motion, strict=True)):
        is_multiple = isinstance(unknown.entries, Multiples)
        own = tables.setdefault((unknown.entries.basis, unknown.carries, at), []) if is_multiple else others
        own.append(u)
    return tables, others


def elements_of(
    unknowns: Sequence[Parameter], motion: Sequence[int], size: int, chosen: Callable[[Parameter, Entry], bool]
) -> tuple[Elements, list[Entry]]:
    """Elements of chosen entries, in columns of motions, their conjugates, constants, and an Entry of each kind."""
    kinds, parts, seen = {}, [], size * (max(motion, default=0) + 1)
    tables, others = multiples_of(unknowns, motion)

    def place(entry, first):
        """Number of its kind, and its first column."""
        k, _ = kinds.setdefault(entry.kind, (len(kinds), entry))
        return k, 2 * seen if entry.is_constant else first + seen * entry.is_conjugate

    for u in others:
        for entry in (e for e in unknowns[u].entries if chosen(unknowns[u], e)):
            parts.append((u, *place(entry, size * motion[u]), *entry.nonzero))
    found = [_in_one(parts)]
    for (basis, _, at), own in tables.items():
        factor = np.array([unknowns[u].entries.factor for u in own])
        factor[:, [not chosen(unknowns[own[0]], entry) for entry in basis.entries]] = 0
        k, first = np.zeros((2, len(basis.entries)), int)
        for i in np.flatnonzero(factor.any(axis=0)):
            k[i], first[i] = place(basis.entries[i], size * at)
        amplitude, entry, row, column, value = basis.elements(factor)
        found.append(Elements(np.array(own)[amplitude], k[entry], row, column + first[entry], value))
    return Elements(*map(np.concatenate, zip(*found, strict=True))), [entry for _, entry in kinds.values()]


def _in_one(parts):
    """Elements of parts (amplitude, kind, first column, rows, columns, values)."""
    numbers = np.array([part[:3] for part in parts], int).reshape(-1, 3)
    unknown, kind, first = np.repeat(numbers, [len(part[3]) for part in parts], axis=0).T
    none = (np.zeros(0, int), np.zeros(0, int), np.zeros(0, complex))
    row, column, value = (np.concatenate(one) for one in zip(none, *(part[3:] for part in parts), strict=True))
    return Elements(unknown, kind, row, column + first, value)


def patterns_of(elements: Elements, kinds: list[Entry], size: int, *, turning: bool) -> list[Pattern]:
    """Pattern of every kind of entry on the motion that rotates with the shaft, or of every one that does not."""
    found = []
    for k, entry in enumerate(kinds):
        if bool(entry.shift) == turning:
            here = elements.kind == k
            place = elements.row[here] * size + elements.column[here] % size
            place, index = np.unique(place, return_inverse=True)
            found.append(Pattern(entry, *np.divmod(place, size), index, elements.unknown[here], elements.value[here]))
    return found


def sparse(value, row, column, shape):
    """Matrix of elements (element,), those at one place added up; sparse unless it is small."""
    if shape[0] * shape[1] > SMALL:
        from scipy.sparse import csr_array

        return csr_array((value, (row, column)), shape)
    found = np.zeros(shape, value.dtype)
    np.add.at(found, (row, column), value)
    return found


def sums(index, count):
    """(count, element) matrix that adds up the elements of the same index."""
    return sparse(np.ones(len(index)), index, np.arange(len(index)), (count, len(index)))


def product(matrix, vectors):
    """Matrix (row, column) times vectors (..., column)."""
    flat = matrix @ vectors.reshape(int(np.prod(vectors.shape[:-1])), vectors.shape[-1]).T
    return flat.T.reshape(*vectors.shape[:-1], matrix.shape[0])


class Columns(NamedTuple):
    """Forces `value` (..., speed, harmonic, place), N, by one unit of the amplitude `unknown` at `row`."""

    row: np.ndarray
    unknown: np.ndarray
    value: np.ndarray

    @classmethod
    def together(cls, parts: Sequence["Columns"]) -> "Columns":
        """Those of all parts."""
        return cls(*(np.concatenate(one, axis=-1) for one in zip(*parts, strict=True)))

    def dense(self, size: int, count: int) -> np.ndarray:
        """(..., speed, harmonic, coordinate, amplitude) of `size` coordinates and `count` amplitudes."""
        whole = np.zeros((*self.value.shape[:-1], size, count), complex)
        whole[..., self.row, self.unknown] = self.value
        return whole


class _Still(NamedTuple):
    """Elements that do not act on the motion, at some speeds and harmonics, of those carried."""

    seen: np.ndarray  # (element,) place in [deflection, its conjugate, 1]
    value: np.ndarray  # (speed, element) complex, with the gain
    harmonic: np.ndarray  # (target,) of the columns that elements add to
    place: np.ndarray  # (target,) in these columns
    to_place: object  # sparse (target, element)


class EntryTable:
    """Entries of amplitudes on `size` coordinates; motion (unknown,) : on which of several motions."""

    def __init__(self, unknowns: tuple[Parameter, ...], size: int, motion: Sequence[int] | None = None):
        self.unknowns, self.size = tuple(unknowns), size
        self.motion = [0] * len(self.unknowns) if motion is None else list(motion)
        self.seen = size * (max(self.motion, default=0) + 1)  # coordinates of all motions

    def columns(self, amplitudes, speed, harmonics, deflection=None) -> Columns:
        """The Columns at harmonics (..., speed, harmonic, motion * coordinate), m, and a static deflection."""
        lead = np.broadcast_shapes(amplitudes.shape[:-3], np.shape(deflection)[:-2])
        amplitudes = np.broadcast_to(amplitudes, (*lead, *amplitudes.shape[-3:]))
        tables, others, rest = self._apart
        if not tables:
            return self._columns(amplitudes, speed, harmonics, deflection)
        still = np.broadcast_to(0.0 if deflection is None else deflection, (*lead, len(speed), self.seen))
        found = rest._columns(amplitudes[..., : rest.seen], speed, harmonics, still[..., : rest.seen])
        found = [found._replace(unknown=others[found.unknown])]
        for (basis, carries, at), unknown in tables.items():
            part = slice(self.size * at, self.size * (at + 1))
            forces = basis.forces(amplitudes[..., part], still[..., part] * (not carries), harmonics)
            along = forces @ np.transpose([self.unknowns[u].entries.factor for u in unknown])
            value = (along[..., None, :] * basis.row[:, None]).reshape(*along.shape[:-1], -1)
            places = np.repeat(basis.here, len(unknown)), np.tile(unknown, len(basis.here))
            found.append(Columns(*places, value))
        return Columns.together(found)

    def _columns(self, amplitudes, speed, harmonics, deflection):
        moving, still = self._of_motion(amplitudes, speed, harmonics), self._at_rest(speed, harmonics, deflection)
        return moving._replace(value=moving.value + still.value)

    def _of_motion(self, amplitudes, speed, harmonics):
        """The Columns of the forces by the motion."""
        kind, column, weights = self._seen
        (factor, source), _ = self._factors(*_key(speed, harmonics))
        motions = np.concatenate([amplitudes, amplitudes.conj()], axis=-1)
        return Columns(*self._places, product(weights, motions[..., source[:, kind], column] * factor[..., kind]))

    def _at_rest(self, speed, harmonics, deflection, constant=True):
        """The Columns of the forces that do not depend on the motion; only what the deflection changes of them."""
        _, still = self._factors(*_key(speed, harmonics))
        deflection = np.zeros(self.seen) if deflection is None else deflection
        deflection = np.broadcast_to(deflection, (*np.shape(deflection)[:-2], len(speed), self.seen))
        one = np.full((*deflection.shape[:-1], 1), float(constant))
        acting = np.concatenate([deflection, deflection.conj(), one], axis=-1)[..., still.seen] * still.value
        value = np.zeros((*acting.shape[:-1], len(harmonics), len(self._places[0])), complex)
        value[..., still.harmonic, still.place] = product(still.to_place, acting)
        return Columns(*self._places, value)

    def dense_columns(self, amplitudes, speed, harmonics, deflection=None) -> np.ndarray:
        """`columns` as (..., speed, harmonic, coordinate, amplitude)."""
        return self.columns(amplitudes, speed, harmonics, deflection).dense(self.size, len(self.unknowns))

    def force_of_motion(self, theta, amplitudes, speed, harmonics) -> np.ndarray:
        """Force harmonics (..., speed, harmonic, coordinate) by the motion, at amplitudes theta (..., amplitude)."""
        return self._total(self._of_motion(amplitudes, speed, harmonics), theta)

    def static_force(self, theta, speed, harmonics, deflection=None, *, constant=True) -> np.ndarray:
        """Force (..., speed, harmonic, coordinate) at rest; only what the deflection changes unless `constant`."""
        return self._total(self._at_rest(speed, harmonics, deflection, constant), theta)

    def _total(self, columns, theta):
        """Force (..., speed, harmonic, coordinate) by amplitudes (..., amplitude) with these Columns."""
        return product(self._to_rows, columns.value * theta[..., None, None, columns.unknown])

    @cached_property
    def _to_rows(self):
        return sums(self._places[0], self.size)

    def reads_deflection(self, harmonics) -> bool:
        """Whether the static deflection changes a force at one of some harmonics."""
        elements, kinds = self._still_elements
        return any(kinds[k].shift in harmonics for k in np.unique(elements.kind[elements.column < 2 * self.size]))

    @cached_property
    def patterns(self) -> list[Pattern]:
        """Pattern of every kind of entry on the motion that does not rotate with the shaft."""
        return patterns_of(*self._moving_elements, self.size, turning=False)

    @cached_property
    def turning_patterns(self) -> list[Pattern]:
        """Pattern of every kind of entry on the motion that rotates with the shaft."""
        return patterns_of(*self._moving_elements, self.size, turning=True)

    @cached_property
    def turned(self) -> np.ndarray:
        """Positions (coordinate,) of the coordinates that turning entries depend or act on."""
        elements, kinds = self._moving_elements
        here = np.array([entry.shift != 0 for entry in kinds], bool)[elements.kind]
        return np.unique(np.concatenate([elements.row[here], elements.column[here] % self.size]))

    @cached_property
    def _apart(self):
        """What `multiples_of` returns, and an EntryTable of the others."""
        tables, others = multiples_of(self.unknowns, self.motion)
        rest = EntryTable([self.unknowns[u] for u in others], self.size, [self.motion[u] for u in others])
        return tables, np.array(others, int), rest

    @cached_property
    def _moving_elements(self):
        """Elements of the entries on the motion, and an Entry of each kind."""
        return elements_of(self.unknowns, self.motion, self.size, lambda _, e: e.reads_motion)

    @cached_property
    def _still_elements(self):
        """Elements of the entries with a part that does not depend on the motion, and an Entry of each kind."""
        return elements_of(
            self.unknowns, self.motion, self.size, lambda u, e: e.is_constant or (e.order == 0 and not u.carries)
        )

    @cached_property
    def _places(self):
        """Row and amplitude (place,) of the forces that are not zero."""
        both = [e.row * len(self.unknowns) + e.unknown for e, _ in (self._moving_elements, self._still_elements)]
        return np.divmod(np.unique(np.concatenate(both)), max(len(self.unknowns), 1))

    def _place_of(self, elements):
        row, unknown = self._places
        known = row * len(self.unknowns) + unknown
        return np.searchsorted(known, elements.row * len(self.unknowns) + elements.unknown)

    @cached_property
    def _seen(self):
        """Kind and column (pair,) of what entries on the motion act on, and sparse weights (place, pair)."""
        elements, _ = self._moving_elements
        pair, index = np.unique(elements.kind * 2 * self.seen + elements.column, return_inverse=True)
        weights = sparse(elements.value, self._place_of(elements), index, (len(self._places[0]), len(pair)))
        return *np.divmod(pair, 2 * self.seen), weights

    @kept(KEPT)
    def _factors(self, speed, harmonics):
        """What `_moving` returns, and the _Still, at speeds and harmonics, both tuples."""
        gains = {}  # (speed, harmonic) of the force, of many kinds the same
        for entry in (entry for _, kinds in (self._moving_elements, self._still_elements) for entry in kinds):
            if (entry.gain, entry.frequency_only) not in gains:
                gains[entry.gain, entry.frequency_only] = entry.gain_at(np.array(speed)[:, None], np.array(harmonics))
        return self._moving(speed, harmonics, gains), self._still(speed, harmonics, gains)

    def _moving(self, speed, harmonics, gains):
        """Factors (speed, harmonic, kind) of entries on the motion, and harmonics (harmonic, kind) they act on."""
        (_, kinds), speed, every = self._moving_elements, np.array(speed)[:, None], np.arange(len(harmonics))
        factor = np.zeros((len(speed), len(harmonics), len(kinds)), complex)
        source = np.zeros((len(harmonics), len(kinds)), int)
        for k, entry in enumerate(kinds):
            here, seen, n = harmonics_seen(entry.shift, entry.is_conjugate, harmonics)
            source[here, k] = every[seen]
            factor[:, here, k] = gains[entry.gain, entry.frequency_only][:, here] * (1j * n * speed) ** entry.order
        return factor, source

    def _still(self, speed, harmonics, gains):
        elements, kinds = self._still_elements
        where = {n: i for i, n in enumerate(harmonics)}
        at = np.array([where.get(entry.shift, -1) for entry in kinds], int)
        gain = [gains[entry.gain, entry.frequency_only][:, i] for entry, i in zip(kinds, at, strict=True)]
        gain = np.array(gain, complex).reshape(-1, len(speed)).T
        kept = at[elements.kind] >= 0
        place, elements = self._place_of(elements)[kept], Elements(*(part[kept] for part in elements))
        target, index = np.unique(at[elements.kind] * len(self._places[0]) + place, return_inverse=True)
        value, targets = gain[:, elements.kind] * elements.value, np.divmod(target, max(len(self._places[0]), 1))
        return _Still(elements.column, value, *targets, sums(index, len(target)))


def _key(speed, harmonics):
    return tuple(np.asarray(speed, float).tolist()), tuple(np.asarray(harmonics).tolist())
