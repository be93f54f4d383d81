"""The rotor without its effects: matrices, coordinates and the places of cracks."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import CannotAct, unknown_name
from rotorstudy.model.reading import Reading
from rotorstudy.model.scales import Scales
from rotorstudy.model.shaft_parts import RigidDisc, Section

UNBALANCED = 1e-6  # of the static load: larger forces that the bearings leave are no round-off
STRETCHES = 8  # most parts into which a shaft is divided, of which longer stretches consist


class Matrices(NamedTuple):
    """Mass, stiffness and gyroscopic matrix (..., dof, dof), and static load (..., dof), of a rotor."""

    mass: np.ndarray
    stiffness: np.ndarray
    gyroscopic: np.ndarray
    static_load: np.ndarray


class Origin(NamedTuple):
    """What a structure was built from: the function of its rotor plugin, all its options, and its uncertain numbers.

    uncertain : path of a number -> usual relative standard deviation, as the plugin states
    """

    function: Callable
    options: dict
    uncertain: dict

    def rebuilt(self, options: dict) -> "Structure":
        """The Structure with other options."""
        return self.function(**options)


@dataclass(frozen=True)
class Structure:
    """The rotor without its effects: M q'' - j w G q' + K q = f, in complex nodal coordinates.

    mass, stiffness, gyroscopic : (dof, dof)
    static_load : (dof,) gravity, real part along the downward x axis, N (N m for a tilt)
    dofs        : one (node, "translation" or "tilt") for each coordinate
    stiffness_loss : name -> (pattern (dof, dof), unit, typical size), the stiffness lost by a crack; if it can be at
                     several places, a function(node, element) -> such a dict, one argument being None
    shape_at    : position along the shaft, m -> (dof,) deflection there by a unit of each coordinate; None if unknown
    curvature_at : element -> (dof,) mean curvature of the shaft there by a unit of each coordinate; None if unknown
    section_at  : position along the shaft, m -> Section; None if unknown
    length      : of the shaft, m; 0 if unknown
    node_positions : node -> position along the shaft, m; empty if unknown
    discs       : the RigidDisc objects on it, for drawings
    is_solid    : whether its cross sections are known and none is hollow
    bearing_nodes : nodes carried by bearings, which are terms
    labels      : node -> what the rig calls the disc or bearing there, set where a rig is read
    gravity     : its acceleration, m/s^2; None if it follows from the static load, see `acceleration_of_gravity`
    support     : (dof, dof) static stiffness of the bearings, N/m; for usual sizes alone, as bearings are terms
    vibration   : usual vibration in the records to be explained, m; for usual sizes alone
    origin      : the Origin, set where a rig is read; None for a structure without a plugin
    reading     : the Reading of the records, set where they are read; by default of probes along x and y
    """

    mass: np.ndarray
    stiffness: np.ndarray
    gyroscopic: np.ndarray
    static_load: np.ndarray
    dofs: tuple[tuple[int, str], ...]
    stiffness_loss: dict | Callable = field(default_factory=dict)
    shape_at: Callable | None = None
    curvature_at: Callable | None = None
    section_at: Callable | None = None
    length: float = 0.0
    node_positions: dict = field(default_factory=dict)
    discs: tuple[RigidDisc, ...] = ()
    is_solid: bool = False
    bearing_nodes: tuple[int, ...] = ()
    labels: dict = field(default_factory=dict)
    gravity: float | None = None
    support: np.ndarray | None = None
    vibration: float = 0.0
    origin: Origin | None = None
    reading: Reading = field(default_factory=Reading)

    def label_at(self, where: dict) -> str:
        """What the rig calls the disc or bearing at the place of an effect; empty if it has no label.

        Parameters
        ----------
        where : dict
            Options of the place, like {"node": 2}.

        Returns
        -------
        str
        """
        node = where.get("node")
        return self.labels.get(node, "") if isinstance(node, int) else ""

    @cached_property
    def along(self) -> np.ndarray:
        """Motion (dof,) of all nodes by one in the same direction, of unit 1."""
        return np.array([float(motion == "translation") for _, motion in self.dofs])

    @cached_property
    def acceleration_of_gravity(self) -> float:
        """Along the downward x axis, m/s^2: as stated, else static load over mass (exact if no node is held)."""
        if self.gravity is not None:
            return self.gravity
        inertia = self.mass @ self.along
        return float(self.static_load @ inertia / (inertia @ inertia)) if inertia.any() else 0.0

    @cached_property
    def scales(self) -> Scales:
        """Usual sizes of this rotor on its supports, for the typical sizes of effects."""
        return Scales(self)

    @property
    def supported_stiffness(self) -> np.ndarray:
        """Stiffness (dof, dof) with that of the bearings where known, N/m."""
        return self.stiffness if self.support is None else self.stiffness + self.support

    @property
    def matrices(self) -> Matrices:
        """Mass, stiffness, gyroscopic matrix and static load."""
        return Matrices(self.mass, self.stiffness, self.gyroscopic, self.static_load)

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes that can translate; a node on a rigid support only tilts."""
        return tuple(sorted({node for node, motion in self.dofs if motion == "translation"}))

    def index(self, node: int | None, motion: str = "translation") -> int:
        """Position of a coordinate.

        Parameters
        ----------
        node : int or None
            Node of the rotor.
        motion : str
            "translation" or "tilt".

        Returns
        -------
        int
            Position among `dofs`.

        Raises
        ------
        CannotAct
            If no node is given, or one without that motion.
        """
        if node is None:
            raise CannotAct(
                f"no node is given; choose one of {list(self.nodes)} with 'node:' (a plugin takes the "
                "only node with structure.default_node())"
            )
        if (node, motion) not in self.dofs:
            raise unknown_name(
                f"{motion} at node", node, [n for n, m in self.dofs if m == motion], "the rotor", CannotAct
            )
        return self.dofs.index((node, motion))

    def unit(self, node: int | None, motion: str = "translation") -> np.ndarray:
        """Vector with a one at a coordinate.

        Parameters
        ----------
        node : int or None
            Node of the rotor.
        motion : str
            "translation" or "tilt".

        Returns
        -------
        array (dof,)
            Of unit 1.

        Raises
        ------
        CannotAct
            If no node is given, or one without that motion.
        """
        return np.eye(len(self.dofs))[self.index(node, motion)]

    def mass_share(self, node: int) -> float:
        """Share of a node in the mass of the rotor: the force on it if all nodes are accelerated alike.

        Parameters
        ----------
        node : int
            Numbered from 1.

        Returns
        -------
        float
        """
        alike = np.array([motion == "translation" for _, motion in self.dofs], dtype=float)
        here = np.array([at == node for at, _ in self.dofs]) * alike  # none at a node that is held
        return float(here @ self.mass @ alike / (alike @ self.mass @ alike))

    def default_node(self) -> int:
        """The node of a rotor that has only one, for effects without a stated node.

        Returns
        -------
        int

        Raises
        ------
        CannotAct
            If the rotor has several nodes.
        """
        if len(self.nodes) > 1:
            raise CannotAct(f"this rotor has nodes {list(self.nodes)}; choose one with 'node:'")
        return self.nodes[0]

    def stiffness_loss_at(
        self, node: int | None = None, element: int | None = None
    ) -> dict[str, tuple[np.ndarray, str, float]]:
        """Stiffness losses of a crack at a node or in an element.

        A rotor that can crack at only one place needs no arguments.

        Parameters
        ----------
        node : int, optional
            Node of the crack.
        element : int, optional
            Element of the crack.

        Returns
        -------
        dict
            Name -> pattern (dof, dof) of unit 1, unit of the loss, typical size.

        Raises
        ------
        RotorstudyError
            If the rotor can crack at several places and not exactly one is given.
        CannotAct
            If the rotor cannot crack at that place.
        """
        if callable(self.stiffness_loss):
            if (node is None) == (element is None):
                raise CannotAct("this rotor can crack at several places; choose one with 'node:' or 'element:'")
            if node is not None and node not in {n for n, _ in self.dofs}:
                raise unknown_name("node", node, {n for n, _ in self.dofs}, "the crack", CannotAct)
            return self.stiffness_loss(node, element)
        if element is not None or (node is not None and self.nodes != (node,)):
            place = f"node {node}" if element is None else f"element {element}"
            raise CannotAct(
                f"this rotor cannot crack at {place}; it has only one place for a crack, so omit node and element"
            )
        return self.stiffness_loss

    def crack_places(self) -> list[dict]:
        """Options for each possible place of a crack: none for a rotor with one place, else each element of the shaft.

        Returns
        -------
        list[dict]
            Options of a crack, one for each place.
        """
        if not callable(self.stiffness_loss):
            return [{}] if self.stiffness_loss else []
        found = []
        for element in range(1, max(node for node, _ in self.dofs) + 1):
            try:
                self.stiffness_loss(None, element)
            except CannotAct:
                break
            found.append({"element": element})
        return found

    def stiffness_of(self, element: int, last_element: int | None = None) -> np.ndarray:
        """Stiffness of an element of the shaft, or of all from that to a last one.

        Parameters
        ----------
        element, last_element : int
            Numbers of elements, from 1.

        Returns
        -------
        array (dof, dof)
            N/m (N m of a tilt).

        Raises
        ------
        CannotAct
            If the rotor does not state the stiffness of its elements, has no such elements, or the last one is before
            the first.
        """
        last = element if last_element is None else last_element
        if last < element:
            raise CannotAct(f"last_element {last} lies before element {element}")
        losses = [self.stiffness_loss_at(None, number) for number in range(element, last + 1)]
        shares = [pattern for loss in losses for pattern, unit, _ in loss.values() if unit == "1"]
        if not shares:
            raise CannotAct("this rotor states no stiffness of its elements")
        return sum(shares)

    def stretches(self) -> list[dict]:
        """Options for each stretch of neighbouring elements that is shorter than the shaft, single elements first.

        On a fine mesh longer stretches begin and end at only some of the nodes, so that their number stays small.

        Returns
        -------
        list[dict]
            `element`, and `last_element` where there are several; none for a rotor without elements.
        """
        numbers = [place["element"] for place in self.crack_places() if place]
        step = max(-(-len(numbers) // STRETCHES), 1)
        starts = numbers[::step]
        ends = [*(start - 1 for start in starts[1:]), *numbers[-1:]]
        longer = [
            {"element": first, "last_element": last}
            for first in starts
            for last in ends
            if 1 < last - first + 1 < len(numbers)
        ]
        return [{"element": number} for number in numbers if len(numbers) > 1] + longer

    def tension_side(self, element: int | None) -> int:
        """On which side of an element bending by the weight stretches the shaft: there a crack is open.

        It is the lower side between bearings and the upper one of an overhung end. The bearings are taken as rigid,
        which is exact for two of them: the moment then follows from equilibrium alone.

        Parameters
        ----------
        element : int or None
            None for a crack whose place along the shaft is not known.

        Returns
        -------
        int
            1 below (also where the moment is zero or not known), -1 above.
        """
        if element is None or self.curvature_at is None:
            return 1
        return -1 if self.curvature_at(element) @ self._deflection_on_rigid_bearings > 0 else 1

    def tension_side_at(self, section: Section) -> int:
        """On which side of a cross section bending by the weight stretches the shaft; see `tension_side`.

        Parameters
        ----------
        section : Section
            Of this rotor.

        Returns
        -------
        int
            1 below (also where the moment is zero or not known), -1 above.
        """
        return -1 if section.moment @ self._deflection_on_rigid_bearings + section.own_moment > 0 else 1

    def bearing_load(self, node: int) -> float:
        """Static load on the bearing at a node, N downward, if the bearings are rigid.

        That is exact for two bearings: the loads then follow from equilibrium alone.

        Parameters
        ----------
        node : int
            Of a bearing.

        Returns
        -------
        float
            Zero where there is no gravity; negative if the rotor lifts there.

        Raises
        ------
        CannotAct
            If the node cannot move, or the bearings do not carry the rotor.
        """
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


def _is_regular(stiffness):
    """Whether a stiffness matrix (dof, dof) carries every load."""
    scale = np.sqrt(np.abs(np.diag(stiffness)))  # translations and tilts have different units
    return bool(scale.all() and np.linalg.cond(stiffness / np.outer(scale, scale)) < 1e14)


def at_supports(structure, sensors):
    """Places of an effect of the supports: the nodes of the bearings; without bearings, every node."""
    return [{"node": node} for node in structure.nodes if node in (structure.bearing_nodes or structure.nodes)]
