"""Cracks of a finite-element shaft: in an element or at a node, refused where there is no such place."""

from dataclasses import replace

import numpy as np
import pytest
from machines import disc, shaft
from uniform_shaft import ANISOTROPIC, GOOD, E, rotor

from rotorstudy import Model, RotorstudyError, build_model, harmonic_response, make_term, time_response
from rotorstudy.response.coupling import forced_harmonics


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


def test_two_cracks_are_told_apart_by_label_and_the_crack_force_acts_where_they_are():
    shaft = rotor(4, pinned_nodes=[1, 5])
    cracks = [
        {"kind": "switching", "label": "left", "element": 2, "stiffness_loss": 0.1},
        {
            "kind": "switching",
            "label": "right",
            "node": 4,
            "stiffness_loss_22_N_per_m": 1e5,
            "stiffness_loss_44_N_m": 9.0,
        },
    ]
    terms = [make_term("crack", crack, shaft, shaft.nodes) for crack in cracks]
    model = Model(shaft, tuple(terms))
    assert model.names == ("stiffness_loss[left]", "stiffness_loss_22[right]", "stiffness_loss_44[right]")
    forces = [
        {"kind": "crack_force", "element": 2, "harmonics": [1], "stiffness_loss_p1": 0.1},
        {"kind": "crack_force", "element": 3, "harmonics": [1], "stiffness_loss_p1": 0.1},
    ]
    here, elsewhere = (make_term("effect", force, shaft, shaft.nodes).unknowns[0].entries[0].matrix for force in forces)
    deflection = shaft.static_deflection
    assert np.array_equal(here, shaft.stiffness_loss_at(element=2)["stiffness_loss"][0])
    assert not np.allclose(here @ deflection, elsewhere @ deflection)


def test_harmonics_and_time_integration_agree_for_a_cracked_shaft_on_anisotropic_bearings():
    rig = {
        "rotor": shaft(0.4, 2, disc(2, 2.0, 0.004, 0.002)),
        "cracks": [{"kind": "switching", "order": 1, "element": 1, "weight_dominance": False, "stiffness_loss": 0.1}],
        "bearings": [{"kind": "linear", "node": node, "label": str(node), **ANISOTROPIC} for node in (1, 3)],
        "effects": [
            {"kind": "shaft_damping", "shaft_damping_s": 2e-5},
            {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": 300.0},
            {"kind": "unbalance", "node": 2, "mass_kg": 2.0, "eccentricity_m": 1e-5},
        ],
    }
    model, speed = build_model(rig), 150.0
    harmonics = forced_harmonics(model, order=21)
    amplitude = harmonic_response(model, [speed], harmonics, order=21)[0]
    time = np.linspace(0, 2 * np.pi / speed, 9)[1:]

    def motion(at):
        turning = np.exp(1j * np.outer(at, harmonics) * speed)
        return turning @ amplitude, turning @ (1j * harmonics[:, None] * speed * amplitude)

    start = tuple(part[0] for part in motion(np.array([0.0])))
    found = time_response(model, speed, time, start=start)
    size = np.abs(found).max()
    assert np.abs(found - motion(time)[0]).max() < 1e-5 * size  # harmonics beyond 21
    sound = replace(model, terms=tuple(term for term in model.terms if term.kind != "switching"))
    assert np.abs(time_response(sound, speed, time, start=start) - found).max() > 1e-3 * size


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
    with pytest.raises(RotorstudyError) as refused:
        make_term("crack", {"kind": "switching", **crack}, structure, structure.nodes)
    for word in words:
        assert word in str(refused.value)


def test_a_node_that_a_support_holds_loses_no_stiffness_of_translation():
    assert list(rotor(4, pinned_nodes=[1, 5]).stiffness_loss_at(1)) == ["stiffness_loss_44"]
    assert list(rotor(4, pinned_nodes=[1, 5]).stiffness_loss_at(2)) == ["stiffness_loss_22", "stiffness_loss_44"]
    assert list(rotor(4, clamped_nodes=[1]).stiffness_loss_at(2)) == ["stiffness_loss_22", "stiffness_loss_44"]
    with pytest.raises(RotorstudyError, match="unknown node '1' in the crack"):
        rotor(4, clamped_nodes=[1]).stiffness_loss_at(1)


def test_a_rotor_with_one_place_for_a_crack_needs_none_and_refuses_others():
    plain = build_model({"rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}}).structure
    crack = {"kind": "switching", "stiffness_loss_N_per_m": 1e5}
    unplaced, placed = (make_term("crack", item, plain, (1,)) for item in (crack, {**crack, "node": 1}))
    assert [e.matrix for e in unplaced.unknowns[0].entries] == [e.matrix for e in placed.unknowns[0].entries]
    for place in ({"node": 2}, {"element": 1}):
        with pytest.raises(RotorstudyError, match="cannot crack at"):
            make_term("crack", {**crack, **place}, plain, (1,))
