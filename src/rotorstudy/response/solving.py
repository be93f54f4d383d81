"""The dynamic stiffness of all harmonics that are solved together, and the motion that a force on them gives.

A slender shaft couples a node with its neighbours: its systems are assembled and solved by their band.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.entries import Entry
from rotorstudy.response.coupling import gather, layout_without_turning, linked_members, mirrored_unknown, own_harmonic
from rotorstudy.response.factorised import FEWEST, WIDEST, bandwidth, factorised, factorised_bands, has_narrow_band
from rotorstudy.response.turning import turning

FEWER_BY = 2  # harmonics are coupled on the coordinates that turn if that takes less than a half of the operations
FACTORS_KEPT = 512  # of kinds of entries at some speeds


class Band(NamedTuple):
    """Places (member, dof) of the unknowns of a group, in an order in which coupled ones lie close, and bandwidth."""

    place: np.ndarray
    width: int


def operator(model, theta, speed, blocks, *, turning=True, adjoint=False, bands=None):
    """Dynamic stiffness (..., speed, block, n, n), n = member * dof, of groups.

    bands : for each group None, or a Band, by which it is stored as LAPACK does, (..., speed, block, 2 width + 1, n)
    """
    speed, dof, places, result = np.asarray(speed, float), len(model.structure.dofs), [], []
    bands = bands or [None] * len(blocks.groups)
    for group, band in zip(blocks.groups, bands, strict=True):
        count = group.shape[1] * dof
        places.append(np.arange(count).reshape(-1, dof) if band is None else band.place)
        height = count if band is None else 2 * band.width + 1
        result.append(np.zeros((*theta.shape[:-1], len(speed), len(group), height, count), complex))

    def add(g, block, rows, columns, value):
        """Add values (..., speed, *index) at blocks, and at rows and columns, each member and coordinate, (*index)."""
        row, column = places[g][rows], places[g][columns]
        result[g][..., block, row if bands[g] is None else bands[g].width + row - column, column] += value

    matrices = model.matrices(theta)[:3]
    i, j = elements_of(matrices)
    mass, stiffness, gyroscopic = (one[..., i, j][..., None, None, None, :] for one in matrices)
    for g, group in enumerate(blocks.groups):
        nw = own_harmonic(group, blocks.harmonics)[..., None] * speed[:, None, None, None]  # n for q_n, -n for w_n
        block, member = (index[..., None] for index in np.ogrid[: group.shape[0], : group.shape[1]])
        value = stiffness - nw**2 * mass + nw * speed[:, None, None, None] * gyroscopic
        add(g, block, (member, i), (member, j), value)
    own = theta[..., [p for p, _ in model.acting]]
    for pattern in [*model.table.patterns, *(model.table.turning_patterns if turning else ())]:
        entry, value = pattern.entry, pattern.values(own)[..., None, None, :]  # (..., speed, link, place)
        if not value.any():
            continue
        linked = linked_members(blocks, entry.is_conjugate, entry.shift)
        factors = _factors(entry.kind, tuple(speed.tolist()), blocks)
        for g, ((n, is_w, block, row, column), factor) in enumerate(zip(linked, factors, strict=True)):
            if len(n):
                both, ends = factor[..., None] * value, [(row, pattern.row), (column, pattern.column)]
                both = np.where(is_w[:, None] != adjoint, both.conj(), both)
                add(g, block, *(ends[::-1] if adjoint else ends), -both)
    return result


def elements_of(matrices):
    """Rows and columns (element,) of what is not zero in one of some matrices (..., dof, dof)."""
    there = np.zeros(matrices[0].shape[-2:], bool)
    for one in matrices:
        there |= np.any(one != 0, axis=tuple(range(one.ndim - 2)))
    return np.divmod(np.flatnonzero(there), len(there))  # far faster than by `nonzero`


@lru_cache(maxsize=FACTORS_KEPT)  # most models of a search have the same bearings
def _factors(kind, speed, blocks):
    """Factors (speed, link) of the matrix of entries of a kind, for each group; None for a group without links."""
    entry, speed = Entry(np.zeros(0), *kind), np.array(speed)[:, None]
    return [
        entry.gain_at(speed, n) * (1j * (n - entry.shift) * speed) ** entry.order if len(n) else None
        for n, *_ in linked_members(blocks, entry.is_conjugate, entry.shift)
    ]


def solver(model, theta, speed, blocks, *, adjoint=False):
    """Function from force to motion, both (..., speed, harmonic, dof, column)."""
    dof, touched = len(model.structure.dofs), model.table.turned
    whole = sum(len(group) * (group.shape[1] * dof) ** 3 for group in blocks.groups)
    # complex numbers take four times as long as the real ones of the coordinates touched
    few = len(touched) and FEWER_BY * (2 * len(blocks.harmonics) * len(touched)) ** 3 < 4 * whole
    own = layout_without_turning(model, blocks) if few else blocks
    solved = _checked(_systems(model, theta, speed, own, turning=not few, adjoint=adjoint), speed)
    if not few:
        return solved
    coupled = turning(model, theta, speed, blocks.harmonics, solved, adjoint)
    return _checked(lambda force: coupled(solved(force)), speed)


def _checked(motion, speed):
    """The function from force to motion, which then raises NoSteadyState unless the motion is finite."""

    def checked(force):
        try:
            with np.errstate(divide="ignore", invalid="ignore"):
                found = motion(force)
        except np.linalg.LinAlgError:
            found = np.array(np.nan)
        if not np.isfinite(found).all():
            some = ", ".join(f"{w:g}" for w in speed[:5]) + (" ..." if len(speed) > 5 else "")
            raise NoSteadyState(
                f"no steady state at one of {some} rad/s: a harmonic coincides with an undamped natural "
                "frequency, or a parameter is not finite; add damping or leave that speed out"
            )
        return found

    return checked


def _systems(model, theta, speed, blocks, *, turning, adjoint):
    """Function from force to motion, both (..., speed, harmonic, dof, column)."""
    turns = turning and model.table.turning_patterns
    bands = [None] * len(blocks.groups) if turns else _bands(model, theta, blocks)
    matrices = operator(model, theta, speed, blocks, turning=turning, adjoint=adjoint, bands=bands)
    groups, every = [], np.arange(len(model.structure.dofs))
    for matrix, group, band in zip(matrices, blocks.groups, bands, strict=True):
        if band is not None:
            groups.append(factorised_bands(matrix, np.argsort(band.place, axis=None)))
        else:  # a harmonic and its neighbours lie together
            members = np.argsort(group[0] % len(blocks.harmonics), kind="stable")
            groups.append(factorised(matrix, (members[:, None] * len(every) + every).ravel()))

    return lambda force: _solve_groups(groups, force, blocks)


def _bands(model, theta, blocks):
    """For each group the Band of its systems, without turning coefficients; None where it is not narrow."""
    dof, sizes = len(model.structure.dofs), [group.shape[1] for group in blocks.groups]
    if max(sizes) * dof < FEWEST:
        return [None] * len(sizes)
    parts = [
        elements_of(model.matrices(theta)[:3]),
        *((pattern.row, pattern.column) for pattern in model.table.patterns),
    ]
    rows, columns = (np.concatenate(one) for one in zip(*parts, strict=True))
    place = np.arange(dof)
    if bandwidth(rows, columns) >= WIDEST * dof:  # such as housings, which are the last coordinates
        place = _close_together(rows.tobytes(), columns.tobytes(), dof)
    width, found = bandwidth(place[rows], place[columns]), []
    for members in sizes:
        band = Band(members * place + np.arange(members)[:, None], members * (width + 1) - 1)
        found.append(band if has_narrow_band(band.width, members * dof) else None)
    return found


@lru_cache(maxsize=8)  # models of a search have the same foundation
def _close_together(rows, columns, count):
    """Places (coordinate,) in an order in which coupled coordinates lie close; rows, columns : those coupled, bytes."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    at = np.frombuffer(rows, int), np.frombuffer(columns, int)
    return np.argsort(reverse_cuthill_mckee(csr_array((np.ones(len(at[0])), at), (count, count))))


def _solve_groups(groups, force, blocks):
    count, dof = len(blocks.harmonics), force.shape[-2]
    if not blocks.doubled and len(blocks.groups) == 1 and blocks.groups[0].shape == (count, 1):
        return groups[0](force)
    result = np.zeros_like(force)
    columns = np.moveaxis(force, -1, 0)
    for motion, group, mirror in zip(groups, blocks.groups, blocks.mirrors, strict=True):
        right = np.moveaxis(gather(columns, group, count, blocks.harmonics), 0, -1)
        solved = motion(right).reshape(*right.shape[:-2], group.shape[1], dof, right.shape[-1])
        direct = group < count
        result[..., group[direct], :, :] = solved[..., direct, :, :]
        if mirror:
            result[..., mirrored_unknown(group[~direct], blocks.harmonics), :, :] = solved[..., ~direct, :, :].conj()
    return result
