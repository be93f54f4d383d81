"""Systems of equations of a shaft: each node is coupled to its neighbours alone, so that their matrices are banded."""

import numpy as np

FEWEST = 60  # unknowns from which a banded solution is faster than a dense one
WIDEST = 0.1  # of the unknowns: bandwidth below which the shaft is slender


def bandwidth(matrices):
    """Largest distance from the diagonal of an element that is not zero in one of the matrices (..., n, n)."""
    used = np.any(matrices.reshape(-1, *matrices.shape[-2:]) != 0, axis=0)
    row, column = np.nonzero(used)
    return int(np.abs(row - column).max(initial=0))


def narrow_band(*matrices):
    """Bandwidth of all these matrices (..., n, n), or None if a dense solution is as fast."""
    count = matrices[0].shape[-1]
    if count < FEWEST:
        return None
    band = max(bandwidth(one) for one in matrices)
    return band if band <= WIDEST * count else None


def stored_by_band(matrices, band):
    """The diagonals (..., 2 band + 1, n) of matrices (..., n, n), the uppermost first, as LAPACK takes them."""
    column, offset = np.arange(matrices.shape[-1]), np.arange(-band, band + 1)[:, None]  # offset: row minus column
    row = column + offset
    inside = (row >= 0) & (row < len(column))
    return np.where(inside, matrices[..., np.where(inside, row, 0), column], 0)


def solve_bands(stored, right):
    """Solutions (..., n, column) of systems `stored_by_band` (..., 2 band + 1, n), right sides (..., n, column).

    raises : LinAlgError if a matrix is singular
    """
    from scipy.linalg import solve_banded

    if np.iscomplexobj(right) and not np.iscomplexobj(stored):
        return solve_bands(stored, np.ascontiguousarray(right).view(float)).view(complex)
    band, leading = stored.shape[-2] // 2, np.broadcast_shapes(stored.shape[:-2], right.shape[:-2])
    found = np.empty((*leading, *right.shape[-2:]), np.result_type(stored, right))
    stored, right = (np.broadcast_to(one, (*leading, *one.shape[-2:])) for one in (stored, right))
    for place in np.ndindex(leading):
        found[place] = solve_banded((band, band), stored[place], right[place], check_finite=False)
    return found
