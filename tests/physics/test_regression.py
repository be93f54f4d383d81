"""The table read the other way: columns, exact elimination, and what cannot be identified."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, OFFSET_DISC, jeffcott, jeffcott_rig, point, spectrum_of
from one_line_errors import refused
from random_rotor import four_coordinates

from rotorstudy import RotorstudyError, build_model
from rotorstudy.errors import UnidentifiableError
from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.linear import solve_linear
from rotorstudy.model.rig_numbers import with_numbers


def solved(model, spectrum, names):
    return solve_linear(*regression(model, spectrum, names).real_system(), names)


def test_identification_from_the_unloaded_line_is_exact():
    model = replace(jeffcott(), from_unloaded_line=True)
    # round-off of 1e-16, magnified by the spread of the scaled columns (under a thousand)
    assert solved(model, spectrum_of(model, [88.0], HARMONICS), model.names) == pytest.approx(model.theta, rel=1e-11)


def with_a_gap():
    return jeffcott(effects=[{"kind": "sensor_gap", "sensor_gap_m": 1e-3}])


def test_a_known_gap_is_taken_off():
    model = with_a_gap()
    # the gap is a thousand times the vibration: round-off grows by as much
    found = solved(model, spectrum_of(model, [88.0], HARMONICS), model.names[:5])
    assert found == pytest.approx(model.theta[:5], rel=1e-9)


def free_crack():
    kinds = ("external_damping", "internal_damping", "unbalance", "crack_force")
    return build_model({"rotor": point(), "effects": [{"kind": kind} for kind in kinds]})


def test_two_speeds_tell_unbalance_from_the_crack_at_1X_and_one_speed_cannot():
    model = free_crack()
    with pytest.raises(UnidentifiableError, match="trade off") as caught:
        solved(model, spectrum_of(jeffcott(), [88.0], HARMONICS), model.names)
    assert set(caught.value.parameters) == {"eccentricity_real", "stiffness_loss_p1"}
    found = solved(model, spectrum_of(jeffcott(), [88.0, 120.0], HARMONICS), model.names)
    assert found[2] == pytest.approx(5e-6 * np.cos(np.pi / 6), rel=1e-8)


REFUSED = {
    "the full crack without its harmonics": (
        lambda: jeffcott(weight_dominance=False), HARMONICS, None,
        r"'stiffness_loss' acts on harmonics .* not measured.*maximum_likelihood",
    ),
    "an unknown on a hidden coordinate": (
        lambda: four_coordinates(1), range(-15, 16), ("damping",), r"'damping' acts on coordinates .*tilt.* not measur",
    ),
    "an unknown of the sensor": (with_a_gap, HARMONICS, ("sensor_gap_real",), "acts on the sensor"),
    "a number of the rig": (
        lambda: with_numbers(jeffcott(), ["rotor.mass_kg"]), HARMONICS, ("rotor.mass_kg",),
        "'rotor.mass_kg' is a number of the rig.*maximum_likelihood",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_equations_cannot_tell_is_refused_by_name(what):
    made, harmonics, names, words = REFUSED[what]
    model = made()
    refused(lambda: regression(model, spectrum_of(model, [50.0, 88.0], harmonics), names or model.names), match=words)


def test_too_few_equations_are_counted_and_an_unknown_nobody_asked_for_is_refused():
    model = free_crack()
    with pytest.raises(UnidentifiableError, match="4 equations for 13 unknowns"):
        solved(model, spectrum_of(jeffcott(), [88.0], [1, 2]), model.names)
    with pytest.raises(RotorstudyError, match="neither among the unknowns"):
        regression(model, spectrum_of(jeffcott(), [88.0], HARMONICS), ("external_damping",))


def test_both_parts_of_a_complex_amplitude_without_value_are_unknown():
    model = build_model({"rotor": jeffcott_rig()["rotor"], "effects": [{"kind": "unbalance"}]})
    assert model.unknown_names() == ("eccentricity_real", "eccentricity_imag")


@pytest.mark.parametrize("n", [0, 2])
def test_free_crack_forces_are_refused_where_the_speed_cannot_tell_deflection_and_tilt_apart(n):
    """At 0X, and at 2X for a polar moment twice the diametral one, the tilt has no inertia: one shape at all speeds."""
    shaking = [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
    ]
    free = {"kind": "crack_force", "harmonics": [1, n], "label": "free"}
    for order in (1, n):
        free |= {f"stiffness_loss_22_p{order}_N_per_m": 1e4, f"stiffness_loss_44_p{order}_N_m": 100.0}
    model = build_model({"rotor": OFFSET_DISC, "effects": [*shaking, free]})
    names = [name for name in model.names if name.endswith("[free]")]
    with pytest.raises(UnidentifiableError, match="trade off") as refused:
        solved(model, spectrum_of(model, [90.0, 200.0, 310.0], [1, n]), tuple(names))
    assert refused.value.parameters == tuple(f"stiffness_loss_{k}_p{n}[free]" for k in ("22", "44"))
