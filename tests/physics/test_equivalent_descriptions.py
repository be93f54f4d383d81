"""One rotor coupled by every kind of entry gives one answer in two descriptions: q, conj(q), shifts, derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from machines import spectrum_of
from random_rotor import four_coordinates, random_model

from rotorstudy import Problem, harmonic_response, measured_response_and_jacobian
from rotorstudy.model.terms import with_entries

SPEED = 110.0
SHOWN = np.arange(-5, 6)
ROUND_OFF = 1e-10  # 1e-16 times the condition of 31 coupled harmonics, the highest with 200 times the inertia


@pytest.fixture(params=[four_coordinates(1), four_coordinates(2), random_model(1)], ids=["four", "four too", "crack"])
def model(request):
    return request.param


def rewritten(model, rule):
    """The model with each entry replaced by what `rule` makes of it."""
    return replace(model, terms=tuple(with_entries(term, lambda entry: [rule(entry)]) for term in model.terms))


def response(model):
    return harmonic_response(model, [SPEED], SHOWN)[0]


def differs(found, expected):
    """Largest difference relative to the largest harmonic."""
    return np.abs(found - expected).max() / np.abs(expected).max()


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
    return spectrum_of(model, [80.0, SPEED], np.arange(-15, 16), 1e-9)


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


def test_trials_at_once_equal_trials_one_by_one_in_a_coupled_rotor(model):
    theta = model.theta * (1 + 0.05 * np.random.default_rng(3).standard_normal((2, 3, len(model.theta))))
    together, slopes = measured_response_and_jacobian(model, [80.0, SPEED], SHOWN, theta)
    for trial in np.ndindex(2, 3):
        one, slope = measured_response_and_jacobian(model, [80.0, SPEED], SHOWN, theta[trial])
        assert differs(together[trial], one) < ROUND_OFF
        assert differs(slopes[trial] * model.typical, slope * model.typical) < ROUND_OFF
    assert differs(together[0, 0], together[1, 2]) > 1e-3  # negative control: trials differ
