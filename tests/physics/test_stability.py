"""Eigenvalues and the threshold of instability by internal damping."""

import numpy as np
import pytest
from machines import jeffcott

from rotorstudy import Entry, Parameter, RotorstudyError, Term, build_model, eigenvalues, stability_threshold

NATURAL = np.sqrt(7.6e5 / 2.0)


def rotor(c_internal=20.0, c_external=100.0):
    effects = [
        {"kind": "external_damping", "external_damping_N_s_per_m": c_external},
        {"kind": "internal_damping", "internal_damping_N_s_per_m": c_internal},
    ]
    return build_model({"rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}, "effects": effects})


@pytest.mark.parametrize(("c_internal", "c_external"), [(20.0, 100.0), (50.0, 25.0), (30.0, 30.0)])
def test_threshold_is_the_closed_form(c_internal, c_external):
    found = stability_threshold(rotor(c_internal, c_external), 8 * NATURAL)
    assert found == pytest.approx(NATURAL * (1 + c_external / c_internal), rel=1e-9)  # the root finder's 1e-9 rad/s


def test_uneven_support_gives_two_natural_frequencies():
    uneven = Term("uneven", (Parameter("uneven", "N/m", (Entry(-np.eye(1), on="conj"),), 1e4),), {"uneven": 1e5})
    found = eigenvalues(rotor(0.0, 0.0).plus(uneven), [100.0])[0]
    positive = np.unique(np.round(found.imag[found.imag > 0], 6))
    assert positive == pytest.approx([np.sqrt(6.6e5 / 2), np.sqrt(8.6e5 / 2)], rel=1e-8)  # k -/+ uneven


def test_a_model_that_varies_in_time_has_no_eigenvalues():
    with pytest.raises(RotorstudyError, match="'stiffness_loss' makes the model time-varying"):
        eigenvalues(jeffcott(weight_dominance=False), [88.0])
