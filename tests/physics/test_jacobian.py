"""Derivatives of the measured response against central differences."""

import numpy as np
import pytest
from conftest import HARMONICS, jeffcott

from rotorstudy import Entry, Parameter, Term, measured_response


def chain(sensors):
    """Gap, runout, and a probe that mixes in derivative and conjugate: acts on what the other terms show."""
    mixing = (Entry(0.3 * np.eye(sensors), order=1), Entry(1j * np.eye(sensors), on="conj"))
    one = np.eye(sensors)[0]
    return (
        Term("gap", (Parameter("gap", "m", (Entry(one, on="one"),), 1e-3, True),), {"gap": 1e-3 + 2e-3j}, "output"),
        Term("mixing", (Parameter("mixing", "1", mixing, 1e-2),), {"mixing": 1e-2}, "output"),
    )


def worst(model, speeds, harmonics, jacobian=None):
    """Largest relative difference of the analytic from the numerical derivative, over the parameters."""
    shown, analytic = measured_response(model, speeds, harmonics, jacobian=True)
    analytic = analytic if jacobian is None else jacobian(analytic)
    assert shown == pytest.approx(measured_response(model, speeds, harmonics), rel=1e-12)
    found = []
    for p, size in enumerate(np.maximum(np.abs(model.theta), 1e-3 * model.typical)):
        step = np.zeros(len(model.theta))
        step[p] = 1e-5 * size
        high, low = (measured_response(model, speeds, harmonics, model.theta + sign * step) for sign in (1, -1))
        numerical = (high - low) / (2 * step[p])
        found.append(np.abs(numerical - analytic[..., p]).max() / np.abs(analytic[..., p]).max())
    return max(found)


# central differences with a relative step of 1e-5: error 1e-10 of the curvature, and round-off 1e-16 / 1e-5 of the
# response, which where a parameter matters little is a thousand times larger against its own derivative
TOLERANCE = 1e-6


@pytest.mark.parametrize("weight_dominance", [True, False])
def test_jeffcott(weight_dominance):
    model = jeffcott(weight_dominance=weight_dominance)
    assert worst(model.plus(*chain(1)), [88.0, 308.0], HARMONICS) < TOLERANCE


def test_coupled_machine(machine):
    assert worst(machine.plus(*chain(2)), [100.0, 150.0], range(-4, 5)) < TOLERANCE


def test_the_comparison_finds_a_wrong_column():
    def off(analytic):
        wrong = analytic.copy()
        wrong[..., 1] *= 1.001
        return wrong

    assert worst(jeffcott(), [88.0], HARMONICS, off) > 5e-4
