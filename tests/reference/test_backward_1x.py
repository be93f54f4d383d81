"""-1X of both test rigs: simulated readings separate the hypotheses, and the published ones say what the page says."""

import numpy as np
import pytest

from rotorstudy.thesis.backward_1x import METHOD, READING_M, hypotheses
from rotorstudy.thesis.config import load_replay
from rotorstudy.thesis.replay import rounding_draws

RIG = np.repeat([0, 1], 5)
SHARE = 0.09 * np.exp(1.3j)
RUNOUT = np.array([30e-6 - 5e-6j, 10e-6j])
STD = np.full(len(RIG), 1e-6)


def made_up(share, runout, seed):
    """(rig, forward, backward, std) with noise of the stated size."""
    rng = np.random.default_rng(seed)
    forward = 5e-4 + 2e-4 * rng.standard_normal((len(RIG), 2)) @ [1, 1j]
    noise = 1e-6 * rng.standard_normal((len(RIG), 2)) @ [1, 1j]
    return RIG, forward, share * forward.conj() + runout[RIG] + noise, STD


@pytest.mark.parametrize(
    ("share", "runout", "accepted"),
    [
        (SHARE, 0 * RUNOUT, [True, True, False, True]),
        (0.0, RUNOUT, [False, False, True, True]),
        (SHARE, RUNOUT, [False, False, False, True]),
    ],
    ids=["probes", "runout", "both"],
)
def test_a_wrong_hypothesis_is_rejected_and_a_true_one_is_not(share, runout, accepted):
    p_values = np.array([hypotheses(*made_up(share, runout, seed))["p-value"] for seed in range(50)])
    assert ((p_values > 1e-3).mean(axis=0) > 0.9).tolist() == accepted
    assert (p_values[:, ~np.array(accepted)] < 1e-6).all()


def test_the_share_is_within_its_standard_deviation():
    off = []
    for seed in range(200):
        both = hypotheses(*made_up(SHARE, RUNOUT, seed)).iloc[3]
        found = both["share"][0] * np.exp(1j * np.deg2rad(both["angle"][0]))
        off += [(found - SHARE) / both["standard deviation"][0]]
    assert np.std(np.real(off)) == pytest.approx(1, abs=0.15)  # 200 draws: 5 % standard deviation


def test_published_readings_need_both(pytestconfig):
    root = pytestconfig.rootpath / "workflow"
    rig, forward, backward = [], [], []
    for number, name in enumerate(("chapter_3", "chapter_5")):
        config = load_replay(root / "config" / f"{name}.yaml").model_copy(update={"trials": 100})
        amplitude = rounding_draws(config, root / "reference", "fft").mean(axis=0)  # (case, harmonic)
        rig += [number] * len(amplitude)
        forward += list(amplitude[:, config.harmonics.index(1)])
        backward += list(amplitude[:, config.harmonics.index(-1)])
    backward = np.array(backward)
    found = hypotheses(np.array(rig), np.array(forward), backward, np.hypot(READING_M, METHOD * np.abs(backward)))
    assert (found["p-value"] > 0.05).tolist() == [False, False, False, True]  # as the page and its caption say
    assert found["p-value"][[0, 2]].max() < 1e-6
