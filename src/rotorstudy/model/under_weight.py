"""What the weight does to a rotor at rest: deflection, loads on the bearings, and the side where a crack is open."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from rotorstudy.errors import CannotAct
from rotorstudy.model.shaft_parts import Section

UNBALANCED = 1e-6  # of the static load: larger forces that the bearings leave are no round-off


class UnderWeight:
    """What a Structure tells about its statics, from these of its fields."""

    stiffness: np.ndarray
    static_load: np.ndarray
    dofs: tuple[tuple[int, str], ...]
    bearing_nodes: tuple[int, ...]
    curvature_at: Callable | None
    index: Callable

    @cached_property
    def is_supported(self) -> bool:
        """Whether rigid supports carry the load; otherwise bearings do, which are terms."""
        return _is_regular(self.stiffness)

    @cached_property
    def static_deflection(self) -> np.ndarray:
        """Deflection (dof,) from the bearing line under the static load, m (rad); zero if not supported."""
        if not np.any(self.static_load) or not self.is_supported:
            return np.zeros(len(self.dofs))
        return np.linalg.solve(self.stiffness, self.static_load)

    def tension_side(self, element: int | None) -> int:
        """The side of an element, 1 below or -1 above, that bending by the weight stretches: there a crack is open.

        Where the moment is zero or not known, below. Bearings are taken as rigid, which is exact for two.
        """
        if element is None or self.curvature_at is None:
            return 1
        return -1 if self.curvature_at(element) @ self._deflection_on_rigid_bearings > 0 else 1

    def tension_side_at(self, section: Section) -> int:
        """The side of a cross section that bending by the weight stretches, as `tension_side`."""
        return -1 if section.moment @ self._deflection_on_rigid_bearings + section.own_moment > 0 else 1

    def bearing_load(self, node: int) -> float:
        """Static load on a bearing, N downward, if bearings are rigid (exact for two); negative if the rotor lifts."""
        i = self.index(node)
        deflection = self._deflection_on_rigid_bearings
        left = self.static_load - self.stiffness @ deflection
        held = [self.dofs.index((n, "translation")) for n in self.bearing_nodes if (n, "translation") in self.dofs]
        if np.abs(np.delete(left, held)).max(initial=0) > UNBALANCED * np.abs(self.static_load).max():
            raise CannotAct("the bearings and supports do not carry the rotor, so their static loads are not known")
        return float(left[i])

    @cached_property
    def _deflection_on_rigid_bearings(self):
        """Static deflection (dof,) with the bearings taken as rigid, m; zero if they do not carry the shaft."""
        held = [i for i, (node, motion) in enumerate(self.dofs) if node in self.bearing_nodes and motion != "tilt"]
        free = np.setdiff1d(np.arange(len(self.dofs)), held)
        carried = self.stiffness[np.ix_(free, free)]
        deflection = np.zeros(len(self.dofs))
        if np.any(self.static_load) and _is_regular(carried):
            deflection[free] = np.linalg.solve(carried, self.static_load[free])
        return deflection


def _is_regular(stiffness):
    """Whether a stiffness matrix (dof, dof) carries every load."""
    scale = np.sqrt(np.abs(np.diag(stiffness)))  # translations and tilts have different units
    return bool(scale.all() and np.linalg.cond(stiffness / np.outer(scale, scale)) < 1e14)
