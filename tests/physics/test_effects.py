"""What each effect does, against closed forms and against rotors and signals built with the error in them."""

import numpy as np
import pytest
from machines import OFFSET_DISC, errors_of_derivatives, point

from rotorstudy import Model, build_model, full_spectrum, make_term, measured_response, registry, simulate_records
from rotorstudy.response.harmonic import harmonic_response, harmonic_response_and_jacobian

MASS, STIFFNESS = 2.0, 7.6e5
SPEEDS = np.array([60.0, 150.0, 250.0, 340.0])
PLAIN = build_model({"rotor": point(MASS, STIFFNESS)}).structure
TILTING = build_model({"rotor": OFFSET_DISC}).structure
SHAKEN = (
    {"kind": "unbalance", "eccentricity_m": 1e-5, "eccentricity_phase_rad": 0.4},
    {"kind": "external_damping", "external_damping_N_s_per_m": 60.0},
    {"kind": "parallel_misalignment", "misalignment_force_2X_N": 3.0, "harmonics": [2]},
)


def model_of(structure, *items):
    terms = [make_term("effect", {"label": str(i), **item}, structure, structure.nodes) for i, item in enumerate(items)]
    return Model(structure, tuple(terms))


def whirl(structure, *items, harmonics=(0, 1, 2, -1), speeds=SPEEDS):
    return harmonic_response(model_of(structure, *items), speeds, harmonics)


def same(found, expected, tolerance=1e-12):
    return np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def test_speed_error_is_the_derivative_by_the_speed():
    push = {"kind": "parallel_misalignment", "harmonics": [1, 2, -1]}
    push |= {f"misalignment_force_{n}X_N": 1.0 for n in (1, 2, -1)}
    step = 1e-5
    up, down = (whirl(TILTING, push, harmonics=[1, 2, -1], speeds=SPEEDS * (1 + e)) for e in (step, -step))
    model = model_of(TILTING, push, {"kind": "speed_error", "speed_error": 0.0})
    _, change = harmonic_response_and_jacobian(model, SPEEDS, [1, 2, -1])
    assert same(change[..., -1], (up - down) / (2 * step), 1e-6)


def test_base_motion_is_that_of_a_frame_that_is_carried_along():
    """m z'' + k (z - z_b) = 0 in the frame at rest; displacements count from the base."""
    along = np.array([1.0, 0.0])
    found = whirl(TILTING, {"kind": "base_motion", "harmonic": 2, "base_motion_2X_m": 1e-5}, harmonics=[2])[:, 0]
    for w, seen in zip(SPEEDS, found, strict=True):
        dynamic = TILTING.stiffness - 4 * w**2 * TILTING.mass + 2 * w * w * TILTING.gyroscopic
        absolute = np.linalg.solve(dynamic, TILTING.stiffness @ along * 1e-5)
        assert same(seen, absolute - along * 1e-5, 1e-9)


CHAIN = [  # what x, y become, exactly
    ({"kind": "probe_gain", "gain_error": 0.05, "gain_mismatch": 0.02}, lambda x, y: (1.07 * x, 1.03 * y), 1e-12),
    ({"kind": "swapped_probes", "swapped_probes": 1.0}, lambda x, y: (y, x), 1e-12),
    ({"kind": "reversed_probe", "reversed_probe_x": 1.0}, lambda x, y: (-x, y), 1e-12),
    ({"kind": "reversed_probe", "probe": "y", "reversed_probe_y": 1.0}, lambda x, y: (x, -y), 1e-12),
    (
        {"kind": "probe_angle", "probe_rotation_rad": 0.1, "probe_skew_rad": 0.2},
        lambda x, y: (np.cos(0.1) * x + np.sin(0.1) * y, np.cos(0.3) * y - np.sin(0.3) * x),
        1e-12,
    ),
]


def wrong_probe(x, y):
    """Probes at 10 and 85 degrees, as the user believes; the first reads 1.25 times the motion along 25 degrees."""
    first, second, true = np.deg2rad([10, 85, 25])
    read = [1.25 * (np.cos(true) * x + np.sin(true) * y), np.cos(second) * x + np.sin(second) * y]
    believed = np.array([[np.cos(first), np.sin(first)], [np.cos(second), np.sin(second)]])
    return np.einsum("ij,jtn->itn", np.linalg.inv(believed), np.array(read))


def error_of_wrong_probe():
    """Its effect: what is shown along -5 degrees, square to the second probe, is off by a part of the motion."""
    direction = np.deg2rad(85 - 90)
    d, e = np.array([np.cos(direction), np.sin(direction)]), np.array([-np.sin(direction), np.cos(direction)])
    unit = np.array([wrong_probe(*np.reshape(one, (2, 1, 1)))[:, 0, 0] - one for one in (d, e)])
    along, across = unit @ d
    return {"kind": "probe_error", "direction_rad": float(direction), "probe_error_along": float(along),
            "probe_error_across": float(across)}  # fmt: skip


CHAIN += [(error_of_wrong_probe(), wrong_probe, 1e-12)]


@pytest.mark.parametrize(("item", "exact", "tolerance"), CHAIN, ids=[str(c[0]) for c in CHAIN])
def test_probes_that_are_wrong_change_x_and_y(item, exact, tolerance):
    shaken, time = (*SHAKEN, {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 5e4}), np.arange(256) * 1e-4
    true = simulate_records(model_of(PLAIN, *shaken), [150.0], [1, 2], time)[0].displacement
    seen = simulate_records(model_of(PLAIN, *shaken, item), [150.0], [1, 2], time)[0].displacement
    x, y = exact(true.real, true.imag)
    assert same(seen, x + 1j * y, tolerance)
    assert not same(seen, true, 1e-5)


def test_a_delay_shifts_the_record():
    time, late = np.arange(256) * 1e-4, 0.7 / 150
    true = simulate_records(model_of(PLAIN, *SHAKEN), [150.0], [1], time - late)[0].displacement
    seen = simulate_records(model_of(PLAIN, *SHAKEN, {"kind": "delay", "delay_s": late}), [150.0], [1], time)[0]
    assert same(seen.displacement, true, 1e-12)


def test_a_delay_has_the_derivatives_of_its_harmonics():
    """Of all sensors and of several delays at once, also through the rotor's own parameters."""
    model = model_of(PLAIN, *SHAKEN, {"kind": "delay", "delay_s": 0.004})
    steps = 1e-5 * np.where(model.theta == 0, 1.0, np.abs(model.theta))
    assert errors_of_derivatives(model, SPEEDS, [0, 1, 2, -1], steps).max() < 1e-8


def test_a_wrong_phase_mark_is_a_record_that_starts_at_an_angle():
    time, angle, harmonics = np.arange(600) * 2e-4, 0.6, [0, 1, 2, -1]
    records = simulate_records(model_of(PLAIN, *SHAKEN), SPEEDS[1:], [1], time, start_angle_rad=angle)
    found = full_spectrum(records, harmonics, registry().get("spectrum", "regression"), "none", whole_revolutions=False)
    marked = model_of(PLAIN, *SHAKEN, {"kind": "phase_reference", "phase_reference_rad": angle})
    assert same(measured_response(marked, SPEEDS[1:], harmonics), found.amplitude, 1e-6)
    assert not same(measured_response(model_of(PLAIN, *SHAKEN), SPEEDS[1:], harmonics), found.amplitude, 1e-5)


@pytest.mark.parametrize(("order", "harmonics"), [(1, [1]), (2, [2, -2]), (3, [-3]), (4, [4, -4])])
def test_a_profile_that_both_probes_see_a_quarter_turn_apart_is_runout(order, harmonics):
    angle = np.arange(64) * 2 * np.pi / 64
    seen = np.cos(order * angle + 0.3) + 1j * np.cos(order * (angle - np.pi / 2) + 0.3)
    effects = [{"kind": "runout", "node": 1, "harmonic": n} for n in harmonics]
    entries = [make_term("effect", effect, PLAIN, (1,)).unknowns[0].entries[0] for effect in effects]
    columns = np.stack([np.exp(1j * e.shift * angle) * e.matrix[0] for e in entries], axis=1)
    amplitude, left, _, _ = np.linalg.lstsq(columns, seen, rcond=None)
    assert left < 1e-24 * len(angle)
    assert np.abs(amplitude) == pytest.approx(1 / len(harmonics) ** 0.5 if order % 2 == 0 else 1.0)
