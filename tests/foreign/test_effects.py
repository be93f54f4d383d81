"""Effects against closed forms, published values, balances, and each other."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq

from rotorstudy.blind.machines import contacts, effects
from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.cracks import arc_crack, dimensionless_compliance
from rotorstudy.blind.machines.faults import add_crack
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.blind.machines.stepping import Stepper, steady_state


def small_rotor(count=6):
    shaft = tuple(Element(0.1, 0.02, 2.1e11, 7850.0, internal_damping=1e-6) for _ in range(count))
    ends = tuple(Bearing(n, 5e6 * np.eye(2), 400.0 * np.eye(2)) for n in (0, count))
    return Rotor(shaft, (Disc(count // 2, 4.0, 0.01, 0.006),), ends, (8.0,) * (count + 1))


def first_critical(machine):
    return np.sqrt(eigh(machine.stiffness, machine.mass, eigvals_only=True)[0])


def test_crack_compliance_against_published_values():
    """Table of Papadopoulos and Dimarogonas (1987), E R³/(1 - nu²) times c55, and c44 over half the face."""
    depths, first = (0.1, 0.2, 0.3, 0.5, 0.8), (0.0277722, 0.144614, 0.372215, 1.22153, 3.97355)
    second = (0.000425851, 0.00474954, 0.019617, 0.12323, 0.827564)
    for depth, c55, c44 in zip(depths, first, second, strict=True):
        opening, sideways = dimensionless_compliance(depth)
        assert opening / np.pi == pytest.approx(c55, rel=2e-5)
        assert sideways / np.pi / 2 == pytest.approx(c44, rel=5e-5)


@pytest.mark.parametrize("position", [0.0, 0.5])
def test_open_crack_lowers_the_frequency_of_a_beam_as_a_hinge_does(position):
    """On supports, hinge amid: 2 cos l = (c E I / L) l (sin l - cos l tanh l), 2 l the wave number times L."""
    count = 12 if position == 0.0 else 13
    shaft = tuple(Element(1.0 / count, 0.02, 2.1e11, 7850.0, theory="euler_bernoulli") for _ in range(count))
    machine = build(Rotor(shaft, (), ()))
    add_crack(machine, 6, position, 1.0, kind="open")
    bending = shaft[0].bending_stiffness
    ratio = arc_crack(0.5, 0.0)[0][0] / (2.1e11 * 0.01**3) * bending
    stiffness = machine.stiffness
    for force in machine.local:  # two at a boundary of elements: each has half of the crack
        _, slope, _ = force.law(0.0, np.ones((1, 2)), np.zeros((1, 2)), np.ones(1))
        stiffness = stiffness - force.selection @ slope[0] @ force.selection.T
    x_plane = [i for i in range(machine.size) if i % 4 in (0, 3) and i not in (0, 4 * count)]
    part = np.ix_(x_plane, x_plane)
    found = np.sqrt(eigh(stiffness[part], machine.mass[part], eigvals_only=True)[0])

    def hinge(half):
        return 2 * np.cos(half) - ratio * half * (np.sin(half) - np.cos(half) * np.tanh(half))

    half = brentq(hinge, 0.5, np.pi / 2)
    expected = (2 * half) ** 2 * np.sqrt(bending / (7850.0 * shaft[0].area))
    assert 1 - (2 * half / np.pi) ** 2 > 0.02  # the crack matters
    assert found == pytest.approx(expected, rel=1.2e-3)


def laws():
    machine = build(small_rotor())
    add_crack(machine, 2, 0.5, 0.9, 0.3)
    for contact in contacts.CONTACTS:
        other = {"contact": contact, "scale": 0.5, "falling": (0.1 * (contact != "linear"), 0.9)}
        contacts.add_rub(machine, 3, 1e6, 0.4, 0.2, 0.7, (0.1, -0.2), 0.8, **other)
    contacts.add_one_sided_loss(machine, 0, 2.0, 0.7)
    contacts.add_one_sided_loss(machine, 0, 2.0, 0.4, 0.5)
    contacts.add_stiffening(machine, 0, 0.0, 3.0)
    contacts.add_asymmetry(machine, [2], 0.1, 0.2)
    contacts.add_misalignment(machine, 6, 5.0, 0.1 + 0.2j, 0.05j, 0.2)
    contacts.add_misalignment(machine, 6, 5.0, 0.1, 0.02, 0.1, angular=True)
    return machine.local


@pytest.mark.parametrize("force", laws(), ids=lambda force: force.name)
def test_derivatives_of_the_laws(force):
    rng = np.random.default_rng(3)
    y, v = rng.normal(size=(2, 5, force.selection.shape[1]))
    speed, small = np.linspace(0.5, 2.0, 5), 1e-7
    _, by_y, by_v = force.law(0.4, y, v, speed)
    for i in range(y.shape[1]):
        d = small * np.eye(y.shape[1])[i]
        for analytic, up, down in ((by_y, (y + d, v), (y - d, v)), (by_v, (y, v + d), (y, v - d))):
            numeric = (force.law(0.4, *up, speed)[0] - force.law(0.4, *down, speed)[0]) / (2 * small)
            scale = np.max(np.abs(by_y))
            np.testing.assert_allclose(analytic[:, :, i], numeric, atol=1e-3 * scale)


def test_balance_of_energy_of_a_rub():
    """Over a steady revolution unbalance does the work that damping and the stator's friction take."""
    rotor = small_rotor()
    machine = build(rotor)
    speed = 0.8 * first_critical(machine)
    effects.add_unbalance(machine, 3, 4.0 * 2e-5)
    free = steady_state(machine, speed, 32, 6)
    swing = np.abs(free.whirl(3, 1))[0]
    sag = free.whirl(3, 0)[0]
    centre = np.array([sag.real + 0.2 * swing, 0.1 * swing])
    contact, clearance, coefficient, radius, slip_speed = 1e5, 0.9 * swing, 0.08, 0.01, 1e-2
    contacts.add_rub(machine, 3, contact, clearance, coefficient, radius, centre, slip_speed)
    steady = steady_state(machine, speed, 256, 4)
    u, v = steady.displacement[0], steady.velocity[0]
    y, w = u[:, 12:14], v[:, 12:14]
    force, _, _ = machine.local[-1].law(0.0, y, w, np.full(256, speed))
    normal, tangent, r, slip = contacts.at_stator(y, w, np.full(256, speed), centre, radius)
    depth = np.maximum(r - clearance, 0.0)
    assert 0.1 < np.mean(depth > 0) <= 1.0
    elastic = np.mean(np.sum(normal * w, axis=1) * contact * depth)
    friction = np.mean(np.sum(force * w, axis=1)) + elastic
    heat = np.mean(coefficient * contact * depth * np.tanh(slip / slip_speed) * slip)
    drive = np.mean(-np.sum(force * tangent, axis=1)) * speed * radius
    vector = machine.harmonic[1, 2] * speed**2
    driven = np.mean(np.sum((vector * np.exp(1j * steady.angle[:, None])).real * v, axis=1))
    _, damping, stiffness = machine.linear(speed)
    damped = np.mean(np.sum((v @ damping.T) * v, axis=1)) + np.mean(
        np.sum((u @ (stiffness - stiffness.T).T / 2) * v, axis=1)
    )
    assert driven > 0 and heat > 0
    assert abs(elastic) < 1e-3 * driven
    assert driven + friction - elastic == pytest.approx(damped, rel=2e-3)
    assert drive == pytest.approx(heat + friction, rel=1e-6)


def test_static_shapes_of_bow_and_thermal_bow():
    """A free shaft takes the bow; one with a hot side bends by kappa L²/8 amid, away to that side."""
    rotor = small_rotor()
    rotor = Rotor(rotor.elements, (), tuple(Bearing(n, 1e13 * np.eye(2), np.zeros((2, 2))) for n in (0, 6)))
    machine = build(rotor, gravity=0.0)
    shape = effects.bow_by_kink(rotor, 2, 1e-3 * np.exp(0.3j))
    effects.add_bow(machine, shape)
    static = np.linalg.solve(machine.stiffness, machine.harmonic[1, 0])
    np.testing.assert_allclose(static[[0, 12, 24]], shape[[0, 3, 6], 0], atol=1e-9)
    machine = build(rotor, gravity=0.0)
    effects.add_thermal_bow(machine, range(6), 10.0, 0.3)
    static = np.linalg.solve(machine.stiffness, machine.harmonic[1, 0])
    assert static[12] == pytest.approx(1.2e-5 * 10 / 0.02 * 0.6**2 / 8 * np.exp(0.3j), rel=1e-6)


def test_couple_unbalance_is_a_tilted_disc():
    """The same as turning the disc's own inertia: (I_d - I_p) W² tilt on slopes, none at all for a sphere."""
    machine = build(small_rotor(), gravity=0.0)
    effects.add_couple_unbalance(machine, 3, 0.01, 0.01, 1e-3)
    assert np.max(np.abs(machine.harmonic[1, 2])) == 0.0
    effects.add_couple_unbalance(machine, 3, 0.01, 0.006, 1e-3, 0.4)
    forward = machine.harmonic[1, 2][15] - 1j * machine.harmonic[1, 2][14]
    assert forward / 2 == pytest.approx(-4e-6 * np.exp(0.4j))


def test_seal_drives_forward_whirl_and_looseness_lifts():
    """Cross stiffness does work k 2 pi r² a forward orbit; a foot that the weight holds down changes nothing."""
    machine = build(small_rotor())
    effects.add_seal(machine, 3, 0.0, 1e4, 0.0, 0.0, 0.5)
    block = machine.stiffness[12:14, 12:14] - build(small_rotor()).stiffness[12:14, 12:14]
    work = -np.mean([np.array([-np.sin(t), np.cos(t)]) @ block @ [np.cos(t), np.sin(t)] for t in np.linspace(0, 6, 50)])
    assert work == pytest.approx(1e4)
    turning = build(small_rotor())
    effects.add_seal(turning, 3, 0.0, 0.0, 50.0, 0.0, 0.0, swirl=0.4)
    change = turning.linear(200.0)[2] - build(small_rotor()).linear(200.0)[2]
    np.testing.assert_allclose(change[12:14, 12:14], 0.4 * 50.0 * 200.0 / 1e4 * block, rtol=1e-9, atol=1e-4)
    plain, loose = build(small_rotor()), build(small_rotor())
    speed = 0.6 * first_critical(plain)
    contacts.add_one_sided_loss(loose, 0, 4e6, np.pi, 1e-3)
    calm = [steady_state(m, speed, 32, 6).whirl(3, 0)[0] for m in (plain, loose)]
    assert calm[1] == pytest.approx(calm[0], rel=1e-9)
    for m in (plain, loose):
        effects.add_unbalance(m, 3, 4.0 * 5e-4)
    shaken = [abs(steady_state(m, speed, 128, 6).whirl(0, 2)[0]) for m in (plain, loose)]
    assert shaken[0] < 1e-12
    assert shaken[1] > 1e-8


def test_stepped_map_keeps_its_derivative():
    """The derivative over a revolution with a rub, against differences."""
    machine = build(small_rotor(4))
    effects.add_unbalance(machine, 2, 1e-4)
    contacts.add_rub(machine, 2, 1e5, 5e-6, 0.2, 0.01, (2e-5, 0.0), 0.1)
    stepper = Stepper(machine, 200.0, 64, 4)
    state, step = np.zeros((1, stepper.propagate.shape[1])), 1e-9 * np.eye(stepper.propagate.shape[1])
    _, end, slope = stepper.revolution(state, tangent=True)
    for i in (0, 5):
        numeric = (stepper.revolution(state + step[i])[1] - end)[0] / 1e-9
        np.testing.assert_allclose(slope[0, :, i], numeric, atol=1e-4 * np.max(np.abs(numeric)))


def test_a_steady_revolution_against_a_general_integrator():
    """From the steady state, the same modes and laws keep to it over a sixteenth of a turn with Radau's method."""
    machine, speed = build(small_rotor(2)), 150.0
    effects.add_unbalance(machine, 1, 3e-4)
    add_crack(machine, 0, 0.7, 0.8, 0.3)
    contacts.add_stiffening(machine, 2, 0.0, 1e15)
    steady = steady_state(machine, speed, 256, 2)
    stepper = Stepper(machine, speed, 256, 2)
    shapes, r = stepper.shapes, stepper.shapes.shape[1]
    _, damping, stiffness = machine.linear(speed)
    stiffness, damping = shapes.T @ stiffness @ shapes, shapes.T @ damping @ shapes
    local = [(shapes.T @ force.selection, force.law) for force in machine.local]
    loads = [(k, shapes.T @ value * speed**power) for (k, power), value in machine.harmonic.items()]

    def rate(t, state):
        q, v = state[:r], state[r:]
        force = -stiffness @ q - damping @ v
        for k, value in loads:
            force = force + (value * np.exp(1j * k * speed * t)).real
        for select, law in local:
            y, w = (q @ select)[None], (v @ select)[None]
            force = force + select @ law(speed * t, y, w, np.array([speed]))[0][0]
        return np.concatenate([v, force])

    period = 2 * np.pi / speed
    to_modes = shapes.T @ machine.mass
    start = np.concatenate([to_modes @ steady.displacement[0, 0], to_modes @ steady.velocity[0, 0]])
    times = np.array([0.03125, 0.0625]) * period
    exact = solve_ivp(rate, (0, period / 16), start, "Radau", times, rtol=1e-5, atol=1e-10)
    for number, state in zip((8, 16), exact.y.T, strict=True):
        size = np.ptp(steady.displacement[0], axis=0).max()
        np.testing.assert_allclose(shapes @ state[:r], steady.displacement[0, number], atol=2e-4 * size)
