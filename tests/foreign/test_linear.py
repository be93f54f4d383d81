"""The linear machine against closed forms."""

import numpy as np
import pytest

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.blind.machines.stepping import NoSteadyState, Stepper, steady_state

STEEL = {"youngs_modulus": 2.1e11, "density": 7850.0}
NONE = np.zeros((2, 2))


def uniform(count, length, diameter, theory="euler_bernoulli", **more):
    return (Element(length / count, diameter, theory=theory, **STEEL, **more),) * count


def jeffcott(damping=0.0, internal=0.0):
    """A light shaft on stiff bearings with a disc of 2 kg amid: stiffness 48 E I / L³."""
    half = Element(0.5, 0.02, 2.1e11, 1e-3, theory="euler_bernoulli", internal_damping=internal)
    ends = tuple(Bearing(node, 1e12 * np.eye(2), 1e5 * np.eye(2)) for node in (0, 2))
    return Rotor((half, half), (Disc(1, 2.0, 1e-3, 1e-3),), ends, (0.0, damping, 0.0)), 48 * half.bending_stiffness


def test_static_deflection_of_a_beam_by_its_weight():
    """5 q L⁴ / (384 E I), with shear + q L² / (8 kappa G A)."""
    for theory in ("euler_bernoulli", "timoshenko"):
        shaft = uniform(4, 2.0, 0.1, theory)
        machine = build(Rotor(shaft, (), (Bearing(0, 1e14 * np.eye(2), NONE), Bearing(4, 1e14 * np.eye(2), NONE))))
        sag = np.linalg.solve(machine.stiffness, machine.harmonic[0, 0].real)[8]
        load = STEEL["density"] * shaft[0].area * 9.80665
        expected = 5 * load * 2.0**4 / (384 * shaft[0].bending_stiffness)
        if theory == "timoshenko":
            expected += (
                load * 2.0**2 * shaft[0].shear_parameter * shaft[0].length ** 2 / (96 * shaft[0].bending_stiffness)
            )
        assert sag == pytest.approx(expected, rel=1e-6)


def test_reduction_keeps_the_response():
    shaft = uniform(8, 1.0, 0.03, internal_damping=1e-6)
    bearings = tuple(Bearing(n, np.array([[3e6, 2e5], [-1e5, 2e6]]), 300 * np.eye(2)) for n in (0, 8))
    machine = build(Rotor(shaft, (Disc(3, 5.0, 0.02, 0.01),), bearings))
    machine.add_rotating(3, 1e-4, power=2)
    full, part = (steady_state(machine, [100.0, 300.0], 32, modes) for modes in (None, 14))
    np.testing.assert_allclose(part.whirl(3, 1), full.whirl(3, 1), rtol=1e-4)
    np.testing.assert_allclose(part.whirl(6, -1), full.whirl(6, -1), rtol=1e-3)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_stability_threshold_of_internal_damping(ratio):
    """Stable below w_n (1 + c_e / c_i): steady below it, an error and growth in free motion above it."""
    rotor, stiffness = jeffcott()
    internal = 20.0
    rotor, stiffness = jeffcott(damping=ratio * internal, internal=internal / stiffness)
    machine = build(rotor)
    machine.add_rotating(1, 1e-6, power=2)
    threshold = np.sqrt(stiffness / 2.0) * (1 + ratio)
    assert np.all(steady_state(machine, 0.99 * threshold, 32, modes=4).multipliers < 1.0)
    with pytest.raises(NoSteadyState, match="unstable"):
        steady_state(machine, 1.01 * threshold, 32, modes=4)
    stepper, motion = Stepper(machine, 1.2 * threshold, 32, modes=4), []
    state = np.zeros((1, stepper.propagate.shape[1]))
    for _ in range(60):
        states, state, _ = stepper.revolution(state)
        motion.append(stepper.displacement(states[:, 0])[:, 5])
    motion = np.concatenate(motion)
    assert np.ptp(motion[-320:]) > 1.5 * np.ptp(motion[320:640])
