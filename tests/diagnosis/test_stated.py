"""Numbers that an effect states by its shape and its amplitudes, such as the flexibility of a crack."""

import numpy as np
import pytest
from machines import disc, rig_of, shaft, springs

from rotorstudy import build_model, registry
from rotorstudy.diagnosis.one_cause.stated import stated_numbers
from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.model.cracks import compliance

SHAPE = {"position_m": 0.35, "depth_ratio": 0.2, "angle_rad": 1.0}
FACTOR = 1.1


@pytest.fixture(scope="module")
def stepped():
    """A shaft of 20 mm, of 30 mm from 0.3 to 0.6 m."""
    rotor = shaft(0.6, 4, disc(3, 3.0, 4e-3, 2e-3))
    halves = [{"length_m": 0.3, "count": 2, "outer_diameter_m": diameter} for diameter in (0.02, 0.03)]
    rotor = {key: value for key, value in rotor.items() if key != "length_m"} | {"elements": halves}
    return build_model(rig_of(rotor, springs((1, 5), 2e6, 400.0), sensors=[2]))


def numbers(model, covariance, shape=SHAPE):
    crack = candidate(model, "transverse_crack", {}, shape, "crack")._replace(shape_std={"depth_ratio": 0.01})
    return stated_numbers(model.structure, crack, np.array([FACTOR]), covariance)


def test_a_crack_is_as_flexible_as_the_shaft_where_it_is(stepped):
    """In the thicker part; one of the same share of the diameter beside it is softer by the cube of the diameters."""
    found, thinner = (numbers(stepped, np.zeros((1, 1)), SHAPE | {"position_m": x}) for x in (0.35, 0.25))
    thick = compliance(registry().get("depth", "elasticity"), 0.2, diameter_m=0.03)[0]
    assert found["flexibility_rad_per_N_m"][0] == pytest.approx(FACTOR * thick) and found["depth_m"][0] == 0.2 * 0.03
    assert thinner["flexibility_rad_per_N_m"][0] / found["flexibility_rad_per_N_m"][0] == pytest.approx(1.5**3)


def test_depth_and_factor_that_compensate_leave_the_flexibility_known(stepped):
    """By their joint covariance; each alone would make it as uncertain as it is."""
    flexible = registry().get("depth", "elasticity")
    slope = np.diff(np.log([compliance(flexible, d, diameter_m=0.03)[0] for d in (0.199, 0.201)]))[0] / 0.002
    way = np.array([0.0, 0.01, 0.0, -0.01 * slope * FACTOR])
    joint = numbers(stepped, np.outer(way, way))["flexibility_rad_per_N_m"]
    apart = numbers(stepped, np.diag(way[3:] ** 2))["flexibility_rad_per_N_m"]
    assert joint[1] < 1e-3 * joint[0] and apart[1] == pytest.approx(0.01 * slope * np.sqrt(2) * apart[0], rel=1e-3)


def test_a_crack_that_lags_yields_most_beside_the_side_that_the_weight_stretches(stepped):
    """(1 + cos x + b sin x) / 2 is at most (1 + (1 + b^2)^0.5) / 2; by the moment the front is in tension."""
    stated = registry().get("effect", "transverse_crack").stated
    place, name = (stepped.structure, 0.35, 0.2), "flexibility_rad_per_N_m"
    found = {law: stated(*place, breathing=law, lagging_1=0.6)[name] for law in ("turning", "gradual")}
    plain = {law: stated(*place, breathing=law)[name] for law in found}
    assert found["turning"] == pytest.approx(plain["turning"] * (1 + np.hypot(1, 0.6)) / 2, rel=1e-4)
    assert found["gradual"] == plain["gradual"]
