"""The forces of many amplitudes at once are those of one amplitude after the other, entry by entry."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy import Entry, make_term, read_rig
from rotorstudy.model.entries import Basis, Multiples, apply_entries
from rotorstudy.model.entry_table import EntryTable
from rotorstudy.model.terms import Parameter
from rotorstudy.response.neighbourhood import Neighbourhood

ROUND_OFF = 1e-13  # relative to the largest force: sums of at most some ten products
SPEED, HARMONICS, SIZE = np.array([40.0, 90.0]), np.array([-2, -1, 0, 1, 2]), 3
KINDS = [  # on, order, shift, gain, whether it depends on the harmonic
    ("z", 0, 0, None, False), ("z", 1, 0, np.sqrt, False), ("z", 0, 3, None, False),
    ("conj", 0, 2, None, False), ("conj", 2, -1, None, False),
    ("z", 0, 0, lambda speed, harmonic: speed + 1j * harmonic, True),
    ("static", 0, 1, np.square, False), ("static conj", 0, -1, None, False),
    ("one", 0, 1, np.square, False), ("one", 0, 7, None, False),  # a harmonic that is not carried
]  # fmt: skip


@pytest.fixture
def random():
    return np.random.default_rng(5)


@pytest.fixture
def unknowns(random):
    """Amplitudes of several entries, some of the same kind, one that carries load, and one without entries."""
    found = []
    for i in range(12):
        entries = []
        for k in random.choice(len(KINDS), 3, replace=False):
            on, order, shift, gain, by_harmonic = KINDS[k]
            matrix = random.normal(size=(SIZE,) if on == "one" else (SIZE, SIZE)) * (1 + 0.5j)
            matrix[random.integers(SIZE)] = 0
            entries.append(Entry(matrix, on, order, shift, gain, by_harmonic))
        found.append(Parameter(f"amplitude {i}", "N", tuple(entries), 1.0, carries=i == 4))
    return (*found, Parameter("in time", "N", (), 1.0))


def test_multiples_of_the_same_entries_are_those_entries_times_their_factors(unknowns, random):
    """Of some amplitudes, one of which carries load, beside others."""
    own = np.random.default_rng(6)
    basis = Basis(own.normal(size=SIZE) * [1, 0, 1], 2.0, -3.0, (-3, -1, 0, 1, 4))
    factors = own.normal(size=(6, len(basis.entries))) * own.integers(0, 2, (6, len(basis.entries))) * (1 - 0.3j)
    shared = [Parameter(f"own {i}", "N", Multiples(basis, one), 1.0, carries=i == 4) for i, one in enumerate(factors)]
    multiples = (*unknowns[3:6], *shared, unknowns[-1])
    written_out = [replace(u, entries=tuple(u.entries)) for u in multiples]
    motion = random.normal(size=(len(SPEED), len(HARMONICS), SIZE, 2)) @ [1, 1j]
    at = motion, SPEED, HARMONICS, random.normal(size=SIZE)
    one, other = (EntryTable(some, SIZE).dense_columns(*at) for some in (multiples, written_out))
    assert np.abs(other).max(axis=(0, 1, 2))[3:9].min() > 0.1  # each of them acts
    np.testing.assert_allclose(one, other, rtol=0, atol=ROUND_OFF * np.abs(other).max())


@pytest.mark.parametrize("lead", [(), (4,)])
@pytest.mark.parametrize("deflected", ["not", "alike", "by trial"])
def test_table_is_equal_to_its_entries_one_after_the_other(unknowns, random, lead, deflected):
    shape = (*lead, len(SPEED), len(HARMONICS), SIZE)
    motion = random.normal(size=(*shape, 2)) @ [1, 1j]
    deflection = {"not": None, "alike": random.normal(size=SIZE) + 0.3j,
                  "by trial": random.normal(size=(*lead, len(SPEED), SIZE)) * 1j}[deflected]  # fmt: skip
    theta, table = random.normal(size=(*lead, len(unknowns))), EntryTable(unknowns, SIZE)
    references = [None if u.carries else deflection for u in unknowns]
    both = list(zip(unknowns, references, strict=True))
    slow, still = (
        np.stack([apply_entries(u.entries, z, SPEED, HARMONICS, r) for u, r in both], -1) for z in (motion, 0 * motion)
    )
    fast = table.dense_columns(motion, SPEED, HARMONICS, deflection)
    assert np.abs(fast - slow).max() <= ROUND_OFF * np.abs(slow).max()

    at_rest = table.static_force(theta, SPEED, HARMONICS, deflection)
    summed = np.einsum("...shiu,...u->...shi", still, theta)
    assert np.abs(at_rest - summed).max() <= ROUND_OFF * np.abs(still).max() * len(unknowns)

    moving = table.force_of_motion(theta, motion, SPEED, HARMONICS)
    summed = np.einsum("...shiu,...u->...shi", slow - still, theta)
    assert np.abs(moving - summed).max() <= ROUND_OFF * np.abs(slow).max() * len(unknowns)


def test_what_forces_add_is_the_same_in_parts(monkeypatch):
    """Of a mesh whose motions by all forces would fill the memory, the forces are solved in parts."""
    model = read_rig("examples/two_discs.yaml").model
    effects = ("unbalance", "support_anisotropy", "external_damping")
    items = [
        {"kind": kind, "node": node, "label": f"{kind} {node}"} for kind in effects for node in model.structure.nodes
    ]
    terms = [make_term("effect", item, model.structure, model.sensors) for item in items]
    unknowns = [unknown for term in terms for unknown in term.unknowns]

    def found(groups):
        near = Neighbourhood(model, [200.0, 300.0], [0, 1, -1], order=3)
        force = np.random.default_rng(3).normal(size=(4, *near.motion.amplitude.shape)).astype(complex)
        return near.changes_by_forces(groups), near.moved_by(force), near.changes_by_forces(groups[:1])

    groups = [(unknowns, None)], [(unknowns[:2], None)] * 3
    whole = [found(one) for one in groups]
    monkeypatch.setattr("rotorstudy.response.neighbourhood.FORCES_AT_ONCE", 1)
    for one, before in zip(groups, whole, strict=True):
        for part, same in zip(found(one), before, strict=True):
            assert np.abs(part - same).max() <= ROUND_OFF * np.abs(same).max() and same.any()
