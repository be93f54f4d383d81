"""Bearings: the load they carry, and their dynamic stiffness in x and y from their entries."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.entries import apply_entries


def weight_carried(structure, node=None):
    """Load (N, downward) of a film bearing by the weight if all bearings are rigid; an error if it has none."""
    node = structure.default_node() if node is None else node
    load = structure.bearing_load(node)
    if not load > 0:
        raise RotorstudyError(
            f"the weight of the rotor loads the bearing at node {node} by {load:.3g} N; a film bearing needs a load "
            "downward, so state load_N (with forces of belts or gears) or another bearing"
        )
    return load


def dynamic_stiffness(term, speed, harmonics):
    """Dynamic stiffness (speed, harmonic, force, motion), N/m, of a bearing on one coordinate: force = -Z (X, Y)."""
    speed, found = np.asarray(speed, float), []
    for n in harmonics:
        columns = []
        for x, y in ((1, 0), (0, 1)):
            amplitude = np.empty((len(speed), 2, 1), complex)
            amplitude[:, 0], amplitude[:, 1] = (x + 1j * y) / 2, np.conj(x - 1j * y) / 2  # harmonics n and -n of z
            force = sum(
                value * apply_entries(unknown.entries, amplitude, speed, [n, -n])[..., 0]
                for value, unknown in zip(term.theta, term.unknowns, strict=True)
            )
            forward, mirrored = force[:, 0], np.conj(force[:, 1])
            columns.append([forward + mirrored, (forward - mirrored) / 1j])
        found.append(-np.array(columns))
    return np.transpose(found, (3, 0, 2, 1))
