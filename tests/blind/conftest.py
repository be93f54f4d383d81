"""Stand-ins for the diagnosis: one that knows the truth, one that says nothing, one that always says the same."""

import numpy as np
import pytest

from rotorstudy.blind.config import load_blind
from rotorstudy.blind.injection import draw_case

CONFIG = "workflow/config/blind.yaml"
COUNT, SEED = 40, 11


@pytest.fixture(scope="session")
def config():
    return load_blind(CONFIG)


@pytest.fixture(scope="session")
def cases(config):
    return [draw_case(config, SEED, i) for i in range(COUNT)]


def cause(effect):
    parameters = {
        name: {"value": v, "std": 1e-9 + 1e-6 * abs(v), "unit": "rad" if name.endswith("_phase") else "SI"}
        for name, v in effect["parameters"].items()
    }
    return {
        "effect": effect["effect"],
        "where": effect["where"],
        "parameters": parameters,
        "posterior_probability": 1.0,
    }


def oracle(case):
    """Knows the truth and says what it should."""
    truth = case.truth
    if truth["kind"] == "foreign":
        verdict = {"verdict": "unknown", "causes": []}
    elif not truth["effects"]:
        verdict = {"verdict": "nothing", "causes": []}
    else:
        verdict = {"verdict": "cause", "causes": [cause(effect) for effect in truth["effects"]]}
    shown = np.swapaxes(np.array(truth["without_noise"][0]) + 1j * np.array(truth["without_noise"][1]), 1, 2)
    speeds = truth["speed_rad_per_s"]
    held = {"speed": speeds[1:2], "before": shown[1:2] * 1.1, "after": shown[1:2] * (1 + 1e-3)}
    return {"verdict": verdict, "held_out": held, "seconds": 0.0}


def mute(case):
    """Says nothing, whatever there is."""
    return {"verdict": {"verdict": "nothing", "causes": []}, "held_out": None, "seconds": 0.0}


def accuser(case):
    """Calls everything an unbalance at node 1, quite sure."""
    named = {"effect": "unbalance", "where": {"node": 1}, "parameters": {}, "posterior_probability": 0.99}
    return {"verdict": {"verdict": "cause", "causes": [named]}, "held_out": None, "seconds": 0.0}
