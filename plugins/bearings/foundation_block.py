from itertools import chain

import numpy as np

from rotorstudy.plugins import Bearing, Entry, Parameter, Positive, RotorstudyError, planar_entries


@Bearing(
    source="Newton for a rigid body; Vance, Zeidan and Murphy 2010, Machinery Vibration and Rotordynamics",
    checked="equations of motion written out by hand; records of an independent simulator with such a block",
    positive_damping=True,
    symmetric=True,
)
def foundation_block(
    structure,
    node: int | None = None,
    second_node: int | None = None,
    feet_m: list[float] | None = None,
    centre_m: float | None = None,
    radius_of_gyration_m: Positive | None = None,
):
    """Rigid block on springs and dampers that carries one bearing or two, in the section `foundation`.

    The bearings at node and second_node stand on it. Under two the block also rocks: its stiffness and damping are
    those of all its feet together, at the places feet_m along the shaft (by default under the bearings); its centre of
    mass is at centre_m (by default in the middle between the bearings), its radius of gyration about it by default that
    of a bar of that length, 0.29 times the distance of the bearings. The forces are -(K r + C dr/dt + M d2r/dt2) on the
    motion r of the housings.
    """
    node = structure.default_node() if node is None else node
    unit = structure.unit(node)
    if second_node is None:
        feet, inertia = [unit], np.outer(unit, unit)
    elif second_node == node:
        raise RotorstudyError(f"foundation_block: second_node = {node} is its node; give that of another bearing")
    else:
        other = structure.unit(second_node)
        first, last = structure.node_positions[node], structure.node_positions[second_node]
        middle, span = (first + last) / 2, last - first

        def at(place):
            """Row (dof,) of the motion of the block at a place, m, by that of the housings."""
            return ((last - place) * unit + (place - first) * other) / span

        centre, feet = at(middle if centre_m is None else centre_m), list(map(at, feet_m or [first, last]))
        rocking = (other - unit) / span
        gyration = abs(span) / 12**0.5 if radius_of_gyration_m is None else radius_of_gyration_m
        inertia = np.outer(centre, centre) + gyration**2 * np.outer(rocking, rocking)
    scales = structure.scales
    parameters = [Parameter("foundation_mass", "kg", (Entry(-inertia, order=2),), 10 * scales.mass)]
    for name, unit, order, typical in (
        ("stiffness", "N/m", 0, 13 * scales.stiffness(node)),
        ("damping", "N s/m", 1, 0.4 * scales.critical_damping(node)),
    ):
        for direction in ("xx", "yy"):  # with entries of each foot
            each = (planar_entries(direction, -np.outer(row, row) / len(feet), order) for row in feet)
            parameters.append(Parameter(f"foundation_{name}_{direction}", unit, tuple(chain(*each)), typical))
    return parameters
