"""The rotor without its effects: matrices, coordinates and nodes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rotorstudy.errors import CannotAct, check_known, unknown_name
from rotorstudy.model.scales import Scales
from rotorstudy.model.shaft import RigidDisc, Shaft
from rotorstudy.model.terms import Term
from rotorstudy.model.variation import Matrices


@dataclass(frozen=True)
class Reading:
    """The axes in which records were read."""

    probes: dict = field(default_factory=dict)  # node -> {name: rad from x in the sense of rotation}, else x and y
    gravity_rad: float = 0.0  # direction of gravity in the user's angles
    mark_rad: float = 0.0  # angle of the shaft's reference line from x when the phase mark passes

    def probes_at(self, node: int) -> dict[str, float]:
        """{name: direction (rad)} of the probes of a node."""
        return self.probes.get(node, {"x": 0.0, "y": np.pi / 2})

    def axis(self, node: int) -> complex:
        """Direction e^{ja} of probe x of a node: of its first two the one from which the other is ahead."""
        first, *others = np.exp(1j * np.array(list(self.probes_at(node).values())[:2]))
        second = others[0] if others else 1j * first
        return complex(first if (np.conj(first) * second).imag > 0 else second)


@dataclass(frozen=True, eq=False)
class Structure(Shaft):
    """The rotor without its effects: M q'' - j w G q' + K q = f, in complex nodal coordinates.

    mass, stiffness, gyroscopic : (dof, dof)
    static_load : (dof,) gravity, real part along the downward x axis, N (N m for a tilt)
    dofs        : one (node, "translation", "tilt" or "housing") for each coordinate; a housing is what a bearing
                  stands on, see `bearings`
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
    bearings    : their terms, set where a rig is read
    labels      : node -> what the rig calls the disc or bearing there, set where a rig is read
    gravity     : its acceleration, m/s^2; None if it follows from the static load, see `acceleration_of_gravity`
    support     : (dof, dof) static stiffness of the bearings, N/m; for usual sizes alone, as bearings are terms
    vibration   : usual vibration in the records to be explained, m; for usual sizes alone
    vibrations  : node -> largest vibration there that these tell of, m; likewise
    origin      : the Holder of its numbers, see `rotorstudy.model.rig_numbers`, set where a rig is read; else None
    riding      : node with a sensor -> node on whose housing it rides
    foundation  : the Terms of what the bearings stand on
    films       : the Films, see `rotorstudy.model.rig_numbers`, set where a rig is read
    casings     : number of a transducer on a housing -> node of the bearing in it
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
    bearings: tuple[Term, ...] = ()
    labels: dict = field(default_factory=dict)
    gravity: float | None = None
    support: np.ndarray | None = None
    vibration: float = 0.0
    vibrations: dict = field(default_factory=dict)
    origin: Any = None
    riding: dict = field(default_factory=dict)
    casings: dict = field(default_factory=dict)
    foundation: tuple = ()
    films: tuple = ()
    reading: Reading = field(default_factory=Reading)

    def __post_init__(self):
        for matrix in (self.mass, self.stiffness, self.gyroscopic, self.static_load):
            if isinstance(matrix, np.ndarray):  # a plugin that writes into one would change every rig of the rotor
                matrix.setflags(write=False)

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
        loads = sum(film.load for film in self.films)  # of a machine that stands upright
        acceleration = self.acceleration_of_gravity or loads / (self.along @ self.mass @ self.along)
        own = self.mass, self.supported_stiffness, self.along, acceleration
        return Scales(*own, self.length, self.vibration, self.vibrations, self.index)

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
        """Nodes of the shaft that can translate; a node on a rigid support only tilts."""
        return tuple(sorted({node for node, motion in self.dofs if motion == "translation"}))

    @property
    def measurable(self) -> tuple[int, ...]:
        """Nodes at which a sensor may be, and numbers of transducers on housings."""
        return (*self.nodes, *self.casings)

    @cached_property
    def housings(self) -> tuple[int, ...]:
        """Nodes whose bearings stand on a foundation that moves."""
        return tuple(node for node, motion in self.dofs if motion == "housing")

    def index(self, node: int | None, motion: str = "translation") -> int:
        """Position of a coordinate.

        Parameters
        ----------
        node : int or None
            Node of the rotor, the only one if None, or number of a transducer on a housing.
        motion : str
            "translation" or "tilt".

        Returns
        -------
        int
            Position among `dofs`.

        Raises
        ------
        CannotAct
            If there is no such node, or several and none is given.
        """
        node = self.default_node() if node is None else node
        if node in self.casings and motion == "translation":
            node, motion = self.casings[node], "housing"
        if (node, motion) not in self.dofs:
            known = [n for n, m in self.dofs if m == motion]
            if not known:
                raise CannotAct(
                    f"this rotor has no {motion} coordinates; a plugin that needs them offers the nodes that have one "
                    "by 'places='"
                )
            held = motion != "translation" or any(n == node for n, _ in self.dofs)
            raise unknown_name(f"{motion} at node" if held else "node", node, known, "the rotor", CannotAct)
        return self.dofs.index((node, motion))

    def unit(self, node: int | None, motion: str = "translation") -> np.ndarray:
        """Vector with a one at a coordinate.

        Parameters
        ----------
        node : int or None
            As of `index`.
        motion : str
            "translation" or "tilt".

        Returns
        -------
        array (dof,)
            Of unit 1.

        Raises
        ------
        CannotAct
            As `index`.
        """
        here = np.zeros(len(self.dofs))
        here[self.index(node, motion)] = 1.0
        return here


def at_supports(structure, sensors):
    """Places of an effect of the supports: the nodes of the bearings; without bearings, every node."""
    return [{"node": node} for node in structure.nodes if node in (structure.bearing_nodes or structure.nodes)]


def across(structure, node, element, motion):
    """Row (dof,) of the motion at a coupling: at a node, or of an element, of its first end against its last one."""
    if element is None:
        return structure.unit(node, motion)
    if node is not None:
        raise CannotAct("give the node or the element of the coupling, not both")
    return structure.unit(element, motion) - structure.unit(element + 1, motion)


def spacers(structure):
    """Elements {"element": node} that bend at least twice as easily as both neighbours: couplings, quill shafts."""
    return [{"element": element} for element in structure.soft_elements]


def couples_a_driver(structure, node=None, element=None):
    """How often a coupling is at a place, by `place_rate`: an end of the shaft, a softer element or its hubs."""
    nodes, soft = [node for node, _ in structure.dofs], structure.soft_elements
    hubs = {min(nodes), max(nodes), *soft, *(first + 1 for first in soft)}
    return float(node in hubs or element in soft)


def sensor_unit(sensors, node=None):
    """Vector (sensor,) with a one at the sensor of a node, by default the first; a node without one is an error."""
    node = sensors[0] if node is None else node
    check_known("sensor at node", [node], sensors, "the rig", CannotAct)
    return np.eye(len(sensors))[sensors.index(node)]


def probe_axis(structure, sensors, node=None):
    """Direction e^{ja} of the probe x of a node, by default of the first sensor; y is 90 degrees ahead of it."""
    return structure.reading.axis(sensors[0] if node is None else node)
