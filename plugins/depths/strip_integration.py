import numpy as np

from rotorstudy.plugins import CrackDepth, PoissonsRatio, Positive, hookimpl

GAUSS = np.polynomial.legendre.leggauss(40)  # 12 digits


def strip_integration(
    depth_ratio,
    diameter_m: Positive,
    youngs_modulus_Pa: Positive = 2.1e11,
    poissons_ratio: PoissonsRatio = 0.3,
):
    """Straight-edged crack in a round shaft, from the stress intensity factors of parallel strips.

    In xi each strip is in bending (F2), in eta in tension (F1), with the stress of the uncracked shaft at its edge:
    c = 64 (1 - nu^2) / (pi E R^3) * integral of y (1 - x^2) F2^2 (xi) or y x^2 F1^2 (eta) over half the crack, R = 1.
    In eta the paper includes only the half in tension, 32 instead of 64; here the weight keeps both halves open.
    """
    edge = 1 - 2 * depth_ratio
    x, across = _points(0, np.arcsin(np.sqrt(1 - edge**2)))  # x = sin(angle); the strips end at the circle
    height = 2 * np.cos(x)
    t, deep = _points(0, (np.cos(x) - edge)[:, None] / height[:, None])  # y over the height of the strip
    common = t * np.tan(np.pi * t / 2) / (np.pi * t / 2) / np.cos(np.pi * t / 2) ** 2 if depth_ratio else 0 * t
    bent = 0.923 + 0.199 * (1 - np.sin(np.pi * t / 2)) ** 4
    pulled = 0.752 + 2.02 * t + 0.37 * (1 - np.sin(np.pi * t / 2)) ** 3
    strips = [np.sum(deep * common * f**2, axis=1) * height**2 * np.cos(x) * across for f in (bent, pulled)]
    scale = 64 * (1 - poissons_ratio**2) / (np.pi * youngs_modulus_Pa * (diameter_m / 2) ** 3)
    return scale * np.sum(strips[0] * np.cos(x) ** 2), scale * np.sum(strips[1] * np.sin(x) ** 2)


def _points(low, high):
    """Gauss points and weights (..., point) between `low` and `high`."""
    half = (high - low) / 2
    return low + half * (1 + GAUSS[0]), half * GAUSS[1]


@hookimpl
def rotorstudy_depth():
    return CrackDepth(
        "strip_integration",
        strip_integration,
        source="Papadopoulos and Dimarogonas 1987; stress intensity of Tada, Paris, Irwin; range: Papadopoulos 2004",
        valid=(0.0, 0.5),
        example={"diameter_m": 0.02},
        checked="tabulated coefficients c55, and twice c44, of that method in ROSS (petrobras/ross, PAPADOPOULOS.csv)",
    )
