"""Faults of other forms: where one has a form that is known, it acts as that."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy.blind.machines import cracks
from rotorstudy.blind.machines.beam import both_planes
from rotorstudy.blind.machines.contacts import CONTACTS, add_elliptic_forces
from rotorstudy.blind.machines.cracks import Form, add_form, cosine, dimensionless_compliance, smooth_contact
from rotorstudy.blind.machines.draw import MACHINES, draw_point_rotor, draw_rotor
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.film import Film, add_film, bearing, force
from rotorstudy.blind.machines.machine import LocalForce, PointRotor, build, shaft_stiffness
from rotorstudy.blind.machines.stepping import NoSteadyState, steady_state

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
