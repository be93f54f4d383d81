from typing import Literal

import numpy as np

from rotorstudy.plugins import Bearing, Entry, Fraction, Parameter, Positive, outer


@Bearing(
    source="Vance 1988, Rotordynamics of Turbomachinery; San Andres, Modern Lubrication Theory, notes 13",
    example={
        "diameter_m": 0.1,
        "length_m": 0.02,
        "radial_clearance_m": 2e-4,
        "viscosity_Pa_s": 0.01,
        "eccentricity_ratio": 0.4,
    },
    checked="numerical integration of the Reynolds film pressure of an orbit, both films",
    changeable=("radial_clearance_m", "viscosity_Pa_s"),
    positive_damping=True,
    symmetric=True,
)
def squeeze_film(
    structure,
    diameter_m: Positive,
    length_m: Positive,
    radial_clearance_m: Positive,
    viscosity_Pa_s: Positive,
    eccentricity_ratio: Fraction,
    film: Literal["pi", "2pi"] = "pi",
    node: int | None = None,
):
    """Short open-ended squeeze-film damper with centring spring, for a circular centred orbit of given radius.

    film: pi, cavitated, covers half the circumference; 2pi, the supply pressure prevents cavitation.
    Amplitudes: bearing_scale of the film, and centring_stiffness of the spring. The film stiffness is proportional to
    the whirl frequency |n| w and carries no static load, so the half film is defined in the frequency domain only. Each
    harmonic is treated as if alone. The orbit radius of the dominant one is eccentricity_ratio times the clearance; the
    user must compare it with the response.
    """
    here = outer(structure.unit(node))
    stiffness, damping = coefficients(eccentricity_ratio, film)
    size = viscosity_Pa_s * diameter_m / 2 * (length_m / radial_clearance_m) ** 3
    entries = [Entry(-size * damping * here, order=1)]
    if stiffness:
        whirl = Entry(-size * stiffness * here, gain=lambda speed, n: np.abs(n) * speed, frequency_only=True)
        entries.append(whirl)
    return [
        Parameter("bearing_scale", "1", tuple(entries), typical=1.0, default=1.0),
        Parameter("centring_stiffness", "N/m", (Entry(-here),), typical=1.3 * structure.scales.stiffness(node)),
    ]


def coefficients(e, film):
    """Stiffness over whirl frequency, and damping, in units of viscosity radius (length / clearance)^3."""
    half = np.pi / 2 * (1 - e * e) ** -1.5
    return (2 * e / (1 - e * e) ** 2, half) if film == "pi" else (0.0, 2 * half)
