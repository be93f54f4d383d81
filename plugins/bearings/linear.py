from typing import Literal

import numpy as np

from rotorstudy.plugins import Bearing, Entry, NonNegative, Parameter, planar_entries

DIRECTIONS = {"isotropic": (), "anisotropic": ("xx", "yy"), "full": ("xx", "xy", "yx", "yy")}


@Bearing(
    source="Nelson and McVaugh 1976; thesis Chapter 6",
    checked="closed forms: force on an elliptic orbit, unbalance response and whirl threshold of one mass",
    positive_damping=True,
    symmetric=True,
)
def linear(
    structure,
    node: int | None = None,
    coefficients: Literal["isotropic", "anisotropic", "full"] = "isotropic",
    mass_kg: NonNegative = 0.0,
):
    """Spring and damper between a node and the ground: force -(K r + C dr/dt), r = (x, y).

    coefficients: isotropic has one stiffness and one damping; anisotropic has them for x and for y; full also has
    cross-coupling (k_xy is the force along x due to a displacement along y). mass_kg moves with the journal, without
    weight; an item of point_masses of the rotor has weight, too.
    """
    here = structure.unit(node)
    here, parameters = np.outer(here, here), []
    for name, unit, order, typical in (
        ("stiffness", "N/m", 0, 13 * structure.scales.stiffness(node)),
        ("damping", "N s/m", 1, 0.4 * structure.scales.critical_damping(node)),
    ):
        if coefficients == "isotropic":
            parameters.append(Parameter(f"bearing_{name}", unit, (Entry(-here, order=order),), typical))
        for direction in DIRECTIONS[coefficients]:
            entries = planar_entries(direction, -here, order)
            parameters.append(Parameter(f"bearing_{name}_{direction}", unit, entries, typical))
    if mass_kg:
        inertia = Entry(-mass_kg * here, order=2)
        parameters.append(Parameter("bearing_mass_scale", "1", (inertia,), typical=1.0, default=1.0))
    return parameters
