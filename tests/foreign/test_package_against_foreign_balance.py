"""Machines balanced in two planes: how often the stated intervals hold what is left, and what the next run shows.

`benchmarks/balance.py` counts 200 machines, also with updated rigs.
"""

import json

import numpy as np
import pytest
from machines import readings
from named_machines.balancing import PLANES, draw

from rotorstudy import build_model
from rotorstudy.diagnosis.runs.balance import balance
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.measurement.conventions import Conventions

MACHINES = range(1, 7)


def balanced(seed, share=1.0):
    """Shares of the intervals of the vibration left and of the next reading that hold the truth.

    share : of the uncertainty that the rig states
    """
    machine, rng = draw(seed), np.random.default_rng([seed, 32])
    rig = json.loads(json.dumps(machine.rig, default=float))
    stated = rig["diagnosis"] | {"uncertainty": {k: share * v for k, v in rig["diagnosis"]["uncertainty"].items()}}
    own = machine.scattered(rng)
    shown = machine.reading(machine.motion(own=own), rng)
    model = build_model(rig)
    spectrum = readings(shown, machine.speeds, [1, -1], model.sensors, machine.noise)
    found = balance(spectrum, model, [node + 1 for node in PLANES], Settings(**stated), Conventions())
    added = list(zip(PLANES, found.corrections @ [1, 1j], strict=True))
    left = machine.motion(added, own)
    again = machine.reading(machine.motion(added, machine.scattered(rng)), rng)
    true = [np.abs(one).sum(axis=1) for one in (left, again)]
    stated = (found.after, found.next_reading)
    return [np.mean((low <= size) & (size <= high)) for (low, _, high), size in zip(stated, true, strict=True)]


@pytest.fixture(scope="module")
def shares():
    return np.mean([balanced(seed) for seed in MACHINES], axis=0)


def test_the_intervals_hold_as_often_as_they_say(shares):
    """95 %; the 12 intervals of a machine stand and fall together, so that the mean of six scatters by 6 %."""
    assert np.all(shares > 0.8)


def test_with_an_uncertainty_that_is_stated_too_small_they_do_not():
    left, _ = np.mean([balanced(seed, 0.05) for seed in MACHINES[:2]], axis=0)
    assert left < 0.7
