"""Outputs of probes along a shaft."""

import numpy as np

from rotorstudy.errors import RotorstudyError


def output_rows(structure, sensors, extra):
    """Output matrix (output, dof), and the noise of each output relative to that of a probe, (output,).

    Outputs are translations at the sensors, and of an ExtraMeasurement tilts (difference of two probes over their
    distance) and translations at stations.
    """
    rows = [structure.unit(node) for node in sensors]
    rows += [structure.unit(node, "tilt") for node in extra.tilts]
    for position in extra.stations_m:
        if structure.shape_at is None:
            raise RotorstudyError(
                f"no probe can be placed at {position:g} m: this rotor does not define the shaft's shape between nodes"
            )
        rows.append(structure.shape_at(position))
    relative = np.ones(len(rows))
    relative[len(sensors) : len(sensors) + len(extra.tilts)] = np.sqrt(2) / extra.tilt_arm_m
    return np.array(rows), relative
