"""Eigenvalues, gyroscopic whirl and the threshold of instability in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from machines import free_motion, in_x_and_y, jeffcott, jeffcott_rig, point
from random_rotor import random_model

from rotorstudy import Entry, Parameter, RotorstudyError, Term, build_model, eigenvalues, harmonic_response
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


def ad_hoc(name, value, *entries):
    return Term(name, (Parameter(name, "1", entries, abs(value)),), {name: value})


def whirl(speed, direction):
    """Tilting disc, J_d s^2 - j w J_p s + k = 0: forward above, backward below the frequency at rest."""
    half = speed * POLAR / (2 * DIAMETRAL)
    return half + direction * np.sqrt(half**2 + TILTING / DIAMETRAL)


@pytest.mark.parametrize("speed", [1.0, 200.0, 800.0])
def test_a_tilting_disc_whirls_at_its_closed_form(speed):
    found = eigenvalues(rotor(MID_SPAN), [speed])[0]
    expected = np.sort([NATURAL, -NATURAL, whirl(speed, 1), whirl(speed, -1)])
    # round-off of 1e-16 relative to the fastest mode
    assert np.abs(found - 1j * expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("n", "inertia"), [(1, DIAMETRAL - POLAR), (-1, DIAMETRAL + POLAR), (2, 4 * DIAMETRAL - 2 * POLAR)]
)
def test_a_turning_couple_tilts_a_disc_against_its_gyroscopic_moment(n, inertia):
    """k - n^2 w^2 J_d + n w^2 J_p: a thin disc has no forward critical speed, but a backward one."""
    speed, couple = 300.0, 2.0
    model = rotor(MID_SPAN).plus(ad_hoc("couple", couple, Entry(np.array([0.0, 1.0]), on="one", shift=n)))
    found = harmonic_response(model, [speed], [n])[0, 0, 1]
    assert found == pytest.approx(couple / (TILTING - inertia * speed**2), rel=1e-12)  # round-off


def uneven(difference):
    """k + d along x, k - d along y: force -d conj(z)."""
    return ad_hoc("uneven", difference, Entry(-np.array([[1.0]]), on="conj"))


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


def test_a_model_that_varies_in_time_has_no_eigenvalues():
    with pytest.raises(RotorstudyError, match="'stiffness_loss' makes the model time-varying"):
        eigenvalues(jeffcott(weight_dominance=False), [88.0])


@pytest.mark.parametrize("difference", [1e3, 1e4, 5e4])
def test_an_uneven_support_raises_the_threshold_by_its_closed_form(difference):
    """c_H^2 w^2 = c^2 w_n^2 + d^2 with c = c_E + c_H: at the limit s = j w_n, and the imaginary part is silent."""
    internal, external = 50.0, 25.0
    model = rotor(JEFFCOTT, internal, external).plus(uneven(difference))
    expected = np.hypot((internal + external) * NATURAL, difference) / internal
    assert stability_threshold(model, 4000.0) == pytest.approx(expected, rel=1e-8)  # the root finder's 1e-9 rad/s
    assert expected > NATURAL * (1 + external / internal)


def slowest_decay(internal, external, speed):
    """Growth rate of the mode that decays least, from the equations of motion written out here."""
    damp = np.diag([internal + external, 0.0]) - 1j * speed * np.diag([0.0, POLAR])
    stiff = np.array([[K - 1j * speed * internal, 2.0e4], [2.0e4, TILTING]])
    return np.linalg.eigvals(free_motion(np.diag([M, DIAMETRAL]), damp, stiff)).real.max()


def test_the_threshold_of_a_gyroscopic_rotor_is_where_its_own_equations_stop_decaying():
    found = stability_threshold(rotor(OFF_MID_SPAN, 200.0, 60.0), 4000.0)
    # the root finder's 1e-9 rad/s over the slope of the growth, and round-off of eigenvalues near 1e3
    assert abs(slowest_decay(200.0, 60.0, found)) < 1e-8
    assert slowest_decay(200.0, 60.0, 0.999 * found) < -1e-4
    assert slowest_decay(200.0, 60.0, 1.001 * found) > 1e-4


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
