"""Systems of equations factorised once, by their band or as a whole, against numpy's solution of each."""

import numpy as np
import pytest

from rotorstudy.response.factorised import FEWEST, factorised

COUNT = 80


def systems(band, seed=5):
    """Diagonally dominant complex systems (2, 3, COUNT, COUNT) of a bandwidth, and right sides (2, 3, COUNT, 4)."""
    draw = np.random.default_rng(seed).standard_normal
    full = draw((2, 3, COUNT, COUNT)) + 1j * draw((2, 3, COUNT, COUNT))
    near = np.abs(np.subtract.outer(np.arange(COUNT), np.arange(COUNT))) <= band
    return full * near + 10 * np.eye(COUNT), draw((2, 3, COUNT, 4)) + 0j


def refuse(monkeypatch, name):
    monkeypatch.setattr(f"scipy.linalg.lapack.{name}", lambda *_, **__: pytest.fail(f"{name} was used"))


@pytest.mark.parametrize(("band", "other_way"), [(3, "zgetrf"), (60, "zgbtrf")])
def test_both_ways_agree_with_the_dense_solution(band, other_way, monkeypatch):
    """All by elimination with pivots: equal but for round-off times the condition number, here below 100."""
    matrices, right = systems(band)
    refuse(monkeypatch, other_way)
    solved = factorised(matrices.copy())
    for one in (right, 1j * right[..., :1]):  # the factors serve again
        assert np.abs(solved(one) - np.linalg.solve(matrices, one)).max() < 1e-12
    assert np.abs(solved(right[0]) - np.linalg.solve(matrices, right[0])).max() < 1e-12  # the same for all trials


def test_an_order_makes_a_band_of_unknowns_that_lie_apart(monkeypatch):
    matrices, right = systems(3)
    order = np.random.default_rng(1).permutation(COUNT)  # of the unknowns as they will lie
    apart = np.argsort(order)
    mixed, of_mixed = matrices[..., apart[:, None], apart], right[..., apart, :]
    expected = np.linalg.solve(mixed, of_mixed)
    refuse(monkeypatch, "zgetrf")
    assert np.abs(factorised(mixed, order)(of_mixed) - expected).max() < 1e-12
    with pytest.raises(pytest.fail.Exception, match="zgetrf was used"):
        factorised(mixed)


@pytest.mark.parametrize("count", [FEWEST - 1, FEWEST + 1])
def test_a_singular_matrix_is_refused_whatever_the_way(count):
    for matrix in (np.zeros((1, count, count), complex), np.ones((1, count, count), complex)):
        with pytest.raises(np.linalg.LinAlgError):
            factorised(matrix)(np.ones((1, count, 1), complex))
