"""Errors of supports against rotors built with them."""

import numpy as np
import pytest
from machines import disc, full_bearing, pedestal_resonance, shaft, unbalance
from one_line_errors import refused

from rotorstudy import build_model, harmonic_response
from rotorstudy.errors import CannotAct

SPEEDS = np.array([60.0, 180.0, 400.0, 700.0])
HARMONICS = [1, -1, 2, -2]
STIFF, DAMPED = 2e6, 300.0
PUSHED = [
    unbalance(2, 1e-5, 0.4, mass_kg=2.0),
    {"kind": "parallel_misalignment", "node": 3, "harmonics": [2, -1], "misalignment_force_2X_N": 3.0,
     "misalignment_force_-1X_N": 1.0},
]  # fmt: skip


def linear(node, **coefficients):
    return {"kind": "linear", "node": node, "label": str(node), **coefficients}


def isotropic(node):
    return linear(node, bearing_stiffness_N_per_m=STIFF, bearing_damping_N_s_per_m=DAMPED)


def response(bearing, *effects):
    """Harmonics of a shaft on a bearing at node 1 and a usual one at node 4."""
    rotor = shaft(0.6, 3, disc(2, 2.0, 0.004, 0.002))
    rig = {"rotor": rotor, "bearings": [bearing, isotropic(4)], "effects": [*PUSHED, *effects]}
    return harmonic_response(build_model(rig), SPEEDS, HARMONICS)


def same(found, expected, tolerance):
    return np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def full(stiffness, damping):
    return full_bearing(1, stiffness, damping, label="1")


@pytest.mark.parametrize("angle", [0.0, 0.6, -1.2])
def test_support_loss_is_a_softer_spring_along_one_direction(angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    item = {"kind": "support_loss", "node": 1, "direction_rad": angle, "support_stiffness_loss_N_per_m": 4e5}
    built = full(STIFF * np.eye(2) - 4e5 * np.outer(along, along), DAMPED * np.eye(2))
    assert same(response(isotropic(1), item), response(built), 1e-11)
    assert not same(response(isotropic(1)), response(built), 1e-3)


def on_pedestal(bearing, spring, damper, mass):
    """Item of the effect on a bearing of stiffness STIFF and damping `bearing` and a pedestal, (2,) along x and y."""
    total = STIFF + np.asarray(spring)
    natural = np.sqrt(total / mass)
    ratio = (bearing + np.asarray(damper)) / (2 * np.asarray(mass) * natural)
    assert ratio[0] == pytest.approx(ratio[1])  # the effect has one for both directions
    loss = STIFF**2 / total
    return pedestal_resonance(natural, ratio[0], bearing / STIFF, np.diag(loss))


@pytest.mark.parametrize("bearing", [0.0, 600.0])
@pytest.mark.parametrize("across", [1.0, 0.4])  # mass and stiffness along y over those along x
def test_pedestal_resonance_is_a_mass_on_a_spring_behind_the_bearing(bearing, across):
    """Kirk and Gunter's two dynamic stiffnesses in series, each with a resonance of its own."""
    mass, spring = 12.0 * np.array([1.0, across]), 1e6 * np.array([1.0, across])
    critical = 2 * np.sqrt((STIFF + spring) * mass)
    damper = 0.2 * critical - bearing
    item = on_pedestal(bearing, spring, damper, mass)
    plain = linear(1, bearing_stiffness_N_per_m=STIFF, bearing_damping_N_s_per_m=bearing)
    of_pedestal = {"stiffness_N_per_m": spring, "damping_N_s_per_m": damper, "mass_kg": mass}
    built = {
        f"pedestal_{key}": dict(zip(("xx", "yy"), map(float, two), strict=True)) for key, two in of_pedestal.items()
    }
    built |= {"kind": "flexible_pedestal", "node": 1, "label": "1", "bearing_scale": 1.0}
    built |= {"bearing_stiffness_N_per_m": {"xx": STIFF}, "bearing_damping_N_s_per_m": {"xx": bearing}}
    assert same(response(plain, item), response(built), 1e-10)
    assert same(response(plain, item | {"frequency_ratio": 1.0}), response(built), 1e-10) == (across == 1)
    assert not same(response(plain), response(built), 1e-2)


def test_an_undamped_pedestal_in_resonance_and_bad_numbers_are_refused():
    pedestal = {"kind": "flexible_pedestal", "node": 1, "label": "1", "bearing_stiffness_N_per_m": {"xx": 2e6},
                "pedestal_stiffness_N_per_m": {"xx": 2e6}, "pedestal_mass_kg": {"xx": 26.0}}  # fmt: skip
    assert np.isfinite(response(pedestal)).all()
    resonant = pedestal | {"pedestal_mass_kg": {"xx": 25.0}}
    refused(lambda: response(resonant), match="speed 400 rad/s, harmonic -?1: the undamped pedestal at node 1")
    for key, value in (("pedestal_stiffness_N_per_m", 0.0), ("pedestal_mass_kg", -1.0)):
        refused(lambda: response({**pedestal, key: {"xx": value}}), f"{key}.xx = {value}")
    refused(lambda: response({**pedestal, "pedestal_mass_kg": {"xx": 1.0, "zz": 1.0}}), "zz")


def test_a_ring_that_touches_the_shaft_at_rest_is_refused():
    with pytest.raises(CannotAct, match="offset_ratio = 1; must be below 1"):
        response(isotropic(1), {"kind": "rub", "node": 2, "offset_ratio": 1.0, "rub_stiffness_N_per_m": 1e5})


@pytest.mark.parametrize(
    ("kind", "load", "unit"), [("parallel_misalignment", "force", "N"), ("angular_misalignment", "moment", "N_m")]
)
def test_a_coupling_is_at_a_node_or_across_an_element(kind, load, unit):
    with pytest.raises(CannotAct, match="not both"):
        response(isotropic(1), {"kind": kind, "label": "a", "node": 2, "element": 2})
    phase = f"misalignment_{load}_2X_phase_rad"
    common = {"kind": kind, "harmonics": [2], f"misalignment_{load}_2X_{unit}": 5.0}
    ends = [common | {"label": str(node), "node": node, phase: at} for node, at in ((2, 0.3), (3, 0.3 + np.pi))]
    across = common | {"label": "a", "element": 2, phase: 0.3}
    assert same(response(isotropic(1), across), response(isotropic(1), *ends), 1e-12)
