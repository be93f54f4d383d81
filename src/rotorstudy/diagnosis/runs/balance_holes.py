"""Corrections from given holes and weights: the combination that leaves the least vibration.

What a correction w leaves exceeds the least possible by (w - w0)^T N (w - w0), with the best correction w0 and the
normal matrix N of its fit. In each plane up to two holes take one weight each. Planes that the probes hardly tell apart
are strongly coupled by N, so that pairs of planes are chosen together, in turn, until none changes.
"""

from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError

MOST = 5000  # choices in a plane, beyond which the search takes long
LARGEST_G_MM = 1e9  # 1000 kg at 1 m


class Holes(NamedTuple):
    """Angles (hole,) of every plane, rad from the reference line in the project's sense; of weights kg m (weight,)."""

    angles: np.ndarray
    unbalances: np.ndarray


class Choice(NamedTuple):
    """Weights in the holes of a plane: (position of the hole, unbalance in kg m) each, and their sum, kg m."""

    placed: tuple[tuple[int, float], ...]
    total: np.ndarray


def equal_holes(count: int, unbalances_g_mm: list[float], sense: float = 1.0) -> Holes:
    """Holes at equal angles from the reference line on, in the sense (1 or -1) of the user's angles.

    raises : RotorstudyError without a hole or a weight, for weights out of reach, and for too many of both
    """
    if count < 1 or not unbalances_g_mm or not all(0 < one <= LARGEST_G_MM for one in unbalances_g_mm):
        raise RotorstudyError(
            f"holes: {count}, weights: {unbalances_g_mm} g mm; give at least one hole and one weight, above 0 and at "
            f"most {LARGEST_G_MM:g}, as the unbalance that it adds in a hole (mass times radius)"
        )
    weights = 1e-6 * np.unique(unbalances_g_mm)
    choices = 1 + count * len(weights) + count * (count - 1) // 2 * len(weights) ** 2
    if choices > MOST:
        raise RotorstudyError(
            f"{count} holes and {len(weights)} weights make {choices} choices a plane; at most {MOST}"
        )
    return Holes(sense * 2 * np.pi * np.arange(count) / count, weights)


def chosen(holes: Holes, best: np.ndarray, normal: np.ndarray) -> list[Choice]:
    """The choice in each plane that leaves the least vibration.

    best   : (plane * part,) the best correction, kg m
    normal : (plane * part, plane * part) of its fit, per (kg m)²
    """
    choices = _choices(holes)
    totals = np.array([choice.total for choice in choices])
    planes = len(best) // 2
    found = [int(np.argmin(np.sum((totals - best[2 * i : 2 * i + 2]) ** 2, axis=1))) for i in range(planes)]
    pairs = list(combinations(range(planes), 2)) or [(0, 0)]
    while True:
        before = list(found)
        for i, j in pairs:
            found[i], found[j] = _best_pair(totals, found, i, j, best, normal)
        if found == before:
            return [choices[one] for one in found]


def _choices(holes):
    """Every Choice of a plane: no weight, one, or two; of those with one sum that with the fewest weights.

    Between equal sums round-off would decide, and perhaps otherwise each time.
    """
    singles = list(product(range(len(holes.angles)), holes.unbalances.tolist()))
    placed = [(), *((one,) for one in singles), *((a, b) for a, b in combinations(singles, 2) if a[0] != b[0])]
    direction = np.column_stack([np.cos(holes.angles), np.sin(holes.angles)])
    found = {}
    for one in placed:
        total = sum((size * direction[hole] for hole, size in one), np.zeros(2))
        found.setdefault(tuple(np.round(total / holes.unbalances.max(), 9) + 0.0), Choice(one, total))
    return list(found.values())


def _best_pair(totals, found, i, j, best, normal):
    """Positions of the choices in two planes that leave least, with those of the other planes held."""
    held = np.concatenate([totals[one] for one in found]) - best
    a, b = slice(2 * i, 2 * i + 2), slice(2 * j, 2 * j + 2)
    held[a], held[b] = -best[a], -best[b]
    pull = normal @ held

    def alone(part):
        return np.einsum("ca,ab,cb->c", totals, normal[part, part], totals) + 2 * totals @ pull[part]

    if i == j:
        return (int(np.argmin(alone(a))),) * 2
    cost = alone(a)[:, None] + alone(b) + 2 * totals @ normal[a, b] @ totals.T
    return tuple(int(one) for one in np.unravel_index(np.argmin(cost), cost.shape))
