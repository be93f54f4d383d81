"""A verdict states the shape of a cause over all its forms: the depth of a crack over all its fronts."""

import pytest
from test_one_cause import TRUE, crack, records, rig

from rotorstudy import build_model, registry
from rotorstudy.diagnosis.verdict.cause_words import sizes
from rotorstudy.diagnosis.verdict.investigate import investigate

OTHERS = [name for name in registry().plugins["effect"] if name != "transverse_crack"]
SETTINGS = {"uncertainty": {"default": 0.02}, "nuisance": {}, "leave_out": OTHERS, "hold_out_rad_s": []}


def named(**shape):
    """The crack of a verdict, and its warnings of the form."""
    verdict = investigate(records(crack(**shape)), build_model(rig()), settings=SETTINGS).verdict
    (cause,) = verdict.causes
    return cause, [finding.text for finding in verdict.findings if finding.name == "form of the cause"]


def test_the_interval_of_the_depth_holds_whatever_the_front():
    """Negative control: that of a straight front, which the extended rig has, does not hold it."""
    cause, warnings = named(front_aspect_ratio=0.7)
    assert not warnings
    depth, usual = cause.parameters["depth_ratio"], cause.usual_form["depth_ratio"]
    assert depth.interval_95[0] < TRUE["depth_ratio"] < depth.interval_95[1]
    assert usual.value + 5 * usual.std < TRUE["depth_ratio"]
    ends = cause.parameters["depth_m"].interval_95
    assert ends == pytest.approx([0.02 * end for end in depth.interval_95])
    assert f"(95 %: {1e3 * ends[0]:.2f} to {1e3 * ends[1]:.2f} mm)" in sizes(cause)["depth"]


def test_a_crack_with_the_flexibilities_of_no_front_is_told():
    """By strips it yields along its front twice as much as by elasticity."""
    cause, (warning,) = named(depth_ratio=0.3, flexibility="strip_integration")
    assert "flexibility_factor" in warning and "another form" in warning
    assert not cause.usual_form
