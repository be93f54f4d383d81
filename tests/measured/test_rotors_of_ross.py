"""A rotor saved by ROSS, read as a rig, vibrates as ROSS says. Files and results were written by ROSS 1.5, 2.0 and 2.3.

The axes of ROSS are turned by 90 degrees against those of a rig: z here is j (x + j y) of ROSS, and so is the phase of
an unbalance, which counts from x in both.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import yaml
from one_line_errors import refused

from rotorstudy import build_model, harmonic_response, load_rig
from rotorstudy.authoring.ross_model import read_ross
from rotorstudy.response.whirl import critical_speeds, damped_modes, time_invariant

FILES = Path(__file__).parent / "ross"
RESULTS = json.loads((FILES / "ross_results.json").read_text())
NODES = {"machine": [1, 2, 3, 4, 5, 6], "cone": [1, 9, 10, 11, 12, 13]}  # here, of the nodes 0 to 5 of ROSS
ROUND_OFF = 1e-8  # of eigenvalues, relative
CONE = 4e-3  # frequencies of ROSS, with one element for a cone, are higher by 0.1 to 0.3 % than those of 32 cylinders


def model_of(path, case="machine"):
    sections = read_ross(path).sections
    unbalance = {"kind": "unbalance", "node": NODES[case][2], "unbalance_kg_m": 3e-5}
    sections["effects"][-1] = {**unbalance, "eccentricity_phase_rad": 0.4 + np.pi / 2}
    return build_model(sections)


def harmonics_of(along_x, along_y):
    """(speed, harmonic, node) m, from the real and imaginary parts of ROSS along its axes (part, node, speed)."""
    x, y = (np.array(real) + 1j * np.array(imaginary) for real, imaginary in (along_x, along_y))
    return np.transpose(np.stack([1j * (x + 1j * y) / 2, 1j * np.conj(x - 1j * y) / 2]), (2, 0, 1))


def distance(found, known):
    """Largest relative distance of some frequencies from the nearest of ROSS, which also has axial ones."""
    return max(np.abs(np.array(known) - one).min() / one for one in found)


@pytest.mark.parametrize("name", ["ross_2_3_0.toml", "ross_2_0_0.json", "ross_1_5_0.toml"])
def test_whirl_critical_speeds_and_response_are_those_of_ross(name):
    model, known = model_of(FILES / name), RESULTS["machine"]
    still = time_invariant(model)
    for speed, whirl in known["whirl_rad_s"].items():
        assert distance(damped_modes(still, [float(speed)], 5).frequency[0], whirl) < ROUND_OFF
    found = critical_speeds(still, 1200.0, speeds=np.linspace(50, 1200, 100))[0]
    assert len(found) >= 2 and distance(found, known["critical_rad_s"]) < 1e-5  # to which ROSS iterates
    shown = harmonic_response(model, known["speeds_rad_s"], [1, -1])
    shown = shown[..., [model.structure.index(node) for node in NODES["machine"]]]
    theirs = harmonics_of(known["x"], known["y"])
    assert np.abs(shown - theirs).max() < ROUND_OFF * np.abs(theirs).max()


def test_a_cone_is_close(tmp_path):
    still = time_invariant(model_of(FILES / "ross_cone.toml", "cone"))
    for speed, whirl in RESULTS["cone"]["whirl_rad_s"].items():
        off = distance(damped_modes(still, [float(speed)], 5).frequency[0], whirl)
        assert ROUND_OFF < off < CONE
    assert distance(damped_modes(still, [100.0], 5).frequency[0], RESULTS["machine"]["whirl_rad_s"]["100"]) > CONE


def test_a_user_of_ross_brings_a_machine_in_one_line(tmp_path, command):
    said = command("new", "rig", "pump", "--ross", FILES / "ross_2_3_0.toml", "--folder", tmp_path).out
    assert "spline" in said and "ROSS saves none" in said and "pump_probes.png" in said
    rig = yaml.safe_load((tmp_path / "pump.yaml").read_text())
    assert [disc["label"] for disc in rig["rotor"]["discs"]] == ["impeller", "wheel"]
    assert {probe["node"] for probe in rig["measurement"]["probes"]} == {1, 6}
    assert load_rig(tmp_path / "pump.yaml").names[:1] == ("bearing_scale[drive end]",)


def changed(tmp_path, change):
    """A file in which `change` has changed the parts."""
    parts = tomllib.loads((FILES / "ross_2_3_0.toml").read_text())
    change(parts)
    path = tmp_path / "changed.json"
    path.write_text(json.dumps(parts))
    return path


def part(parts, start):
    return next(value for name, value in parts.items() if name.startswith(start))


MODELS = FILES / "models"  # written by benchmarks/ross/models.py with ROSS 2.3
RESPONSES = json.loads((MODELS / "responses.json").read_text())
LESS_EXACT = {
    "CylindricalBearing": 1e-6,  # the curve of ROSS through its table misses its values by 6e-6
    "MagneticBearingElement": 1e-6,  # by 5e-7
    "sleeves": 1e-3,  # each parallel element of ROSS has a shear deformation of its own, which layers share
    "layers": 1e-2,
}


def off(name, sections):
    """Largest difference from the response of ROSS to its unbalance, relative to the largest response."""
    known, disc = RESPONSES[name], sections["rotor"]["discs"][0]["node"]
    unbalance = {"kind": "unbalance", "node": disc, "unbalance_kg_m": 1e-3, "eccentricity_phase_rad": 0.4 + np.pi / 2}
    model = build_model({**sections, "effects": [*sections["effects"][:-1], unbalance]})
    nodes = [model.structure.index(n) for n in range(1, len(sections["rotor"]["elements"]) + 2)]
    shown = harmonic_response(model, known["speeds_rad_s"], [1, -1])[..., nodes]
    theirs = harmonics_of(*known["xy"])[..., : len(nodes)]  # supports last
    return np.abs(shown - theirs).max() / np.abs(theirs).max()


@pytest.mark.parametrize("name", RESPONSES)
def test_every_bearing_class_and_part_of_ross_responds_as_in_ross(name):
    """Constant and over speed, with cross coupling and mass; seals, layers, supports, damping and axial force."""
    assert off(name, read_ross(MODELS / f"{name}.toml").sections) < LESS_EXACT.get(name, ROUND_OFF)


def test_a_bearing_along_the_shaft_is_left_out_and_listed():
    found = read_ross(MODELS / "ThrustPad.toml")
    assert "ThrustPad at node 1: acts along the shaft only, left out" in found.said
    assert [bearing["node"] for bearing in found.sections["bearings"]] == [1, 3]


@pytest.mark.parametrize("name", ["CylindricalBearing", "layers", "sleeves", "supports"])
def test_the_comparison_sees_a_part_that_is_not_read(name):
    """The first row of a table alone, no layers, no mass of a support."""
    sections = read_ross(MODELS / f"{name}.toml").sections
    first = sections["bearings"][0]
    if name == "CylindricalBearing":
        tables = {k: {d: [v[0]] * 5 for d, v in first[k].items()} for k in ("stiffness_N_per_m", "damping_N_s_per_m")}
        sections["bearings"][0] = first | tables
    elif name == "supports":
        sections["bearings"][0] = first | {"pedestal_mass_kg": {"xx": 0.0}}
    else:
        for element in sections["rotor"]["elements"]:
            element.pop("layers", None)
    assert off(name, sections) > 3 * LESS_EXACT.get(name, ROUND_OFF)


LISTED = [
    (lambda p: part(p, "SealElement").update(kyy=[2e5]), "are bearings here", "seal"),
    (lambda p: part(p, "ShaftElement").update(torque=100.0), "torque of the shaft is left out", ""),
    (lambda p: part(p, "ShaftElement").update(beta=1e-5), "of some elements is left out", ""),
    (lambda p: part(p, "ShaftElement").update(alpha=1.0), "proportion to the mass", ""),
]


@pytest.mark.parametrize(("change", "words", "kind"), LISTED, ids=range(len(LISTED)))
def test_what_is_left_out_is_listed(change, words, kind, tmp_path):
    found = read_ross(changed(tmp_path, change))
    assert sum(words in line for line in found.said) == 1
    assert kind not in [item["kind"] for item in found.sections["effects"]]


REFUSED = [
    (lambda p: part(p, "BearingElement").update(n_link=6), "a flexible_pedestal has constant"),
    (lambda p: part(p, "BearingElement").update(n_link=3), "is not between shaft and ground"),
    (lambda p: part(p, "BearingElement").pop("frequency"), "4 values of kyy and 0 speeds"),
    (lambda p: part(p, "BearingElement").update(kxx=[1e7, 2e7]), "2 values of kxx and 4 speeds"),
    (lambda p: part(p, "ShaftElement").update(n=1), "several shafts are not read"),
    (lambda p: part(p, "ShaftElement").update(n="a"), "not a readable rotor of ROSS"),
    (lambda p: part(p, "ShaftElement").pop("material"), "not a readable rotor of ROSS"),
    (lambda p: [p.pop(name) for name in list(p) if name.startswith("Bearing")], "no bearing"),
    (lambda p: [p.pop(name) for name in list(p) if name.startswith("Shaft")], "no ShaftElement"),
    (lambda p: p.update(PointMass_1={"n": 6, "m": 0.7}), "is not between shaft and ground"),
    (lambda p: part(p, "BearingElement").update(kxx=None), "'drive end' has no value of kxx"),
    (lambda p: p.update(BearingElement_1=[part(p, "BearingElement")]), "BearingElement_1 is a list"),
    (lambda p: p.update(MagneticThing_1={"n": 2, "gain": 3.0}), "MagneticThing"),
]


@pytest.mark.parametrize(("change", "words"), REFUSED, ids=range(len(REFUSED)))
def test_what_would_be_another_rotor_is_refused(change, words, tmp_path):
    refused(lambda: read_ross(changed(tmp_path, change)), words)


def test_a_coefficient_across_that_is_not_stated_is_that_along_as_ross_has_it(tmp_path):
    def bearing(change):
        return read_ross(changed(tmp_path, change)).sections["bearings"][0]

    alike = bearing(lambda p: part(p, "BearingElement").update(kyy=part(p, "BearingElement")["kxx"]))
    assert bearing(lambda p: part(p, "BearingElement").pop("kyy")) == alike


@pytest.mark.parametrize("text", ["", "not = = toml", "a = 1\n"])
def test_another_file_is_refused(text, tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(text)
    refused(lambda: read_ross(path))
    refused(lambda: read_ross(tmp_path / "none.toml"), "does not exist")
