"""Systems of equations that are solved for several right sides: factorised once.

Where few unknowns are coupled, the nodes of a shaft to their neighbours and harmonics to the next but one, that is done
by the band of the matrices, so that time and memory grow with their size and not with its cube.
"""

from functools import partial

import numpy as np

FEWEST = 60  # unknowns from which a banded solution is faster than a dense one
WIDEST = 0.25  # of the unknowns: bandwidth below which it is


def factorised(matrices, order=None):
    """Function from right sides (..., n, column) to solutions of systems (..., n, n), complex, which it may overwrite.

    order : (n,) in which the unknowns are taken, so that coupled ones lie close
    """
    count = matrices.shape[-1]
    if count == 1:
        return lambda right: right / matrices
    if count < FEWEST:
        return partial(np.linalg.solve, matrices)
    order = np.arange(count) if order is None else order
    coupled = np.any(matrices != 0, axis=tuple(range(matrices.ndim - 2)))
    band = bandwidth(*np.nonzero(coupled[np.ix_(order, order)]))
    if not has_narrow_band(band, count):
        return _one_by_one(_dense, matrices)
    return factorised_bands(stored_by_band(matrices, band, order), order)


def factorised_bands(stored, order):
    """Function like that of `factorised`, for matrices `stored_by_band` in an order, (..., 2 band + 1, n)."""
    systems, back = _one_by_one(_banded, stored), np.argsort(order)
    return lambda right: systems(right[..., order, :])[..., back, :]


def bandwidth(row, column):
    """Largest distance from the diagonal of elements (element,)."""
    return int(np.abs(row - column).max(initial=0))


def has_narrow_band(band, count):
    """Whether a banded solution of so many unknowns is faster than a dense one."""
    return count >= FEWEST and band <= WIDEST * count


def stored_by_band(matrices, band, order):
    """Diagonals (..., 2 band + 1, n) of matrices (..., n, n) in that order, the uppermost first, as LAPACK has them."""
    column, offset = np.arange(matrices.shape[-1]), np.arange(-band, band + 1)[:, None]  # offset: row minus column
    row = column + offset
    inside = (row >= 0) & (row < len(column))
    return np.where(inside, matrices[..., order[np.where(inside, row, 0)], order], 0)


def _one_by_one(solver_of, matrices):
    """Function from right sides to solutions of systems whose matrices are (..., row, n)."""
    solvers = np.empty(matrices.shape[:-2], object)
    for place in np.ndindex(solvers.shape):
        solvers[place] = solver_of(matrices[place])

    def solved(right):
        leading = np.broadcast_shapes(solvers.shape, right.shape[:-2])
        found = np.empty((*leading, *right.shape[-2:]), np.result_type(matrices, right))
        for place, solver in np.ndenumerate(np.broadcast_to(solvers, leading)):
            found[place] = solver(np.broadcast_to(right, found.shape)[place])
        return found

    return solved


def _dense(matrix):
    """Solution of one system, whose matrix (n, n) is overwritten: its transpose lies in memory as LAPACK takes it."""
    from scipy.linalg.lapack import zgetrf, zgetrs

    factors, pivots, singular = zgetrf(matrix.T, overwrite_a=True)
    return _refused if singular else lambda right: zgetrs(factors, pivots, right, trans=1)[0]


def _banded(stored):
    """Solution of one system `stored_by_band`, (2 band + 1, n)."""
    from scipy.linalg.lapack import zgbtrf, zgbtrs

    band = len(stored) // 2
    room = np.zeros((3 * band + 1, stored.shape[1]), complex, order="F")  # pivoting fills the first rows
    room[band:] = stored
    factors, pivots, singular = zgbtrf(room, band, band, overwrite_ab=True)
    return _refused if singular else lambda right: zgbtrs(factors, band, band, right, pivots)[0]


def _refused(right):
    raise np.linalg.LinAlgError("singular matrix")
