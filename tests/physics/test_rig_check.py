"""`rotorstudy check` of a rig: its numbers are right, each oddity is found, and a sound rig has none."""

import json
import re

import numpy as np
import pytest
import yaml
from machines import disc, film, point, rig_of, shaft, springs
from one_line_errors import changed

from rotorstudy import harmonic_response
from rotorstudy.commands.line import main
from rotorstudy.studies.rig_check import check_rig

pytestmark = pytest.mark.usefixtures("few_speeds")

PROBES = [{"channel": name, "node": 2, "angle_deg": angle} for name, angle in (("x", 45.0), ("y", 135.0))]
SOUND = rig_of(
    shaft(0.6, 4, disc(3, 3.1, 0.0087, 0.0045), outer_diameter_m=0.03), springs({1: "a", 5: "b"}, 1e7, 2000.0),
    {"kind": "unbalance", "node": 3, "unbalance_g_mm": 30.0}, sensors=[2], measurement={"probes": PROBES}
)  # fmt: skip
FILM = film(0.03, 0.012, 4.5e-5, 0.02)


MISSPELT = {("radial_clearance_mm" if key == "radial_clearance_m" else key): FILM[key] for key in FILM} | {"node": 1}


def films(**first):
    return [{**FILM, "node": 1, "label": "a", **first}, {**FILM, "node": 5, "label": "b"}]


def table(highest):
    return {"kind": "speed_tabulated", "speeds_rad_per_s": [10.0, highest],
            "stiffness_N_per_m": {"xx": [1e7, 1e7], "yy": [1e7, 1e7]},
            "damping_N_s_per_m": {"xx": [2e3, 2e3], "yy": [2e3, 2e3]}}  # fmt: skip


def check(rig, folder):
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(rig))
    return path, check_rig(path)


def test_a_sound_rig_has_no_findings_and_the_right_numbers(tmp_path, command):
    """Half the weight on each bearing; disc and 17/35 of the shaft on 48 E I / L^3 and bearings in series, to 3 %."""
    path, found = check(SOUND, tmp_path)
    assert found.findings == []
    shaft = 7850 * np.pi / 4 * 0.03**2 * 0.6
    stiffness = 48 * 2.1e11 * np.pi / 64 * 0.03**4 / 0.6**3
    closed = np.sqrt(1 / (1 / stiffness + 1 / 2e7) / (3.1 + 17 / 35 * shaft))
    assert min(one.speed for one in found.analysis.criticals) == pytest.approx(closed, rel=0.03)
    assert [load.force.real for load in found.analysis.loads] == pytest.approx([9.81 / 2 * (3.1 + shaft)] * 2, rel=1e-9)
    assert command("check", path).out.endswith("0 errors, 0 warnings, 0 notes\n")


ODD = [
    (["rotor", "youngs_modulus_Pa"], 2.1e5, "units", "factor of a million"),  # N/mm2
    (["rotor", "density_kg_per_m3"], 7.85, "units", "steel has 7850"),  # g/cm3
    (["rotor", "youngs_modulus_Pa"], 7e10, "material", "density_kg_per_m3 is taken to be that of steel"),
    (["rotor", "density_kg_per_m3"], 2700.0, "material", "youngs_modulus_Pa is taken to be that of steel"),
    (["rotor", "outer_diameter_m"], 30.0, "units", "larger than meant by a factor of 1000"),
    (["effects", 0, "eccentricity_phase_rad"], 90.0, "units", "for degrees write eccentricity_phase_deg"),
    (["rotor", "discs", 0, "mass_kg"], 3100.0, "disc", "heavier than plausible"),
    (["rotor", "discs", 0, "polar_moment_kg_m2"], 8.7, "moments of inertia", "no rigid body"),
    (["rotor", "discs", 0, "diametral_moment_kg_m2"], 0.2, "disc", "density"),
    (["bearings", 0, "bearing_stiffness_N_per_m"], 1e4, "static deflection", "softer"),
    (["bearings", 0, "bearing_stiffness_N_per_m"], 100.0, "units", "100 N/um are 1e8"),
    (["measurement", "probes", 1, "angle_deg"], 225.0, "probe angles", "one direction"),
    (["measurement", "probes", 1, "sensitivity_V_per_m"], 200.0, "sensitivity", "200 mV/mil or 7.874 V/mm are 7874"),
    (["diagnosis"], {"uncertainty": {"bearing_stiffness": 10}}, "uncertainty", "10 % are 0.1"),
    (["bearings"], films(radial_clearance_m=4.5e-2), "film clearance", "larger than in any machine"),
    (["bearings"], films(load_N=69.0), "load_N", "the weight of the rotor loads this bearing by"),
    (["bearings"], films(length_m=12e-6), "film pressure", "Pa; 1e4"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "name", "words"), ODD, ids=[f"{o[0][-1]}-{o[2]}" for o in ODD])
def test_each_oddity_is_found(path, value, name, words, tmp_path):
    found = check(changed(SOUND, path, value), tmp_path)[1].findings
    assert any(f.name == name and words in f.text and f.severity == "warning" for f in found), found


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["bearings", 1, "node"], 21, "unknown node '21' in"),
        (["effects", 0, "unbalance_gmm"], 30, "did you mean 'unbalance_g_mm'"),
        (["effects", 0, "eccentricity_phase_deg"], "30 deg", "eccentricity_phase_deg = '30 deg'"),
        (["bearings", 0], MISSPELT, "'radial_clearance_mm' is none of its keys"),
        (["measurement", "gravity_angle"], 180, "did you mean 'gravity_angle_deg'"),
        (["rotor", "elements"], [], "elements"),
        (["rotor", "discs", 0, "node"], 9, "node"),
        (["measurement", "probes", 0, "node"], 9, "probe 'x'"),
        (["diagnosis"], {"uncertainty": {"bearing_stifness": 0.1}}, "bearing_stiffness"),
        (["bearings"], [], "do not hold"),
        (["bearings"], [{**table(500.0), "node": 1}, {**table(9e3) | {"speeds_rad_per_s": [600.0, 9e3]}, "node": 5,
                                                      "label": "b"}], "no speed"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_error_in_the_words_of_the_file_and_the_status(path, value, words, tmp_path, command):
    rig, found = check(changed(SOUND, path, value), tmp_path)
    (error,) = found.errors
    printed = json.loads(command("check", rig, "--json", status=1).out)
    assert words in error.text and error.text in [one["text"] for one in printed["findings"]] and printed["errors"] == 1


def test_a_rig_that_is_not_valid_is_told_its_implausible_numbers_too(tmp_path):
    broken = changed(SOUND, ["bearings", 1, "node"], 21)
    broken["rotor"]["outer_diameter_m"] = 30.0
    assert {one.name for one in check(broken, tmp_path)[1].findings} == {"not valid", "units"}


def test_a_material_that_is_stated_is_no_oddity(tmp_path):
    """Of the rotor, or of a stretch, whose modulus alone is one as before."""
    aluminium = {"youngs_modulus_Pa": 7e10, "density_kg_per_m3": 2700.0}
    rotor = SOUND["rotor"]
    for sound in ({**rotor, **aluminium}, {**rotor, "elements": [{**rotor["elements"][0], **aluminium}]}):
        assert not {"material"} & {one.name for one in check({**SOUND, "rotor": sound}, tmp_path)[1].findings}
    odd = {**rotor, "elements": [{**rotor["elements"][0], "youngs_modulus_Pa": 7e10}]}
    assert "material" in {one.name for one in check({**SOUND, "rotor": odd}, tmp_path)[1].findings}


def test_a_film_in_order_is_only_told_its_load(tmp_path):
    found = check(changed(SOUND, ["bearings"], films()), tmp_path)[1].findings
    assert {(f.severity, f.name) for f in found} <= {("note", "load_N"), ("note", "stability")}
    assert sum("by default" in f.text for f in found) == 2


DAMPER = {"kind": "squeeze_film", **{key: FILM[key] for key in FILM if key != "kind"}, "eccentricity_ratio": 0.2,
          "centring_stiffness_N_per_m": 5e6}  # fmt: skip


@pytest.mark.parametrize("kind", [FILM, DAMPER], ids=lambda one: one["kind"])
def test_an_orbit_of_a_third_of_a_film_is_told(kind, tmp_path):
    """The orbit is proportional to the unbalance; the negative control is one just below the third."""

    def checked(unbalance):
        rig = changed(SOUND, ["bearings"], [{**kind, "node": 1, "label": "a"}, {**kind, "node": 5, "label": "b"}])
        rig["effects"][0]["unbalance_g_mm"] = unbalance
        return check(rig, tmp_path)[1]

    found = checked(30.0)
    response = harmonic_response(found.model, found.analysis.data.response_speed.values, (1, -1))
    ends = [found.model.structure.index(node) for node in (1, 5)]
    limit = float(30.0 * FILM["radial_clearance_m"] / 3 / np.abs(response[..., ends]).sum(axis=1).max())
    told = [[one.name for one in checked(share * limit).findings] for share in (0.98, 1.02)]
    assert "orbit in a film" not in told[0] and "orbit in a film" in told[1]


def test_a_probe_at_a_node_of_a_mode_is_told(tmp_path):
    """On soft bearings a symmetrical rotor rocks about its middle in its second mode."""
    rig = changed(SOUND, ["sensors"], [3])
    rig["measurement"]["probes"] = [{"channel": "x", "node": 3, "angle_deg": 0.0}]
    for bearing in rig["bearings"]:
        bearing |= {"bearing_stiffness_N_per_m": 3e5, "bearing_damping_N_s_per_m": 100.0}
    found = [f for f in check(rig, tmp_path)[1].findings if f.name == "probe at a nodal point"]
    assert found and all(f.severity == "warning" and "node 3" in f.text for f in found)
    assert all("(0 % of its largest motion" in f.text for f in found)  # and not the round-off of its mode


def test_speeds_end_where_a_table_does(tmp_path):
    """The ends of a table to the 1e-9 that 30 halvings leave; whirl is then computed up to there."""
    bearings = [{**table(500.0), "node": 1, "label": "a"}, {**table(400.0), "node": 5, "label": "b"}]
    found = check(changed(SOUND, ["bearings"], bearings), tmp_path)[1]
    assert found.valid == pytest.approx((10.0, 400.0), rel=1e-6) and found.findings == []
    assert float(found.analysis.data.speed[-1]) <= 400.0


def test_a_rig_with_unknowns_is_checked_as_far_as_it_goes(tmp_path):
    found = check(changed(SOUND, ["effects", 0], {"kind": "unbalance", "node": 3}), tmp_path)[1]
    assert [f.name for f in found.findings] == ["unknown"] and found.analysis is None


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize(("damping", "listed", "hidden"), [(300.0, 1, 0), (6000.0, 0, 2)])
def test_check_and_analyse_list_the_same_critical_speeds(damping, listed, hidden, tmp_path, capsys):
    """Both leave out those that are overdamped, and say how many."""
    own = {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": damping}
    path, found = check({**SOUND, "effects": [*SOUND["effects"], own]}, tmp_path)
    assert (len(found.analysis.resonant), len(found.analysis.criticals)) == (listed, listed + hidden)
    main(["check", str(path)])
    checked = capsys.readouterr().out
    main(["analyse", str(path), "--out", str(tmp_path / "analysis")])
    analysed = capsys.readouterr().out
    speeds = re.findall(r"critical speed: (\S+) rpm", checked)
    assert re.findall(r"(\S+) rpm \(", analysed) == speeds and len(speeds) == listed
    for told in (checked, analysed):
        assert ("2 more are overdamped" in told) == bool(hidden)


def test_what_drives_an_instability_is_named_and_not_the_damping_that_it_overcomes(tmp_path):
    """Which is larger than either of the two that drive it."""
    effects = [{"kind": "external_damping", "external_damping_N_s_per_m": 60.0}]
    effects += [{"kind": "internal_damping", "internal_damping_N_s_per_m": 60.0}]
    effects += [{"kind": "cross_coupling", "cross_coupling_N_per_m": 1e4}]
    found = check(rig_of(point(2.0, 7.6e5), [], *effects), tmp_path)[1].findings
    (said,) = (one.text for one in found if one.name == "stability")
    assert said.endswith("most of all by internal_damping")
