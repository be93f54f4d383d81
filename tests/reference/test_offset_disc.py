"""The offset disc with gyroscopic moment (thesis Chapter 4), on the same engine as the two-degree-of-freedom rotor."""

import numpy as np
import pytest
from machines import OFFSET_DISC, jeffcott_rig
from one_line_errors import refused

from rotorstudy import build_model, eigenvalues


def rotor():
    return build_model(jeffcott_rig(None, internal=20.0, external=27.0, rotor=OFFSET_DISC))


def test_stiffness_is_that_of_the_thesis_and_of_given_numbers():
    structure = rotor().structure
    # Table 4.1, unrounded
    assert structure.stiffness.ravel() == pytest.approx([577919.472, 22015.9799, 22015.9799, 17612.7839], rel=1e-8)
    given = {**OFFSET_DISC, "k22_N_per_m": 577919.472, "k24_N": 22015.9799, "k44_N_m": 17612.7839}
    for key in ("a_m", "b_m", "diameter_m"):
        del given[key]
    assert build_model({"rotor": given}).structure.stiffness == pytest.approx(structure.stiffness, rel=1e-8)


def test_coupled_natural_frequency_is_83_4_hz():
    model = rotor()
    found = eigenvalues(model, [1e-3], np.zeros(len(model.names))).imag
    assert np.min(found[found > 0]) / (2 * np.pi) == pytest.approx(83.4, abs=0.05)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"k22_N_per_m": 1e5, "k24_N": 2e4, "k44_N_m": 1e3}, "must exceed k24"),
        ({"a_m": 0.2}, "not a mixture"),
        ({"k22_N_per_m": 1e5, "a_m": 0.2}, "not a mixture"),
    ],
)
def test_impossible_stiffness_is_refused(change, words):
    base = {k: v for k, v in OFFSET_DISC.items() if k not in ("a_m", "b_m", "diameter_m")}
    refused(lambda: build_model({"rotor": {**base, **change}}), words)
