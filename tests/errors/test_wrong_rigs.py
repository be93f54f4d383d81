"""A wrong rig file: one line that says what was wrong with which value, where, what is allowed, and what to do."""

import pytest
from machines import jeffcott_rig
from one_line_errors import DROP, changed, refused

from rotorstudy import build_model, load_rig, measured_response
from rotorstudy.studies.config import load_study

RIG = jeffcott_rig(5e-6, 0.5, cracks=[{"kind": "switching", "stiffness_loss_N_per_m": 2.5e5}])


def rig(*path, to):
    return changed(RIG, path, to)


def also(**effect):
    """The effects of the rig and another one."""
    return [*RIG["effects"], effect]


def test_the_rig_itself_is_right():
    assert build_model(RIG).sensors == (1,)
    assert build_model(rig("sensors", to=[1])).sensors == (1,)


@pytest.mark.parametrize(
    ("path", "to", "words"),
    [
        (("rotor", "kind"), "jefcott", ["unknown rotor 'jefcott'", "did you mean 'jeffcott'", "rig.yaml, rotor"]),
        (("cracks", 0, "kind"), "swich", ["unknown crack 'swich'", "switching", "rig.yaml, cracks[0]"]),
        (("effects", 1, "kind"), "unbalanced", ["unknown effect", "'unbalance'", "effects[1]"]),
        (("effects", 1, "kind"), "linear", ["unknown effect 'linear' in", "effects[1]", "is of the kind bearing"]),
        (("effects", 1, "kind"), DROP, ["key 'kind' is missing", "effects[1]"]),
        (("rotor", "kind"), DROP, ["key 'kind' is missing", "rotor"]),
        (("rotor",), DROP, ["section 'rotor' is missing", "rig.yaml"]),
        (("rotor", "mass_kg"), DROP, ["key 'mass_kg' is missing", "rig.yaml, rotor"]),
        (("rotor", "mass_kg"), -2.0, ["mass_kg = -2.0", "greater than 0"]),
        (("rotor", "mass_kg"), 0, ["mass_kg = 0", "greater than 0"]),
        (("rotor", "mass_kg"), "heavy", ["mass_kg = 'heavy'", "number"]),
        (("rotor", "mass_kg"), float("nan"), ["mass_kg = nan"]),
        (("rotor", "mass_kg"), float("inf"), ["mass_kg = inf"]),
        (("rotor", "stiffness_N_per_m"), -1.0, ["stiffness_N_per_m = -1.0", "greater than 0"]),
        (("rotor", "stiffnes_N_per_m"), 1.0, ["unknown key 'stiffnes_N_per_m'", "did you mean 'stiffness_N_per_m'"]),
        (("cracks", 0, "stiffness_loss_N_per_m"), "2.5e5", ["'2.5e5'", "without quotes"]),
        (("cracks", 0, "stiffness_loss"), 1.0, ["unknown key 'stiffness_loss'", "'stiffness_loss_N_per_m'"]),
        (("cracks", 0, "order"), -3, ["order = -3", "greater than or equal to 1"]),
        (("effects", 1, "eccentricity_mm"), 1.0, ["did you mean 'eccentricity_m' (its end is its unit)?"]),
        (("effects", 1, "eccentricity_m"), DROP, ["eccentricity_phase_rad", "no magnitude", "eccentricity_m"]),
        (("effects", 1, "eccentricity_m"), float("nan"), ["eccentricity_m = nan", "finite"]),
        (("effects", 0, "external_damping_N_s_per_m"), DROP, ["no value for external_damping"]),
        (("effects", 1, "node"), 3, ["unknown node '3' in the rotor", "known: 1"]),
        (("sensors",), [2], ["node 2", "does not exist", "[1]"]),
        (("bearing",), [], ["unknown section 'bearing'", "did you mean 'bearings'"]),
        (("effects", 0), RIG["effects"][1], ["'eccentricity_real'", "label"]),
        (("effects",), {"kind": "unbalance"}, ["effects", "list"]),
        (("rotor",), "jeffcott", ["rotor", "kind"]),
        (("sensors",), 1, ["rig.yaml", "sensors"]),
        (("sensors",), [1, 1], ["sensors", "1"]),  # twice the data that there are
        (("rotor", "kind"), ["jeffcott"], ["rig.yaml, rotor", "kind"]),
        (
            ("rotor",),
            {"kind": "finite_element", "elements": [{"length_m": 0, 35: None}]},  # {length_m: 0,35}
            ["35 is no key", "0.35 and not 0,35"],
        ),
        (("effects", 0, "kind"), {}, ["rig.yaml, effects[0]", "kind"]),
        (("effects", 0), "unbalance", ["rig.yaml, effects[0]", "kind"]),
        (("effects", 0, "node"), "one", ["node = 'one'", "effects[0]", "integer"]),
        (("effects", 0, "node"), 1.5, ["node = 1.5", "effects[0]"]),
        (("effects",), also(kind="runout", node=4, runout_1X_m=1e-6), ["node", "4", "known: 1"]),
        (("effects",), also(kind="sensor_gap", node=4, sensor_gap_m=1e-3), ["node", "4", "known: 1"]),
        (("effects",), also(kind="bow", node=4, bow_m=1e-3), ["node '4'", "known: 1"]),
        (("rotor", "mass_kg"), True, ["mass_kg = True", "rig.yaml, rotor", "number"]),  # YAML reads yes as True
        (("rotor", "mass_kg"), None, ["mass_kg = None", "number"]),
        (("rotor", "gravity_m_per_s2"), -1.0, ["gravity_m_per_s2 = -1.0", "greater than or equal to 0"]),
        (("effects", 0, "external_damping_N_s_per_m"), True, ["external_damping_N_s_per_m = True", "number"]),
        (("effects", 0, "external_damping_N_s_per_m"), [1.0], ["= [1.0]", "effects[0]", "number"]),
        (("effects", 0, "external_damping_N_s_per_m"), None, ["= None", "effects[0]", "number"]),
        (("effects", 1, "eccentricity_phase_rad"), float("inf"), ["eccentricity_phase_rad = inf", "finite"]),
        (
            ("effects",),
            also(kind="crack_force", participation=[1, 2]),
            ["participation = [1, 2]", "effects[2]", "dict"],
        ),
        (("effects",), also(kind="crack_force", harmonics=[1, 1]), ["stiffness_loss_p1"]),
        (("effects",), also(kind="couple_unbalance", node=1), ["effects[2]", "no tilt coordinates", "'places='"]),
        ((1,), 2, ["unknown section '1'", "known: bearings, cracks"]),
    ],
    ids=lambda part: ".".join(map(str, part)) if isinstance(part, tuple) else "",
)
def test_a_wrong_rig_is_refused(path, to, words):
    refused(lambda: measured_response(build_model(rig(*path, to=to), "rig.yaml"), [88.0], [0, 1]), *words)


SHAFT = {"kind": "finite_element", "elements": [{"length_m": 1.0, "count": 4}], "outer_diameter_m": 0.05,
         "pinned_nodes": [1, 5]}  # fmt: skip
DISC = {"node": 3, "mass_kg": 1.0, "polar_moment_kg_m2": 0.1, "diametral_moment_kg_m2": 0.05}
CYLINDER = {"node": 3, "thickness_m": 0.02, "diameter_m": 0.3}
STRETCH = {"length_m": 1.0, "count": 4}
OF_SHAFTS = [
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


@pytest.mark.parametrize("wrong, words", OF_SHAFTS, ids=lambda value: str(value)[:40])
def test_a_wrong_shaft_of_finite_elements_is_refused(wrong, words):
    build_model({"rotor": {**SHAFT, "discs": [DISC]}})
    refused(lambda: build_model({"rotor": {**SHAFT, **wrong}}), *words)


def test_a_rig_that_is_empty_or_nothing_is_refused():
    refused(lambda: build_model({}, "rig.yaml"), "section 'rotor' is missing in rig.yaml")
    refused(lambda: build_model(None, "rig.yaml"), "rig.yaml")


def test_a_label_tells_two_of_a_kind_apart_and_a_section_may_be_empty():
    second = also(kind="unbalance", label="second", eccentricity_m=1e-6)
    assert "eccentricity[second]_real" in build_model(rig("effects", to=second)).names
    assert build_model({"rotor": RIG["rotor"], "effects": None}).names == ()


def test_an_answer_does_not_offer_what_was_given_nor_an_empty_list():
    assert "did you mean '1'" not in refused(lambda: build_model(rig("sensors", to=["1"])))
    assert "(of )" not in refused(lambda: build_model({"rotor": RIG["rotor"]}).unknown_names())


@pytest.mark.parametrize(
    ("value", "said"), [("5.0e6", True), ("0.5", True), ("small", False), ("nan", False), ("inf", False)]
)
def test_a_number_in_quotes_is_told_to_be_written_without_them(value, said):
    quoted = rig("effects", 1, "eccentricity_m", to=value)
    assert ("without quotes" in refused(lambda: build_model(quoted), f"eccentricity_m = {value!r}")) == said


def test_files_that_are_folders_or_missing_are_refused(tmp_path):
    for load in (load_rig, load_study):
        refused(lambda load=load: load(tmp_path), str(tmp_path))
        refused(lambda load=load: load(tmp_path / "none.yaml"), "none.yaml", "does not exist")


def test_a_parameter_without_its_label_is_that_of_all_labels_and_a_wrong_name_is_refused():
    unbalances = [{"kind": "unbalance", "label": label, "eccentricity_m": 1e-6} for label in "ab"]
    model = build_model({"rotor": RIG["rotor"], "effects": unbalances})
    assert model.unknown_names(["eccentricity"]) == model.names
    assert model.unknown_names(["eccentricity[b]"]) == model.names[2:]
    refused(lambda: model.unknown_names(["excentricity"]), "unknown parameter 'excentricity'", "eccentricity")
