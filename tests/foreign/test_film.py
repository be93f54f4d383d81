"""The film against the published closed form of a journal that runs with a given eccentricity."""

import numpy as np
import pytest

from rotorstudy.blind.machines.film import Film, bearing, force, running_position

FILM = Film(node=0, diameter=0.1, length=0.03, clearance=1e-4, viscosity=0.1, load=525.0)
SPEED = 50 * np.pi  # rad/s, 1500 rpm


def test_a_film_runs_where_the_published_one_does():
    """Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (2010), example 5.5.1."""
    at = running_position(FILM, SPEED)
    assert np.hypot(*at) / FILM.clearance == pytest.approx(0.2663, abs=5e-5)
    assert force(FILM, SPEED, at, (0, 0)) == pytest.approx([-525.0, 0.0], abs=1e-6)


def test_coefficients_of_the_book():
    """The same example, MN/m and kN s/m along x (the load) and y; the book's axes are turned by a right angle."""
    found, turn = bearing(FILM, SPEED), np.array([[0, 1], [-1, 0]])
    assert turn @ found.stiffness @ turn.T / 1e6 == pytest.approx(np.array([[12.81, 16.39], [-25.06, 8.815]]), rel=4e-4)
    assert turn @ found.damping @ turn.T / 1e3 == pytest.approx(np.array([[232.9, -81.92], [-81.92, 294.9]]), rel=3e-4)
