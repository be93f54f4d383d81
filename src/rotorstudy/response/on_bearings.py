"""The motion of a rotor on bearings, from the receptances of the rotor.

Bearings couple harmonic n with -n, but touch few coordinates. Without them each harmonic of the rotor is on its own,
and its matrices are small, and real unless it is damped. They are inverted once for all forces, those of a slender
shaft solved by their band; the forces of the bearings, -E q, then follow from small systems of equations: with the
receptances G of the rotor, q = G (f - E q). A rotor that would be free without its bearings is held by springs at the
same coordinates, which E takes back.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from rotorstudy.response.factorised import FEWEST, factorised_bands

LARGEST_LOOP = 1e4  # of receptance times stiffness; above it four of sixteen digits would be lost
FEWER_BY = 3  # times as many coordinates as those touched: with more of these, the whole system is solved as fast


class OnBearings(NamedTuple):
    """A group of blocks; a block has some harmonics (members) that are solved together.

    alone    : motion of the rotor, held by springs, by a force, both (..., speed, block, member, dof, column)
    columns  : (..., speed, block, member, dof, coordinate) its receptances to forces on those touched, m/N
    touched  : (coordinate,) positions of the coordinates on which bearings act
    reaction : (..., member * coordinate, member * coordinate) force of bearings less springs by that motion, N/m
    """

    alone: Callable
    columns: np.ndarray
    touched: np.ndarray
    reaction: np.ndarray

    def motion(self, force: np.ndarray) -> np.ndarray:
        """Motion of a force, both (..., speed, block, member, dof, column) complex."""
        alone = self.alone(force)
        at = alone[..., self.touched, :]
        pulled = self.reaction @ at.reshape(*at.shape[:-3], -1, at.shape[-1])
        return alone - _times(self.columns, pulled.reshape(at.shape))


def touched_by(patterns):
    """Positions (coordinate,) of the coordinates that entries depend or act on; patterns : list of Pattern."""
    return np.unique(np.concatenate([[], *((one.row, one.column) for one in patterns)], axis=None)).astype(int)


def are_few(touched, dof, members):
    """Whether bearings touch so few coordinates, all harmonics together, that the rotor is inverted without them."""
    return 0 < FEWER_BY * len(touched) <= dof and (members > 1 or dof < FEWEST)


def diagonal_blocks(matrix, size):
    """(..., member, size, size) of matrices (..., member * size, member * size)."""
    parts = [slice(first, first + size) for first in range(0, matrix.shape[-1], size)]
    return np.stack([matrix[..., own, own] for own in parts], axis=-3)


def on_bearings(alone, added, touched, springs, band=None):
    """The OnBearings of a group; LinAlgError if the rotor resonates without its bearings.

    alone : dynamic stiffness (..., member, dof, dof) of the rotor, or its band;  added : of the bearings
    """
    members, count = alone.shape[-3], len(touched)
    held = alone.copy()
    held[..., touched if band is None else band, touched] += springs
    if band is None:
        inverse = np.linalg.inv(held)
        motion, columns = partial(_times, inverse), inverse[..., touched]
    else:
        motion = factorised_bands(held)
        columns = motion(np.eye(held.shape[-1])[:, touched])
    taken = added - np.diag(np.tile(springs, members))
    between = columns[..., touched, :]  # (..., member, coordinate, coordinate)
    by_member = np.swapaxes(taken.reshape(*taken.shape[:-1], members, count), -3, -2)
    loop = np.swapaxes(by_member @ between, -3, -2).reshape(taken.shape)
    if not np.all(np.abs(loop) < LARGEST_LOOP):
        raise np.linalg.LinAlgError
    reaction = np.linalg.solve(np.eye(members * count) + loop, taken)
    return OnBearings(motion, columns, touched, reaction)


def _times(matrix, columns):
    """Matrices (..., row, dof), real or complex, times complex columns (..., dof, column)."""
    if np.iscomplexobj(matrix):
        return matrix @ columns
    columns = np.ascontiguousarray(columns)
    return (matrix @ columns.view(float)).view(complex)
