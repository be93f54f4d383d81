"""A model: base structure + terms + output terms, with the values of its amplitudes."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.terms import Term


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
    def nodes(self):
        """Nodes that can move; one that a rigid support holds only tilts."""
        return tuple(sorted({node for node, motion in self.dofs if motion == "translation"}))

    def index(self, node, motion="translation"):
        """Position of a coordinate; an unknown node is an error that lists the nodes there are."""
        if node is None:
            raise RotorstudyError(
                f"no node is given; say which of {list(self.nodes)} with 'node:' (a plugin takes the only one there is "
                "with structure.default_node() where its node is None)"
            )
        if (node, motion) not in self.dofs:
            raise unknown_name(f"{motion} at node", node, [n for n, m in self.dofs if m == motion], "the rotor")
        return self.dofs.index((node, motion))

    def unit(self, node, motion="translation"):
        """(dof,) vector with a one at a coordinate."""
        return np.eye(len(self.dofs))[self.index(node, motion)]

    def default_node(self):
        """The only node, or an error asking for one: effects that act at a node call this."""
        if len(self.nodes) > 1:
            raise RotorstudyError(f"this rotor has nodes {list(self.nodes)}; say which with 'node:'")
        return self.nodes[0]

    def stiffness_loss_at(self, node=None, element=None):
        """Stiffness losses, name -> (pattern, unit, typical), of a crack at a node or in an element.

        A rotor that can crack at one place only needs no place; the others raise where none, or two, are given.
        """
        if callable(self.stiffness_loss):
            if (node is None) == (element is None):
                raise RotorstudyError("this rotor can crack at several places; say where with 'node:' or 'element:'")
            if node is not None and node not in {n for n, _ in self.dofs}:
                raise unknown_name("node", node, {n for n, _ in self.dofs}, "the crack")
            return self.stiffness_loss(node, element)
        if element is not None or (node is not None and self.nodes != (node,)):
            place = f"node {node}" if element is None else f"element {element}"
            raise RotorstudyError(f"this rotor cannot crack at {place}; it has one place for a crack: leave it out")
        return self.stiffness_loss

    def crack_places(self):
        """Options that say where a crack can be: one place without options, or each element of the shaft."""
        if not callable(self.stiffness_loss):
            return [{}] if self.stiffness_loss else []
        found = []
        for element in range(1, max(node for node, _ in self.dofs) + 1):
            try:
                self.stiffness_loss(None, element)
            except RotorstudyError:
                break
            found.append({"element": element})
        return found

    @cached_property
    def is_supported(self):
        """Whether the shaft alone carries a load; otherwise bearings do, which are terms."""
        scale = np.sqrt(np.abs(np.diag(self.stiffness)))  # translations and tilts have different units
        return bool(scale.all() and np.linalg.cond(self.stiffness / np.outer(scale, scale)) < 1e14)

    @cached_property
    def static_deflection(self):
        """(dof,) deflection under the static load, from the bearing line; zeros if the shaft is not supported."""
        if not np.any(self.static_load) or not self.is_supported:
            return np.zeros(len(self.dofs))
        return np.linalg.solve(self.stiffness, self.static_load)


def sensor_unit(sensors, node=None):
    """(sensor,) vector with a one at the sensor of a node, the first by default; a node without sensor is an error."""
    node = sensors[0] if node is None else node
    if node not in sensors:
        raise unknown_name("sensor at node", node, sensors, "the rig")
    return np.eye(len(sensors))[sensors.index(node)]


@dataclass(frozen=True)
class Model:
    """Structure + terms; displacements count from the static deflection (see `statics`).

    sensors : nodes where the translation is measured (all by default)
    held_deflection : (dof,) or (..., speed, dof) deflection to take instead, whatever carries the rotor
    theta   : (parameter,) real amplitudes of `names`, rotor terms first, then output terms
    """

    structure: Structure
    terms: tuple[Term, ...] = ()
    sensors: tuple[int, ...] = ()
    held_deflection: np.ndarray | None = None

    def __post_init__(self):
        if not self.sensors:
            object.__setattr__(self, "sensors", self.structure.nodes)
        for node in self.sensors:
            self.structure.index(node)
        ordered = sorted(self.terms, key=lambda term: term.acts_on == "output")
        object.__setattr__(self, "terms", tuple(ordered))
        doubled = [name for name in self.names if self.names.count(name) > 1]
        if doubled:
            raise RotorstudyError(
                f"two terms share the amplitude {doubled[0]!r}; give each its own 'label:' to tell them apart"
            )

    @cached_property
    def unknowns(self):
        """Real amplitudes of all terms, in the order of `theta`."""
        return tuple(unknown for term in self.terms for unknown in term.unknowns)

    @cached_property
    def names(self):
        return tuple(unknown.name for unknown in self.unknowns)

    @cached_property
    def units(self):
        return tuple(unknown.unit for unknown in self.unknowns)

    @cached_property
    def typical(self):
        return np.array([unknown.typical for unknown in self.unknowns])

    @cached_property
    def theta(self):
        """(parameter,) the values given; an amplitude without one is an error that names it."""
        self.require_values()
        return np.concatenate([term.theta for term in self.terms]) if self.terms else np.zeros(0)

    def require_values(self):
        """Raise for amplitudes that have no value, and name them."""
        theta = np.concatenate([term.theta for term in self.terms]) if self.terms else ()
        missing = [name for name, value in zip(self.names, theta, strict=True) if np.isnan(value)]
        if missing:
            raise RotorstudyError(f"no value for {', '.join(missing)}; give one in the rig file to simulate")

    @cached_property
    def rotor_unknowns(self):
        return tuple(u for term in self.terms if term.acts_on == "rotor" for u in term.unknowns)

    @cached_property
    def local_forces(self):
        """(position in `rotor_unknowns`, LocalForce) of the amplitudes that multiply a force in time."""
        return tuple((p, u.force) for p, u in enumerate(self.rotor_unknowns) if u.force)

    @cached_property
    def output_unknowns(self):
        return tuple(u for term in self.terms if term.acts_on == "output" for u in term.unknowns)

    @cached_property
    def measured(self):
        """(sensor,) positions of the measured translations among the coordinates."""
        return np.array([self.structure.index(node) for node in self.sensors])

    @cached_property
    def involved(self):
        """(coordinate,) positions of those that are measured, read or acted on by a term; the rest pass forces on."""
        seen = np.zeros(len(self.structure.dofs), bool)
        seen[self.measured] = True
        for entry in (e for u in self.rotor_unknowns for e in u.entries):
            matrix = np.asarray(entry.matrix)
            seen |= matrix != 0 if matrix.ndim == 1 else (matrix != 0).any(axis=0) | (matrix != 0).any(axis=1)
        for _, force in self.local_forces:
            seen |= np.any(force.matrix, axis=0)
        return np.flatnonzero(seen | (self.static_residual != 0))

    @cached_property
    def is_carried(self):
        """Whether bearings carry the static load, alone or beside the shaft's own supports."""
        return any(unknown.carries for unknown in self.rotor_unknowns)

    @cached_property
    def static_residual(self):
        """(dof,) static load that the static deflection does not carry, N; an error if nothing carries it."""
        structure = self.structure
        if self.is_carried or self.held_deflection is not None or structure.is_supported:
            return np.zeros(len(structure.dofs))
        springs = (e for u in self.rotor_unknowns for e in u.entries if e.on == "z" and not (e.order or e.shift))
        if structure.static_load.any() and not any(springs):
            raise RotorstudyError("nothing carries the rotor against its weight; add bearings, or support it rigidly")
        return structure.static_load

    def position(self, names):
        """Positions of amplitudes by name in `theta`."""
        for name in names:
            if name not in self.names:
                raise unknown_name("parameter", name, self.names, "this model")
        return np.array([self.names.index(name) for name in names], int)

    def unknown_names(self, wanted=None):
        """Names of the real amplitudes to estimate: those wanted, or those without a value.

        A complex amplitude can be named as a whole: eccentricity stands for its real and imaginary part.
        """
        if wanted is None:
            given = np.concatenate([term.theta for term in self.terms]) if self.terms else np.zeros(0)
            found = [name for name, value in zip(self.names, given, strict=True) if np.isnan(value)]
            if not self.names:
                raise RotorstudyError("the model has no parameters to estimate; add effects or a crack to the rig")
            if not found:
                raise RotorstudyError(
                    f"the rig gives every parameter a value; name the unknown ones (of {', '.join(self.names)})"
                )
            return tuple(found)
        found = []
        for name in wanted:
            parts = [f"{name}_real", f"{name}_imag"]
            found += parts if parts[0] in self.names else [name]
        self.position(found)
        if len(set(found)) < len(found):
            raise RotorstudyError(f"unknowns {list(wanted)}: a parameter is named twice")
        return tuple(found)

    def reported_units(self, names):
        """Units of amplitudes as reported: of a magnitude its own, of a phase rad."""
        known = dict(zip(self.names, self.units, strict=True))
        return ["rad" if n.endswith("_phase") else known.get(n, known.get(f"{n}_real")) for n in names]

    def without(self, kinds):
        """The model with the terms of some kinds taken out."""
        return replace(self, terms=tuple(term for term in self.terms if term.kind not in kinds))

    def plus(self, *terms):
        """The model extended by terms."""
        return replace(self, terms=self.terms + terms)
