import numpy as np

from rotorstudy.plugins import Bearing, Entry, Parameter


@Bearing(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
    positive_damping=True,  # a claim; `rotorstudy check` checks each claim both ways
)
def my_model(structure, node: int | None = None):
    """Spring with cross-coupling, and a damper: force -(k (1 + j/10) + c d/dt) z."""
    # Arguments after `structure` are options in the rig file; put the unit of a number in its name, as `length_m`.
    here = np.outer(structure.unit(node), structure.unit(node))
    # An entry is a force: matrix @ (d/dt)^order of z, of its conjugate (on="conj") or of a constant (on="one").
    # gain=lambda speed: ... makes it depend on the spin speed in rad/s, shift=k multiplies it by e^{jkwt}.
    return [
        Parameter(
            "bearing_stiffness", "N/m", (Entry(-(1 + 0.1j) * here),), typical=10 * structure.scales.stiffness(node)
        ),
        Parameter(
            "bearing_damping", "N s/m", (Entry(-here, order=1),), typical=0.4 * structure.scales.critical_damping(node)
        ),
    ]
