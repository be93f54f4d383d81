"""What surfaces that touch have in common, whichever fault they belong to."""

import numpy as np


def mean_overlap(depth: np.ndarray, spread: float | None) -> np.ndarray:
    """Mean of max(depth + e, 0) of a contact whose gap varies by e, normal with a standard deviation `spread`.

    A real contact closes gradually, as the heights of its surfaces, seats and threads are scattered.

    depth, spread : m, depth (...); None for a contact that closes at once
    returns       : (...) m
    source        : Greenwood and Williamson 1966, Proc. R. Soc. A 295, 300-319, for elastic seats
    """
    from scipy.special import ndtr

    if not spread:
        return np.maximum(depth, 0.0)
    x = depth / spread
    return spread * (x * ndtr(x) + np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi))
