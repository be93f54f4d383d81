"""The breathing law of a crack is named alone only where the others are improbable."""

import pytest

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words
from rotorstudy.diagnosis.verdict.causes import _other_variants
from rotorstudy.diagnosis.verdict.result import Cause


def cracked(breathing, log_odds):
    """An explanation by a crack of some law."""
    crack = Candidate("transverse_crack", {}, None, {}, variant={"breathing": breathing})
    return Explanation((crack,), None, log_odds)


@pytest.mark.parametrize(("behind", "others"), [(1.0, [{"breathing": "sudden"}]), (10.0, [])])
def test_laws_within_reach_are_named_too(behind, others):
    best = cracked("gradual", 100.0)
    shapes = [cracked("sudden", 99.0 - behind), cracked("gradual", 99.0), cracked("none", 60.0)]
    elsewhere = Explanation((*best.causes, Candidate("bow", {}, None, {})), None, 100.0)
    among = [best, cracked("sudden", 100.0 - behind), *shapes, elsewhere]
    found = _other_variants(best, best.causes[0], among, 0.99)
    assert found == others
    cause = Cause(effect="transverse_crack", where={}, parameters={}, variant=best.causes[0].variant,
                  other_variants=found, posterior_probability=1.0)  # fmt: skip
    assert cause_in_words(cause).endswith(f"breathing gradual{' or sudden' * bool(others)})")
