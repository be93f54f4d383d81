"""Bearings: the load they carry, their dynamic stiffness, and the housings that those on a foundation have.

A housing has a coordinate (node, "housing") beside those of the rotor. The items of the section `foundation:` are those
of a bearing, between the housing and the ground; the bearing at that node then acts between journal and housing.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.entries import Entry, apply_entries
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term

SPEEDS_TRIED = 12  # halved each time, to find one at which a bearing is defined


def on_housings(function: Callable, nodes: Iterable[int]) -> Callable:
    """A function that builds the Structure of another one with a coordinate more for the housing at each node."""
    nodes = tuple(nodes)
    if not nodes:
        return function

    def built(**options):
        structure = function(**options)
        more = len(nodes)

        def longer(array):
            return np.pad(array, (0, more))

        def section(at):
            found = structure.section_at(at)
            return found._replace(moment=longer(found.moment))

        def loss(of):
            return {name: (longer(pattern), *rest) for name, (pattern, *rest) in of.items()}

        given, matrices = structure.stiffness_loss, structure.matrices._asdict()
        return replace(
            structure,
            **{name: longer(matrix) for name, matrix in matrices.items()},
            dofs=(*structure.dofs, *((node, "housing") for node in nodes)),
            stiffness_loss=(lambda *at: loss(given(*at))) if callable(given) else loss(given),
            shape_at=structure.shape_at and (lambda at: longer(structure.shape_at(at))),
            curvature_at=structure.curvature_at and (lambda at: longer(structure.curvature_at(at))),
            section_at=structure.section_at and section,
        )

    return built


def at_housings(structure: Structure, parameters: tuple[Parameter, ...], *, from_ground: bool) -> tuple:
    """Parameters whose forces between a node and the ground act between housing and ground, or journal and housing."""
    seen = np.eye(len(structure.dofs))  # what the force reads as the motion of the node
    for node in structure.housings:
        journal, housing = structure.index(node), structure.index(node, "housing")
        seen[journal, housing] = 1.0 if from_ground else -1.0
        seen[journal, journal] = 0.0 if from_ground else 1.0

    def moved(parameter):
        force = parameter.force and replace(parameter.force, matrix=parameter.force.matrix @ seen)
        each = {id(entry.matrix): entry.matrix for entry in parameter.entries}  # those of a film share one
        each = {key: seen.T @ np.asarray(one) for key, one in each.items()}
        each = {key: one if one.ndim == 1 else one @ seen for key, one in each.items()}
        entries = tuple(replace(entry, matrix=each[id(entry.matrix)]) for entry in parameter.entries)
        return replace(parameter, entries=entries, force=force)

    return tuple(map(moved, parameters)) if structure.housings else tuple(parameters)


def weight_carried(structure, node=None):
    """Load (N, downward) of a film bearing by the weight if all bearings are rigid; an error if it has none."""
    node = structure.default_node() if node is None else node
    load = structure.bearing_load(node)
    if not load > 0:
        raise RotorstudyError(
            f"the weight of the rotor loads the bearing at node {node} by {load:.3g} N; a film bearing needs a load "
            "downward, so state load_N (with forces of belts or gears) or another bearing"
        )
    return load


def running_position(kind: str, options: dict) -> Callable | None:
    """Function speed, rad/s -> where a journal runs in its bearing, m, complex, from the middle, real along gravity.

    None of a bearing that does not know it.
    """
    running = getattr(registry().plugins["bearing"].get(kind), "running", None)
    if running is None:
        return None
    given = {name: value for name, value in options.items() if name != "node"}

    @lru_cache(maxsize=256)
    def position(speed):
        eccentricity, attitude = running(speed, **given)
        return given["radial_clearance_m"] * eccentricity * np.exp(1j * attitude)

    return position


def journal_shift(structure: Structure, node: int, parameters: tuple, before: Callable, after: Callable, more: complex):
    """The parameters of a film with the constant force that takes its journal from where it ran to where it runs.

    Displacements count from p0, where the journal of the sound machine runs. With the stiffness K at p, where it runs
    now, the film adds the force K (p - p0), less the load F that it carries more at p.

    before, after : p0 and p, as `running_position` gives them;  more : F, N, complex
    """
    (film, *others), here = parameters, structure.index(node)
    springs = [(e, -complex(np.asarray(e.matrix)[here, here])) for e in film.entries if e.reads_motion and not e.order]

    def force(speed):
        moved = np.reshape([after(w) - before(w) for w in np.ravel(speed).tolist()], np.shape(speed))
        each = (size * e.gain_at(speed, 0) * (moved.conj() if e.is_conjugate else moved) for e, size in springs)
        return sum(each) - more

    return replace(film, entries=(*film.entries, Entry(structure.unit(node), on="one", gain=force))), *others


def springs_at_rest(structure: Structure, term: Term) -> np.ndarray:
    """Static stiffness (part, dof, part, dof), N/m, of a term at a usual speed, by real and imaginary parts.

    It is a typical one where it is not stated.
    """
    dof, speeds = len(structure.dofs), structure.scales.frequency * 0.5 ** np.arange(SPEEDS_TRIED)
    found = np.zeros((2, dof, 2, dof))
    for unknown, value in zip(term.unknowns, term.theta, strict=True):
        size = unknown.typical if np.isnan(value) else value
        for entry in unknown.springs:
            spring = -size * _gain_somewhere(entry, speeds) * np.asarray(entry.matrix)
            for part, own in enumerate((spring, -1j * spring if entry.is_conjugate else 1j * spring)):
                found[:, :, part] += own.real, own.imag
    return found


def _gain_somewhere(entry, speeds):
    """Gain of an entry at 0X at the first of some speeds where it exists; 0 if at none."""
    for speed in speeds:
        with suppress(RotorstudyError):  # outside its table, or without a film
            return complex(entry.gain_at(speed, 0))
    return 0.0


def dynamic_stiffness(term, speed, harmonics):
    """Dynamic stiffness (speed, harmonic, force, motion), N/m, of a bearing on one coordinate: force = -Z (X, Y)."""
    speed, found = np.asarray(speed, float), []
    for n in harmonics:
        columns = []
        for x, y in ((1, 0), (0, 1)):
            amplitude = np.empty((len(speed), 2, 1), complex)
            amplitude[:, 0], amplitude[:, 1] = (x + 1j * y) / 2, np.conj(x - 1j * y) / 2  # harmonics n and -n of z
            force = sum(
                value * apply_entries(unknown.entries, amplitude, speed, [n, -n])[..., 0]
                for value, unknown in zip(term.theta, term.unknowns, strict=True)
            )
            forward, mirrored = force[:, 0], np.conj(force[:, 1])
            columns.append([forward + mirrored, (forward - mirrored) / 1j])
        found.append(-np.array(columns))
    return np.transpose(found, (3, 0, 2, 1))
