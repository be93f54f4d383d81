from typing import NotRequired

import numpy as np

from rotorstudy.plugins import Bearing, NonNegative, Parameter, Positive, RotorstudyError, TypedDict, planar_entries


class Stiffness(TypedDict):
    """Along x and y; by default yy = xx."""

    xx: Positive
    yy: NotRequired[Positive]


class NonNegativeNumber(TypedDict):
    """Along x and y; by default yy = xx."""

    xx: NonNegative
    yy: NotRequired[NonNegative]


@Bearing(
    source="Kirk and Gunter 1972, effect of support flexibility and damping; two dynamic stiffnesses in series",
    example={
        "bearing_stiffness_N_per_m": {"xx": 2e6, "yy": 1.5e6},
        "bearing_damping_N_s_per_m": {"xx": 400.0, "yy": 300.0},
        "pedestal_stiffness_N_per_m": {"xx": 4e6, "yy": 1e6},
        "pedestal_damping_N_s_per_m": {"xx": 500.0},
        "pedestal_mass_kg": {"xx": 20.0},
    },
    checked="an explicit model with the pedestal as a further mass, at harmonics of both signs",
    uncertain={"pedestal_stiffness_N_per_m.xx": 0.1, "pedestal_stiffness_N_per_m.yy": 0.1, "pedestal_mass_kg": 0.1},
    positive_damping=True,
    symmetric=True,
)
def flexible_pedestal(
    structure,
    bearing_stiffness_N_per_m: Stiffness,
    pedestal_stiffness_N_per_m: Stiffness,
    pedestal_mass_kg: NonNegativeNumber,
    bearing_damping_N_s_per_m: NonNegativeNumber | None = None,
    pedestal_damping_N_s_per_m: NonNegativeNumber | None = None,
    node: int | None = None,
):
    """Linear bearing on a pedestal with stiffness, damping and mass in x and y, times the amplitude bearing_scale.

    The pedestal's motion is eliminated exactly at every harmonic: S = b p / (b + p) with b = k_b + j v c_b and
    p = k_p + j v c_p - v^2 m_p at the frequency v = n w. It is therefore defined in the frequency domain only.
    Displacements are measured from the pedestal's own static deflection.
    """
    node = structure.default_node() if node is None else node
    here, entries = np.outer(structure.unit(node), structure.unit(node)), []
    given = (
        bearing_stiffness_N_per_m,
        bearing_damping_N_s_per_m or {"xx": 0.0},
        pedestal_stiffness_N_per_m,
        pedestal_damping_N_s_per_m or {"xx": 0.0},
        pedestal_mass_kg,
    )
    for direction in ("xx", "yy"):
        one = [values.get(direction, values["xx"]) for values in given]
        entries += planar_entries(direction, -here, gain=series(*one, node), frequency_only=True)
    return [Parameter("bearing_scale", "1", tuple(entries), typical=1.0, default=1.0)]


def series(bearing_stiffness, bearing_damping, pedestal_stiffness, pedestal_damping, mass, node):
    """The gain of one direction: the dynamic stiffness of bearing and pedestal in series."""

    def gain(speed, harmonic):
        frequency = speed * harmonic
        bearing = bearing_stiffness + 1j * frequency * bearing_damping
        pedestal = pedestal_stiffness + 1j * frequency * pedestal_damping - mass * frequency**2
        resonant = np.abs(bearing + pedestal) <= 1e-12 * np.abs(bearing)
        if np.any(resonant):
            raise RotorstudyError(
                f"speed {speed[resonant].flat[0]:g} rad/s, harmonic {harmonic[resonant].flat[0]}: the undamped "
                f"pedestal at node {node} is in resonance; add damping or leave that speed out"
            )
        return bearing * pedestal / (bearing + pedestal)

    return gain
