"""What is known of a shaft beyond the matrices: sections, discs, places of cracks, and how the weight bends it."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import CannotAct, check_known

STRETCHES = 8  # most parts into which a shaft is divided, of which longer stretches consist
UNBALANCED = 1e-6  # of the static load: larger forces that the bearings leave are no round-off


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


class Shaft:
    """What a Structure tells about its places, cracks and statics, from its fields."""

    def default_node(self) -> int:
        """The node of a rotor that has only one, for effects without a stated node; CannotAct if it has several."""
        if len(self.nodes) > 1:
            raise CannotAct(f"this rotor has nodes {list(self.nodes)}; choose one with 'node:'")
        return self.nodes[0]

    def against_casing(self, node: int | None) -> np.ndarray:
        """Motion (dof,) of a node, 1, against its housing, or the casing on the nearest block under two bearings.

        That of the node alone, as of `Structure.unit`, where there is neither.
        """
        here, at = self.unit(node), self.node_positions
        if node in self.housings:
            return here - self.unit(node, "housing")
        under = (term.options for term in self.foundation)
        blocks = [(one["node"], one["second_node"]) for one in under if one.get("second_node")]
        if not blocks or node not in at:
            return here
        first, last = min(blocks, key=lambda ends: abs(at[ends[0]] + at[ends[1]] - 2 * at[node]))
        share = (at[node] - at[first]) / (at[last] - at[first])
        return here - (1 - share) * self.unit(first, "housing") - share * self.unit(last, "housing")

    def label_at(self, where: dict) -> str:
        """What the rig calls the disc or bearing at a place, such as {"node": 2}; empty if it has no label."""
        node = where.get("node")
        return self.labels.get(node, "") if isinstance(node, int) else ""

    def mass_share(self, node: int) -> float:
        """Share of a node in the mass of the rotor: the force on it if all nodes are accelerated alike."""
        here = np.array([at == node for at, _ in self.dofs]) * self.along  # none at a node that is held
        return float(here @ self.mass @ self.along / (self.along @ self.mass @ self.along))

    def stiffness_loss_at(
        self, node: int | None = None, element: int | None = None
    ) -> dict[str, tuple[np.ndarray, str, float]]:
        """Stiffness losses of a crack at one place: name -> pattern (dof, dof), unit, typical size; else CannotAct."""
        if callable(self.stiffness_loss):
            if (node is None) == (element is None):
                raise CannotAct("this rotor can crack at several places; choose one with 'node:' or 'element:'")
            check_known("node", [] if node is None else [node], {n for n, _ in self.dofs}, "the crack", CannotAct)
            return self.stiffness_loss(node, element)
        if element is not None or (node is not None and self.nodes != (node,)):
            place = f"node {node}" if element is None else f"element {element}"
            raise CannotAct(f"this rotor cannot crack at {place}; it has only one place, so omit node and element")
        return self.stiffness_loss

    def crack_places(self) -> list[dict]:
        """Options for each possible place of a crack: none for a rotor with one place, else each element."""
        if not callable(self.stiffness_loss):
            return [{}] if self.stiffness_loss else []
        return [{"element": 1 + i} for i in range(self._elements)]

    @cached_property
    def _elements(self) -> int:
        """Number of elements that can crack."""
        for element in range(1, max(node for node, _ in self.dofs) + 1):
            try:
                self.stiffness_loss(None, element)
            except CannotAct:
                return element - 1
        return element

    def stiffness_of(self, element: int, last_element: int | None = None) -> np.ndarray:
        """Stiffness (dof, dof) of an element of the shaft, or of all from it to a last one, N/m (N m of a tilt)."""
        last = element if last_element is None else last_element
        if last < element:
            raise CannotAct(f"last_element {last} lies before element {element}")
        losses = (self.stiffness_loss_at(None, number) for number in range(element, last + 1))
        shares = (pattern for loss in losses for pattern, unit, _ in loss.values() if unit == "1")
        found = next(shares, None)
        if found is None:
            raise CannotAct("this rotor states no stiffness of its elements")
        return sum(shares, found)

    @cached_property
    def soft_elements(self) -> tuple[int, ...]:
        """Elements that bend at least twice as easily as both neighbours."""
        tilts = {node: i for i, (node, motion) in enumerate(self.dofs) if motion == "tilt"}
        rigidity = {}
        for node in (node for node in tilts if node + 1 in tilts and node + 1 in self.node_positions):
            try:
                one, other = self.stiffness_of(node)[tilts[node], [tilts[node], tilts[node + 1]]]
            except CannotAct:  # a rotor without elements
                return ()
            rigidity[node] = (one - other) * (self.node_positions[node + 1] - self.node_positions[node])  # 2 E I
        beside = {node: [rigidity.get(node - 1, 0.0), rigidity.get(node + 1, 0.0)] for node in rigidity}
        return tuple(node for node, own in rigidity.items() if 2 * own <= min(beside[node]))

    @property
    def stretch_step(self) -> int:
        """Elements of a part of the shaft, of which longer stretches consist."""
        return max(-(-len(self.crack_places()) // STRETCHES), 1)

    def stretches(self) -> list[dict]:
        """Options of each stretch of elements shorter than the shaft, single ones first; of a fine mesh, of some."""
        numbers = [place["element"] for place in self.crack_places() if place]
        starts = numbers[:: self.stretch_step]
        ends = [*(start - 1 for start in starts[1:]), *numbers[-1:]]
        pairs = ((first, last) for first in starts for last in ends if 1 < last - first + 1 < len(numbers))
        longer = [{"element": first, "last_element": last} for first, last in pairs]
        return [{"element": number} for number in numbers if len(numbers) > 1] + longer

    @cached_property
    def is_supported(self) -> bool:
        """Whether rigid supports carry the load; otherwise bearings do, which are terms."""
        return is_regular(self.stiffness)

    @cached_property
    def static_deflection(self) -> np.ndarray:
        """Deflection (dof,) from the bearing line under the static load, m (rad); zero if not supported."""
        if not np.any(self.static_load) or not self.is_supported:
            return np.zeros(len(self.dofs))
        return np.linalg.solve(self.stiffness, self.static_load)

    def tension_side(self, element: int | None) -> int:
        """The side of an element, 1 below or -1 above, that the weight stretches, on rigid bearings; else below."""
        if element is None or self.curvature_at is None:
            return 1
        return -1 if self.curvature_at(element) @ self._deflection_on_rigid_bearings > 0 else 1

    def static_moment_at(self, section: Section) -> float:
        """Bending moment by the weight, N m; positive where it stretches the upper side, as for `tension_side`."""
        return float(section.moment @ self._deflection_on_rigid_bearings + section.own_moment)

    def bearing_load(self, node: int) -> float:
        """Static load on a bearing, N downward, if bearings are rigid (exact for two); negative if the rotor lifts."""
        i = self.index(node)
        left = self.static_load - self.stiffness @ self._deflection_on_rigid_bearings
        held = [self.dofs.index((n, "translation")) for n in self.bearing_nodes if (n, "translation") in self.dofs]
        if np.abs(np.delete(left, held)).max(initial=0) > UNBALANCED * np.abs(self.static_load).max():
            raise CannotAct("the bearings and supports do not carry the rotor, so their static loads are not known")
        return float(left[i])

    def carried_at(self, node: int) -> np.ndarray:
        """Load (dof,) on a bearing by a unit force along each coordinate if bearings are rigid; zero if not known."""
        free = self._not_held
        row = np.zeros(len(self.dofs))
        if is_regular(self.stiffness[np.ix_(free, free)]):
            row[free] = -np.linalg.solve(self.stiffness[np.ix_(free, free)], self.stiffness[free, self.index(node)])
            row[self.index(node)] = 1.0
        return row

    @cached_property
    def _not_held(self):
        """Positions of the coordinates that rigid bearings do not hold."""
        held = [i for i, (node, motion) in enumerate(self.dofs) if node in self.bearing_nodes and motion != "tilt"]
        return np.setdiff1d(np.arange(len(self.dofs)), held)

    @cached_property
    def _deflection_on_rigid_bearings(self):
        """Static deflection (dof,) with the bearings taken as rigid, m; zero if they do not carry the shaft."""
        free = self._not_held
        carried = self.stiffness[np.ix_(free, free)]
        deflection = np.zeros(len(self.dofs))
        if np.any(self.static_load) and is_regular(carried):
            deflection[free] = np.linalg.solve(carried, self.static_load[free])
        return deflection


def is_regular(stiffness):
    """Whether a stiffness matrix (dof, dof) carries every load."""
    from scipy.linalg.lapack import dgecon, dgetrf  # an estimate of the condition, in a fifth of the time

    scale = np.sqrt(np.abs(np.diag(stiffness)))  # translations and tilts have different units
    if not scale.all():
        return False
    scaled = stiffness / np.outer(scale, scale)
    return bool(dgecon(dgetrf(scaled)[0], np.linalg.norm(scaled, 1))[0] > 1e-14)
