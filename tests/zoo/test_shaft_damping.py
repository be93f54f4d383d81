"""Damping of the turning shaft in proportion to its stiffness: viscous and hysteretic."""

import numpy as np
import pytest

from rotorstudy import RotorstudyError, build_model, eigenvalues, harmonic_response, make_term, stability_threshold
from rotorstudy.model.entries import apply_entries
from rotorstudy.response.integration import force_in_time

PLAIN = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
SHAFT = {"kind": "finite_element", "elements": [{"length_m": 0.6, "count": 3}], "outer_diameter_m": 0.02}
UNBALANCE = {"kind": "unbalance", "eccentricity_m": 1e-5}
HARMONICS = np.array([0, 1, 2, 3, -1, -2])
SPEED = 200.0


def column(item, structure, amplitude):
    """(harmonic, dof) force of the unit amplitude."""
    (unknown,) = make_term("effect", item, structure, structure.nodes).unknowns
    return apply_entries(unknown.entries, amplitude[None], [SPEED], HARMONICS)[0]


def test_it_damps_the_bending_of_the_shaft_that_a_turning_observer_sees():
    shaft = build_model({"rotor": SHAFT}).structure
    random = np.random.default_rng(1)
    z, velocity = random.standard_normal((2, 5, 8)) + 1j * random.standard_normal((2, 5, 8))
    (unknown,) = make_term("effect", {"kind": "shaft_damping"}, shaft, shaft.nodes).unknowns
    found = force_in_time(unknown.entries, SPEED, np.zeros(5), z, velocity)
    assert found == pytest.approx(-(velocity - 1j * SPEED * z) @ shaft.stiffness.T, rel=1e-12)
    turning = force_in_time(unknown.entries, SPEED, np.zeros(5), z, 1j * SPEED * z)
    assert np.abs(turning).max() < 1e-12 * np.abs(found).max()  # bent, turning with the shaft: silent
    rigid = np.kron(np.ones((5, 4)), [1, 0])
    assert np.abs(force_in_time(unknown.entries, SPEED, np.zeros(5), rigid, rigid)).max() < 1e-9 * np.abs(found).max()


def test_on_one_coordinate_it_is_internal_damping_of_that_stiffness():
    plain = {"kind": "internal_damping", "internal_damping_N_s_per_m": 19.0}
    along = {"kind": "shaft_damping", "shaft_damping_s": 19.0 / 7.6e5}
    outside = {"kind": "external_damping", "external_damping_N_s_per_m": 60.0}
    models = [build_model({"rotor": PLAIN, "effects": [e, outside, UNBALANCE]}) for e in (plain, along)]
    found = [harmonic_response(model, [150.0, 700.0], HARMONICS) for model in models]
    assert np.abs(found[0] - found[1]).max() < 1e-12 * np.abs(found[0]).max()
    threshold = np.sqrt(7.6e5 / 2.0) * (1 + 60.0 / 19.0)
    assert [stability_threshold(m, 5000.0) for m in models] == pytest.approx([threshold] * 2, rel=1e-9)


def test_hysteretic_is_the_viscous_one_of_the_same_loss_at_each_harmonic():
    """beta (n - 1) w = eta sign(n - 1): equal where |n - 1| w beta = eta, silent at +1X, in step at 0X."""
    shaft = build_model({"rotor": SHAFT}).structure
    random = np.random.default_rng(2)
    amplitude = random.standard_normal((len(HARMONICS), 8)) + 1j * random.standard_normal((len(HARMONICS), 8))
    hysteretic = column({"kind": "hysteretic_damping"}, shaft, amplitude)
    viscous = column({"kind": "shaft_damping"}, shaft, amplitude)
    for n, by_loss, by_rate in zip(HARMONICS, hysteretic, viscous, strict=True):
        assert by_loss * abs(n - 1) * SPEED == pytest.approx(by_rate, rel=1e-9, abs=1e-9 * np.abs(viscous).max())
    assert np.abs(hysteretic[1]).max() == 0 and np.abs(hysteretic[2] * SPEED * 2 - viscous[2]).max() > 1.0


def test_hysteretic_takes_the_loss_factor_of_its_energy_in_a_cycle_at_any_speed():
    """A circle of radius a once a turn against the shaft costs 2 pi eta k a^2 a turn, whatever the speed."""
    plain = build_model({"rotor": PLAIN}).structure
    (unknown,) = make_term("effect", {"kind": "hysteretic_damping"}, plain, (1,)).unknowns
    amplitude = np.zeros((1, len(HARMONICS), 1), complex)
    amplitude[0, 2] = 1e-5  # 2X: once a turn for the shaft
    for speed in (50.0, 500.0):
        force = apply_entries(unknown.entries, amplitude, [speed], HARMONICS)[0, 2, 0]
        power = (force * np.conj(1j * speed * 1e-5)).real  # in the turning frame the motion runs at w
        assert power * 2 * np.pi / speed == pytest.approx(-2 * np.pi * 7.6e5 * 1e-10, rel=1e-12)


def test_hysteretic_damping_exists_in_frequency_only():
    model = build_model({"rotor": PLAIN, "effects": [{"kind": "hysteretic_damping", "loss_factor": 0.01}, UNBALANCE]})
    assert np.isfinite(harmonic_response(model, [150.0], HARMONICS)).all()
    with pytest.raises(RotorstudyError, match="'loss_factor' makes the model time-varying or frequency-dependent"):
        eigenvalues(model, [150.0])
