"""The independent simulator and its measuring chain: closed forms, published values, balances, and other parts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq

from rotorstudy.blind.machines import contacts, cracks, effects
from rotorstudy.blind.machines.beam import Element, both_planes
from rotorstudy.blind.machines.contacts import CONTACTS, add_elliptic_forces
from rotorstudy.blind.machines.cracks import Form, add_form, arc_crack, cosine, dimensionless_compliance, smooth_contact
from rotorstudy.blind.machines.draw import MACHINES, draw_point_rotor, draw_rotor
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.faults import add_crack
from rotorstudy.blind.machines.film import Film, add_film, bearing, force
from rotorstudy.blind.machines.machine import Bearing, Disc, LocalForce, PointRotor, Rotor, build, shaft_stiffness
from rotorstudy.blind.machines.measuring import Chain, Probe, at_angle, coloured, keyphasor, record, surface_runout
from rotorstudy.blind.machines.stepping import NoSteadyState, Steady, Stepper, steady_state


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
    for one in machine.local:  # two at a boundary of elements: each has half of the crack
        _, slope, _ = one.law(0.0, np.ones((1, 2)), np.zeros((1, 2)), np.ones(1))
        stiffness = stiffness - one.selection @ slope[0] @ one.selection.T
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


TABLE = 1e-4  # of a kink by a table of 720 directions
RNG = np.random.default_rng(3)
ROTOR = draw_rotor(RNG, mass=5.0, count=4)
SPEEDS = np.array([0.4, 0.7]) * np.sqrt(ROTOR.bearings[0].stiffness[0, 0] / ROTOR.mass) * 0.2


def compliance(depth_over_radius):
    part = ROTOR.elements[1]
    scale = (1 - part.poissons_ratio**2) / (np.pi * part.youngs_modulus * (part.outer_diameter / 2) ** 3)
    return scale * np.diag(dimensionless_compliance(depth_over_radius))


def motion(add):
    """Steady displacement of the rotor with what `add` adds."""
    machine = build(ROTOR)
    add_unbalance(machine, 2, 1e-4 * ROTOR.mass * 1e-2)
    add(machine)
    return steady_state(machine, SPEEDS, steps=128, modes=6).displacement


def gap(one, other, beside):
    """Largest difference of two motions over the largest effect of the second, beside that without it."""
    return np.abs(one - other).max() / np.abs(other - beside).max()


POSITION = float(ROTOR.positions[1] + 0.3 * ROTOR.elements[1].length)
SOUND = motion(lambda machine: None)


def formed(form, length=0.0):
    return motion(lambda machine: add_form(machine, POSITION, form, 0.7, length))


SLOT = formed(Form(compliance(0.6), "open", None))


def add_switching(machine):
    """A hinge that yields across the front alone, while the moment pulls on it."""
    ((selection, stiffness, _, own),) = cracks.pieces(machine, POSITION, 0.0)
    softer = compliance(0.6)[0, 0] / (1 + stiffness * compliance(0.6)[0, 0])

    def law(turn, y, v, speed):
        across = -np.array([np.cos(turn + 0.7), np.sin(turn + 0.7)])
        slope = softer * np.outer(across, across) * ((y + own) @ across > 0)[:, None, None]
        return (slope @ (y + own)[..., None])[..., 0], slope, np.zeros_like(slope)

    machine.local.append(LocalForce(selection, law, "crack"))


@pytest.mark.parametrize("law", ["energy", "whole"])
def test_an_abrupt_contact_that_yields_across_alone_is_the_switching_crack(law):
    form, switching = Form(compliance(0.6) * [1, 0], law, smooth_contact(0.01)), motion(add_switching)
    assert gap(formed(form), switching, SOUND) < 0.02  # the jump has a width
    assert gap(formed(Form(form.compliance, law, smooth_contact(1.0))), switching, SOUND) > 0.05


def test_a_crack_held_open_by_residual_stress_is_a_slot():
    form = Form(compliance(0.6), "whole", smooth_contact(0.02), closing=-1e4)
    constant = formed(form) - SLOT
    # the stress bends the shaft, too: a constant in rotating axes, that is at 1X alone
    lines = np.abs(np.fft.fft(constant, axis=1)).max(axis=(0, 2))
    assert lines[[0, 2, 3]].max() < 1e-3 * lines[1]


def test_a_law_by_the_angle_that_is_always_open_is_a_slot():
    for law in ("flexibility_by_angle", "stiffness_by_angle"):
        form = Form(compliance(0.6), law, lambda angle: 1.0)
        assert gap(formed(form), SLOT, SOUND) < TABLE
    # negative control: another ratio of the flexibilities
    assert gap(formed(Form(compliance(0.6) * [1, 0.5], "open", None)), SLOT, SOUND) > 0.05


def test_a_crack_by_the_weight_opens_below():
    """(1 + cos) / 2 is one half open on average, and most where the front is on the side that the weight stretches."""
    form = Form(compliance(0.6), "stiffness_by_angle", cosine())
    deflection = formed(form)[:, :, 8] - SOUND[:, :, 8]
    lines = np.fft.fft(deflection, axis=1)[0] / deflection.shape[1]
    turned = lines[1] * np.exp(-0.7j)  # of a rest deflection at most where angle + 0.7 = 0
    assert abs(np.angle(turned)) < 0.5 and turned.real > 0
    lagging = Form(compliance(0.6), "stiffness_by_angle", cosine(lag=1.0))
    assert gap(formed(lagging), formed(form), SOUND) > 0.3


def test_a_short_softened_length_is_a_section_and_a_long_one_is_not():
    form = Form(compliance(0.6), "open", None)
    assert gap(formed(form, 1e-3 * ROTOR.diameter), formed(form), SOUND) < 1e-3
    assert gap(formed(form, 3 * ROTOR.elements[1].length), formed(form), SOUND) > 0.02
    machine = build(ROTOR)
    assert len(cracks.pieces(machine, POSITION, 2 * ROTOR.elements[1].length)) == 3
    assert sum(
        share for _, _, share, _ in cracks.pieces(machine, POSITION, 1.5 * ROTOR.elements[1].length)
    ) == pytest.approx(1.0)


@pytest.mark.parametrize("length", [0.0, 0.5])
def test_the_weight_between_the_nodes_bends_the_crack_too(length):
    """The moment at a place of the shaft does not depend on where it is divided."""
    part, *others = ROTOR.elements
    divided = replace(part, length=part.length / 4)
    fine = replace(
        ROTOR, elements=(*4 * [divided], *others), discs=tuple(replace(d, node=d.node + 3) for d in ROTOR.discs),
        bearings=tuple(replace(b, node=b.node + 3 * (b.node > 0)) for b in ROTOR.bearings),
        external_damping=np.insert(ROTOR.external_damping, 1, [0.0] * 3),
    )  # fmt: skip

    def moment(rotor):
        machine = build(rotor)
        found = cracks.pieces(machine, 0.5 * part.length, length * part.length)
        return sum(share * (selection.T @ machine.sag() + own)[0] for selection, _, share, own in found), found

    (coarse, ((selection, *_),)), (exact, _) = moment(ROTOR), moment(fine)
    assert coarse == pytest.approx(exact, rel=1e-9)
    by_the_nodes = (selection.T @ build(ROTOR).sag())[0]
    assert by_the_nodes != pytest.approx(exact, rel=1e-3)  # negative control


def test_a_whole_element_of_less_rigidity_is_the_softened_length():
    """E I less by a share over an element, in closed form: its kinks add its length over E I share / (1 - share)."""
    part = ROTOR.elements[1]
    share, flexibility = 0.2, part.length / part.bending_stiffness
    form = Form(flexibility * share / (1 - share) * np.eye(2), "open", None)
    machine = build(ROTOR)
    ((selection, stiffness, whole, _),) = cracks.pieces(machine, ROTOR.positions[1] + part.length / 2, part.length)
    softer = whole * form.compliance[0, 0] / (1 + stiffness * whole * form.compliance[0, 0])
    reduced = machine.stiffness - softer * selection @ selection.T
    bent = np.zeros(machine.size)  # pure bending of the element: opposite rotations of its ends
    bent[[4 + 3, 8 + 3]] = -1.0, 1.0
    whole_one = bent @ shaft_stiffness(ROTOR, [0, 1, 0, 0]) @ bent
    assert bent @ (machine.stiffness - reduced) @ bent == pytest.approx(share * whole_one, rel=1e-9)


def test_shares_are_shares():
    angle = np.linspace(-np.pi, np.pi, 721)
    for share in (smooth_contact(0.3), cosine(1.5, 0.2), cracks.trapezoid(0.5, 1.0, -0.3)):
        values = share(angle)
        assert values.min() >= 0 and values.max() <= 1 and values.max() > 0.99 and values.min() < 0.01


def test_a_point_rotor_is_a_light_shaft_with_a_disc():
    rotor = draw_point_rotor(np.random.default_rng(1), middle=False)
    stiffness_of = both_planes(rotor.plane_stiffness)
    assert np.linalg.eigvalsh(stiffness_of).min() > 0
    middle = draw_point_rotor(np.random.default_rng(1), middle=True)
    length, second = middle.length, np.pi / 64 * middle.diameter**4
    assert middle.plane_stiffness[0, 0] == pytest.approx(48 * middle.youngs_modulus * second / length**3)
    # a hinge of compliance c in the middle: 1 / k' = 1 / k + c L² / 16
    selection, stiffness = middle.hinge(middle.first)
    c = 0.3 / stiffness
    softer = selection[0, 0] ** 2 * c / (1 + stiffness * c)
    k = middle.plane_stiffness[0, 0]
    assert 1 / (k - softer) == pytest.approx(1 / k + c * length**2 / 16)
    # by a force on the disc the moment at the crack grows linearly from either bearing
    force = stiffness_of @ np.linalg.solve(stiffness_of, [1.0, 0, 0, 0])
    for position in (0.3 * rotor.first, rotor.length - 0.4 * rotor.second):
        selection, _ = rotor.hinge(position)
        moment = selection[:, 0] @ np.linalg.solve(stiffness_of, force)
        from_end = position if position < rotor.first else rotor.length - position
        other = rotor.second if position < rotor.first else rotor.first
        assert abs(moment) == pytest.approx(from_end * other / rotor.length)


def test_contacts_push_only_inwards_and_the_more_the_deeper():
    for law in CONTACTS.values():
        value, _ = law(np.array([-0.7, 0.3, 1.1, 1.2]))
        assert (value >= 0).all() and (np.diff(value) > 0).all()


def test_elliptic_forces_are_forward_and_backward():
    machine = build(ROTOR)
    add_elliptic_forces(machine, 1, {(2, 0): (3.0 + 1j, 2.0 - 1j)})
    vector, angle = machine.harmonic[2, 0], 0.4
    x, y = ((vector[4 + i] * np.exp(2j * angle)).real for i in (0, 1))
    assert x + 1j * y == pytest.approx((3 + 1j) * np.exp(2j * angle) + (2 - 1j) * np.exp(-2j * angle))


def test_a_film_in_time_is_its_linear_bearing_for_small_motion():
    film = Film(node=0, diameter=0.1, length=0.03, clearance=1e-4, viscosity=0.1, load=525.0)
    machine, linear = build(ROTOR), bearing(film, 150.0)
    add_film(machine, film, linear, [150.0])
    law, speed = machine.local[-1].law, np.array([150.0])
    rest = law(0.0, np.zeros((1, 2)), np.zeros((1, 2)), speed)[0]
    assert rest == pytest.approx(np.array([[-525.0, 0.0]]), rel=1e-3, abs=0.5)
    value, by_y, by_v = law(0.0, np.array([[1e-8, 0]]), np.array([[0, 1e-6]]), speed)
    assert np.abs(value - rest).max() < 1e-3 * linear.stiffness[0, 0] * 1e-8
    assert np.abs(by_y).max() < 1e-3 * np.abs(linear.stiffness).max()
    assert np.abs(by_v).max() < 1e-3 * np.abs(linear.damping).max()
    far = law(0.0, np.array([[2e-5, 0]]), np.zeros((1, 2)), speed)[0] - rest  # a fifth of the clearance is not small
    assert np.abs(far).max() > 0.05 * linear.stiffness[0, 0] * 2e-5
    at = np.array([[1e-5, 2e-5], [-3e-5, 1e-5]])
    several = force(film, speed, at, np.zeros((2, 2)))
    assert several[1] == pytest.approx(force(film, 150.0, at[1], np.zeros(2)))


def test_machines_of_every_kind():
    for name, make in MACHINES.items():
        if name != "any":
            rotor = make(np.random.default_rng(5))
            assert rotor.mass > 0 and (len(rotor.elements) >= 5 or isinstance(rotor, PointRotor))


def test_a_law_without_a_unique_kink_is_refused():
    machine = build(ROTOR)
    lagging = Form(100 * compliance(0.6), "whole", smooth_contact(0.01, 1.0))
    with pytest.raises(NoSteadyState, match="no unique solution"):
        add_form(machine, POSITION, lagging, 0.7)


SPEED = 100.0
FORWARD, SECOND = 2e-5 * np.exp(0.4j), 3e-6  # of the motion, m
GOOD = (Probe(0.0), Probe(np.pi / 2))


def steady():
    angle = 2 * np.pi * np.arange(64) / 64
    z = 1e-5 + FORWARD * np.exp(1j * angle) + SECOND * np.exp(2j * angle)
    u = np.stack([z.real, z.imag, 0 * angle, 0 * angle], axis=1)[None]
    return Steady(np.array([SPEED]), angle, u, 0 * u, np.zeros(1), np.zeros(1))


def harmonic(chain, probes=GOOD, k=1):
    """Complex amplitude of x + j y at k, with the phase counted from the centre of the pulses."""
    result = record(np.random.default_rng(1), steady(), [0], {0: probes}, chain)
    high = result["keyphasor"] > 2.5
    time = result["time"]
    edges = np.diff(high.astype(int), axis=1)[0]
    up, down = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    down = down[down > up[0]][: len(up)]
    centres = (time[up[: len(down)]] + time[down] + 1 / chain.rate) / 2
    slope, start = np.polyfit(centres, 2 * np.pi * np.arange(len(centres)), 1)
    part = slice(up[0], up[0] + round(20 * 2 * np.pi / SPEED * chain.rate))
    angle = slope * time[part] + start + chain.sensor_angle - chain.mark_angle
    z = result["displacement"][0, 0, 0, part] + 1j * result["displacement"][0, 0, 1, part]
    return np.mean(z * np.exp(-1j * k * angle))


CLEAN = Chain(rate=SPEED / (2 * np.pi) * 512)


def test_a_clean_chain_reads_the_motion():
    assert harmonic(CLEAN) == pytest.approx(2e-5 * np.exp(0.4j), rel=5e-3)
    marked = replace(CLEAN, mark_angle=0.7, sensor_angle=-0.3)
    assert harmonic(marked) == pytest.approx(2e-5 * np.exp(0.4j), rel=5e-3)
    assert harmonic(CLEAN, k=-1) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize(
    ("changes", "factor"), [({"phase_offset": 0.2}, np.exp(-0.2j)), ({"delay": 1e-3}, np.exp(-1j * SPEED * 1e-3))]
)
def test_phase_errors(changes, factor):
    assert harmonic(replace(CLEAN, **changes)) == pytest.approx(2e-5 * np.exp(0.4j) * factor, rel=8e-3)


def test_probe_errors():
    gain = harmonic(CLEAN, (Probe(0.0, gain=1.1), Probe(np.pi / 2, gain=1.1)))
    assert abs(gain) == pytest.approx(2.2e-5, rel=5e-3)
    back = harmonic(CLEAN, (Probe(0.0), Probe(np.pi / 2, reversed=True)), k=-1)
    assert abs(back) == pytest.approx(2e-5, rel=5e-3)
    swapped = harmonic(replace(CLEAN, swapped=(0,)), k=-1)
    assert abs(swapped) == pytest.approx(2e-5, rel=5e-3)
    turned = harmonic(CLEAN, (Probe(0.0, angle_error=0.1), Probe(np.pi / 2, angle_error=0.1)))
    assert turned == pytest.approx(2e-5 * np.exp(0.3j), rel=8e-3)
    runout = surface_runout(np.random.default_rng(0), (0.0, np.pi / 2), 1e-6)
    seen = harmonic(CLEAN, (Probe(0.0, runout=runout[0]), Probe(np.pi / 2, runout=runout[1])))
    assert abs(seen - harmonic(CLEAN)) == pytest.approx(abs(runout[0][1]), rel=1e-2)


def test_noise_is_of_the_given_size_and_colour():
    noise = coloured(np.random.default_rng(2), (200, 1024))
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    power = np.mean(np.abs(np.fft.rfft(noise)) ** 2, axis=0)
    assert power[4] / power[64] == pytest.approx(16.0, rel=0.4)


def test_pulses_and_interpolation():
    angle = np.linspace(0, 20 * np.pi, 20001)
    pulses = keyphasor(angle, CLEAN)
    assert np.count_nonzero(np.diff((pulses > 2.5).astype(int)) == 1) == 10
    assert np.mean(pulses > 2.5) == pytest.approx(0.2 / (2 * np.pi), rel=0.02)
    turn = 2 * np.pi * np.arange(32) / 32
    np.testing.assert_allclose(at_angle(np.cos(3 * turn + 0.1), angle, 5), np.cos(3 * angle + 0.1), atol=1e-12)
