"""Systems of equations that are solved for the forces and again for the derivatives: factorised once.

Where few unknowns are coupled, the nodes of a shaft to their neighbours and harmonics to the next but one, that is done
by the band of the matrices.
"""

from functools import partial

import numpy as np

from rotorstudy.response.banded import FEWEST, bandwidth, stored_by_band

WIDEST = 0.25  # of the unknowns: bandwidth below which a banded factorisation is faster than a dense one


def factorised(matrices, order=None):
    """Function that solves systems of equations.

    Parameters
    ----------
    matrices : complex array (..., n, n)
        May be overwritten.
    order : ints (n,), optional
        In which the unknowns are taken, so that coupled ones lie close to each other; as they are by default.

    Returns
    -------
    callable
        From right sides (..., n, column) to solutions (..., n, column); LinAlgError if a matrix is singular.
    """
    count = matrices.shape[-1]
    if count < FEWEST:
        return partial(np.linalg.solve, matrices)
    order = np.arange(count) if order is None else order
    coupled = np.any(matrices != 0, axis=tuple(range(matrices.ndim - 2)))
    band = bandwidth(coupled[np.ix_(order, order)])
    solver_of = _dense if band > WIDEST * count else partial(_banded, band=band, order=order)
    solvers = np.empty(matrices.shape[:-2], object)
    for place in np.ndindex(solvers.shape):
        solvers[place] = solver_of(matrices[place])

    def solved(right):
        leading = np.broadcast_shapes(solvers.shape, right.shape[:-2])
        found = np.empty((*leading, *right.shape[-2:]), complex)
        for place, solver in np.ndenumerate(np.broadcast_to(solvers, leading)):
            found[place] = solver(np.broadcast_to(right, found.shape)[place])
        return found

    return solved


def _dense(matrix):
    """Solution of one system, whose matrix (n, n) is overwritten: its transpose lies in memory as LAPACK takes it."""
    from scipy.linalg.lapack import zgetrf, zgetrs

    factors, pivots, singular = zgetrf(matrix.T, overwrite_a=True)
    return _refused if singular else lambda right: zgetrs(factors, pivots, right, trans=1)[0]


def _banded(matrix, band, order):
    """Solution of one system of a bandwidth, its unknowns in an order (n,)."""
    from scipy.linalg.lapack import zgbtrf, zgbtrs

    stored = np.zeros((3 * band + 1, len(order)), complex, order="F")  # the first rows are filled by pivoting
    stored[band:] = stored_by_band(matrix[np.ix_(order, order)], band)
    factors, pivots, singular = zgbtrf(stored, band, band, overwrite_ab=True)
    back = np.argsort(order)
    return _refused if singular else lambda right: zgbtrs(factors, band, band, right[order], pivots)[0][back]


def _refused(right):
    raise np.linalg.LinAlgError("singular matrix")
