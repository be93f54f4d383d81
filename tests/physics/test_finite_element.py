"""The finite-element rotor against the other rotors of the plugin library, a textbook and the shaft of Chapter 6."""

import numpy as np
import pytest
from machines import OFFSET_DISC, disc, shaft, springs
from one_line_errors import refused
from uniform_shaft import LENGTH, E, rotor

from rotorstudy import Model, build_model, eigenvalues, harmonic_response, make_term, simulate_records
from rotorstudy.response.statics import static_deflection

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
