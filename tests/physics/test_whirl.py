"""Critical speeds against closed forms."""

import numpy as np
import pytest
from machines import disc, film, shaft, springs
from scipy.optimize import brentq
from test_transient import LOSS, OFFSET_DISC, RIGS

from rotorstudy import build_model, eigenvalues
from rotorstudy.response import few_shapes, whirl
from rotorstudy.response.stability import damping_of_effects, state_matrix
from rotorstudy.response.whirl import critical_speeds, damped_modes, time_invariant, whirl_modes

JEFFCOTT = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}


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
    assert len(critical_speeds(build_model({"rotor": JEFFCOTT, "effects": damping}), 2000.0)[0]) == 0


def test_only_what_turns_is_taken_off():
    model = build_model({**RIGS["gyroscopic"], "cracks": [{"kind": "switching", "weight_dominance": False, **LOSS}]})
    kept = {term.kind for term in time_invariant(model).terms}
    assert kept == {"external_damping", "internal_damping", "unbalance"}
    assert eigenvalues(time_invariant(model), [100.0]).shape == (1, 4)


def test_modes_of_a_simply_supported_beam_are_sines():
    rotor = shaft(1.0, 16, pinned_nodes=[1, 17], theory="euler_bernoulli", shaft_inertia="translation")
    model = build_model({"rotor": rotor})
    values, shapes = whirl_modes(model, 1e-3)
    nodes = np.arange(2, 17)
    rows = [model.structure.index(int(n)) for n in nodes]
    forward = np.flatnonzero(values.imag > 0)
    for n in (1, 2, 3):
        shape = shapes[forward[n - 1]][rows]
        sine = np.sin(n * np.pi * (nodes - 1) / 16)
        ratio = shape / shape[np.abs(sine).argmax()]
        assert ratio == pytest.approx(sine / sine[np.abs(sine).argmax()], abs=1e-3)
        assert np.abs(ratio - np.cos(n * np.pi * (nodes - 1) / 16)).max() > 0.5


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
