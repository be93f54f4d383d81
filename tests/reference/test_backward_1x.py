"""-1X of both test rigs: simulated readings separate the hypotheses, and the published ones say what the page says."""

import numpy as np
import pytest
from chapters import REFERENCE, replay

from thesis.backward_1x import METHOD, READING_M, hypotheses, receptance_at
from thesis.replay import rounding_draws

RIG = np.repeat([0, 1], 5)
SHARE = 0.09 * np.exp(1.3j)
RUNOUT = np.array([30e-6 - 5e-6j, 10e-6j])
STD = np.full(len(RIG), 1e-6)
SPEED = np.tile(np.linspace(0.1, 0.7, 5), 2)  # over the critical speed
RECEPTANCE = 1 / (3e5 * (1 - SPEED**2))  # m/N
FORCE = np.array([12.0, 5j])  # N


def made_up(share, runout, force, seed):
    """(rig, forward, backward, receptance, std) with noise of the stated size."""
    rng = np.random.default_rng(seed)
    forward = 5e-4 + 2e-4 * rng.standard_normal((len(RIG), 2)) @ [1, 1j]
    noise = 1e-6 * rng.standard_normal((len(RIG), 2)) @ [1, 1j]
    backward = share * forward.conj() + runout[RIG] + RECEPTANCE * force[RIG] + noise
    return RIG, forward, backward, RECEPTANCE, STD


@pytest.mark.parametrize(
    ("share", "runout", "force", "accepted"),
    [
        (SHARE, 0 * RUNOUT, 0 * FORCE, [True, True, False, True, False]),
        (0.0, RUNOUT, 0 * FORCE, [False, False, True, True, False]),
        (SHARE, RUNOUT, 0 * FORCE, [False, False, False, True, False]),
        (0.0, 0 * RUNOUT, FORCE, [False, False, False, False, True]),
    ],
    ids=["probes", "runout", "both", "force"],
)
def test_a_wrong_hypothesis_is_rejected_and_a_true_one_is_not(share, runout, force, accepted):
    p_values = np.array([hypotheses(*made_up(share, runout, force, seed))["p-value"] for seed in range(50)])
    assert ((p_values > 1e-3).mean(axis=0) > 0.9).tolist() == accepted
    assert (p_values[:, ~np.array(accepted)] < 1e-6).all()


def test_the_share_is_within_its_standard_deviation():
    off = []
    for seed in range(200):
        both = hypotheses(*made_up(SHARE, RUNOUT, 0 * FORCE, seed)).iloc[3]
        found = both["share"][0] * np.exp(1j * np.deg2rad(both["angle"][0]))
        off += [(found - SHARE) / both["standard deviation"][0]]
    assert np.std(np.real(off)) == pytest.approx(1, abs=0.15)  # 200 draws: 5 % standard deviation


def test_published_readings_need_both_or_leave_a_force_possible():
    rig, forward, backward, receptance = [], [], [], []
    for number, config in enumerate(map(replay, (3, 5))):
        few = config.model_copy(update={"trials": 100})
        amplitude = rounding_draws(few, REFERENCE, "fft").mean(axis=0)  # (case, harmonic)
        rig += [number] * len(amplitude)
        forward += list(amplitude[:, config.harmonics.index(1)])
        backward += list(amplitude[:, config.harmonics.index(-1)])
        receptance += list(receptance_at(config.model, config.speeds))
    rig, forward, backward, receptance = map(np.array, (rig, forward, backward, receptance))
    found = hypotheses(rig, forward, backward, receptance, np.hypot(READING_M, METHOD * np.abs(backward)))
    assert (found["p-value"] > 0.05).tolist() == [False, False, False, True, False]  # as the page and its caption say
    assert found["p-value"][[0, 2]].max() < 1e-6
    assert found["p-value"][[1, 4]].min() > 1e-3  # doubtful, not excluded


def test_the_receptance_is_that_of_a_jeffcott_rotor():
    speed = np.array([20.0, 140.0])
    closed_form = 1 / (2.66e5 - 1.87 * speed**2)  # Table 3.3
    assert receptance_at(replay(3).model, speed) == pytest.approx(closed_form, rel=1e-9)
