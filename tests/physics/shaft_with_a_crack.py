"""A shaft with a disc in the middle, and a transverse crack in it."""

import numpy as np
from machines import disc, rig_of, shaft, springs, unbalance

from rotorstudy import build_model, harmonic_response

LENGTH, DIAMETER, YOUNG, POISSON, MASS = 0.6, 0.02, 2.1e11, 0.3, 2.0
HARMONICS = np.arange(-6, 7)


def rotor(count, *effects, density=7850.0, bearings=True, **options):
    """A disc in the middle of a shaft of equal elements, on pins or on two bearings."""
    middle, ends = count // 2 + 1, (1, count + 1)
    options = {"density_kg_per_m3": density, "pinned_nodes": [] if bearings else list(ends), **options}
    shape = shaft(LENGTH, count, disc(middle, MASS, 0.0, 0.0), outer_diameter_m=DIAMETER, **options)
    held = springs(ends if bearings else (), 1e7, 500.0)
    return build_model(rig_of(shape, held, unbalance(middle, 2e-5, 0.7, mass_kg=MASS), *effects))


def crack(position=0.23, depth=0.25, **options):
    shape = {"position_m": position, "depth_ratio": depth, "flexibility_factor": 1.0}
    return {"kind": "transverse_crack", **shape, **options}


def at_disc(count, speeds, *effects, **options):
    model = rotor(count, *effects, **options)
    return harmonic_response(model, speeds, HARMONICS)[..., model.structure.index(count // 2 + 1)]
