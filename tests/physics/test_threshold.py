"""Eigenvalues, gyroscopic whirl and the threshold of instability in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from machines import in_x_and_y, jeffcott_rig, point
from random_rotor import random_model

from rotorstudy import build_model, eigenvalues
from rotorstudy.response.stability import check_stable, stability_threshold

M, K = 2.0, 7.6e5
NATURAL = np.sqrt(K / M)
POLAR, DIAMETRAL, TILTING = 0.02, 0.011, 4000.0
JEFFCOTT = point(M, K)
MID_SPAN = {"kind": "offset_disc", "mass_kg": M, "polar_moment_kg_m2": POLAR, "diametral_moment_kg_m2": DIAMETRAL}
MID_SPAN |= {"k22_N_per_m": K, "k24_N": 0.0, "k44_N_m": TILTING}  # translation and tilt do not see each other
OFF_MID_SPAN = {**MID_SPAN, "k24_N": 2.0e4}


def rotor(kind, internal=0.0, external=0.0):
    return build_model(jeffcott_rig(None, internal=internal, external=external, rotor=kind))


BOTH = [(JEFFCOTT, 20.0, 100.0, up_to) for up_to in (8 * NATURAL, 4e4, 4e5, 4e6)]  # far above at the first speed tried


@pytest.mark.parametrize(
    ("kind", "internal", "external", "up_to"),
    [*BOTH, (JEFFCOTT, 50.0, 25.0, 5e3), (JEFFCOTT, 30.0, 30.0, 5e3), (MID_SPAN, 20.0, 100.0, 5e3)],
)
def test_internal_damping_is_unstable_from_its_closed_form_on_also_beside_an_undamped_tilt(
    kind, internal, external, up_to
):
    found = stability_threshold(rotor(kind, internal, external), up_to)
    assert found == pytest.approx(NATURAL * (1 + external / internal), rel=1e-9)  # the root finder's 1e-9 rad/s


@pytest.mark.parametrize("external", [0.0, 100.0])
@pytest.mark.parametrize("kind", [JEFFCOTT, MID_SPAN, OFF_MID_SPAN], ids=["jeffcott", "mid-span", "off mid-span"])
def test_external_damping_alone_and_round_off_without_any_have_no_threshold(kind, external):
    """At mid-span the tilt is not damped, and nothing feeds it either."""
    check_stable(rotor(kind, 0.0, external), [12.5, 62.5, 500.0])
    assert stability_threshold(rotor(kind, 0.0, external), 5000.0) is None


TURNING = 400.0
STEADY = ("external_damping", "internal_damping", "damping", "anisotropy", "added_mass", "unbalance", "couple")


def smallest_share(model, values):
    """Smallest over largest singular value of s^2 M + s C + K at each s; zero where s is an eigenvalue."""
    structure, zero = model.structure, np.zeros((3, 3), complex)
    on_z = [structure.stiffness + 0j, -1j * TURNING * structure.gyroscopic, structure.mass + 0j]
    on_conj = [zero, zero, zero]
    for value, unknown in zip(model.theta, model.rotor_unknowns, strict=True):
        for entry in (e for e in unknown.entries if e.on != "one"):
            table = on_z if entry.on == "z" else on_conj
            table[entry.order] = table[entry.order] - value * entry.gain_at(TURNING, 0) * entry.matrix
    k, c, m = (in_x_and_y(*pair) for pair in zip(on_z, on_conj, strict=True))
    singular = np.array([np.linalg.svd(s**2 * m + s * c + k, compute_uv=False) for s in values])
    return singular[:, -1] / singular[:, 0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_eigenvalue_solves_the_equations_in_x_and_y(seed):
    """Gyroscopic, anisotropic, with both dampings and added mass, but nothing that varies in time."""
    model = random_model(seed)
    steady = replace(model, terms=tuple(term for term in model.terms if term.kind in STEADY))
    values = eigenvalues(steady, [TURNING])[0]
    assert len(values) == 12  # three coordinates in two planes, each with its mirror image
    # round-off of 1e-16 times the ratio of the highest to the lowest mode, a few hundred
    assert smallest_share(steady, values).max() < 1e-11
    assert smallest_share(steady, values * (1 + 1e-6)).min() > 1e-9  # negative control
