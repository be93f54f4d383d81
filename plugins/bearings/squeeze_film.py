from typing import Literal

import numpy as np

from rotorstudy.plugins import Bearing, Entry, Fraction, Parameter, Positive, hookimpl


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
    """Short squeeze-film damper with open ends on a circular centred orbit of given size, and its centring spring.

    film: pi, it cavitates and covers half the circle; 2pi, it is supplied with enough pressure to stay whole.
    Amplitudes: bearing_scale of the film, centring_stiffness of the spring that holds the journal in the middle. The
    film's stiffness is that of a whirl, proportional to its frequency |n| w: a film at rest carries nothing, so the
    half film exists in frequency only. Each harmonic is taken as the only one; the orbit of the main one has the size
    eccentricity_ratio times the clearance, which the user compares with the response.
    """
    here = structure.unit(structure.default_node() if node is None else node)
    here = np.outer(here, here)
    stiffness, damping = coefficients(eccentricity_ratio, film)
    size = viscosity_Pa_s * diameter_m / 2 * (length_m / radial_clearance_m) ** 3
    entries = [Entry(-size * damping * here, order=1)]
    if stiffness:
        whirl = Entry(-size * stiffness * here, gain=lambda speed, n: np.abs(n) * speed, frequency_only=True)
        entries.append(whirl)
    return [
        Parameter("bearing_scale", "1", tuple(entries), typical=1.0),
        Parameter("centring_stiffness", "N/m", (Entry(-here),), typical=1e6),
    ]


def coefficients(e, film):
    """Stiffness over whirl speed, and damping, in units of viscosity radius (length / clearance)^3."""
    half = np.pi / 2 * (1 - e * e) ** -1.5
    return (2 * e / (1 - e * e) ** 2, half) if film == "pi" else (0.0, 2 * half)


@hookimpl
def rotorstudy_bearing():
    return Bearing(
        "squeeze_film",
        squeeze_film,
        source="Vance 1988, Rotordynamics of Turbomachinery; San Andres, Modern Lubrication Theory, notes 13",
        example={
            "diameter_m": 0.1,
            "length_m": 0.02,
            "radial_clearance_m": 2e-4,
            "viscosity_Pa_s": 0.01,
            "eccentricity_ratio": 0.4,
        },
        checked="the Reynolds film of an orbit integrated numerically, both films",
        positive_damping=True,
        symmetric=True,
    )
