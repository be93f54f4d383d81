"""How a transverse crack breathes: the motion of the rotor, and the stiffness that is lost."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shaft_with_a_crack import DIAMETER, HARMONICS, LENGTH, MASS, POISSON, YOUNG, at_disc, rotor
from shaft_with_a_crack import crack as any_crack

from rotorstudy.model.hinge import crack_at


def crack(*place, **options):
    return any_crack(*place, flexibility="strip_integration", **options)


def by_strips(depth, count=400):
    """Rotation of a breathing crack by a unit moment at any angle, as a function, E and R = 1, nu = 0.

    Papadopoulos and Dimarogonas 1987, Eqs. of K_I by both moments with F1 and F2 of Tada, summed over small cells.
    """
    deep = 2 * depth
    x = np.linspace(-1, 1, count + 1)[:-1] + 1 / count  # across the crack
    x = x * np.sqrt(1 - (1 - deep) ** 2)
    cell = x[1] - x[0]
    half = np.sqrt(1 - x**2)
    tip = half - (1 - deep)
    y = (np.arange(count) + 0.5)[:, None] / count * tip
    ratio = np.pi * y / (2 * half) / 2
    common = np.sqrt(np.tan(ratio) / ratio) / np.cos(ratio)
    f1 = common * (0.752 + 2.02 * y / (2 * half) + 0.37 * (1 - np.sin(ratio)) ** 3)
    f2 = common * (0.923 + 0.199 * (1 - np.sin(ratio)) ** 4)
    k_xi, k_eta = (4 / np.pi * side * np.sqrt(np.pi * y) * f for side, f in ((half, f2), (x, f1)))
    weight = 2 * cell * tip / count
    angle = np.linspace(-np.pi, np.pi, 361)
    opening = [np.maximum(np.cos(a) * k_xi + np.sin(a) * k_eta, 0) * weight for a in angle]
    kink = np.array([np.sum(o * k_xi) + 1j * np.sum(o * k_eta) for o in opening])
    return lambda a: np.interp(a, angle, kink.real) + 1j * np.interp(a, angle, kink.imag)


def integrated(position, depth, speed, damping, closing=0.0):
    """Harmonics at the disc of a massless pinned shaft, integrated in real coordinates.

    The beam is statically determinate: a force F at mid-span bends the crack, c from the nearer end, by F c / 2, and
    a kink there deflects mid-span by c / 2 of it. The force follows from the deflection at each instant. A residual
    stress that closes the crack like a moment of `closing` is, for the crack, a force of that over c / 2.
    """
    lever, radius = min(position, LENGTH - position) / 2, DIAMETER / 2
    soft, scale = LENGTH**3 / (48 * YOUNG * np.pi / 64 * DIAMETER**4), (1 - POISSON**2) / (YOUNG * radius**3)
    kink = by_strips(depth)

    # F = |z| f(arg z) in turning axes, as the crack has no scale: z = soft F + lever^2 kink(F) by direction of F
    direction = np.linspace(-np.pi, np.pi, 1441)
    given = soft * np.exp(1j * direction) + scale * lever**2 * kink(direction)
    seen, force = np.unwrap(np.angle(given)), np.exp(1j * direction) / np.abs(given)

    def elastic_force(z, angle):
        beyond = z * np.exp(-1j * angle) - soft * closing / lever
        opening = abs(beyond) * np.interp(np.angle(beyond), seen, force)
        return (opening + closing / lever) * np.exp(1j * angle)

    def derivative(t, state):
        x, y, vx, vy = state
        force = elastic_force(x + 1j * y, speed * t)
        shake = MASS * 2e-5 * speed**2
        ax = (shake * np.cos(speed * t + 0.7) - damping * vx - force.real) / MASS + 9.81
        ay = (shake * np.sin(speed * t + 0.7) - damping * vy - force.imag) / MASS
        return [vx, vy, ax, ay]

    rest = MASS * 9.81 * soft
    turns = np.ceil(20 * MASS / damping * speed / np.pi)  # the start decays by e^-20
    time = (turns + np.arange(64) / 64) * 2 * np.pi / speed
    solved = solve_ivp(derivative, (0, time[-1]), [rest, 0, 0, 0], method="Radau", t_eval=time, rtol=1e-5, atol=1e-9)
    z = solved.y[0] - rest + 1j * solved.y[1]
    return (np.fft.fft(z) / len(z))[HARMONICS]


DAMPING = 250.0
DRAG = {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": DAMPING}
LIGHT = {"density": 1e-3, "bearings": False, "theory": "euler_bernoulli"}


# the natural frequency is 428 rad/s, with the crack of 30 % about 417: a third and a half of it are among the speeds
@pytest.mark.parametrize(("speed", "depth"), [(60.0, 0.4), (139.0, 0.3), (208.0, 0.3), (390.0, 0.3)])
def test_steady_state_is_what_integration_in_real_coordinates_settles_to(speed, depth):
    """At 390 rad/s vibration exceeds the weight: the crack opened by the weight alone is far off then."""
    item = crack(0.23, depth, angle_rad=0.0)
    cracks = ((), (item,), ({**item, "opened_by": "weight"},))
    bare, found, by_weight = (at_disc(2, [speed], DRAG, *one, **LIGHT)[0] for one in cracks)
    expected = integrated(0.23, depth, speed, DAMPING)
    size = np.abs(expected - bare).max()
    assert size > 0.01 * np.abs(bare).max()
    assert np.abs(found - expected).max() < 5e-3 * size
    if speed == 390.0:
        assert np.abs(by_weight - expected).max() > 0.05 * size


@pytest.mark.parametrize("closing", [0.8, -0.8])  # the weight bends the crack by 2.3 N m
def test_residual_stress_delays_or_advances_the_opening(closing):
    speed, item = 139.0, crack(0.23, 0.3, angle_rad=0.0)
    cracks = ((), (item,), ({**item, "closing_moment_N_m": closing},))
    bare, without, found = (at_disc(2, [speed], DRAG, *one, **LIGHT)[0] for one in cracks)
    expected = integrated(0.23, 0.3, speed, DAMPING, closing)
    size = np.abs(expected - without).max()
    assert np.abs(found - expected).max() < 0.02 * size
    assert size > 0.05 * np.abs(integrated(0.23, 0.3, speed, DAMPING) - bare).max()


@pytest.mark.parametrize("switching", [False, True])
def test_by_its_angle_a_part_of_the_stiffness_of_the_open_crack_is_lost(switching):
    """(1 + cos) / 2 or none or all of it, with half the flexibility across, as the coefficients of the paper have."""
    hinge = crack_at(rotor(4).structure, 0.23, 0.3, 0.4, "strip_integration")
    stiffness, motion = hinge.section.stiffness, np.random.default_rng(1).normal(size=(2, len(hinge.row))).T @ [1, 1j]
    given = {"z": motion, "conj": motion.conj()}
    own = hinge.section.own_moment / stiffness
    softer = hinge.open_shares / (1 - hinge.open_shares) * [1, 0.5]
    entries = hinge.entries_by_angle(switching)
    for angle in (0.0, 0.6, 2.5, 5.0):  # half a radian or more from where it switches
        turn, cosine = np.exp(1j * (angle + 0.4)), np.cos(angle + 0.4)
        share = float(cosine > 0) if switching else (1 + cosine) / 2
        imposed = (hinge.row @ motion + own) / turn
        whole = (softer / (1 + softer)) @ [imposed.real, 1j * imposed.imag] * turn
        force = sum(
            np.exp(1j * one.shift * angle) * (one.matrix if one.on == "one" else one.matrix @ given[one.on])
            for one in entries
        )
        error = (
            np.abs(force - stiffness * hinge.row * share * whole).max() / np.abs(stiffness * hinge.row * whole).max()
        )
        assert error < (0.04 if switching else 1e-9)  # the first harmonic left out, of 17, is 2 / (17 pi)


def test_a_crack_that_residual_stress_holds_closed_has_no_effect():
    """But for 1e-3 of the kink by the closing moment, which the finite series leaves where the crack is closed."""
    bare, free, held = (
        at_disc(4, [139.0], *item) for item in ((), (crack(0.23, 0.3),), (crack(0.23, 0.3, closing_moment_N_m=8.0),))
    )
    assert np.abs(held - bare).max() < 5e-3 * np.abs(free - bare).max()
