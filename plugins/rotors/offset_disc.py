from functools import partial
from typing import Literal

import numpy as np

from rotorstudy.plugins import NonNegative, Positive, Rotor, RotorstudyError, Section, Structure

POISSONS_RATIO = 0.3  # of steel; the flexibility of a crack changes by 3 % between 0.25 and 0.33
NEXT_TO_BEARING = 1e-6  # of a span: nearer to a bearing, where a kink meets no resistance, it is taken to be so far


@Rotor(
    source="thesis section 4.2 (Table 4.1); sign of the gyroscopic moment corrected",
    checked="thesis Tables 4.2 to 4.9: 250 of 252 printed values, with the printed gyroscopic sign",
    uncertain={"youngs_modulus_Pa": 0.005, "k22_N_per_m": 0.005, "k24_N": 0.005, "k44_N_m": 0.005},
    example={
        "mass_kg": 2.0,
        "polar_moment_kg_m2": 0.0048,
        "diametral_moment_kg_m2": 0.0024,
        "a_m": 0.2,
        "b_m": 0.16,
        "diameter_m": 0.015,
    },
)
def offset_disc(
    mass_kg: Positive,
    polar_moment_kg_m2: Positive,
    diametral_moment_kg_m2: Positive,
    a_m: Positive | None = None,
    b_m: Positive | None = None,
    diameter_m: Positive | None = None,
    youngs_modulus_Pa: Positive = 2.1e11,
    k22_N_per_m: Positive | None = None,
    k24_N: float | None = None,
    k44_N_m: Positive | None = None,
    gyroscopic_sign: Literal[1, -1] = 1,
    gravity_m_per_s2: NonNegative = 9.81,
):
    """Disc off mid-span of a shaft on rigid bearings: coordinates z = u_x + j u_y and the tilt dz/ds.

    Stiffness from the shaft (disc at a from one bearing, b from the other) or given as k22, k24, k44:
    k22 = 3EI (a^3 + b^3) / (ab)^3, k24 = 3EI (a^2 - b^2) / (ab)^2, k44 = 3EI (a + b) / (ab).
    gyroscopic_sign -1 is the reversed sign of the thesis, only for its tables.
    """
    known = {}
    shaft, given = (a_m, b_m, diameter_m), (k22_N_per_m, k24_N, k44_N_m)
    if None not in shaft and given == (None, None, None):
        a, b, rigidity = a_m, b_m, 3 * youngs_modulus_Pa * np.pi * diameter_m**4 / 64
        k22, k24 = rigidity * (a**3 + b**3) / (a * b) ** 3, rigidity * (a**2 - b**2) / (a * b) ** 2
        k44 = rigidity * (a + b) / (a * b)
        known = {
            "shape_at": partial(shaft_shape, a=a, b=b),
            "section_at": partial(section, shaft=shaft, youngs_modulus_Pa=youngs_modulus_Pa),
            "length": a + b,
            "node_positions": {1: a},
            "is_solid": True,
        }
    elif None not in given and shaft == (None, None, None):
        k22, k24, k44 = given
    else:
        raise RotorstudyError("offset_disc: give a_m, b_m, diameter_m, or k22_N_per_m, k24_N, k44_N_m, not a mixture")
    if k22 * k44 <= k24**2:
        raise RotorstudyError(
            f"offset_disc: k22 k44 = {k22 * k44:g} must exceed k24^2 = {k24**2:g} for a positive definite stiffness"
        )
    return Structure(
        mass=np.diag([mass_kg, diametral_moment_kg_m2]),
        stiffness=np.array([[k22, k24], [k24, k44]]),
        gyroscopic=np.diag([0.0, gyroscopic_sign * polar_moment_kg_m2]),
        static_load=np.array([mass_kg * gravity_m_per_s2, 0.0]),
        dofs=((1, "translation"), (1, "tilt")),
        stiffness_loss={
            "stiffness_loss_22": (np.diag([1.0, 0.0]), "N/m", 0.3 * k22),
            "stiffness_loss_44": (np.diag([0.0, 1.0]), "N m", 0.1 * k44),
        },
        gravity=gravity_m_per_s2,
        **known,
    )


def shaft_shape(position, a, b):
    """Deflection (dof,) of the massless shaft at a position (m) from the first bearing, for unit z and unit dz/ds."""
    span, s, sign = _located(position, a, b)
    return np.array([s * (3 * span**2 - s**2) / (2 * span**3), sign * s * (s**2 - span**2) / (2 * span**2)])


def section(position, shaft, youngs_modulus_Pa):
    """The Section at a position (m) from the first bearing: the moment rises linearly from a bearing to the disc."""
    a, b, diameter = shaft
    span, s, sign = _located(position, a, b)
    s = max(s, NEXT_TO_BEARING * span)
    rise = 3 * youngs_modulus_Pa * np.pi * diameter**4 / 64 * s / span**2
    solid, moment = (diameter, 0.0, youngs_modulus_Pa, POISSONS_RATIO), rise * np.array([-1 / span, sign])
    return Section(position, *solid, moment=moment, own_moment=0.0, stiffness=rise * s / span)


def _located(position, a, b):
    """The span that a position is in, the distance from its bearing, and the sense of a tilt of the disc there."""
    if not 0 <= position <= a + b:
        raise RotorstudyError(f"offset_disc: position {position:g} m is not on the shaft of 0 to {a + b:g} m")
    return (a, position, 1) if position <= a else (b, a + b - position, -1)
