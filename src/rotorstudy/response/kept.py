"""Responses of the earlier state of a machine, which all explanations of a change share, kept for the last few."""

from collections.abc import Callable

import numpy as np

from rotorstudy.model.model import Model
from rotorstudy.response.harmonic import Linearised, with_its_bearings

KEPT, LARGEST = 16, 100_000  # responses, and numbers in each with its derivatives


def kept_response(earlier: Model, theta: np.ndarray, of: tuple, state: Callable) -> Linearised:
    """The Linearised response state(model, theta) of the earlier machine.

    Parameters
    ----------
    earlier : Model
        One object for all explanations, see `Model.plus`.
    theta : ndarray (..., parameter)
    of : tuple
        All else that the response depends on.
    state : function

    Returns
    -------
    Linearised
        Not to be changed.
    """
    key, recent = (theta.shape, theta.tobytes(), *of), earlier.recent
    if key in recent:
        return recent[key]
    found = with_its_bearings(state, earlier, theta)
    if found.response.size * theta.shape[-1] <= LARGEST:
        if len(recent) == KEPT:
            del recent[next(iter(recent))]
        recent[key] = found
    return found
