"""Cracks of a finite-element shaft: in an element or at a node, refused where there is no such place."""

import numpy as np
import pytest
from one_line_errors import refused
from uniform_shaft import GOOD, E, rotor

from rotorstudy import build_model, make_term


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
