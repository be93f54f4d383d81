"""The places of a rotor at which a fault may act, with the forces there."""

from collections.abc import Iterator

import numpy as np

from rotorstudy.model.structure import Structure

INTERNAL = 2  # independent loads of an element at rest: a constant and a linear bending moment


def places_of(structure: Structure) -> Iterator[tuple[tuple[str, int, str], np.ndarray]]:
    """((kind of place, its number, kind of force), rows (row, dof)) of every node, bearing on a foundation and element.

    A bearing on a foundation that moves acts between journal and housing.
    """
    units = np.eye(len(structure.dofs))
    kinds = {"translation": "force", "tilt": "moment"}
    for (node, motion), row in zip(structure.dofs, units, strict=True):
        if motion in kinds:
            yield ("node", node, kinds[motion]), row[None]
    for node in structure.housings:
        yield ("bearing", node, "force"), structure.against_casing(node)[None]
        yield ("foundation", node, "force"), structure.unit(node, "housing")[None]
    for place in structure.crack_places():
        if "element" in place and structure.curvature_at is not None:
            stiffness = structure.stiffness_of(place["element"])
            here, rows = np.flatnonzero(stiffness.any(axis=0)), np.zeros((INTERNAL, len(units)))
            rows[:, here] = np.linalg.svd(stiffness[np.ix_(here, here)])[0][:, :INTERNAL].T
            yield ("element", place["element"], "bending"), rows
