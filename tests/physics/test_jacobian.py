"""Derivatives of the measured response against central differences."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, disc, errors_of_derivatives, full_bearing, jeffcott, rig_of, shaft, springs, unbalance

from rotorstudy import Entry, Parameter, Term, build_model, measured_response, measured_response_and_jacobian
from rotorstudy.model.rig_numbers import with_numbers
from rotorstudy.response.statics import static_deflection


def chain(sensors):
    """Gap, runout, and a probe that mixes in derivative and conjugate: acts on what the other terms show."""
    mixing = (Entry(0.3 * np.eye(sensors), order=1), Entry(1j * np.eye(sensors), on="conj"))
    one = np.eye(sensors)[0]
    return (
        Term("gap", (Parameter("gap", "m", (Entry(one, on="one"),), 1e-3, True),), {"gap": 1e-3 + 2e-3j}, "output"),
        Term("mixing", (Parameter("mixing", "1", mixing, 1e-2),), {"mixing": 1e-2}, "output"),
    )


def worst(model, speeds, harmonics, jacobian=None):
    """Largest relative difference of the analytic from the numerical derivative, over the parameters."""
    shown, analytic = measured_response_and_jacobian(model, speeds, harmonics)
    analytic = analytic if jacobian is None else jacobian(analytic)
    assert shown == pytest.approx(measured_response(model, speeds, harmonics), rel=1e-12)
    steps = 1e-5 * np.maximum(np.abs(model.theta), np.where(model.theta, 1e-3, 1.0) * model.typical)
    return errors_of_derivatives(model, speeds, harmonics, steps, analytic).max()


ROTOR = shaft(0.4, 3, disc(2, 2.0, 0.004, 0.002))
# central differences with a relative step of 1e-5: error 1e-10 of the curvature, and round-off 1e-16 / 1e-5 of the
# response, which where a parameter matters little is a thousand times larger against its own derivative
TOLERANCE = 1e-6


def carried(**crack):
    """A shaft on cross-coupled bearings: the static deflection moves with their stiffness, and is not vertical."""
    stiffness = np.array([[1e5, 4e4], [-3e4, 2e5]])
    losses = {"stiffness_loss_22_N_per_m": 2e4, "stiffness_loss_44_N_m": 300.0}
    bearings = [full_bearing(node, stiffness, 1e-3 * stiffness, label=str(node)) for node in (1, 4)]
    lossy = {"kind": "internal_damping", "node": 3, "internal_damping_N_s_per_m": 10.0}
    cracks = [{"kind": "switching", "node": 3, **losses, **crack}]
    return build_model(rig_of(ROTOR, bearings, lossy, unbalance(2, 3e-5, 1.0, mass_kg=2.0), cracks=cracks))


@pytest.mark.parametrize("weight_dominance", [True, False])
def test_shaft_on_bearings(weight_dominance):
    assert worst(carried(weight_dominance=weight_dominance), [60.0, 100.0], range(-3, 5)) < TOLERANCE


def stressed(effect):
    """A shaft with an effect whose force depends on the motion about the static deflection; its modulus is a number."""
    rig = rig_of(ROTOR, springs((1, 4), (1e5, 2e5), (100.0, 200.0)), effect, unbalance(2, 3e-5, 1.0, mass_kg=2.0))
    return with_numbers(build_model(rig), ["rotor.youngs_modulus_Pa"])


@pytest.mark.parametrize(
    "effect",
    [
        {"kind": "transverse_crack", "position_m": 0.22, "depth_ratio": 0.3, "angle_rad": 0.4, "flexibility_factor": 1},
        {"kind": "cubic_stiffness", "node": 3, "cubic_stiffness_N_per_m3": 1e13},
        {"kind": "rub", "node": 3, "rub_stiffness_N_per_m": 2e4, "clearance_m": 1e-6},
    ],
    ids=lambda effect: effect["kind"],
)
def test_a_nonlinear_force_follows_the_deflection_that_moves_with_modulus_and_bearings(effect):
    assert worst(stressed(effect), [60.0, 100.0], range(-3, 5)) < TOLERANCE


def test_displacements_from_the_unloaded_line():
    """The sensors show the static deflection, which moves with the bearings, with the errors of the probes."""
    at_rest = carried(weight_dominance=True)
    model = replace(at_rest.plus(*chain(len(at_rest.sensors))), from_unloaded_line=True)
    assert worst(model, [60.0, 100.0], range(-3, 5)) < TOLERANCE
    deflection = static_deflection(at_rest, [60.0], at_rest.theta).value[..., at_rest.measured]
    loaded, more = (measured_response(m, [60.0], [0, 1]) for m in (at_rest, replace(at_rest, from_unloaded_line=True)))
    assert more[:, 0] == pytest.approx(loaded[:, 0] + deflection, rel=1e-12)
    assert (more[:, 1] == loaded[:, 1]).all()


def test_holding_the_deflection_costs_the_derivative_by_the_bearings_its_static_part():
    """Negative control: with the deflection held the derivative is another one."""
    model = carried()
    deflection = static_deflection(model, [60.0], model.theta).value
    held = replace(model, held_deflection=deflection)
    shown, free = measured_response_and_jacobian(model, [60.0], range(-3, 5))
    same, fixed = measured_response_and_jacobian(held, [60.0], range(-3, 5))
    assert shown == pytest.approx(same, rel=1e-12)
    stiffness = model.position(["bearing_stiffness_xx[1]"])[0]
    assert np.abs(free - fixed)[..., stiffness].max() > 0.05 * np.abs(free)[..., stiffness].max()
    others = [p for p, unknown in enumerate(model.unknowns) if not unknown.carries]
    assert free[..., others] == pytest.approx(fixed[..., others], rel=1e-12)


def test_the_comparison_finds_a_wrong_column():
    def off(analytic):
        wrong = analytic.copy()
        wrong[..., 1] *= 1.001
        return wrong

    assert worst(jeffcott(), [88.0], HARMONICS, off) > 5e-4
