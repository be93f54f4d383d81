"""Structures of two rotors, without and with tilts, and what tests of both share."""

import numpy as np
from machines import OFFSET_DISC

from rotorstudy import build_model, make_term, registry

SPEEDS = np.array([90.0, 200.0, 310.0, 450.0])  # below the critical speeds of both rotors
HARMONICS = np.array([0, 1, 2, 3, 5, 7, -1, -3, -5])
PLAIN = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
ROTORS = {"plain": build_model({"rotor": PLAIN}).structure, "tilting": build_model({"rotor": OFFSET_DISC}).structure}
# forces in time: tests/physics/test_alternating.py and test_breathing_by_the_moment.py
LOCAL = {"rub", "looseness", "support_clearance", "cubic_stiffness", "transverse_crack"}
CRACKS = list(registry().plugins["crack"].values())


def at_disc(structure):
    return np.outer(structure.unit(1), structure.unit(1))


def parameters_of(name, structure, **options):
    return make_term("effect", {"kind": name, **options}, structure, structure.nodes).parameters
