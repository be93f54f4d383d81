"""Stand-ins for the diagnosis: one that knows the truth, one that says nothing, one that always says the same."""

import numpy as np
import pytest

from rotorstudy import registry
from rotorstudy.blind.config import KINDS, load_blind
from rotorstudy.blind.injection import draw, order_of
from rotorstudy.blind.meanings import MEANS

CONFIG = "workflow/config/test/blind.yaml"
COUNT, SEED = 10, 20261121


def only(kind):
    """Shares of cases of one kind alone."""
    return {name: float(name == kind) for name in KINDS}


@pytest.fixture(scope="session")
def config():
    return load_blind(CONFIG)


@pytest.fixture(scope="session")
def drawn(config, tmp_path_factory):
    """(truth, folder with record and rig file) of some cases."""
    base = tmp_path_factory.mktemp("drawn")
    orders = [order_of(config, SEED, number) for number in range(COUNT)]
    return [(draw(order, base / str(order.number)), base / str(order.number)) for order in orders]


@pytest.fixture(scope="session")
def truths(drawn):
    """Of drawn cases and, as drawing takes time, of further ones by hand: five of each group, of size 9."""
    first = next(truth for truth, _ in drawn if "without_noise" in truth)
    one = {"family": "bow", "node": 3, "kink_rad": 1e-4, "phase_rad": 0.3}
    mass = {"family": "added_mass", "node": 2, "mass_kg": 0.5}
    crack = {"family": "crack_form", "position_m": 0.3, "softened_m": 0.0, "length_m": 1.0, "phase_rad": 0.4,
             "across_rad_per_N_m": 1e-5, "element": 2}  # fmt: skip
    runout = {"family": "runout", "node": 2}
    kinds = {"single": [mass], "form": [crack], "two": [one, mass], "chain": [runout], "outside": [one]}
    more = []
    for kind, true in kinds.items():
        for _ in range(5):
            numbers = {"case": len(drawn) + len(more), "kind": kind, "true": true, "size": 9.0, "beside": None}
            numbers |= {"families": "+".join(one["family"] for one in true), "known": kind != "outside"}
            numbers |= {"fault": "runout" if kind == "chain" else None}
            more.append(first | numbers)
    return [truth for truth, _ in drawn] + more


def cause(one):
    """A cause as a verdict states it that is the true effect, with its place, sizes and small errors."""
    zoo = registry().plugins["effect"]
    name = next(name for name in MEANS[one["family"]].names if name in zoo)
    where = {key: one[key] for key in ("node", "element") if key in one}
    if "elements" in one:
        where = {"element": one["elements"][0], "last_element": one["elements"][-1]}
    known = {**MEANS[one["family"]].sizes, **({"position_m": "position_m"} if "position_m" in one else {})}
    stated = {parameter: one[key] for parameter, key in known.items() if key in one}
    parameters = {name: {"value": size, "std": 1e-9 + 1e-6 * abs(size)} for name, size in stated.items()}
    return {"effect": name, "where": where, "parameters": parameters, "probability": 1.0}


def oracle(truth):
    """Knows the truth and says what it should."""
    if not truth["known"]:
        verdict = {"verdict": "unknown", "causes": []}
    elif not truth["true"]:
        verdict = {"verdict": "nothing", "causes": []}
    elif truth["fault"] == "unloaded_zero":
        said = {"hypothesis": "displacements count from the unloaded line"}
        verdict = {"verdict": "convention", "causes": [], "measuring_chain": said}
    elif truth["fault"] in ("swapped", "reversed"):
        verdict = {"verdict": "refused", "error": f"node {truth['true'][-1]['node']}: swapped probes: as it is"}
    else:
        verdict = {"verdict": "cause", "causes": [cause(one) for one in truth["true"]]}
    return {"verdict": verdict, "held_out": held_out(truth), "seconds": 0.1}


def held_out(truth):
    """Predictions at a held-out speed that the causes bring from 10 % off to 0.1 %."""
    if "without_noise" not in truth:
        return None
    real, imag = np.array(truth["without_noise"])
    shown = (real + 1j * imag)[1:2]
    return {"speed": truth["speeds_rad_per_s"][1:2], "before": shown * 1.1, "after": shown * (1 + 1e-3)}


def mute(truth):
    """Says nothing, whatever there is."""
    return {"verdict": {"verdict": "nothing", "causes": []}, "held_out": None, "seconds": 0.1}


def accuser(truth):
    """Calls everything a motion of the base, quite sure."""
    named = {"effect": "base_motion", "where": {}, "parameters": {}, "probability": 0.99}
    return {"verdict": {"verdict": "cause", "causes": [named]}, "held_out": None, "seconds": 0.1}
