"""The offset disc with gyroscopic moment (thesis Chapter 4), on the same engine as the two-degree-of-freedom rotor."""

from pathlib import Path

import numpy as np
import pytest
from machines import OFFSET_DISC

from rotorstudy import Problem, RotorstudyError, Spectrum, build_model, eigenvalues, measured_response
from rotorstudy.inference.linear import solve_linear
from rotorstudy.measurement.spectrum import independent_covariance
from thesis.scoreboard import published

REFERENCE = Path(__file__).parents[2] / "workflow" / "reference"
HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]
PRINTED_FACTORS = {0: 0.25, 1: 0.319, 2: 0.25, 3: 0.106, 5: -0.021, 7: 0.009, -1: 0.106, -3: -0.021, -5: 0.009}
LOSS = {"stiffness_loss_22_N_per_m": 0.3 * 577919.472, "stiffness_loss_44_N_m": 0.1 * 17612.7839}


def rotor(gyroscopic_sign, crack):
    effects = [
        {"kind": "external_damping", "external_damping_N_s_per_m": 27.0},
        {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
        {"kind": "unbalance", "eccentricity_m": 3e-5, "eccentricity_phase_rad": np.pi / 6},
    ]
    rig = {"rotor": {**OFFSET_DISC, "gyroscopic_sign": gyroscopic_sign}, "effects": effects}
    if crack == "printed factors":
        rig["effects"] = [*effects, {"kind": "crack_force", "participation": PRINTED_FACTORS, **LOSS}]
    else:
        rig["cracks"] = [{"kind": "switching", **LOSS}]
    return build_model(rig)


def agreeing(model):
    """How many of the 36 printed amplitudes and phases of complete cycles at 20 and 50 Hz a model gives."""
    table = published(REFERENCE, ["4.2", "4.3", "4.4", "4.5"])
    table = table[
        (table.method == "regression") & table.case.str.contains("complete") & ~table.case.str.contains("incomplete")
    ]
    found = measured_response(model, 2 * np.pi * np.array([20.0, 50.0]), HARMONICS)[..., 0]
    count = 0
    for row in table.itertuples():
        value = found[0 if row.case.startswith("20") else 1, HARMONICS.index(int(row.item))]
        if row.quantity == "amplitude":
            count += abs(abs(value) - row.published) <= row.last_digit * (1 + 1e-6)
        else:
            count += abs(np.angle(value * np.exp(-1j * row.published))) <= row.last_digit * (1 + 1e-6)
    return count


def test_printed_spectra_come_back_with_the_thesis_sign():
    # all but four: the thesis's record keeps the undamped tilt transient, which steady harmonics do not have
    assert agreeing(rotor(-1, "printed factors")) >= 32


def test_with_the_physical_sign_they_do_not():
    assert agreeing(rotor(1, "printed factors")) < 20


def test_stiffness_is_that_of_the_thesis_and_of_given_numbers():
    structure = rotor(1, "switching").structure
    # Table 4.1, unrounded
    assert structure.stiffness.ravel() == pytest.approx([577919.472, 22015.9799, 22015.9799, 17612.7839], rel=1e-8)
    given = {**OFFSET_DISC, "k22_N_per_m": 577919.472, "k24_N": 22015.9799, "k44_N_m": 17612.7839}
    for key in ("a_m", "b_m", "diameter_m"):
        del given[key]
    assert build_model({"rotor": given}).structure.stiffness == pytest.approx(structure.stiffness, rel=1e-8)


def test_all_six_parameters_come_back_from_translations_alone():
    """The unmeasured tilt is eliminated exactly, so nothing but round-off is left."""
    model, speeds = rotor(1, "switching"), 2 * np.pi * np.arange(20.0, 51.0)
    shown = measured_response(model, speeds, HARMONICS)
    assert shown.shape[-1] == 1  # the tilt is not among the sensors
    covariance = independent_covariance(np.zeros(shown.shape))
    problem = Problem(model, Spectrum(shown, speeds, np.array(HARMONICS), model.sensors, covariance), model.names)
    found = solve_linear(*problem.equations(), problem.names)
    assert found == pytest.approx(model.theta, rel=1e-9)


def test_coupled_natural_frequency_is_83_4_hz():
    model = rotor(1, "switching").without(["switching"])
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
    with pytest.raises(RotorstudyError, match=words):
        build_model({"rotor": {**base, **change}})
