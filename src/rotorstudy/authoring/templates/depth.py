import numpy as np

from rotorstudy.plugins import CrackDepth, Positive


@CrackDepth(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
    valid=(0.0, 0.5),
    example={"diameter_m": 0.02},
)
def my_model(depth_ratio, diameter_m: Positive, youngs_modulus_Pa: Positive = 2.1e11):
    """Hinge with a compliance quadratic in the depth, half of it across: c = 64 (a/D)^2 / (pi E D^3) * 10."""
    # depth_ratio is the crack depth over the diameter; return the compliance of the open crack along its weak
    # direction xi and across it (eta), in rad/(N m).
    weak = 640 * depth_ratio**2 / (np.pi * youngs_modulus_Pa * diameter_m**3)
    return weak, weak / 2
