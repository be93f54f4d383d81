"""What bearings stand on: coordinates of their housings, and forces and readings against them.

A housing has a coordinate (node, "housing") beside those of the rotor. The items of the section `foundation:` are those
of a bearing, between the housing and the ground; the bearing at that node then acts between journal and housing.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter


def on_housings(function: Callable, nodes: Iterable[int]) -> Callable:
    """A function that builds the Structure of another one with a coordinate more for the housing at each node."""
    nodes = tuple(nodes)

    def built(**options):
        structure = function(**options)
        more = len(nodes)

        def longer(row):
            return np.pad(row, (0, more))

        def loss(of):
            return {name: (np.pad(pattern, (0, more)), *rest) for name, (pattern, *rest) in of.items()}

        given = structure.stiffness_loss
        return replace(
            structure,
            **{name: np.pad(getattr(structure, name), (0, more)) for name in ("mass", "stiffness", "gyroscopic")},
            static_load=longer(structure.static_load),
            dofs=(*structure.dofs, *((node, "housing") for node in nodes)),
            stiffness_loss=(lambda *at: loss(given(*at))) if callable(given) else loss(given),
            shape_at=structure.shape_at and (lambda at: longer(structure.shape_at(at))),
            curvature_at=structure.curvature_at and (lambda at: longer(structure.curvature_at(at))),
            section_at=structure.section_at and (lambda at: _longer_section(structure.section_at(at), longer)),
        )

    return built


def _longer_section(section, longer):
    return section._replace(moment=longer(section.moment))


def at_housings(structure: Structure, parameters: tuple[Parameter, ...], *, from_ground: bool) -> tuple:
    """Parameters whose forces between a node and the ground act between housing and ground, or journal and housing."""
    seen = np.eye(len(structure.dofs))  # what the force reads as the motion of the node
    for node in structure.housings:
        journal, housing = structure.index(node), structure.index(node, "housing")
        seen[journal, housing] = 1.0 if from_ground else -1.0
        seen[journal, journal] = 0.0 if from_ground else 1.0

    def moved(parameter):
        force = parameter.force and replace(parameter.force, matrix=parameter.force.matrix @ seen)
        entries = tuple(replace(entry, matrix=_moved(np.asarray(entry.matrix), seen)) for entry in parameter.entries)
        return replace(parameter, entries=entries, force=force)

    return tuple(map(moved, parameters)) if structure.housings else tuple(parameters)


def _moved(matrix, seen):
    return seen.T @ matrix if matrix.ndim == 1 else seen.T @ matrix @ seen


def housings_of(key: str, probes: list, bearings: dict, housings: tuple, sensors: tuple, where: str) -> dict:
    """{node of a probe: node of the housing that a key names}, from the items of `measurement: probes:`.

    key : "relative_to", of probes that ride on a housing, or "on", of transducers on it;  bearings : name -> node
    """
    found = {}
    for i, probe in enumerate(probes):
        place, to = f"{where}, measurement.probes[{i}]", probe.get(key)
        for node in [probe["node"]] if probe.get("node") is not None else sensors:
            known = {**bearings, "bearing": node}
            if to is not None and known.get(to) not in housings:
                raise RotorstudyError(
                    f"{key} = {to!r} in {place}: must be a bearing on the foundation, by its label or node, or "
                    f"'bearing' for the one at the probe's own node (on a foundation: nodes {list(housings)})"
                )
            housing = None if to is None else known[to]
            if found.setdefault(node, housing) != housing:
                raise RotorstudyError(f"{place}: all probes of node {node} need the same bearing under '{key}:'")
    return {node: housing for node, housing in found.items() if housing is not None}
