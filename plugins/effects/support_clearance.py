import numpy as np

from rotorstudy.plugins import (
    Effect,
    Feared,
    NonlinearForce,
    NonNegative,
    Parameter,
    Positive,
    Share,
    at_supports,
    mean_overlap,
)


@Effect(
    source="Ehrich 1988, J. Vib. Acoust. 110, 9-16; Yamamoto and Ishida 2001, Linear and Nonlinear Rotordynamics",
    places=at_supports,
    shape={
        "clearance_m": (0.05, 5.0, "vibration"),
        "rest_ratio": (0.0, 2.0),
        "rest_angle_rad": (-np.pi, np.pi),
        "spread_ratio": (0.02, 0.5),
    },
    example={"clearance_m": 2e-6},
    positive=True,
    switches=True,
    feared=Feared("stiffness_lost_in_clearance", 10.0, {"clearance_m": (0.8, "vibration")}),
    checked="circular whirl inside and outside in closed form to 1e-9; time integration to 2e-4 of its effect",
    form_error=0.2,  # seats are not round
    confounders={
        "looseness": "a foot lifts in one direction; a clearance is alike in all directions",
        "rub": "a rub adds stiffness and friction; a clearance takes stiffness away below its size",
    },
)
def support_clearance(
    structure,
    node: int | None = None,
    clearance_m: Positive = 1e-5,
    rest_ratio: NonNegative = 0.0,
    rest_angle_rad: float = 0.0,
    spread_ratio: Share | None = None,
):
    """Support with clearance: force k min(|s|, R) s / |s|, where s is the way from the centre of its clearance.

    R is clearance_m, such as that of a worn rolling bearing or of its seat in the housing, within which the part k of
    the modelled stiffness does not act. At rest, that is at its static deflection, the shaft is rest_ratio R from the
    centre, on the side rest_angle_rad from x: 0 in the middle, 1 where it touches. spread_ratio: standard deviation of
    the clearance around the seat over R: contact is gradual; without it, sudden.
    """
    here = structure.against_casing(node)[None]
    rest = rest_ratio * clearance_m * np.exp(1j * rest_angle_rad)
    spread = spread_ratio and spread_ratio * clearance_m

    def without_support(displacement, velocity, deflection):
        offset = displacement - deflection + rest
        distance = np.abs(offset)
        inside = distance - mean_overlap(distance - clearance_m, spread)
        return inside * offset / np.where(distance > 0, distance, 1)

    usual = 0.13 * structure.scales.stiffness(node)
    force = NonlinearForce(here, without_support)
    return [Parameter("stiffness_lost_in_clearance", "N/m", (), typical=usual, force=force)]
