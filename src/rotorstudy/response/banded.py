"""Systems of equations of a shaft: each node is coupled to its neighbours alone, so that their matrices are banded."""

import numpy as np

FEWEST = 60  # unknowns from which a banded solution is faster than a dense one
WIDEST = 0.1  # of the unknowns: bandwidth below which it is


def bandwidth(matrices):
    """Largest distance from the diagonal of an element that is not zero in one of the matrices (..., n, n)."""
    used = np.any(matrices.reshape(-1, *matrices.shape[-2:]) != 0, axis=0)
    row, column = np.nonzero(used)
    return int(np.abs(row - column).max(initial=0))


def solve_systems(matrices, right):
    """Solutions of systems of equations, those of a slender shaft by the band of their matrices.

    Parameters
    ----------
    matrices : array (..., n, n)
    right : array (..., n, column)

    Returns
    -------
    array (..., n, column)

    Raises
    ------
    numpy.linalg.LinAlgError
        If a matrix is singular.
    """
    count = matrices.shape[-1]
    if count < FEWEST or (band := bandwidth(matrices)) > WIDEST * count:
        return np.linalg.solve(matrices, right)
    from scipy.linalg import solve_banded

    leading = np.broadcast_shapes(matrices.shape[:-2], right.shape[:-2])
    found = np.empty((*leading, *right.shape[-2:]), np.result_type(matrices, right))
    matrices, right = (np.broadcast_to(one, (*leading, *one.shape[-2:])) for one in (matrices, right))
    column = np.arange(count)
    offset = np.arange(-band, band + 1)[:, None]  # of a row of the band storage: row minus column
    inside = (column + offset >= 0) & (column + offset < count)
    row = np.where(inside, column + offset, 0)
    for place in np.ndindex(leading):
        stored = np.where(inside, matrices[place][row, column], 0)
        found[place] = solve_banded((band, band), stored, right[place], overwrite_ab=True, check_finite=False)
    return found
