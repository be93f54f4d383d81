"""The axes in which records were read: directions of the probes, gravity and the phase mark."""

from dataclasses import dataclass, field

import numpy as np

from rotorstudy.errors import CannotAct, unknown_name


@dataclass(frozen=True)
class Reading:
    """The axes in which records were read.

    probes      : node -> {name: direction, rad from x in the sense of rotation}; others are along x and y
    gravity_rad : direction of gravity in the user's angles
    mark_rad    : angle of the shaft's reference line from x when the phase mark passes
    """

    probes: dict = field(default_factory=dict)
    gravity_rad: float = 0.0
    mark_rad: float = 0.0

    def probes_at(self, node: int) -> dict[str, float]:
        """{name: direction (rad)} of the probes of a node."""
        return self.probes.get(node, {"x": 0.0, "y": np.pi / 2})

    def axis(self, node: int) -> complex:
        """Direction e^{ja} of probe x of a node: of its first two the one from which the other is ahead."""
        first, *others = np.exp(1j * np.array(list(self.probes_at(node).values())[:2]))
        second = others[0] if others else 1j * first
        return complex(first if (np.conj(first) * second).imag > 0 else second)


def sensor_unit(sensors, node=None):
    """Vector (sensor,) with a one at the sensor of a node, by default the first; a node without one is an error."""
    node = sensors[0] if node is None else node
    if node not in sensors:
        raise unknown_name("sensor at node", node, sensors, "the rig", CannotAct)
    return np.eye(len(sensors))[sensors.index(node)]


def probe_axis(structure, sensors, node=None):
    """Direction e^{ja} of the probe x of a node, by default of the first sensor; y is 90 degrees ahead of it."""
    return structure.reading.axis(sensors[0] if node is None else node)
