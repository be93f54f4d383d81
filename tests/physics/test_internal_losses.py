"""What the shaft loses inside is no force from outside: no net force, no net moment, nothing on a rigid motion."""

import numpy as np
import pytest
from one_line_errors import refused
from shaft_with_a_crack import crack
from test_transverse_crack import LAWS, NAMES, OF_ANGLE

from rotorstudy import build_model, make_term, registry
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.settings import Settings

STRETCHES = [{"length_m": 0.3, "count": 2}, {"length_m": 0.5, "count": 1, "outer_diameter_m": 0.03}]
FREE = {"kind": "finite_element", "elements": STRETCHES, "outer_diameter_m": 0.02}
FREE["discs"] = [{"node": 2, "mass_kg": 2.0, "polar_moment_kg_m2": 0.005, "diametral_moment_kg_m2": 0.0025}]
POSITIONS = np.array([0.0, 0.15, 0.3, 0.8])
RIGID = np.array([np.kron(np.ones(4), [1, 0]), np.kron(POSITIONS, [1, 0]) + np.kron(np.ones(4), [0, 1])]).T
INSIDE = ("breathing_crack", "breathing_crack_weight", "internal_damping")
ROUND_OFF = 1e-12


def outside(structure, **effect):
    """Largest net force or moment, and force on a rigid motion, of a loss, relative to its largest stiffness."""
    term = make_term("effect", effect, structure, structure.nodes)
    matrices = [np.asarray(e.matrix) for unknown in term.unknowns for e in unknown.entries if not e.is_constant]
    matrices += [u.force.matrix.T @ u.force.matrix for u in term.unknowns if u.force]
    return max(
        np.abs(part).max() / np.abs(matrix).max() for matrix in matrices for part in (RIGID.T @ matrix, matrix @ RIGID)
    )


@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
@pytest.mark.parametrize("effect", INSIDE)
def test_a_loss_in_an_element_is_internal(effect, theory):
    structure = build_model({"rotor": {**FREE, "theory": theory}}).structure
    for element in (1, 2, 3):
        assert outside(structure, kind=effect, element=element) < ROUND_OFF
    assert outside(structure, kind=effect, node=2) > 0.1  # the thesis's form holds the shaft from outside


@pytest.mark.parametrize("law", (*LAWS, *OF_ANGLE), ids=[*NAMES, "cosine", "turning"])
def test_a_transverse_crack_is_internal(law):
    assert outside(build_model({"rotor": FREE}).structure, **crack(**law)) < ROUND_OFF


@pytest.mark.parametrize("effect", ["internal_damping", "shaft_asymmetry"])
def test_a_stretch_is_the_sum_of_its_elements(effect):
    structure = build_model({"rotor": FREE}).structure

    def matrices(place):
        entries = make_term("effect", {"kind": effect, **place}, structure, structure.nodes).unknowns[0].entries
        return np.array([e.matrix for e in entries])

    both = matrices({"element": 2, "last_element": 3})
    assert np.array_equal(both, matrices({"element": 2}) + matrices({"element": 3}))
    assert outside(structure, kind=effect, element=2, last_element=3) < ROUND_OFF
    refused(lambda: matrices({"element": 2, "last_element": 1}), "last_element 1 lies before element 2")


def test_every_rotor_on_free_ends_cracks_in_its_elements_only():
    """A rotor with one place has its rigid bearings in its stiffness: what the crack loses they take."""
    for plugin in registry().plugins["rotor"].values():
        structure = plugin.function(**plugin.example)
        places = structure.crack_places()
        if structure.is_supported:
            assert places == [{}]
        else:
            assert places and all(set(place) == {"element"} for place in places)


def test_no_hypothesis_loses_stiffness_or_damping_at_a_node():
    hollow = {**FREE, "inner_diameter_m": 0.005}  # a crack in a solid shaft is a kink at any position, not a loss
    found, _ = candidates(build_model({"rotor": hollow}), Settings())
    inside = [c for c in found if c.effect in INSIDE]
    assert {c.effect for c in inside} == {"breathing_crack", "internal_damping"}
    assert all({"element"} <= set(c.where) <= {"element", "last_element"} for c in inside)
