"""Whether causes take more stiffness from a support than it has."""

import numpy as np

from rotorstudy.model.registry import registry

UNCERTAIN = 2.0  # standard deviations of the loss, by which it may exceed the stiffness


def loses_more_than_all(explanation, structure, speed):
    """Whether the losses of stiffness at a node exceed that of its bearings, in any direction and at any speed.

    The losses are those of causes that cannot be negative and act as a static stiffness. A rotor without bearings has
    its own supports; how much of its stiffness is theirs is not known, and the answer is False.

    explanation : Explanation;  structure : Structure of the rig;  speed : (speed,) rad/s
    """
    if not structure.bearing_nodes:
        return False
    lost = {}
    for cause in explanation.causes:
        effect = registry().plugins["effect"][cause.effect]
        for p in cause.term.parameters:
            if p.unit == "N/m" and p.entries and "node" in cause.where and effect.is_positive(p.name):
                lost.setdefault(cause.where["node"], []).append(cause.term.full_name(p))
    fitted = explanation.fit
    return any(
        _least_stiffness(fitted, structure.index(node), names, speed) < -UNCERTAIN * _std(fitted, names)
        for node, names in lost.items()
    )


def _least_stiffness(fitted, i, lost, speed):
    """Lowest principal stiffness, over the speeds, of the bearings at a coordinate less the losses, N/m."""
    on_z, on_conj = np.zeros((2, len(speed)), complex)
    model, theta = fitted.model.at(fitted.theta)
    for p, unknown in model.acting:
        if not unknown.carries and unknown.name not in lost:
            continue
        for entry in (e for e in unknown.entries if e.reads_motion and e.order == 0 and e.shift == 0):
            found = on_conj if entry.is_conjugate else on_z
            found += -theta[p] * entry.gain_at(speed, 0) * entry.matrix[i, i]
    return float((on_z.real - np.abs(on_conj)).min())


def _std(fitted, names):
    """Standard deviation of the sum of some amplitudes."""
    chosen = np.isin(fitted.names, names)
    return np.sqrt(chosen @ fitted.covariance @ chosen)
