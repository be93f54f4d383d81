"""What the published measurements show by themselves, and how estimates are shown."""

import chapters
import numpy as np
import pandas as pd
import pytest

from thesis import checks
from thesis.checks import largest_crack_response, physical_checks, shown_estimates, slow_roll_text, weight_text
from thesis.replay import BOTH_DAMPINGS, rounding_draws


@pytest.fixture(scope="module", params=[3, 5])
def replay(request):
    config = chapters.replay(request.param).model_copy(update={"trials": 100})
    return config, rounding_draws(config, chapters.REFERENCE, "fft").mean(axis=0)


def test_most_of_minus_1x_is_there_at_slow_roll_and_no_crack_can_do_it(replay):
    config, amplitude = replay
    place = config.harmonics.index(-1)
    share = checks.slow_roll_share(config, amplitude)[:, place]
    assert (share > 0.7).all()
    assert "of -1X, as vectors, is already present at slow roll" in slow_roll_text(-1, share)
    assert abs(amplitude[0, place]) > 20 * largest_crack_response(config, -1)


def test_the_verdict_on_weight_dominance_goes_by_the_numbers(replay):
    config, amplitude = replay
    words = {"chapter_3": "does not hold here", "chapter_5": "is doubtful"}
    assert words[config.name] in weight_text(config, amplitude)


def test_two_possible_dampings_can_be_impossible_together(replay):
    config, _ = replay
    names = ["external_damping", "internal_damping", BOTH_DAMPINGS, "eccentricity"]
    sizes = np.array([300.0, 290.0, 590.0 if config.name == "chapter_3" else 690.0, 1e-4])
    table = pd.DataFrame({"source": "a", "group": "b", "parameter": names, "estimate": sizes})
    checks = physical_checks(config, table.assign(low=sizes * 0.99, high=sizes * 1.01), bow=5e-4)
    assert list(checks.verdict) == ["possible", "possible", "impossible", "possible"]
    assert list(checks.unit) == ["N s/m", "N s/m", "N s/m", "µm"] and checks.estimate[3] == pytest.approx(100.0)


def test_estimates_are_shown_in_um_and_degrees_under_short_names(replay):
    config, _ = replay
    loss = config.thesis_names["dk p_-1"][0]
    names = [BOTH_DAMPINGS, "eccentricity", "eccentricity_phase", loss]
    table = pd.DataFrame({"parameter": names, "estimate": [1.0, 1e-6, np.pi, 2.0], "low": 0.0, "high": 0.0})
    shown = shown_estimates(config, table)
    assert list(shown.parameter) == ["both dampings", "eccentricity", "eccentricity phase", "dk p_-1"]
    assert list(shown.unit) == ["N s/m", "µm", "deg", "N/m"]
    assert list(shown.estimate) == pytest.approx([1.0, 1.0, 180.0, 2.0])
