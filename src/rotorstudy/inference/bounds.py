"""The smallest covariance that any unbiased estimate can have."""

import numpy as np

from rotorstudy.inference.linear import check_identifiable, invert
from rotorstudy.inference.prediction import predicted_derivatives
from rotorstudy.inference.problem import Problem


def cramer_rao_bound(problem: Problem, theta: np.ndarray) -> np.ndarray:
    """The Cramer-Rao bound of the unknowns of a problem, from the data alone.

    Parameters
    ----------
    problem : Problem
        Model, spectrum and unknowns.
    theta : array (parameter,)
        The true amplitudes in the units of the parameters.

    Returns
    -------
    array (parameter, parameter)
        Covariance in the units of the parameters.

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
