from typing import Literal

import numpy as np

from rotorstudy.plugins import Effect, NonNegative, Parameter, Positive, at_supports, hookimpl, planar_entries


def pedestal_resonance(
    structure,
    node: int | None = None,
    natural_frequency_rad_per_s: Positive = 300.0,
    damping_ratio: Positive = 0.05,
    bearing_time_s: NonNegative = 0.0,
    direction: Literal["x", "y", "both"] = "both",
):
    """Support that yields at a resonance of its own, along x, y or both.

    At the frequency v = n w the force is +k (1 + j v T)^2 w0^2 / (w0^2 - v^2 + 2j zeta w0 v) times the displacement.
    A bearing k_b + j v c_b loses exactly that dynamic stiffness by a pedestal k_p + j v c_p - v^2 m in series, with
    T = c_b / k_b, k = k_b^2 / (k_b + k_p), w0^2 = (k_b + k_p) / m and 2 zeta w0 = (c_b + c_p) / m.
    It is defined in the frequency domain.
    """
    here = structure.unit(structure.default_node() if node is None else node)

    def gain(speed, harmonic):
        share = harmonic * speed / natural_frequency_rad_per_s
        passed = 1 + 1j * harmonic * speed * bearing_time_s
        return passed**2 / (1 - share**2 + 2j * damping_ratio * share)

    return [
        Parameter(
            f"stiffness_loss_at_rest_{axis}",
            "N/m",
            planar_entries(axis, np.outer(here, here), gain=gain, frequency_only=True),
            typical=0.03 * structure.scales.stiffness(node),
        )
        for axis in ("xx", "yy")
        if direction in (axis[0], "both")
    ]


def each_direction(structure, sensors):
    """Each support with the same resonance in both directions, and with one along x and along y."""
    return [{**place, "direction": axis} for place in at_supports(structure, sensors) for axis in ("both", "x", "y")]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "pedestal_resonance",
        pedestal_resonance,
        source="Kirk and Gunter 1972, effect of support flexibility and damping; two dynamic stiffnesses in series",
        shape={
            "natural_frequency_rad_per_s": (0.1, 10.0, "frequency"),
            "damping_ratio": (0.005, 0.5),
            "bearing_time_s": (0.0, 1.0, "time"),
        },
        places=each_direction,
        parts=("direction",),
        positive=True,
        checked="a rotor on flexible_pedestal, with and without damping of the bearing, to 1e-10",
        confounders=(
            ("support_stiffness", "equal far below its resonance; tap the pedestal, or measure its motion"),
            ("support_anisotropy", "equal far below its resonance; tap the pedestal, or measure its motion"),
            ("bearing_coefficients", "constant coefficients have no resonance of their own; tap the pedestal"),
            ("added_mass", "a mass acts at all frequencies alike; measure the motion of the pedestal"),
        ),
    )
