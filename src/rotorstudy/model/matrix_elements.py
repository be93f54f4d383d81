"""The elements of the matrices of entries, gathered over several amplitudes, and sums over them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.model.entries import Entry
from rotorstudy.model.terms import Unknown


class Elements(NamedTuple):
    """Matrix elements of entries, each (element,): amplitude, kind of entry, place in the matrix, value."""

    unknown: np.ndarray
    kind: np.ndarray
    row: np.ndarray
    column: np.ndarray
    value: np.ndarray


class Pattern(NamedTuple):
    """Entries on the motion that differ in their matrix alone, of which `entry` is one.

    row, column : (element,) int, places in the matrix
    element, unknown, weight : (part,) what one unit of an amplitude adds to an element
    """

    entry: Entry
    row: np.ndarray
    column: np.ndarray
    element: np.ndarray
    unknown: np.ndarray
    weight: np.ndarray

    def values(self, theta: np.ndarray) -> np.ndarray:
        """Elements (..., element) of the matrix of all these entries at amplitudes (..., amplitude)."""
        found = np.zeros((*theta.shape[:-1], len(self.row)), complex)
        np.add.at(found, (..., self.element), self.weight * theta[..., self.unknown])
        return found


def elements_of(
    unknowns: Sequence[Unknown], motion: Sequence[int], size: int, chosen: Callable[[Unknown, Entry], bool]
) -> tuple[Elements, list[Entry]]:
    """Elements of the chosen entries of amplitudes, and an Entry of each kind; motion (unknown,) as of EntryTable.

    Columns are those of the motions one after another, of their conjugates, and of constants.
    """
    kinds, found, seen = {}, [], size * (max(motion, default=0) + 1)
    for u, unknown in enumerate(unknowns):
        first = size * motion[u]
        for entry in (e for e in unknown.entries if chosen(unknown, e)):
            k, _ = kinds.setdefault(entry.kind, (len(kinds), entry))
            found.append((u, k, 2 * seen if entry.is_constant else first + seen * entry.is_conjugate))
            found[-1] += entry.nonzero
    if not found:
        none = np.zeros(0, int)
        return Elements(none, none, none, none, np.zeros(0, complex)), []
    unknown, kind, first, row, column, value = zip(*found, strict=True)
    count = [len(one) for one in row]
    unknown, kind, first = (np.repeat(part, count) for part in (unknown, kind, first))
    row, column, value = map(np.concatenate, (row, column, value))
    elements = Elements(unknown, kind, row, column + first, value.astype(complex))
    return elements, [entry for _, entry in kinds.values()]


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


def same_but_gains(unknowns: Sequence[Unknown], others: Sequence[Unknown]) -> dict | None:
    """{kind: Entry of the other kind}, one to one, if the entries of two lists differ in gains alone, else None."""
    if [(u.carries, len(u.entries)) for u in unknowns] != [(u.carries, len(u.entries)) for u in others]:
        return None
    found = {}
    for entry, other in zip(
        (e for u in unknowns for e in u.entries), (e for u in others for e in u.entries), strict=True
    ):
        if entry is not other:
            on, order, shift, _, frequency_only = entry.kind
            alike = other.kind == (on, order, shift, other.gain, frequency_only)
            if not alike or not (entry.matrix is other.matrix or np.array_equal(entry.matrix, other.matrix)):
                return None
        if found.setdefault(entry.kind, other).kind != other.kind:
            return None
    return found if len({other.kind for other in found.values()}) == len(found) else None


def sparse(value, row, column, shape):
    """Sparse matrix of elements (element,), those at one place added up."""
    from scipy.sparse import csr_array

    return csr_array((value, (row, column)), shape)


def sums(index, count):
    """Sparse (count, element) matrix that adds up the elements of the same index."""
    from scipy.sparse import csc_array

    return csc_array((np.ones(len(index)), index, np.arange(len(index) + 1)), (count, len(index)))


def product(matrix, vectors):
    """Sparse matrix (row, column) times vectors (..., column)."""
    flat = matrix @ vectors.reshape(int(np.prod(vectors.shape[:-1])), vectors.shape[-1]).T
    return flat.T.reshape(*vectors.shape[:-1], matrix.shape[0])
