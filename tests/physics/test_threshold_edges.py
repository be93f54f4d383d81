"""Undamped modes have real parts of round-off size, and a search may start above the threshold."""

import pytest
from test_threshold import JEFFCOTT, MID_SPAN, NATURAL, OFF_MID_SPAN, rotor

from rotorstudy import stability_threshold
from rotorstudy.response.stability import check_stable


@pytest.mark.parametrize("kind", [JEFFCOTT, MID_SPAN, OFF_MID_SPAN], ids=["jeffcott", "mid-span", "off mid-span"])
def test_round_off_of_an_undamped_rotor_is_no_threshold(kind):
    check_stable(rotor(kind), [12.5, 62.5, 500.0])
    assert stability_threshold(rotor(kind), 5000.0) is None


def test_round_off_of_an_undamped_tilt_is_no_threshold():
    """External damping of the translation; at mid-span the tilt has none, and nothing that feeds it either."""
    assert stability_threshold(rotor(MID_SPAN, 0.0, 100.0), 5000.0) is None


def test_an_undamped_tilt_does_not_hide_the_threshold_of_the_translation():
    assert stability_threshold(rotor(MID_SPAN, 20.0, 100.0), 5000.0) == pytest.approx(6 * NATURAL, rel=1e-8)


@pytest.mark.parametrize("up_to", [4e3, 4e4, 4e5, 4e6])
def test_the_threshold_does_not_depend_on_how_far_it_is_looked_for(up_to):
    """With up_to = 4e6 rad/s the first speed tried, 10 000 rad/s, is unstable and is returned as the threshold."""
    assert stability_threshold(rotor(JEFFCOTT, 20.0, 100.0), up_to) == pytest.approx(6 * NATURAL, rel=1e-8)
