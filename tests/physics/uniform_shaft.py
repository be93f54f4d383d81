"""A uniform shaft of finite elements, and its numbers."""

import numpy as np

from rotorstudy import build_model

E, NU, RHO, LENGTH, D = 2.1e11, 0.3, 7850.0, 1.0, 0.05
AREA, SECOND_MOMENT = np.pi / 4 * D**2, np.pi / 64 * D**4
ENDS = {"simply supported": "pinned_nodes", "cantilever": "clamped_nodes"}


def rotor(count=8, **options):
    """Structure of a uniform shaft."""
    options = {"elements": [{"length_m": LENGTH, "count": count}], "outer_diameter_m": D, **options}
    return build_model({"rotor": {"kind": "finite_element", **options}}).structure


def beam(ends, count=8, **options):
    """Euler-Bernoulli without rotary inertia, the beam of the textbooks, unless told otherwise."""
    held = {"pinned_nodes": [1, count + 1]} if ends == "simply supported" else {"clamped_nodes": [1]}
    return rotor(count, **{"theory": "euler_bernoulli", "shaft_inertia": "translation", **held, **options})


GOOD = {"elements": [{"length_m": 1.0, "count": 4}], "outer_diameter_m": 0.05, "pinned_nodes": [1, 5]}
