"""Small machines at few speeds, also with an effect of a test, their exact rig, and what their nodes do."""

import numpy as np
import yaml

from rotorstudy import build_model, measured_response
from rotorstudy.blind.machines.cases import draw_case
from rotorstudy.blind.machines.files import ERRORS, rig_of, write_case
from rotorstudy.blind.run import read_case

HARMONICS = [0, 1, -1, 2, -2, 3, -3]


def small(seed, family, **options):
    """A case of a small rotor at few speeds."""
    return draw_case(seed, family, **({"speeds": 6, "count": 2} | options))


def special(seed, add, **options):
    """A small case with an effect of a test: add(draw) adds it and returns the truth."""
    return small(seed, "special", known={"special": add}, **({"speeds": 5, "steps": 128} | options))


def read(case, folder, rig_error=1.0, change=None):
    """What `read_case` reads; by a rig file as wrong as good ones are, times an error; change(given) : what else is."""
    write_case(case, folder, ERRORS * rig_error, harmonics=HARMONICS)
    if change:
        given = yaml.safe_load((folder / "rig.yaml").read_text())
        change(given)
        (folder / "rig.yaml").write_text(yaml.safe_dump(given))
    return read_case(folder)


def exact_model(case, *effects, errors=(0, 0, 0)):
    """The model of the machine of a case, exact but for stated errors, as `ERRORS`, with further effects."""
    rig = rig_of(case, errors)
    return build_model(rig | {"effects": [*rig["effects"], *effects]})


def distance(case, harmonics, model, **options):
    """Largest difference of a model's response from the motion of a case, over the largest motion."""
    rest = (case.sag[0::4] + 1j * case.sag[1::4])[case.nodes]
    true = case.steady.harmonics(case.nodes, harmonics) - np.outer(np.equal(harmonics, 0), rest)
    return np.abs(measured_response(model, case.steady.speed, harmonics, **options) - true).max() / np.abs(true).max()
