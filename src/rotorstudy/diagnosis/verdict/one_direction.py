"""Whether two causes that turn with the shaft point in one direction, as the parts of one fault do.

In a frame that follows a bent shaft, the shape s of the bend, z = y + s e^{jwt}, the equations of motion of y are those
of a straight shaft with the unbalance m s of every mass m; at a probe s is a runout. So a bend is an unbalance and a
runout, in one direction. Two faults that have nothing to do with each other may point anywhere.
"""

import numpy as np

from rotorstudy.diagnosis.search.odds import Explanation, faults_of

SPREAD = 0.05  # rad, by which directions of parts of one fault differ: its damping turns them


def log_odds_of_one_direction(explanation: Explanation) -> float:
    """Logarithm of how much more probable the directions of two causes are if they are parts of one fault.

    returns : 0 where there are not two causes of one direction each, or they are less probable
    """
    directions = [_direction(parts, explanation.fit) for parts in faults_of(explanation.causes).values()]
    if len(directions) != 2 or None in directions:
        return 0.0
    (one, one_variance), (other, other_variance) = directions
    apart = (one - other + np.pi / 2) % np.pi - np.pi / 2  # a part may have either sign
    variance = one_variance + other_variance + SPREAD**2
    likely = -0.5 * (apart**2 / variance + np.log(2 * np.pi * variance))
    return float(max(likely + np.log(np.pi), 0.0))


def _direction(parts, fitted):
    """Angle and its variance of the one amplitude of a fault that turns with the shaft, rad; None without one."""
    found = []
    for part in parts:
        (first, *others), turning = part.term.parameters, {("one", 1)}
        if others:  # of a coupling, or of a stretch, whose direction is not that of one of its amplitudes
            return None
        if first.is_complex and {(entry.on, entry.shift) for entry in first.entries} == turning:
            found.append([fitted.names.index(name) for name in part.names])
    if len(found) != 1:
        return None
    real, imaginary = fitted.free[found[0]]
    slope = np.array([-imaginary, real]) / (real**2 + imaginary**2)
    return np.arctan2(imaginary, real), float(slope @ fitted.covariance[np.ix_(found[0], found[0])] @ slope)
