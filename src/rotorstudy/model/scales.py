"""Usual sizes of a rotor, from which the typical sizes of effects follow, so that they hold in any units.

A gram-sized rotor and a turbine have the same damping ratios, eccentricities over static deflection, and support errors
over local stiffness. Mass, length and time of the rotor are therefore the units in which effects state what is usual.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

SINGULAR = 1e-13  # eigenvalue of the stiffness with a unit diagonal below which a motion is rigid
RIGID_FREQUENCY = 314.0  # rad/s, of a rigid body without supports, which has none: that of the mains
STILL_LENGTH = 1e-5  # m, of a rotor without weight and records: 10 um, a usual vibration (ISO 20816)


@dataclass(frozen=True)
class Scales:
    """Usual sizes of a rotor on its supports; without, those of the freely accelerating body (inertia relief)."""

    inertia: np.ndarray  # (dof, dof) kg
    rigidity: np.ndarray  # (dof, dof) N/m
    along: np.ndarray  # (dof,) motion of all nodes
    gravity: float  # m/s^2
    shaft: float  # length, m
    measured: float  # vibration in the records, m
    vibrations: dict  # node -> largest vibration there in the records, m, where known
    coordinate: Callable  # function(node, motion) -> its position

    @cached_property
    def flexibility(self) -> np.ndarray:
        """Displacement (dof, dof) per unit force, m/N, the acceleration of a body without supports subtracted."""
        mass, stiffness = self.inertia, self.rigidity
        if not np.any(stiffness):
            stiffness = RIGID_FREQUENCY**2 * mass
        size = np.sqrt(np.abs(np.diag(stiffness)))  # translations and tilts have different units
        size = np.where(size > 0, size, 1.0)
        value, vector = np.linalg.eigh(stiffness / np.outer(size, size))
        elastic = value > SINGULAR
        shape, rigid = vector[:, elastic] / size[:, None], vector[:, ~elastic] / size[:, None]
        inverse = shape / value[elastic] @ shape.T
        # of a coordinate with neither stiffness nor mass, which only a bearing holds, nothing is carried
        carried = rigid @ np.linalg.pinv(rigid.T @ mass @ rigid, hermitian=True) @ rigid.T @ mass
        relieved = np.eye(len(mass)) - carried
        return relieved @ inverse @ relieved.T

    @cached_property
    def frequency(self) -> float:
        """Lowest natural frequency of bending at rest, rad/s."""
        return float(np.linalg.eigvals(self.flexibility @ self.inertia).real.max() ** -0.5)

    @property
    def time(self) -> float:
        """Of a radian at the lowest natural frequency, s."""
        return 1 / self.frequency

    @cached_property
    def softest(self) -> float:
        """Stiffness against a force where the rotor is softest, N/m."""
        return float(1 / np.diag(self.flexibility)[self.along > 0].max())

    @property
    def mass(self) -> float:
        """Mass that with the softest stiffness has the lowest natural frequency, kg."""
        return self.softest / self.frequency**2

    @property
    def length(self) -> float:
        """Usual displacement, m: the static deflection g / w^2 or the vibration measured, whichever is larger."""
        return max(self.gravity / self.frequency**2, self.measured) or STILL_LENGTH

    @property
    def vibration(self) -> float:
        """Usual vibration, m: the one measured, which may be far below the static deflection; else the usual length."""
        return self.measured or self.length

    def usual(self, scale: str, node: int | None = None) -> float:
        """The size of that name; of a vibration or length at a node, None where most moves, less where it is stiff.

        A vibration at a node is the largest there where the records tell it.
        """
        if scale == "vibration" and node in self.vibrations:
            return self.vibrations[node]
        size = getattr(self, scale)
        local = node is not None and scale in ("vibration", "length")
        return size * self.displacement(node) / self.length if local else size

    @property
    def force(self) -> float:
        """Force that deflects the softest place by the usual length, N: under gravity about the weight."""
        return self.softest * self.length

    def stiffness(self, node: int | None, motion: str = "translation") -> float:
        """Local stiffness of the supported rotor, N/m (N m of a tilt); node None is the only one of a rotor."""
        here = self.coordinate(node, motion)
        return float(1 / self.flexibility[here, here])

    def displacement(self, node: int | None) -> float:
        """Displacement by the usual force at a node, m: small at a stiff bearing."""
        return self.force / self.stiffness(node)

    def critical_damping(self, node: int | None) -> float:
        """Damping 2 k / w at a node that is critical for a mass on its local stiffness, N s/m."""
        return 2 * self.stiffness(node) / self.frequency

    def lever(self, node: int | None) -> float:
        """Length by which a moment at a node strains the rotor as much as a force where it is softest, m."""
        return (self.stiffness(node, "tilt") / self.softest) ** 0.5
