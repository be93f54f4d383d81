"""Two faults adjoin if one force at a common node could stand in for both."""

from types import SimpleNamespace

import pytest
from test_search import TWO_DISCS

from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.causes import adjoin
from rotorstudy.model.rig import build_model

MODEL = build_model(TWO_DISCS)
CANDIDATES = candidates(MODEL, Settings())[0]
EVERY = {cause.cause: cause for cause in CANDIDATES}


def adjoining(*names):
    causes = tuple(EVERY[name] for name in names)
    return adjoin(SimpleNamespace(causes=causes, fit=SimpleNamespace(model=MODEL)), CANDIDATES)


@pytest.mark.parametrize(
    "other",
    ["external_damping, node 3", "bow, element 3", "rub, node 3", "stiffness_error", "runout, node 3, harmonic 1"],
)
def test_faults_at_a_common_node_adjoin(other):
    assert adjoining("unbalance, node 3", other)


@pytest.mark.parametrize("other", ["external_damping, node 2", "bow, element 1", "rub, node 4", "shaft_asymmetry"])
def test_faults_apart_do_not(other):
    """Nor does one that may be anywhere on the shaft, and is found to extend over the whole of it."""
    assert not adjoining("unbalance, node 3", other)


def test_a_fault_does_not_adjoin_its_own_parts():
    """The harmonics of a runout are one fault; a single fault adjoins none."""
    assert not adjoining("unbalance, node 3")
    assert not adjoining("runout, node 3, harmonic 1", "runout, node 3, harmonic 2")
