"""The linear machine against closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.blind.machines.stepping import NoSteadyState, Stepper, steady_state

STEEL = {"youngs_modulus": 2.1e11, "density": 7850.0}
NONE = np.zeros((2, 2))


def uniform(count, length, diameter, theory="euler_bernoulli", **more):
    return (Element(length / count, diameter, theory=theory, **STEEL, **more),) * count


def frequencies(machine, held):
    """Natural frequencies (rad/s) with the coordinates `held` fixed."""
    free = np.setdiff1d(np.arange(machine.size), held)
    part = np.ix_(free, free)
    return np.sqrt(eigh(machine.stiffness[part], machine.mass[part], eigvals_only=True))


def jeffcott(mass=2.0, damping=0.0, internal=0.0, polar=0.0, count=2):
    """A light shaft on stiff bearings with a disc amid: stiffness 48 E I / L³."""
    shaft = tuple(
        Element(1.0 / count, 0.02, 2.1e11, 1e-3, theory="euler_bernoulli", internal_damping=internal)
        for _ in range(count)
    )
    ends = tuple(Bearing(node, 1e12 * np.eye(2), 1e5 * np.eye(2)) for node in (0, count))
    external = tuple(damping if node == count // 2 else 0.0 for node in range(count + 1))
    disc = Disc(count // 2, mass, polar + 1e-3, 1e-3)
    return Rotor(shaft, (disc,), ends, external), 48 * shaft[0].bending_stiffness


def test_simply_supported_and_cantilever_beams():
    shaft = uniform(20, 1.0, 0.01)
    machine = build(Rotor(shaft, (), ()))
    unit = np.sqrt(shaft[0].bending_stiffness / (STEEL["density"] * shaft[0].area))
    ends = [0, 1, 80, 81]
    found = frequencies(machine, ends)[[0, 2, 4]]
    rotary = 1 + (np.arange(1, 4) * np.pi) ** 2 * shaft[0].second_moment / shaft[0].area  # Rayleigh
    np.testing.assert_allclose(found, (np.arange(1, 4) * np.pi) ** 2 * unit / np.sqrt(rotary), rtol=1e-4)
    clamped = frequencies(machine, [0, 1, 2, 3])[[0, 2]]
    np.testing.assert_allclose(clamped, np.array([1.875104, 4.694091]) ** 2 * unit, rtol=1e-3)


def test_timoshenko_beam_simply_supported():
    """w = sin(n pi z / L): the quadratic in the square of the frequency of Timoshenko's equation."""
    shaft = uniform(20, 1.0, 0.1, "timoshenko")
    element = shaft[0]
    found = frequencies(build(Rotor(shaft, (), ())), [0, 1, 80, 81])[[0, 2]]
    shear = 12 * element.bending_stiffness / (element.shear_parameter * element.length**2)
    for n, value in enumerate(found, start=1):
        k, line, turn = n * np.pi, element.density * element.area, element.density * element.second_moment
        bending = element.bending_stiffness
        roots = np.roots([line * turn, -line * (bending * k**2 + shear) - turn * shear * k**2, shear * bending * k**4])
        assert value == pytest.approx(np.sqrt(roots.min()), rel=1e-3)


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


def test_unbalance_response_of_a_jeffcott_rotor():
    rotor, stiffness = jeffcott(damping=40.0, internal=1e-9)  # some damping for the tilting of the disc
    machine = build(rotor)
    value = 2.0 * 1e-5 * np.exp(0.7j)
    machine.add_rotating(1, value, power=2)
    speeds = np.sqrt(stiffness / 2.0) * np.array([0.4, 0.97, 1.8])
    steady = steady_state(machine, speeds, steps=64)
    expected = value * speeds**2 / (stiffness - 2.0 * speeds**2 + 40j * speeds)
    np.testing.assert_allclose(steady.whirl(1, 1), expected, rtol=5e-6)
    np.testing.assert_allclose(steady.whirl(1, 0), 2.0 * 9.80665 / stiffness, rtol=1e-6)
    np.testing.assert_allclose(steady.whirl(1, -1), 0.0, atol=1e-12)


def test_reduction_keeps_the_response():
    shaft = uniform(8, 1.0, 0.03, internal_damping=1e-6)
    bearings = tuple(Bearing(n, np.array([[3e6, 2e5], [-1e5, 2e6]]), 300 * np.eye(2)) for n in (0, 8))
    machine = build(Rotor(shaft, (Disc(3, 5.0, 0.02, 0.01),), bearings))
    machine.add_rotating(3, 1e-4, power=2)
    full, part = (steady_state(machine, [100.0, 300.0], 32, modes) for modes in (None, 14))
    np.testing.assert_allclose(part.whirl(3, 1), full.whirl(3, 1), rtol=1e-4)
    np.testing.assert_allclose(part.whirl(6, -1), full.whirl(6, -1), rtol=1e-3)


def test_gyroscopic_split_of_an_overhung_disc():
    """A disc at the end of a light cantilever: the quartic of the 2x2 stiffness 12 E I/L³, -6 E I/L², 4 E I/L."""
    element = Element(0.5, 0.02, 2.1e11, 1e-6, theory="euler_bernoulli")
    machine = build(Rotor((element,), (Disc(1, 3.0, 0.04, 0.02),), ()))
    speed, bending = 400.0, element.bending_stiffness
    k11, k12, k22 = 12 * bending / 0.5**3, -6 * bending / 0.5**2, 4 * bending / 0.5
    mass, damping, stiffness = machine.linear(speed)
    mass, damping, stiffness = (matrix[4:, 4:] for matrix in (mass, damping, stiffness))
    first = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]])
    found = np.sort(np.abs(np.linalg.eigvals(first).imag))[::2]

    def determinant(w):
        return (k11 - 3.0 * w**2) * (k22 - 0.02 * w**2 + 0.04 * speed * w) - k12**2

    grid = np.linspace(-2000.0, 2000.0, 4001)
    signs = determinant(grid)
    roots = [brentq(determinant, *grid[i : i + 2]) for i in np.flatnonzero(signs[:-1] * signs[1:] < 0)]
    assert len(roots) == 4
    np.testing.assert_allclose(found, np.sort(np.abs(roots)), rtol=1e-6)


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
