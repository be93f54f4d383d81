"""The rotor without its effects: matrices, coordinates and where things can sit."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rotorstudy.errors import CannotAct, unknown_name


@dataclass(frozen=True)
class Structure:
    """The rotor without its effects: M q'' - j w G q' + K q = f, in complex nodal coordinates.

    mass, stiffness, gyroscopic : (dof, dof)
    static_load : (dof,) gravity, real part along the downward x axis, N (N m for a tilt)
    dofs        : one (node, "translation" or "tilt") for each coordinate
    stiffness_loss : name -> (pattern (dof, dof), unit, typical), the stiffness a crack takes away; where it can be at
                     several places, a function(node, element) -> such a dict, one of the two being None
    shape_at    : position along the shaft, m -> (dof,) what each coordinate moves the shaft there; None if not known
    """

    mass: np.ndarray
    stiffness: np.ndarray
    gyroscopic: np.ndarray
    static_load: np.ndarray
    dofs: tuple[tuple[int, str], ...]
    stiffness_loss: dict | Callable = field(default_factory=dict)
    shape_at: Callable | None = None

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes that can move; one that a rigid support holds only tilts."""
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
            If no node is given, or one without that motion; it lists those that have it.
        """
        if node is None:
            raise CannotAct(
                f"no node is given; say which of {list(self.nodes)} with 'node:' (a plugin takes the only one there is "
                "with structure.default_node() where its node is None)"
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

    def default_node(self) -> int:
        """The only node: effects that act at a node call this where none is given.

        Returns
        -------
        int

        Raises
        ------
        CannotAct
            If the rotor has several nodes, asking for one.
        """
        if len(self.nodes) > 1:
            raise CannotAct(f"this rotor has nodes {list(self.nodes)}; say which with 'node:'")
        return self.nodes[0]

    def stiffness_loss_at(
        self, node: int | None = None, element: int | None = None
    ) -> dict[str, tuple[np.ndarray, str, float]]:
        """Stiffness losses of a crack at a node or in an element.

        A rotor that can crack at one place only needs no place.

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
            If no place or two are given where the rotor can crack at several, or one where it cannot crack.
        CannotAct
            If the rotor cannot crack at that place.
        """
        if callable(self.stiffness_loss):
            if (node is None) == (element is None):
                raise CannotAct("this rotor can crack at several places; say where with 'node:' or 'element:'")
            if node is not None and node not in {n for n, _ in self.dofs}:
                raise unknown_name("node", node, {n for n, _ in self.dofs}, "the crack", CannotAct)
            return self.stiffness_loss(node, element)
        if element is not None or (node is not None and self.nodes != (node,)):
            place = f"node {node}" if element is None else f"element {element}"
            raise CannotAct(f"this rotor cannot crack at {place}; it has one place for a crack: leave it out")
        return self.stiffness_loss

    def crack_places(self) -> list[dict]:
        """Options that say where a crack can be: one place without options, or each element of the shaft.

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

    @cached_property
    def is_supported(self) -> bool:
        """Whether the shaft alone carries a load; otherwise bearings do, which are terms."""
        scale = np.sqrt(np.abs(np.diag(self.stiffness)))  # translations and tilts have different units
        return bool(scale.all() and np.linalg.cond(self.stiffness / np.outer(scale, scale)) < 1e14)

    @cached_property
    def static_deflection(self) -> np.ndarray:
        """Deflection (dof,) under the static load from the bearing line, m (rad); zeros if not supported."""
        if not np.any(self.static_load) or not self.is_supported:
            return np.zeros(len(self.dofs))
        return np.linalg.solve(self.stiffness, self.static_load)


def sensor_unit(sensors, node=None):
    """(sensor,) vector with a one at the sensor of a node, the first by default; a node without sensor is an error."""
    node = sensors[0] if node is None else node
    if node not in sensors:
        raise unknown_name("sensor at node", node, sensors, "the rig", CannotAct)
    return np.eye(len(sensors))[sensors.index(node)]
