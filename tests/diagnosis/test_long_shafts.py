"""Time and memory of a diagnosis grow in proportion to the elements of a shaft: counted, as seconds depend on load."""

import tracemalloc
from typing import NamedTuple

import numpy as np
import pytest
from machines import all_but, disc, shaft, springs, unbalance

from rotorstudy import build_model
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.response import neighbourhood

ELEMENTS = 40  # and twice as many
IN_PROPORTION = 2.4  # at twice the elements: 2, and some per cent of round numbers


class Cost(NamedTuple):
    """Numbers solved for the candidates, their columns, and largest memory, bytes."""

    solved: int
    columns: int
    memory: int


def columns_of_candidates(near, unknowns):
    return near.changes_by_forces([(unknowns, None)]).shape[-1]


def motions_by_every_coordinate(near, unknowns):
    """The negative control: what was done before the adjoint system."""
    force = np.zeros((near.motion.amplitude.shape[-1], *near.motion.amplitude.shape), complex)
    force[range(len(force)), ..., range(len(force))] = 1.0
    return len(near.moved_by(force))


def cost(elements, counted_columns, monkeypatch):
    """Of the columns of all candidates on a shaft of 1.5 m."""
    settings = Settings(leave_out=all_but("unbalance", "added_mass"), nuisance={})
    rig = {"rotor": shaft(1.5, elements, disc(elements // 2 + 1, 15.0, 0.2, 0.1), outer_diameter_m=0.04)}
    rig |= {"bearings": springs([1, elements + 1], 2e7, 500.0), "sensors": [elements // 4 + 1, elements // 2 + 1]}
    model = build_model({**rig, "effects": [unbalance(elements // 2 + 1, 1e-5)]})
    numbers, own = [], neighbourhood.solver

    def counting(*given, **options):
        solved = own(*given, **options)
        return lambda force: numbers.append(force.size) or solved(force)

    monkeypatch.setattr(neighbourhood, "solver", counting)
    tracemalloc.start()
    found, _ = candidates(model, settings)
    near = neighbourhood.Neighbourhood(model, [60.0, 110.0, 210.0], [0, 1, -1, 2], order=4)
    columns = counted_columns(near, [unknown for one in found for unknown in one.term.unknowns])
    memory = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    monkeypatch.setattr(neighbourhood, "solver", own)
    return Cost(sum(numbers), columns, memory)


@pytest.mark.parametrize(
    ("columns", "is_in_proportion"), [(columns_of_candidates, True), (motions_by_every_coordinate, False)]
)
def test_the_cost_of_all_candidates_is_in_proportion_to_the_elements(columns, is_in_proportion, monkeypatch):
    short, long = (cost(count, columns, monkeypatch) for count in (ELEMENTS, 2 * ELEMENTS))
    assert long.columns > 1.7 * short.columns
    assert (long.solved < IN_PROPORTION * short.solved) == is_in_proportion
    assert (long.memory < IN_PROPORTION * short.memory) == is_in_proportion
