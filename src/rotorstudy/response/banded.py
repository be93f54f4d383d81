"""Systems of equations of a shaft: each node is coupled to its neighbours alone, so that their matrices are banded."""

import numpy as np

FEWEST = 60  # unknowns from which a banded solution is faster than a dense one


def bandwidth(matrices):
    """Largest distance from the diagonal of an element that is not zero in one of the matrices (..., n, n)."""
    used = np.any(matrices.reshape(-1, *matrices.shape[-2:]) != 0, axis=0)
    row, column = np.nonzero(used)
    return int(np.abs(row - column).max(initial=0))
