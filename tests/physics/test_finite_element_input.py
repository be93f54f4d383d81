"""Wrong options of the finite-element rotor are refused with what is allowed."""

import pytest
from one_line_errors import refused
from uniform_shaft import GOOD

from rotorstudy import build_model

DISC = {"node": 3, "mass_kg": 1.0, "polar_moment_kg_m2": 0.1, "diametral_moment_kg_m2": 0.05}
CYLINDER = {"node": 3, "thickness_m": 0.02, "diameter_m": 0.3}
STRETCH = {"length_m": 1.0, "count": 4}
BAD = [
    ({"elements": []}, ["elements = []", "at least 1"]),
    ({"elements": [{"length_m": 0.0}]}, ["length_m = 0.0", "elements[0]", "greater than 0"]),
    ({"elements": [{"length_m": -1.0}]}, ["length_m = -1.0", "elements[0]", "greater than 0"]),
    ({"elements": [{"lenght_m": 1.0}]}, ["'length_m' is missing in", "elements[0]", "did you mean 'length_m'?"]),
    ({"elements": [{"length_m": "1e0"}]}, ["length_m = '1e0'", "elements[0]", "without quotes"]),
    ({"elements": [{"length_m": 1.0, "count": 0}]}, ["count = 0", "elements[0]", "greater than or equal to 1"]),
    ({"elements": [{"length_m": 1.0, "count": 2.5}]}, ["count = 2.5", "elements[0]", "integer"]),
    ({"elements": {"length_m": 1.0}}, ["elements", "list"]),
    ({"outer_diameter_m": None}, ["give outer_diameter_m of the rotor, or of each of the elements"]),
    ({"inner_diameter_m": 0.05}, ["inner_diameter_m = 0.05 must be smaller than outer_diameter_m = 0.05"]),
    ({"inner_diameter_m": -0.01}, ["inner_diameter_m = -0.01", "greater than or equal to 0"]),
    ({"poissons_ratio": 0.6}, ["poissons_ratio = 0.6", "less than or equal to 0.5"]),
    ({"discs": [{**DISC, "node": 6}]}, ["unknown node '6' in discs", "known: 1, 2, 3, 4, 5"]),
    ({"discs": [{**DISC, "node": 0}]}, ["unknown node '0' in discs"]),
    ({"discs": [{**DISC, "mass_kg": -1.0}]}, ["mass_kg = -1.0", "discs[0]"]),
    ({"discs": [{"node": 3}]}, ["disc at node 3", "give mass_kg, polar_moment_kg_m2", "or thickness_m and diameter_m"]),
    ({"discs": [{**DISC, "thickness_m": 0.1}]}, ["disc at node 3", "not a mixture"]),
    ({"discs": [{**DISC, "density_kg_per_m3": 7e3}]}, ["disc at node 3", "not a mixture"]),
    ({"discs": [{**CYLINDER, "bore_m": 0.3}]}, ["disc at node 3: bore_m = 0.3 must be smaller than diameter_m = 0.3"]),
    ({"shear_modulus_Pa": 8e10, "poissons_ratio": 0.3}, ["shear_modulus_Pa = 8e+10", "poissons_ratio = 0.3", "one of"]),
    ({"shear_modulus_Pa": 8e9}, ["shear_modulus_Pa = 8e+09", "Poisson's ratio of 12.1", "from 0 to 0.5"]),
    ({"elements": [{**STRETCH, "end": {"inner_diameter_m": 0.05}}]}, ["0.05 must be smaller than outer_diameter_m"]),
    ({"elements": [{**STRETCH, "end": {"outer": 0.05}}]}, ["'end.outer'", "elements[0]", "end.outer_diameter_m"]),
    ({"elements": [{**STRETCH, "layers": [{"outer_diameter_m": 0.1}]}]}, ["inner_diameter_m", "elements[0].layers[0]"]),
    ({"point_masses": [{"node": 9, "mass_kg": 1.0}]}, ["unknown node '9' in point_masses"]),
    ({"point_masses": [DISC]}, ["unknown key 'polar_moment_kg_m2'", "point_masses[0]"]),
    ({"pinned_nodes": [7]}, ["unknown node '7' in pinned_nodes"]),
    ({"clamped_nodes": [-1]}, ["unknown node '-1' in clamped_nodes"]),
    ({"clamped_nodes": [1, 2, 3, 4, 5]}, ["fix every node"]),
    ({"theory": "reddy"}, ["theory = 'reddy'", "'timoshenko' or 'euler_bernoulli'"]),
    ({"gyroscopic_sign": 0}, ["gyroscopic_sign = 0"]),
    ({"speed": 1.0}, ["unknown key 'speed'"]),
]


@pytest.mark.parametrize("wrong, words", BAD, ids=lambda value: str(value)[:40])
def test_bad_input_is_refused(wrong, words):
    build_model({"rotor": {"kind": "finite_element", **GOOD, "discs": [DISC]}})
    refused(lambda: build_model({"rotor": {"kind": "finite_element", **GOOD, **wrong}}), *words)
