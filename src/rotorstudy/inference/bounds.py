"""The smallest covariance that any unbiased estimate can have."""

import numpy as np

from rotorstudy.inference.linear import check_identifiable, invert
from rotorstudy.inference.prediction import predicted_derivatives


def cramer_rao_bound(problem, theta):
    """The Cramer-Rao bound of the unknowns of a problem, from the data alone.

    Parameters
    ----------
    problem : Problem
    theta : ndarray (parameter,)
        The true amplitudes.

    Returns
    -------
    ndarray (parameter, parameter)
        Covariance.

    Raises
    ------
    UnidentifiableError
        If the data cannot tell the unknowns apart.

    References
    ----------
    Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, ch. 3.
    """
    _, jacobian = predicted_derivatives(problem, np.asarray(theta, float))
    check_identifiable(jacobian, problem.names)
    return invert(jacobian.T @ jacobian)
