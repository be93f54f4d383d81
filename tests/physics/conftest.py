"""Rotors the physics is tried on."""

import numpy as np
import pytest

from rotorstudy import Entry, Model, Parameter, Structure, Term


@pytest.fixture(scope="session")
def machine():
    """Three coordinates with gyroscopic moment, anisotropic support, a term that turns, forces on a hidden coordinate.

    Coordinates 0 and 1 are measured translations, coordinate 2 a tilt that is not.
    """
    generator = np.random.default_rng(7)
    root = generator.normal(size=(3, 3))
    stiffness = (root @ root.T + 3 * np.eye(3)) * 1e5
    structure = Structure(
        mass=np.diag([2.0, 1.5, 0.8]),
        stiffness=stiffness,
        gyroscopic=np.diag([0.0, 0.0, 0.6]),
        static_load=np.array([2.0, 1.5, 0.0]) * 9.81,
        dofs=((1, "translation"), (2, "translation"), (3, "tilt")),
        stiffness_loss={},
    )
    everywhere, first, second = np.eye(3), np.diag([1.0, 0, 0]), np.diag([0, 1.0, 0])
    terms = (
        Term("damping", (Parameter("damping", "N s/m", (Entry(-everywhere, order=1),), 300.0),), {"damping": 300.0}),
        Term(
            "rotating",
            (
                Parameter(
                    "rotating", "N s/m", (Entry(-second, order=1), Entry(1j * second, gain=lambda speed: speed)), 40.0
                ),
            ),
            {"rotating": 40.0},
        ),
        Term("uneven", (Parameter("uneven", "N/m", (Entry(-first, on="conj"),), 5e4),), {"uneven": 5e4}),
        Term(
            "turning",
            (Parameter("turning", "N/m", (Entry(second, shift=1), Entry(second, on="conj", shift=2)), 2e4),),
            {"turning": 2e4},
        ),
        Term(
            "push",
            (Parameter("push", "N", (Entry(np.array([0.3, 0, 1.0]), on="one", shift=1),), 5.0, True),),
            {"push": 5.0 * np.exp(0.4j)},
        ),
    )
    return Model(structure, terms, sensors=(1, 2))
