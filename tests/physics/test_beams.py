"""Finite elements against beams solved by hand, other rotors of the library and a textbook; where they can crack."""

import numpy as np
import pytest
from machines import OFFSET_DISC, disc, shaft, springs
from one_line_errors import refused
from scipy.linalg import eigh
from scipy.optimize import brentq

from rotorstudy import Model, build_model, eigenvalues, harmonic_response, make_term, simulate_records
from rotorstudy.response.statics import static_deflection

E, NU, RHO, LENGTH, D = 2.1e11, 0.3, 7850.0, 1.0, 0.05
AREA, SECOND_MOMENT = np.pi / 4 * D**2, np.pi / 64 * D**4
ENDS = {"simply supported": "pinned_nodes", "cantilever": "clamped_nodes"}


def rotor(count=8, **options):
    """Structure of a uniform shaft."""
    options = {"elements": [{"length_m": LENGTH, "count": count}], "outer_diameter_m": D, **options}
    return build_model({"rotor": {"kind": "finite_element", **options}}).structure


def beam(ends, count=8, **options):
    """Euler-Bernoulli without rotary inertia, the beam of the textbooks, unless told otherwise."""
    held = {"pinned_nodes": [1, count + 1]} if ends == "simply supported" else {"clamped_nodes": [1]}
    return rotor(count, **{"theory": "euler_bernoulli", "shaft_inertia": "translation", **held, **options})


GOOD = {"elements": [{"length_m": 1.0, "count": 4}], "outer_diameter_m": 0.05, "pinned_nodes": [1, 5]}


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


def test_a_rotor_at_rest_has_eigenvalues_and_no_speed_below():
    shaft_at_rest = beam("simply supported", 8)
    found = np.sort(np.abs(whirl(shaft_at_rest, 0.0)))[::2]  # forward and backward alike
    assert found == pytest.approx(frequencies(shaft_at_rest), rel=1e-6)
    for speed, words in ((-1.0, "speed -1 rad/s: give speeds from 0 rad/s"), (np.nan, "speed nan rad/s")):
        refused(lambda speed=speed: whirl(shaft_at_rest, speed), words)
    refused(lambda: harmonic_response(Model(shaft_at_rest), [0.0], [1]), "only a rotating shaft has harmonics")


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


HARMONICS = [0, 1, 2, 3, 5, -1, -3]
SPEEDS = [90.0, 200.0, 310.0]
CAUSES = [
    {"kind": "unbalance", "mass_kg": 2.0, "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
    {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
    {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
]


def response(rig, at, losses, *, weight_dominance, **place):
    """(speed, harmonic) displacement of the disc of a rig with the causes above and a crack."""
    crack = {"kind": "switching", "weight_dominance": weight_dominance, **losses, **place}
    model = build_model({"rotor": rig, "cracks": [crack], "effects": [{**cause, "node": at} for cause in CAUSES]})
    return harmonic_response(model, SPEEDS, HARMONICS)[..., model.structure.index(at)]


@pytest.mark.parametrize("weight_dominance", [True, False])
@pytest.mark.parametrize("a, b", [(0.18, 0.18), (0.2, 0.16)])
def test_a_disc_on_a_light_shaft_is_the_disc_of_the_zoo(a, b, weight_dominance):
    spans = {"elements": [{"length_m": a, "count": 2}, {"length_m": b}], "pinned_nodes": [1, 4], "discs": [disc(3)]}
    light = {"kind": "finite_element", "outer_diameter_m": 0.015, "density_kg_per_m3": 1e-6, **spans}
    light["theory"] = "euler_bernoulli"
    massless = {**OFFSET_DISC, "a_m": a, "b_m": b}
    losses = {"stiffness_loss_22_N_per_m": 1e5, "stiffness_loss_44_N_m": 300.0}

    beam, two = build_model({"rotor": light}).structure, build_model({"rotor": massless}).structure
    at_disc = [beam.index(3), beam.index(3, "tilt")]
    condensed = np.linalg.inv(np.linalg.inv(beam.stiffness)[np.ix_(at_disc, at_disc)])
    assert condensed == pytest.approx(two.stiffness, rel=1e-9, abs=1e-9 * two.stiffness[0, 0])

    expected = response(massless, 1, losses, weight_dominance=weight_dominance)
    found = response(light, 3, losses, weight_dominance=weight_dominance, node=3)
    assert np.abs(found - expected).max(0) == pytest.approx(0, abs=1e-8 * np.abs(expected).max())
    if a == b:
        plain = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": two.stiffness[0, 0]}
        lost = {"stiffness_loss_N_per_m": 1e5}
        assert response(plain, 1, lost, weight_dominance=weight_dominance) == pytest.approx(expected, rel=1e-9)
    else:
        mirrored = {**massless, "a_m": b, "b_m": a}  # k24 changes sign
        assert build_model({"rotor": mirrored}).structure.stiffness[0, 1] == pytest.approx(-two.stiffness[0, 1])
        assert condensed[0, 1] != pytest.approx(-two.stiffness[0, 1])
        reversed_sign = response({**light, "gyroscopic_sign": -1}, 3, losses, weight_dominance=True, node=3)
        assert np.abs(reversed_sign - expected).max() > 1e-3 * np.abs(expected).max()


SPRING = {"kind": "support_stiffness", "support_stiffness_N_per_m": 1e6}


def test_the_shaft_sags_on_its_bearings():
    light = shaft(LENGTH, 2, disc(2, 4.0, 0.0, 0.0), density_kg_per_m3=1e-6, theory="euler_bernoulli")
    model = build_model({"rotor": light, "bearings": springs((1, 3), damping=0.0)})
    found = static_deflection(model, [50.0], model.theta).value[0]
    assert np.abs(harmonic_response(model, [50.0], [0])).max() < 1e-15  # displacements count from there
    sag = 4.0 * 9.81 * LENGTH**3 / (48 * E * np.pi / 64 * 0.02**4)
    ends = 4.0 * 9.81 / 2e6
    expected = {(1, "translation"): ends, (2, "translation"): ends + sag, (2, "tilt"): 0.0}
    for place, value in expected.items():
        assert found[model.structure.dofs.index(place)] == pytest.approx(value, rel=1e-6, abs=1e-12)
    damping = {"kind": "shaft_damping", "shaft_damping_s": 1e-5}  # resists bending alone, as the shaft does
    for effects in ([], [damping]):
        free = build_model({"rotor": light, "effects": effects})
        refused(lambda free=free: harmonic_response(free, [50.0], [0]), "nothing carries the weight")
        refused(lambda free=free: simulate_records(free, [50.0], [1], np.arange(9)), "do not hold the rotor")
    held = build_model({"rotor": light, "effects": [{**SPRING, "node": n, "label": n} for n in (1, 3)]})
    assert np.isfinite(harmonic_response(held, [50.0], [0])).all()


def test_a_bow_of_a_free_shaft_counts_from_the_line_through_its_ends():
    held, free = rotor(4, pinned_nodes=[1, 5]), rotor(4)
    bow = {"kind": "bow", "node": 2, "bow_m": 1e-5}
    forces = [make_term("effect", bow, s, s.nodes).unknowns[0].entries[0].matrix for s in (held, free)]
    common = [free.dofs.index(place) for place in held.dofs]
    assert forces[1][common] == pytest.approx(forces[0], abs=1e-9 * np.abs(forces[0]).max())
    assert abs(forces[1][::2].sum()) < 1e-9 * np.abs(forces[1]).max()  # in balance: nothing holds it
    assert abs(forces[0][1:-1:2].sum()) > 1e-3 * np.abs(forces[0]).max()
    refused(lambda: make_term("effect", {**bow, "node": 5}, free, free.nodes), "node 5 is an end of the shaft")


def test_natural_frequencies_of_the_shaft_of_chapter_6():
    """On its bearings in x and in y, and on rigid ones; the printed 415.99 rad/s belongs to none of them."""
    moments = ((2, 0.7990, 6.8560e-3), (4, 0.7231, 5.6502e-3))
    discs = [disc(n, m, 2 * i, i) for n, m, i in moments]
    shaft = {"elements": [{"length_m": 0.45, "count": 4}], "outer_diameter_m": 0.015, "theory": "euler_bernoulli"}

    def first(*bearings, **supports):
        free = rotor(discs=discs, **shaft, **supports)
        items = [one for n, k in zip((1, 5), bearings, strict=False) for one in springs([n], k, 0.0)]
        terms = tuple(make_term("bearing", item, free, free.nodes) for item in items)
        return np.abs(eigenvalues(Model(free, terms), [1e-6])[0].imag).min()

    assert first(128592.0, 127788.0) == pytest.approx(283.4, abs=0.05)
    assert first(106788.0, 115788.0) == pytest.approx(270.0, abs=0.05)
    assert first(pinned_nodes=[1, 5]) == pytest.approx(447.9, abs=0.05)
    assert first(128592.0, 106788.0) != pytest.approx(283.4, abs=0.05)


def test_a_crack_in_an_element_is_that_element_made_softer():
    stretches = [{"length_m": 0.2}, {"length_m": 0.3}, {"length_m": 0.25}]
    softer = [stretches[0], {**stretches[1], "youngs_modulus_Pa": 0.9 * E}, stretches[2]]
    options = {"pinned_nodes": [1, 4], "youngs_modulus_Pa": E}
    sound, soft = rotor(elements=stretches, **options), rotor(elements=softer, **options)
    for element, same in ((2, True), (3, False)):
        ((name, (pattern, unit, _)),) = sound.stiffness_loss_at(element=element).items()
        assert (name, unit) == ("stiffness_loss", "1")
        assert np.allclose(sound.stiffness - 0.1 * pattern, soft.stiffness, rtol=1e-12) is same


LOSS = {"stiffness_loss_22_N_per_m": 1e5, "stiffness_loss_44_N_m": 9.0}


def test_a_crack_force_acts_in_its_element():
    shaft = rotor(4, pinned_nodes=[1, 5])
    forces = ({"kind": "crack_force", "element": n, "harmonics": [1], "stiffness_loss_p1": 0.1} for n in (2, 3))
    here, elsewhere = (make_term("effect", one, shaft, shaft.nodes).unknowns[0].entries[0].matrix for one in forces)
    assert np.array_equal(here, shaft.stiffness_loss_at(element=2)["stiffness_loss"][0])
    assert not np.allclose(here @ shaft.static_deflection, elsewhere @ shaft.static_deflection)


BAD_CRACKS = [
    (GOOD, LOSS, ["several places", "'node:' or 'element:'"]),
    (GOOD, {"node": 3, "element": 2, **LOSS}, ["several places"]),
    (GOOD, {"node": 9, **LOSS}, ["unknown node '9' in the crack"]),
    (GOOD, {"element": 5, "stiffness_loss": 0.1}, ["unknown element '5'", "known: 1, 2, 3, 4"]),
    (GOOD, {"element": 2, **LOSS}, ["unknown key 'stiffness_loss_22_N_per_m'", "stiffness_loss"]),
]


@pytest.mark.parametrize("shaft, crack, words", BAD_CRACKS, ids=range(len(BAD_CRACKS)))
def test_a_crack_needs_a_place_that_exists(shaft, crack, words):
    structure = build_model({"rotor": {"kind": "finite_element", **shaft}}).structure
    refused(lambda: make_term("crack", {"kind": "switching", **crack}, structure, structure.nodes), *words)


def test_a_node_that_a_support_holds_loses_no_stiffness_of_translation():
    assert list(rotor(4, pinned_nodes=[1, 5]).stiffness_loss_at(1)) == ["stiffness_loss_44"]
    assert list(rotor(4, pinned_nodes=[1, 5]).stiffness_loss_at(2)) == ["stiffness_loss_22", "stiffness_loss_44"]
    assert list(rotor(4, clamped_nodes=[1]).stiffness_loss_at(2)) == ["stiffness_loss_22", "stiffness_loss_44"]
    refused(lambda: rotor(4, clamped_nodes=[1]).stiffness_loss_at(1), "unknown node '1' in the crack")


def test_a_rotor_with_one_place_for_a_crack_needs_none_and_refuses_others():
    plain = build_model({"rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}}).structure
    crack = {"kind": "switching", "stiffness_loss_N_per_m": 1e5}
    unplaced, placed = (make_term("crack", item, plain, (1,)) for item in (crack, {**crack, "node": 1}))
    assert [e.matrix for e in unplaced.unknowns[0].entries] == [e.matrix for e in placed.unknowns[0].entries]
    for place in ({"node": 2}, {"element": 1}):
        refused(lambda: make_term("crack", {**crack, **place}, plain, (1,)), "cannot crack at")
