"""The banded solution of long shafts against the dense one."""

import numpy as np
import pytest

from rotorstudy.response import banded
from rotorstudy.response.banded import bandwidth, solve_systems


def systems(generator, band, count=80):
    """Diagonally dominant complex systems (2, 3, count, count) of a bandwidth, and right sides (2, 3, count, 4)."""
    draw = generator.standard_normal
    full = draw((2, 3, count, count)) + 1j * draw((2, 3, count, count))
    near = np.abs(np.subtract.outer(np.arange(count), np.arange(count))) <= band
    return full * near + 10 * np.eye(count), draw((2, 3, count, 4)) + 0j


def test_banded_and_dense_solutions_agree(monkeypatch):
    """Both by elimination with pivots: equal but for round-off times the condition number, here below 100."""
    matrices, right = systems(np.random.default_rng(5), 3)
    assert bandwidth(matrices) == 3
    found = solve_systems(matrices, right)
    monkeypatch.setattr(np.linalg, "solve", lambda *_: pytest.fail("the dense solution was used"))
    assert np.array_equal(solve_systems(matrices, right), found)
    monkeypatch.undo()
    assert np.abs(found - np.linalg.solve(matrices, right)).max() < 1e-13


def test_a_wide_band_is_solved_densely(monkeypatch):
    matrices, right = systems(np.random.default_rng(6), 20)
    monkeypatch.setattr("scipy.linalg.solve_banded", lambda *_, **__: pytest.fail("the banded solution was used"))
    assert np.abs(matrices @ solve_systems(matrices, right) - right).max() < 1e-12


def test_a_singular_matrix_is_refused_by_both():
    for size in (banded.FEWEST - 1, banded.FEWEST + 1):
        with pytest.raises(np.linalg.LinAlgError):
            solve_systems(np.zeros((1, size, size)), np.ones((1, size, 1)))
