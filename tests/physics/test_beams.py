"""Finite elements against beams solved by hand: frequencies, sag, rigid motion and whirl, orders of convergence."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from uniform_shaft import AREA, ENDS, GOOD, LENGTH, NU, RHO, SECOND_MOMENT, D, E, beam, rotor

from rotorstudy import Model, build_model, eigenvalues


def frequencies(structure):
    """Natural frequencies at rest, rad/s."""
    return np.sqrt(eigh(structure.stiffness, structure.mass, eigvals_only=True))


def whirl(structure, speed):
    """Forward (positive) and backward whirl frequencies, rad/s, by size."""
    found = eigenvalues(Model(structure), [speed])[0].imag
    return found[np.argsort(abs(found))]


def order(found, exact):
    """Convergence order from two meshes, the second twice as fine."""
    coarse, fine = (abs(f - exact) for f in found)
    return np.log2(coarse / fine)


def wave_numbers(ends):
    if ends == "simply supported":
        return np.arange(1, 4) * np.pi / LENGTH
    return np.array([brentq(lambda x: np.cos(x) + 1 / np.cosh(x), (n - 1) * np.pi, n * np.pi) for n in (1, 2, 3)])


@pytest.mark.parametrize("ends", ENDS)
def test_natural_frequencies_of_the_beam(ends):
    exact = wave_numbers(ends) ** 2 * np.sqrt(E * SECOND_MOMENT / (RHO * AREA))
    assert frequencies(beam(ends, 32))[:3] == pytest.approx(exact, rel=1e-5)
    assert order([frequencies(beam(ends, n))[0] for n in (4, 8)], exact[0]) == pytest.approx(4, abs=0.05)
    wrong = [frequencies(beam(ends, n, density_kg_per_m3=1.01 * RHO))[0] for n in (4, 8)]
    assert order(wrong, exact[0]) < 1


def shear_rigidity(ratio=0.0):
    """kappa G A with the coefficient of Cowper for a hollow section, inner over outer diameter given."""
    square = (1 + ratio**2) ** 2
    kappa = 6 * (1 + NU) * square / ((7 + 6 * NU) * square + (20 + 12 * NU) * ratio**2)
    return kappa * E / (2 * (1 + NU)) * AREA * (1 - ratio**2)


def timoshenko(n, ratio=0.0):
    """Lower of the two frequencies of the simply supported beam that bends in n half waves, rad/s.

    w = sin(kx), tilt = b cos(kx): (S k^2 - rho A W^2)(EI k^2 + S - rho I W^2) = (S k)^2.
    """
    k, s = n * np.pi / LENGTH, shear_rigidity(ratio)
    area, moment = AREA * (1 - ratio**2), SECOND_MOMENT * (1 - ratio**4)
    middle = RHO * moment * s * k**2 + RHO * area * (E * moment * k**2 + s)
    squares = np.roots([RHO**2 * area * moment, -middle, s * E * moment * k**4])
    return np.sqrt(squares.real.min())


@pytest.mark.parametrize("ratio", [0.0, 0.8])
def test_the_shear_beam(ratio):
    def found(count, **options):
        shaft = {"theory": "timoshenko", "shaft_inertia": "rotary", "inner_diameter_m": ratio * D}
        return frequencies(beam("simply supported", count, **{**shaft, **options}))

    exact = np.array([timoshenko(n, ratio) for n in (1, 2, 3)])
    # an element lacks the shapes its own inertia would give it: of bending (h^4) and of shear (h^2)
    bend = (np.arange(1, 4) * np.pi / 64) ** 4 / 1440
    slide = exact**2 * RHO * AREA * (1 - ratio**2) / 64**2 / (24 * shear_rigidity(ratio))
    assert found(64)[:3] / exact - 1 == pytest.approx(bend + slide, rel=0.02)
    assert found(64)[:3] == pytest.approx(exact, rel=1e-4)
    assert order([found(n)[0] for n in (64, 128)], exact[0]) == pytest.approx(2, abs=0.05)
    assert found(32, theory="euler_bernoulli")[0] > 1.001 * exact[0]
    assert found(32, shaft_inertia="translation")[2] > 1.001 * exact[2]


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_sag_under_its_own_weight_is_exact_at_the_nodes(ends, theory):
    x, load = np.linspace(0, LENGTH, 6), RHO * AREA * 9.81
    if ends == "simply supported":
        bend, shear = x * (LENGTH**3 - 2 * LENGTH * x**2 + x**3), x * (LENGTH - x)
    else:
        bend, shear = x**2 * (6 * LENGTH**2 - 4 * LENGTH * x + x**2), x * (2 * LENGTH - x)
    exact = load * bend / (24 * E * SECOND_MOMENT)
    exact = exact + (load * shear / (2 * shear_rigidity()) if theory == "timoshenko" else 0)
    found = beam(ends, 5, theory=theory)
    sag = np.array([found.static_deflection[found.index(node)] for node in found.nodes])
    expected = exact[np.array(found.nodes) - 1]
    assert sag == pytest.approx(expected, rel=1e-10)
    other = beam(ends, 5, theory="timoshenko" if theory == "euler_bernoulli" else "euler_bernoulli")
    assert other.static_deflection[other.index(4)] != pytest.approx(exact[3], rel=1e-4)


def test_a_stepped_cantilever_with_a_load_at_its_end():
    first, second = 0.4, 0.3
    stretches = [
        {"length_m": first, "outer_diameter_m": 0.06, "count": 2},
        {"length_m": second, "outer_diameter_m": 0.03, "inner_diameter_m": 0.01},
    ]
    point = {"node": 4, "mass_kg": 5.0}
    options = {"clamped_nodes": [1], "theory": "euler_bernoulli", "density_kg_per_m3": 1e-9, "point_masses": [point]}
    inner, outer = np.pi / 64 * 0.06**4, np.pi / 64 * (0.03**4 - 0.01**4)
    whole = first + second
    exact = 5.0 * 9.81 / (3 * E) * ((whole**3 - second**3) / inner + second**3 / outer)
    found = rotor(elements=stretches, **options)
    assert found.static_deflection[found.index(4)] == pytest.approx(exact, rel=1e-9)
    turned = rotor(elements=stretches[::-1], **options)
    assert turned.static_deflection[turned.index(4)] != pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_a_free_shaft_moves_as_a_rigid_body(theory):
    disc = {"node": 3, "mass_kg": 2.0, "polar_moment_kg_m2": 0.02, "diametral_moment_kg_m2": 0.01}
    found = rotor(4, theory=theory, discs=[disc])
    s = np.linspace(0, LENGTH, 5)
    shift, turn = np.kron(np.ones(5), [1, 0]), np.kron(s, [1, 0]) + np.kron(np.ones(5), [0, 1])
    stiffest = np.abs(found.stiffness).max()
    for motion in (shift, turn):
        assert np.abs(found.stiffness @ motion).max() < 1e-12 * stiffest
    assert np.abs(found.stiffness @ np.kron(s**2, [1, 0])).max() > 1e-3 * stiffest  # no rigid body
    mass, tilting = RHO * AREA * LENGTH, RHO * SECOND_MOMENT * LENGTH
    assert shift @ found.mass @ shift == pytest.approx(mass + 2.0, rel=1e-12)
    assert shift @ found.mass @ turn == pytest.approx(mass * LENGTH / 2 + 2.0 * s[2], rel=1e-12)
    assert turn @ found.mass @ turn == pytest.approx(mass * LENGTH**2 / 3 + tilting + 2.0 * s[2] ** 2 + 0.01, rel=1e-12)
    assert turn @ found.gyroscopic @ turn == pytest.approx(2 * tilting + 0.02, rel=1e-12)
    assert shift @ found.static_load == pytest.approx(9.81 * (mass + 2.0), rel=1e-12)
    assert not found.is_supported and not found.static_deflection.any()


@pytest.mark.parametrize("ends", ENDS)
def test_a_fine_mesh_of_a_supported_shaft_counts_as_supported(ends):
    assert beam(ends, 200).is_supported
    assert not rotor(200).is_supported
    assert not rotor(4, pinned_nodes=[2]).is_supported  # it turns about that node


def rayleigh(n, speed):
    """Forward and backward whirl of the simply supported shaft with rotary inertia, rad/s.

    z = sin(kx) e^{jWt}: (rho A + rho I k^2) W^2 - 2 rho I k^2 w W - EI k^4 = 0, I k^2 / A = (n pi r / 2L)^2.
    """
    k = n * np.pi / LENGTH
    slender = 1 + (n * np.pi * D / (4 * LENGTH)) ** 2
    found = np.roots([RHO * AREA * slender, -2 * RHO * AREA * (slender - 1) * speed, -E * SECOND_MOMENT * k**4])
    return np.sort(found.real)[::-1]


@pytest.mark.parametrize("speed", [0.01, 3000.0])
def test_forward_and_backward_whirl_of_a_turning_beam(speed):
    exact = np.concatenate([rayleigh(n, speed) for n in (1, 2, 3)])
    exact = exact[np.argsort(abs(exact))]
    turning = {"shaft_inertia": "gyroscopic"}
    found = [whirl(beam("simply supported", n, **turning), speed)[:6] for n in (16, 32)]
    assert found[1] == pytest.approx(exact, rel=1e-5)
    assert order([f[0] for f in found], exact[0]) == pytest.approx(4, abs=0.1)
    if speed > 1:
        for wrong in ({"gyroscopic_sign": -1, **turning}, {"shaft_inertia": "rotary"}):
            assert whirl(beam("simply supported", 16, **wrong), speed)[:6] != pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("tension", [3e5, -1e5])
def test_tension_stiffens_and_pressure_softens(tension):
    k = wave_numbers("simply supported")
    exact = np.sqrt((k**4 * E * SECOND_MOMENT + k**2 * tension) / (RHO * AREA))
    assert frequencies(beam("simply supported", 32, axial_force_N=tension))[:3] == pytest.approx(exact, rel=1e-5)
    assert frequencies(beam("simply supported", 16))[0] != pytest.approx(exact[0], rel=0.01)


def test_a_short_column_buckles_at_the_load_of_engesser():
    """P = P_e / (1 + P_e / (kappa G A)); without shear it would be P_e, 5 % more."""

    def load(count):
        def softest(load):
            column = {"elements": [{"length_m": 0.3, "count": count}], "pinned_nodes": [1, count + 1]}
            return np.linalg.eigvalsh(rotor(**column, axial_force_N=-load).stiffness)[0]

        return brentq(softest, 0.5 * euler, 1.1 * euler)

    euler = (np.pi / 0.3) ** 2 * E * SECOND_MOMENT
    engesser = euler / (1 + euler / shear_rigidity())
    assert load(16) == pytest.approx(engesser, rel=2e-4)
    assert order([load(8), load(16)], engesser) == pytest.approx(2, abs=0.1)
    assert load(16) != pytest.approx(euler, rel=0.04)


def test_the_sag_of_a_cone_converges_with_the_square_of_its_cylinders():
    """Cantilever, d0 at the wall and d1 at the tip, with a load there: 64 P L^3 / (3 pi E d0^3 d1)."""
    exact = 64 * LENGTH**3 / (3 * np.pi * E * 0.05**3 * 0.03)

    def sag(count, tip=0.03):
        cone = {"length_m": LENGTH, "count": count, "end": {"outer_diameter_m": tip}}
        structure = beam("cantilever", count, elements=[cone])
        return np.linalg.inv(structure.stiffness)[-2, -2]

    assert sag(32) == pytest.approx(exact, rel=1e-3)
    assert order([sag(8), sag(16)], exact) == pytest.approx(2, abs=0.05)
    assert sag(32, tip=0.05) != pytest.approx(exact, rel=0.1)


def test_a_sleeve_of_the_same_steel_makes_the_shaft_thicker():
    sleeve = {"outer_diameter_m": 0.08, "inner_diameter_m": D}
    stretch = {"length_m": LENGTH, "count": 8}
    thick = beam("simply supported", elements=[{**stretch, "outer_diameter_m": 0.08}], shaft_inertia="gyroscopic")
    found = beam("simply supported", elements=[{**stretch, "layers": [sleeve]}], shaft_inertia="gyroscopic")
    for name in ("mass", "stiffness", "gyroscopic", "static_load"):
        whole = getattr(thick, name)
        assert getattr(found, name) == pytest.approx(whole, abs=1e-12 * np.abs(whole).max())
    assert found.section_at(0.3).own_moment == pytest.approx(thick.section_at(0.3).own_moment, rel=1e-12)
    loose = beam("simply supported", elements=[{**stretch, "layers": [{**sleeve, "youngs_modulus_Pa": 0.0}]}])
    assert frequencies(loose)[0] == pytest.approx(frequencies(beam("simply supported"))[0] * D / 0.08, rel=1e-9)


def test_a_disc_by_its_dimensions_and_steel_by_its_shear_modulus():
    mass = 7800 * np.pi / 4 * (0.3**2 - 0.04**2) * 0.02
    moments = {
        "polar_moment_kg_m2": mass / 8 * (0.3**2 + 0.04**2),
        "diametral_moment_kg_m2": mass / 48 * (3 * 0.3**2 + 3 * 0.04**2 + 4 * 0.02**2),
    }
    cylinder = {"node": 3, "thickness_m": 0.02, "diameter_m": 0.3, "bore_m": 0.04, "density_kg_per_m3": 7800.0}
    one = rotor(discs=[cylinder], shear_modulus_Pa=E / 2.6)
    other = rotor(discs=[{"node": 3, "mass_kg": mass, **moments}], poissons_ratio=0.3)
    for name in ("mass", "stiffness", "gyroscopic", "static_load"):
        whole = getattr(other, name)
        assert getattr(one, name) == pytest.approx(whole, abs=1e-12 * np.abs(whole).max())
    own = rotor(discs=[{k: v for k, v in cylinder.items() if k != "density_kg_per_m3"}])
    assert own.discs[0].mass == pytest.approx(mass * RHO / 7800, rel=1e-12)


@pytest.mark.parametrize(
    "item, ratio",
    [
        ({"kind": "modal_damping", "damping_ratio": 0.02}, lambda w: 0.02 + 0 * w),
        ({"kind": "mass_proportional_damping", "mass_proportional_damping_1_per_s": 9.0}, lambda w: 4.5 / w),
        ({"kind": "stiffness_proportional_damping", "stiffness_proportional_damping_s": 1e-5}, lambda w: 5e-6 * w),
    ],
)
def test_damping_of_all_modes(item, ratio):
    rig = {"rotor": {"kind": "finite_element", **GOOD, "shaft_inertia": "rotary"}, "effects": [item]}
    model = build_model(rig)
    values = eigenvalues(model, [1e-9])[0]
    values = values[np.argsort(np.abs(values))][:8]
    assert -values.real / np.abs(values) == pytest.approx(ratio(np.abs(values)), rel=1e-6)
    w = np.repeat(frequencies(model.structure)[:4], 2)
    assert np.abs(values) == pytest.approx(w, rel=1e-6)
