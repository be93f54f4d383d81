"""A bearing on a pedestal; against the same machine with the pedestal as a further mass: physics/test_foundation.py."""

import numpy as np
import pytest
from machines import disc, shaft
from one_line_errors import refused

from rotorstudy import Entry, Model, Parameter, RotorstudyError, Term, build_model, harmonic_response, make_term

HARMONICS = [0, 1, 2, 3, -1, -2, -3]
SPEEDS = np.array([60.0, 120.0, 400.0, 900.0])
PEDESTAL = {
    "kind": "flexible_pedestal", "bearing_scale": 1.0, "pedestal_mass_kg": {"xx": 20.0, "yy": 35.0},
    "bearing_stiffness_N_per_m": {"xx": 2e6, "yy": 1.5e6}, "bearing_damping_N_s_per_m": {"xx": 400.0, "yy": 300.0},
    "pedestal_stiffness_N_per_m": {"xx": 4e6, "yy": 1e6}, "pedestal_damping_N_s_per_m": {"xx": 500.0, "yy": 900.0},
}  # fmt: skip
SHAFT = build_model({"rotor": shaft(0.6, 4, disc(2, 2.0, 0.004, 0.002))}).structure


def series(item):
    """A shaken shaft on the bearing and a cross-coupled one at the other end."""
    force = Parameter("force", "N", (Entry(SHAFT.unit(2), on="one", shift=1), Entry(SHAFT.unit(2), on="one")), 1.0)
    cross = {"bearing_stiffness_xx_N_per_m": 3e5, "bearing_stiffness_xy_N_per_m": 5e4}
    cross |= {"bearing_stiffness_yx_N_per_m": -2e4, "bearing_stiffness_yy_N_per_m": 2e5}
    other = {"kind": "linear", "coefficients": "full", "node": 1, "label": "other", **cross}
    other |= {f"bearing_damping_{ab}_N_s_per_m": 60.0 * (ab in ("xx", "yy")) for ab in ("xx", "xy", "yx", "yy")}
    bearings = [make_term("bearing", one, SHAFT, SHAFT.nodes) for one in (other, {**item, "node": 5})]
    return Model(SHAFT, (Term("shaking", (force,), {"force": 3.0}), *bearings))


def test_one_value_serves_both_directions():
    isotropic = {**PEDESTAL}
    for name in ("bearing_stiffness_N_per_m", "pedestal_stiffness_N_per_m", "pedestal_mass_kg"):
        isotropic[name] = {"xx": PEDESTAL[name]["xx"]}
    for name in ("bearing_damping_N_s_per_m", "pedestal_damping_N_s_per_m"):
        isotropic.pop(name)
    same = {k: {"xx": v["xx"], "yy": v["xx"]} if isinstance(v, dict) else v for k, v in isotropic.items()}
    found, expected = (harmonic_response(both_ends, SPEEDS, [1, -1]) for both_ends in (series(isotropic), series(same)))
    assert np.array_equal(found, expected)


def test_an_undamped_pedestal_in_resonance_and_bad_numbers_are_refused():
    free = {**PEDESTAL, "pedestal_stiffness_N_per_m": {"xx": 2e6}, "pedestal_mass_kg": {"xx": 100.0}}
    free |= {"bearing_stiffness_N_per_m": {"xx": 2e6}}
    free.pop("bearing_damping_N_s_per_m")
    free.pop("pedestal_damping_N_s_per_m")
    harmonic_response(series(free), [100.0], [1])
    with pytest.raises(RotorstudyError, match=r"speed 200 rad/s, harmonic -?1: the undamped pedestal at node 5"):
        harmonic_response(series(free), [100.0, 200.0], [1])
    for key, value in (("pedestal_stiffness_N_per_m", 0.0), ("pedestal_mass_kg", -1.0)):
        refused(lambda: series({**PEDESTAL, key: {"xx": value}}), match=rf"{key}\.xx = {value}")
    refused(lambda: series({**PEDESTAL, "pedestal_mass_kg": {"xx": 1.0, "zz": 1.0}}), "zz")
