"""Stability of a rotor with a crack that the motion itself opens: Floquet multipliers about its steady state."""

import numpy as np
import pytest
from machines import unbalance
from shaft_with_a_crack import MASS, crack, rotor

from rotorstudy import check_stable, simulate_records
from rotorstudy.errors import NoSteadyState
from rotorstudy.response import few_shapes, floquet
from rotorstudy.response.floquet import periodic_growth_rate

TWICE = 820.0  # rad/s, about twice the natural frequency of the cracked shaft, where its stiffness pumps a whirl
LIGHT = {"density": 1e-3, "bearings": False, "theory": "euler_bernoulli"}
BALANCED = unbalance(2, 2e-5, 0.7 + np.pi, label="against", mass_kg=MASS)  # fmt: skip


def cracked(damping, *effects, **law):
    drag = {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": damping}
    return rotor(2, drag, crack(0.28, 0.5, angle_rad=0.0, **law), *effects, **LIGHT)


def test_without_vibration_it_grows_as_if_the_weight_opened_it():
    """The slopes of the force along the steady state are then the periodic stiffness of the linear law.

    The crack relieves the shaft, so the deflection that opens it is not quite that of the weight.
    """
    by_motion, by_weight = (
        periodic_growth_rate(cracked(1.0, BALANCED, **law), [TWICE, 700.0]) for law in ({}, {"opened_by": "weight"})
    )
    assert by_weight[0] > 5
    assert by_motion[0] == pytest.approx(by_weight[0], rel=0.1)
    assert -0.05 < by_motion[1] <= 0  # the tilts of the shaft, at 1e7 rad/s, are not damped


def test_no_record_is_simulated_where_a_whirl_grows():
    """A periodic motion exists there, but the rotor leaves it; enough damping holds it."""
    time = np.arange(64) / 1000
    with pytest.raises(NoSteadyState, match=r"820 rad/s\), where a free motion grows by [\d.]+ 1/s") as said:
        simulate_records(cracked(1.0), [TWICE], [0, 1, 2], time)
    assert "\n" not in str(said.value)
    check_stable(cracked(1.0), [700.0])
    assert len(simulate_records(cracked(100.0), [TWICE], [0, 1, 2], time)) == 1


def test_on_a_fine_mesh_few_shapes_do(monkeypatch):
    """The lowest modes and the static shapes of the forces grow as all coordinates do; two modes alone do not."""
    drag = {"kind": "external_damping", "node": 4, "external_damping_N_s_per_m": 1.0}
    model = rotor(6, drag, crack(0.28, 0.5, angle_rad=0.0))
    speeds = [300.0, 560.0]
    every = periodic_growth_rate(model, speeds)
    monkeypatch.setattr(few_shapes, "MODES", 6)
    assert few_shapes.shapes(model, model.theta).shape[1] < len(model.structure.dofs)
    assert periodic_growth_rate(model, speeds) == pytest.approx(every, rel=2e-3)
    monkeypatch.setattr(floquet, "shapes", lambda model, theta: np.linalg.eigh(model.structure.stiffness)[1][:, :2])
    assert np.abs(periodic_growth_rate(model, speeds) - every).max() > 0.01 * np.abs(every).max()
