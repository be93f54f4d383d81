"""How the matrices of a rotor follow relative changes of its numbers, to second order."""

from dataclasses import dataclass

import numpy as np

from rotorstudy.model.structure import Matrices


@dataclass(frozen=True, eq=False)
class Variation:
    """Matrices of a rotor as polynomials of second order in the relative changes of its numbers.

    Second order, since a stiffness follows the fourth power of a diameter: with changes of 2 % the linear part leaves
    0.25 % of it, the second order 0.003 %.

    base       : Matrices without changes
    slopes     : Matrices with a leading dimension (number,)
    curvatures : Matrices with leading dimensions (number, number)
    """

    base: Matrices
    slopes: Matrices
    curvatures: Matrices

    def at(self, change: np.ndarray) -> Matrices:
        """Matrices (..., dof, dof) and load (..., dof) at relative changes (..., number)."""
        return Matrices(
            *(
                base + np.tensordot(change, slope, 1) + np.tensordot(_products(change), curvature, 2) / 2
                for base, slope, curvature in zip(self.base, self.slopes, self.curvatures, strict=True)
            )
        )

    def slopes_at(self, change: np.ndarray) -> Matrices:
        """Their derivatives (..., number, dof, dof) and (..., number, dof) there."""
        return Matrices(
            *(
                slope + np.tensordot(change, curvature, 1)
                for slope, curvature in zip(self.slopes, self.curvatures, strict=True)
            )
        )


def _products(change):
    return change[..., :, None] * change[..., None, :]
