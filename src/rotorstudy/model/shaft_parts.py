"""What a rotor plugin tells of its shaft beyond the matrices: cross sections and discs."""

from typing import NamedTuple

import numpy as np


class Section(NamedTuple):
    """A cross section of the shaft, and how it bends.

    position   : m from node 1
    outer_diameter_m, inner_diameter_m, youngs_modulus_Pa, poissons_ratio : of the shaft there
    moment     : (dof,) bending moment E I d2z/ds2 by a unit of each coordinate, N (N m of a tilt)
    own_moment : moment by the weight of its element while the nodes are held, N m
    stiffness  : moment by a kink of 1 rad in the shaft there while the nodes are held, N m/rad
    sleeve_diameter_m : over the layers on the shaft there; 0 if there are none
    """

    position: float
    outer_diameter_m: float
    inner_diameter_m: float
    youngs_modulus_Pa: float
    poissons_ratio: float
    moment: np.ndarray
    own_moment: float
    stiffness: float
    sleeve_diameter_m: float = 0.0


class RigidDisc(NamedTuple):
    """A rigid disc: its node, mass in kg, and moments of inertia in kg m2."""

    node: int
    mass: float
    polar_moment: float
    diametral_moment: float

    @property
    def radius(self) -> float:
        """Of the solid cylinder with these moments, m."""
        return float(np.sqrt(2 * self.polar_moment / self.mass))

    @property
    def thickness(self) -> float:
        """Of the solid cylinder with these moments, m; 0 if they are those of a thinner body."""
        return float(np.sqrt(max(12 * self.diametral_moment / self.mass - 3 * self.radius**2, 0.0)))
