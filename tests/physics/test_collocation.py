"""Response against motion that was computed without the package: collocation in x and y."""

import numpy as np
import pytest
from collocation import collocated, four_coordinates, term
from machines import jeffcott

from rotorstudy import Entry, harmonic_response

SPEEDS, ORDER = [90.0, 130.0], 30
SHOWN = np.arange(-6, 7)
# round-off of 1e-16 times the condition of the collocation matrix: the 40th harmonic's inertia over the stiffness, 1e4
ROUND_OFF = 1e-10


@pytest.fixture(scope="module", params=range(1, 3), ids=lambda seed: f"seed {seed}")
def model(request):
    return four_coordinates(request.param)


@pytest.fixture(scope="module")
def settled(model):
    """Collocated motion of the model at each of the speeds."""
    return [collocated(model, speed) for speed in SPEEDS]


def apart(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


def at(harmonics, motion):
    return np.array([motion[n] for n in harmonics])


def test_response_of_four_coupled_coordinates_is_the_collocated_motion(model, settled):
    found = harmonic_response(model, SPEEDS, SHOWN, order=ORDER)
    for harmonics, motion in zip(found, settled, strict=True):
        expected = at(SHOWN, motion)
        only_by_coupling = np.abs(expected[[0, 2, -1]]).min()  # harmonics -6, -4 and 6, which no force has
        assert only_by_coupling > 1000 * ROUND_OFF * np.abs(expected).max()  # so they are compared, too
        assert apart(harmonics, expected) < ROUND_OFF


def test_collocation_finds_the_gyroscopic_sign(model):
    """Negative control: +j w G q' instead of -j w G q'."""
    found = harmonic_response(model, SPEEDS[:1], SHOWN, order=ORDER)[0]
    assert apart(found, at(SHOWN, collocated(model, SPEEDS[0], gyroscopic_sign=-1.0))) > 1e-3


@pytest.mark.parametrize("kind", ["uneven", "turning", "backward", "swirl", "push", "rub"])
def test_collocation_finds_every_effect_that_is_a_thousandth_off(model, settled, kind):
    theta = np.where([name.startswith(kind) for name in model.names], 1.001, 1.0) * model.theta
    found = harmonic_response(model, SPEEDS[:1], SHOWN, theta, order=ORDER)[0]
    assert apart(found, at(SHOWN, settled[0])) > 100 * ROUND_OFF


def test_full_crack_is_the_collocated_motion():
    model = jeffcott(weight_dominance=False, order=7)
    found = harmonic_response(model, [88.0], SHOWN, order=ORDER)[0]
    # harmonics beyond 30, left out here and aliased there, are below 1e-9 and reach those shown through many steps
    assert apart(found, at(SHOWN, collocated(model, 88.0))) < ROUND_OFF


def test_turning_inertia_is_the_collocated_motion():
    """Acceleration entries on z and conj(z) that turn: no integrator of the package takes them."""
    plain = four_coordinates(1)
    matrix = np.diag([0.3, 0.2, 0.1, 0.1])
    model = plain.plus(
        term("inertia", 0.5, Entry(-matrix, order=2, shift=1), Entry(-matrix, on="conj", order=2, shift=2))
    )
    expected = at(SHOWN, collocated(model, 90.0))
    assert apart(harmonic_response(model, [90.0], SHOWN, order=ORDER)[0], expected) < ROUND_OFF
    assert apart(harmonic_response(plain, [90.0], SHOWN, order=ORDER)[0], expected) > 1e-3  # negative control
