"""One rotor described in two ways gives one answer: turned axes, a later clock, other coordinates, other entries.

The rotors are coupled by every kind of entry, so each rule is a statement about q, conj(q), shifts and derivatives.
"""

from dataclasses import replace

import numpy as np
import pytest
from collocation import four_coordinates
from machines import HARMONICS, jeffcott
from random_rotor import random_model

from rotorstudy import (
    Entry,
    Model,
    Parameter,
    Term,
    harmonic_response,
    measured_response,
    measured_response_and_jacobian,
)
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance

SPEED = 110.0
SHOWN = np.arange(-5, 6)
ROUND_OFF = 1e-10  # 1e-16 times the condition of 31 coupled harmonics, the highest with 200 times the inertia


@pytest.fixture(params=[four_coordinates(1), four_coordinates(2), random_model(1)], ids=["four", "four too", "crack"])
def model(request):
    return request.param


def rewritten(model, rule, **structure):
    """The model with each entry replaced by what `rule` makes of it, and parts of its structure by others."""

    def changed(term):
        parameters = tuple(replace(p, entries=tuple(map(rule, p.entries))) for p in term.parameters)
        return replace(term, parameters=parameters)

    return Model(replace(model.structure, **structure), tuple(map(changed, model.terms)), model.sensors)


def response(model):
    return harmonic_response(model, [SPEED], SHOWN)[0]


def differs(found, expected):
    """Largest difference relative to the largest harmonic."""
    return np.abs(found - expected).max() / np.abs(expected).max()


ANGLE = 0.7
IN_TURNED_AXES = {"z": 0, "conj": -2, "one": -1}  # powers of e^{j angle} for p = q e^{-j angle}


def weightless(model):
    return {"static_load": np.zeros(len(model.structure.dofs))}


def test_turned_axes_turn_the_response(model):
    turned = rewritten(model, lambda e: e.times(np.exp(1j * ANGLE * IN_TURNED_AXES[e.on])), **weightless(model))
    plain = response(rewritten(model, lambda e: e, **weightless(model)))
    assert differs(response(turned), plain * np.exp(-1j * ANGLE)) < ROUND_OFF


def test_conjugate_entries_left_behind_in_turned_axes_are_noticed(model):
    """Negative control."""
    wrong = rewritten(model, lambda e: e.times(np.exp(-1j * ANGLE * (e.on == "one"))), **weightless(model))
    plain = response(rewritten(model, lambda e: e, **weightless(model)))
    assert differs(response(wrong), plain * np.exp(-1j * ANGLE)) > 1e-5


def test_a_clock_that_starts_later_turns_each_harmonic_by_its_own_angle(model):
    later = rewritten(model, lambda e: e.times(np.exp(1j * e.shift * ANGLE)))
    expected = response(model) * np.exp(1j * SHOWN * ANGLE)[:, None]
    assert differs(response(later), expected) < ROUND_OFF
    assert differs(response(model), expected) > 1e-3  # negative control: the angle is seen


def test_other_coordinates_show_the_same_motion(model):
    """q = T p with real T: the equations become T' M T p'' + ..., forces T' f."""
    dof = len(model.structure.dofs)
    t = np.eye(dof) + 0.3 * np.random.default_rng(9).standard_normal((dof, dof))
    here = model.structure
    other = rewritten(
        model,
        lambda e: replace(e, matrix=t.T @ e.matrix if e.on == "one" else t.T @ e.matrix @ t),
        mass=t.T @ here.mass @ t,
        stiffness=t.T @ here.stiffness @ t,
        gyroscopic=t.T @ here.gyroscopic @ t,
        static_load=t.T @ here.static_load,
    )
    assert differs(response(other) @ t.T, response(model)) < 100 * ROUND_OFF  # T is conditioned below 10
    softer = replace(other, structure=replace(other.structure, gyroscopic=here.gyroscopic))
    assert differs(response(softer) @ t.T, response(model)) > 1e-5  # negative control: one matrix left as it was


def in_frequency(entry):
    """d/dt written as a gain that depends on the harmonic: harmonic n of e^{jkwt} x' is j (n - k) w x_{n-k}."""
    if entry.on == "one":
        return replace(entry, gain=lambda w, n: entry.gain_at(w, n), frequency_only=True)

    def gain(w, n):
        return entry.gain_at(w, n) * ((n - entry.shift) * w) ** entry.order

    return replace(entry.times(1j**entry.order), order=0, gain=gain, frequency_only=True)


def test_a_derivative_is_a_gain_of_the_harmonic(model):
    same = rewritten(model, in_frequency)
    assert differs(response(same), response(model)) < ROUND_OFF
    found, expected = (measured_response_and_jacobian(m, [SPEED], SHOWN)[1] for m in (same, model))
    for p, name in enumerate(model.names):
        assert differs(found[..., p], expected[..., p]) < 100 * ROUND_OFF, name  # a derivative adds a second solve


def exact(model):
    every = np.arange(-15, 16)
    shown = measured_response(model, [80.0, SPEED], every)
    covariance = independent_covariance(np.full(shown.shape, 1e-18))
    return Spectrum(shown, np.array([80.0, SPEED]), every, model.sensors, covariance)


@pytest.mark.parametrize("seed", [1, 2])
def test_and_gives_the_same_equations_for_the_unknowns(seed):
    model = four_coordinates(seed)
    names = ("swirl", "turning", "backward", "push_real", "push_imag")
    (a, b), (same_a, same_b) = (
        Problem(m, exact(model), names).equations() for m in (model, rewritten(model, in_frequency))
    )
    for p, name in enumerate(names):
        assert differs(same_a[:, p], a[:, p]) < ROUND_OFF, name
    assert differs(same_b, b) < ROUND_OFF


def hysteresis(loss, stiffness):
    """Force -j loss k z_n on forward and +j loss k z_n on backward harmonics: no form in time."""
    entry = Entry(-1j * np.array([[stiffness]]), gain=lambda w, n: np.sign(n) + 0 * w, frequency_only=True)
    return Term("hysteresis", (Parameter("loss_factor", "1", (entry,), 0.01),), {"loss_factor": loss})


def test_hysteretic_damping_has_its_closed_form():
    m, k, loss = 2.0, 7.6e5, 0.05
    rotor, n = jeffcott(), np.array(HARMONICS)
    found = harmonic_response(rotor.plus(hysteresis(loss, k)), [SPEED], HARMONICS)[0, :, 0]
    plain = harmonic_response(rotor, [SPEED], HARMONICS)[0, :, 0]
    stiff = k - m * (n * SPEED) ** 2 + 1j * n * SPEED * 100.0 + 1j * (n - 1) * SPEED * 20.0
    assert found == pytest.approx(plain * stiff / (stiff + 1j * loss * k * np.sign(n)), rel=1e-12)  # round-off
    assert np.abs(found / plain - 1).max() > 1e-3  # negative control: it matters


def test_coupling_of_zero_strength_changes_nothing_in_a_rotor_of_many_coordinates():
    """Harmonics solved one by one, and all 31 with their mirror images in one block."""
    coupled = four_coordinates(3)
    plain = coupled.without(["uneven", "turning", "backward"])
    theta = np.where(np.isin(coupled.names, plain.names), coupled.theta, 0.0)
    expected = harmonic_response(plain, [SPEED], SHOWN)[0]
    assert differs(harmonic_response(coupled, [SPEED], SHOWN, theta)[0], expected) < ROUND_OFF
    assert differs(response(coupled), expected) > 1e-3  # negative control: with their strengths they change it


def test_trials_at_once_equal_trials_one_by_one_in_a_coupled_rotor(model):
    theta = model.theta * (1 + 0.05 * np.random.default_rng(3).standard_normal((2, 3, len(model.theta))))
    together, slopes = measured_response_and_jacobian(model, [80.0, SPEED], SHOWN, theta)
    for trial in np.ndindex(2, 3):
        one, slope = measured_response_and_jacobian(model, [80.0, SPEED], SHOWN, theta[trial])
        assert differs(together[trial], one) < ROUND_OFF
        assert differs(slopes[trial] * model.typical, slope * model.typical) < ROUND_OFF
    assert differs(together[0, 0], together[1, 2]) > 1e-3  # negative control: trials differ
