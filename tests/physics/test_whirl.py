"""Critical speeds, eigenvalues, thresholds of instability and motion from rest: closed forms and integration."""

from dataclasses import replace

import numpy as np
import pytest
from machines import OFFSET_DISC, disc, film, in_x_and_y, jeffcott_rig, point, shaft, springs
from one_line_errors import refused
from random_rotor import random_model
from scipy.linalg import expm
from scipy.optimize import brentq

from rotorstudy import build_model, eigenvalues, time_response
from rotorstudy.response import few_shapes, whirl
from rotorstudy.response.integration import transient_response
from rotorstudy.response.stability import check_stable, damping_of_effects, stability_threshold, state_matrix
from rotorstudy.response.whirl import critical_speeds, damped_modes, time_invariant, whirl_modes


def closed_form(order, sign):
    """det(K - W^2 M + n w^2 G) = 0 for W = n w: (k22 - n^2 w^2 m)(k44 + (n Ip - n^2 Id) w^2) = k24^2."""
    k = build_model({"rotor": OFFSET_DISC}).structure.stiffness
    m, polar, diametral, n = 2.0, sign * 0.0048, 0.0024, order
    tilt = n * polar - n**2 * diametral
    quadratic = [-(n**2) * m * tilt, k[0, 0] * tilt - n**2 * m * k[1, 1], k[0, 0] * k[1, 1] - k[0, 1] ** 2]
    roots = np.roots(quadratic if quadratic[0] else quadratic[1:])
    return np.sqrt(np.sort(roots[roots > 0].real))


@pytest.mark.parametrize("order", [1, 2, 3, -1])
@pytest.mark.parametrize("sign", [1, -1])
def test_offset_disc_meets_the_closed_form(order, sign):
    model = build_model({"rotor": {**OFFSET_DISC, "gyroscopic_sign": sign}})
    expected = closed_form(order, sign)
    assert critical_speeds(model, 3000.0, [order])[0] == pytest.approx(expected[expected < 3000], rel=1e-8)


def test_a_mode_that_is_damped_out_has_no_critical_speed():
    damping = [{"kind": "external_damping", "external_damping_N_s_per_m": 3e3}]  # over-critical: 2465 N s/m
    assert len(critical_speeds(build_model({"rotor": point(), "effects": damping}), 2000.0)[0]) == 0


def test_only_what_turns_is_taken_off():
    model = build_model({**RIGS["gyroscopic"], "cracks": [{"kind": "switching", "weight_dominance": False, **LOSS}]})
    kept = {term.kind for term in time_invariant(model).terms}
    assert kept == {"external_damping", "internal_damping", "unbalance"}
    assert eigenvalues(time_invariant(model), [100.0]).shape == (1, 4)


def test_modes_solve_the_equations_of_motion():
    model = build_model(RIGS["anisotropic"])
    values, shapes = whirl_modes(model, 300.0)
    assert values == pytest.approx(eigenvalues(model, [300.0])[0], rel=1e-9)
    lower = state_matrix(model, [300.0])[0][shapes.shape[1] :]
    for value, shape in zip(values, shapes, strict=True):
        state = np.concatenate([shape, value * shape])
        assert lower @ state == pytest.approx(value**2 * shape, rel=1e-6, abs=1e-6 * abs(value) ** 2)


def test_a_critical_speed_beside_the_onset_of_another_whirl_is_found():
    """A pair of overdamped motions begins to whirl where the flexible mode crosses 1X; sorted they would cancel."""
    lengths = ((0.1, 1), (0.08, 1), (0.3, 2), (0.35, 2), (0.3, 2), (0.08, 1), (0.1, 1))
    elements = [{"length_m": length, "count": count} for length, count in lengths]
    for end in (0, -1):
        elements[end] |= {"outer_diameter_m": 0.08}
    rotor = {"kind": "finite_element", "outer_diameter_m": 0.09, "elements": elements}
    rotor["discs"] = [disc(5, 62.0, 1.6, 0.86), disc(7, 48.0, 1.1, 0.6)]
    bearings = [film(0.08, 0.035, 9e-5, 0.018, node=node, label=str(node)) for node in (2, 10)]
    losses = [{"kind": "shaft_damping", "shaft_damping_s": 1e-5}]
    model = build_model({"rotor": rotor, "bearings": bearings, "effects": losses})

    def off(w):
        values = eigenvalues(model, [w])[0]
        light = values[(values.real > -0.09 * np.abs(values)) & (np.abs(values.imag - 433) < 50)]
        assert len(light) == 1
        return light[0].imag - w

    expected = brentq(off, 425, 445)
    speeds = np.linspace(14.56, 728.06, 150)
    onset = [np.sum(eigenvalues(model, [w])[0].imag > w) for w in speeds]
    i = np.searchsorted(speeds, expected)
    assert onset[i - 1] == onset[i]  # they cancel: the count does not change
    assert np.abs(critical_speeds(model, 728.06, speeds=speeds)[0] - expected).min() < 1e-5


def test_on_a_fine_mesh_whirl_by_few_shapes_is_that_of_all_coordinates(monkeypatch):
    """Modes of the free shaft without the deflections by the bearings are not: the negative control."""
    rotor = shaft(1.0, 40, disc(14, 5.0, 0.02, 0.01), outer_diameter_m=0.03)
    effects = [{"kind": "shaft_damping", "shaft_damping_s": 1e-6}]
    bearings = springs([1, 41], (2e7, 1.5e7), (800.0, 600.0))
    model = build_model({"rotor": rotor, "bearings": bearings, "effects": effects})
    few, dampings = damped_modes(model, [300.0], 8), damping_of_effects(model, 300.0)
    monkeypatch.setattr(few_shapes, "ALL_KEPT", 1000)
    every = damped_modes(model, [300.0], 8)
    assert few.eigenvalue == pytest.approx(every.eigenvalue, rel=1e-6)
    assert few.forward == pytest.approx(every.forward, abs=1e-3)
    assert dampings == pytest.approx(damping_of_effects(model, 300.0), rel=1e-4)
    free = np.linalg.eigh(model.structure.stiffness)[1][:, :24]
    monkeypatch.setattr(whirl, "few_shapes", lambda *_: free)
    assert damped_modes(model, [300.0], 8).eigenvalue != pytest.approx(every.eigenvalue, rel=1e-4)


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


DAMPINGS = [
    {"kind": "external_damping", "external_damping_N_s_per_m": 27.0},
    {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
    {"kind": "unbalance", "eccentricity_m": 3e-5, "eccentricity_phase_rad": 0.5},
]
LOSS = {"stiffness_loss_22_N_per_m": 1.7e5, "stiffness_loss_44_N_m": 1.7e3}
CRACKED = {"rotor": OFFSET_DISC, "effects": DAMPINGS, "cracks": [{"kind": "switching", **LOSS}]}
RIGS = {"gyroscopic": CRACKED, "anisotropic": CRACKED | {"bearings": springs([1], (1e5, 3e5), (10.0, 30.0))}}


@pytest.mark.parametrize("name", RIGS)
def test_exact_motion_is_that_of_integration(name):
    model, time = build_model(RIGS[name]), np.linspace(0, 0.3, 400)
    exact, integrated = (response(model, 300.0, time) for response in (transient_response, time_response))
    assert np.abs(exact - integrated).max() < 1e-8 * np.abs(integrated).max()  # the integrator's tolerance is 1e-10


@pytest.mark.parametrize("name", RIGS)
def test_motion_from_a_start_is_that_from_rest_and_the_free_motion(name):
    model, time, generator = build_model(RIGS[name]), np.linspace(0, 0.3, 400), np.random.default_rng(3)
    start = [scale * (generator.normal(size=2) + 1j * generator.normal(size=2)) for scale in (1e-5, 1e-3)]
    state = state_matrix(model, [300.0])[0]  # of the gyroscopic rig without entries on conj(z)
    both = start if len(state) == 4 else [np.append(part, part.conj()) for part in start]
    free = (expm(time[:, None, None] * state) @ np.concatenate(both))[:, :2]
    moved = time_response(model, 300.0, time, start=start) - time_response(model, 300.0, time)
    assert np.abs(moved - free).max() < 1e-8 * np.abs(free).max()


def test_a_crack_that_moves_with_the_shaft_has_no_exact_solution():
    rig = {**CRACKED, "cracks": [{"kind": "switching", "weight_dominance": False, **LOSS}]}
    refused(lambda: transient_response(build_model(rig), 300.0, np.linspace(0, 1, 10)), "time-varying")
