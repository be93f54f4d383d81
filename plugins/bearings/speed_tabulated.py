from typing import NotRequired

import numpy as np

from rotorstudy.plugins import AtLeastOne, Bearing, Parameter, RotorstudyError, TypedDict, planar_entries


class Table(TypedDict):
    """One value per speed; an omitted direction is zero."""

    xx: NotRequired[list[float]]
    xy: NotRequired[list[float]]
    yx: NotRequired[list[float]]
    yy: NotRequired[list[float]]


@Bearing(
    source="Lund 1987, Review of the concept of dynamic coefficients for fluid film journal bearings",
    example={
        "speeds_rad_per_s": [0.0, 1000.0],
        "stiffness_N_per_m": {"xx": [3e5, 2e5], "xy": [5e4, 9e4], "yx": [-4e4, -7e4], "yy": [2e5, 3e5]},
        "damping_N_s_per_m": {"xx": [300.0, 200.0], "yy": [200.0, 200.0]},
    },
    checked="equal to the linear bearing at its coefficients between two speeds of the table",
    positive_damping=True,
)
def speed_tabulated(
    structure,
    speeds_rad_per_s: AtLeastOne[float],
    stiffness_N_per_m: Table,
    damping_N_s_per_m: Table | None = None,
    mass_kg: Table | None = None,
    node: int | None = None,
):
    """Coefficients over speed, linearly interpolated, of a tilting pad or other bearing or a seal, times bearing_scale.

    mass_kg holds the added masses of a seal; they have inertia and no weight.
    """
    speeds = np.array(speeds_rad_per_s)
    if (np.diff(speeds) <= 0).any():
        raise RotorstudyError(f"speed_tabulated: speeds_rad_per_s = {speeds_rad_per_s} must be strictly increasing")
    node = structure.default_node() if node is None else node
    here, entries = np.outer(structure.unit(node), structure.unit(node)), []
    tables = {"stiffness_N_per_m": stiffness_N_per_m, "damping_N_s_per_m": damping_N_s_per_m, "mass_kg": mass_kg}
    for order, (name, table) in enumerate(tables.items()):
        for direction, values in (table or {}).items():
            if len(values) != len(speeds):
                raise RotorstudyError(
                    f"speed_tabulated: {name}.{direction} has {len(values)} values for {len(speeds)} speeds; "
                    "give one per speed"
                )
            entries += planar_entries(direction, -here, order, interpolation(speeds, np.array(values), node))
    if not entries:
        raise RotorstudyError("speed_tabulated: stiffness_N_per_m has no direction; give xx, yy, xy or yx")
    return [Parameter("bearing_scale", "1", tuple(entries), typical=1.0, default=1.0)]


def interpolation(speeds, values, node):
    """The gain of one coefficient by linear interpolation; a speed outside the table is an error."""

    def gain(speed):
        outside = (speed < speeds[0]) | (speed > speeds[-1])
        if np.any(outside):
            raise RotorstudyError(
                f"speed {np.asarray(speed)[outside].flat[0]:g} rad/s is outside the table of the bearing at node "
                f"{node}, {speeds[0]:g} to {speeds[-1]:g} rad/s; extend the table or leave that speed out"
            )
        return np.interp(speed, speeds, values)

    return gain
