"""What probes show of the motion of a shaft."""

import numpy as np

from rotorstudy.errors import RotorstudyError


def output_rows(structure, sensors, extra):
    """(output, dof) what each probe shows, the disturbance of each output over that of a probe, (output,).

    Translations at the sensors, tilts as the difference of two probes over their distance, translations at stations.
    """
    rows = [structure.unit(node) for node in sensors]
    rows += [structure.unit(node, "tilt") for node in extra.tilts]
    for position in extra.stations_m:
        if structure.shape_at is None:
            raise RotorstudyError(f"no probe can stand at {position:g} m: this rotor does not tell the shaft's shape")
        rows.append(structure.shape_at(position))
    relative = np.ones(len(rows))
    relative[len(sensors) : len(sensors) + len(extra.tilts)] = np.sqrt(2) / extra.tilt_arm_m
    return np.array(rows), relative
