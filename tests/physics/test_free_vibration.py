"""Eigenvalues against equations of motion assembled in x and y, and against the growth that integration shows."""

import numpy as np
import pytest
from random_rotor import random_model

from rotorstudy import Model, eigenvalues

SPEED = 400.0
STEADY = ("external_damping", "internal_damping", "damping", "anisotropy", "added_mass", "unbalance", "couple")


def in_x_and_y(on_z, on_conj):
    """Matrix (2 dof, 2 dof) acting on real (x, y) as on_z acts on z = x + jy and on_conj on its conjugate."""
    both, less = on_z + on_conj, on_z - on_conj
    return np.block([[both.real, -less.imag], [both.imag, less.real]])


def smallest_share(model, values):
    """Smallest over largest singular value of s^2 M + s C + K at each s; zero where s is an eigenvalue."""
    structure, zero = model.structure, np.zeros((3, 3), complex)
    on_z = [structure.stiffness + 0j, -1j * SPEED * structure.gyroscopic, structure.mass + 0j]
    on_conj = [zero, zero, zero]
    for value, unknown in zip(model.theta, model.rotor_unknowns, strict=True):
        for entry in (e for e in unknown.entries if e.on != "one"):
            table = on_z if entry.on == "z" else on_conj
            table[entry.order] = table[entry.order] - value * entry.gain_at(SPEED, 0) * entry.matrix
    k, c, m = (in_x_and_y(*pair) for pair in zip(on_z, on_conj, strict=True))
    singular = np.array([np.linalg.svd(s**2 * m + s * c + k, compute_uv=False) for s in values])
    return singular[:, -1] / singular[:, 0]


@pytest.fixture(params=range(1, 4), ids=lambda seed: f"seed {seed}")
def rotor(request):
    """Gyroscopic, anisotropic, with both dampings and added mass, but nothing that varies in time."""
    model = random_model(request.param)
    return Model(model.structure, tuple(term for term in model.terms if term.kind in STEADY), model.sensors)


def test_every_eigenvalue_solves_the_equations_in_x_and_y(rotor):
    values = eigenvalues(rotor, [SPEED])[0]
    assert len(values) == 12  # three coordinates in two planes, each with its mirror image
    # round-off of 1e-16 times the ratio of the highest to the lowest mode, a few hundred
    assert smallest_share(rotor, values).max() < 1e-11
    assert smallest_share(rotor, values * (1 + 1e-6)).min() > 1e-9  # negative control
