from typing import Literal

import numpy as np

from rotorstudy.plugins import AtLeastOne, Effect, Entry, Parameter, TypedDict, outer

Motion = Literal["translation", "tilt"]


class Place(TypedDict):
    row_node: int
    row_motion: Motion
    node: int
    motion: Motion
    lever_m: float


@Effect(
    source="Newton; plane y for thesis Tables 6.2 to 6.7",
    brings=("unbalance",),
    checked="response equal to that of a rotor built with M + m to 1e-11; thesis Tables 6.2 to 6.7 with plane y",
    confounders={
        "pedestal_resonance": "a mass acts at all frequencies alike; measure the motion of the pedestal",
        "seal": "the mass of the fluid comes with its damping, and only in the full machine",
        "stiffness_error": "stiffness dominates below the critical speed, mass above it; a mass has weight (0X)",
        "speed_error": "equal if all masses are off by the same share and nothing tilts; use a second tachometer",
        "gyroscopic_error": "gyroscopic moments change sign between forward and backward harmonics, inertia not",
    },
)
def added_mass(
    structure, node: int | None = None, places: AtLeastOne[Place] | None = None, plane: Literal["both", "y"] = "both"
):
    """Additional mass with its weight: force -m W (d2q/dt2 - g), at a node or at given `places` of the mass matrix.

    places: rows and columns of W, with a lever where a translation is coupled with a tilt;
    plane y: horizontal motion only, without weight, as for a misprinted mass matrix of one plane.
    """
    if places is None:
        here = structure.unit(node)
        pattern = outer(here)
    else:
        ends = [((p["row_node"], p["row_motion"]), (p["node"], p["motion"]), p["lever_m"]) for p in places]
        pattern = sum(lever * np.outer(structure.unit(*row), structure.unit(*column)) for row, column, lever in ends)
    weight = structure.acceleration_of_gravity * pattern @ structure.along
    entries = (Entry(-pattern, order=2), Entry(weight, on="one"))
    if plane == "y":
        entries = (Entry(-pattern / 2, order=2), Entry(pattern / 2, on="conj", order=2))
    return [Parameter("added_mass", "kg", entries, typical=0.05 * structure.scales.mass)]
