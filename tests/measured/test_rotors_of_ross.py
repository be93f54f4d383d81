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

from rotorstudy import RotorstudyError, build_model, harmonic_response, load_rig
from rotorstudy.authoring.ross_model import read_ross
from rotorstudy.commands.line import main
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
    x, y = (np.array(known[axis][0]) + 1j * np.array(known[axis][1]) for axis in "xy")  # (node, speed)
    theirs = np.stack([1j * (x + 1j * y) / 2, 1j * np.conj(x - 1j * y) / 2])
    assert np.abs(shown - np.transpose(theirs, (2, 0, 1))).max() < ROUND_OFF * np.abs(theirs).max()


def test_a_cone_is_close(tmp_path):
    still = time_invariant(model_of(FILES / "ross_cone.toml", "cone"))
    for speed, whirl in RESULTS["cone"]["whirl_rad_s"].items():
        off = distance(damped_modes(still, [float(speed)], 5).frequency[0], whirl)
        assert ROUND_OFF < off < CONE
    assert distance(damped_modes(still, [100.0], 5).frequency[0], RESULTS["machine"]["whirl_rad_s"]["100"]) > CONE


def test_a_user_of_ross_brings_a_machine_in_one_line(tmp_path, capsys):
    assert main(["new", "rig", "pump", "--ross", str(FILES / "ross_2_3_0.toml"), "--folder", str(tmp_path)]) == 0
    said = capsys.readouterr().out
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


LISTED = [
    (lambda p: part(p, "SealElement").update(kxx=[1e5, 2e5], frequency=[0.0, 100.0]), "LEFT OUT", "seal"),
    (lambda p: part(p, "SealElement").update(kyy=[2e5]), "LEFT OUT", "seal"),
    (lambda p: part(p, "ShaftElement").update(axial_force=100.0), "axial force = 100", ""),
    (lambda p: part(p, "ShaftElement").update(beta=1e-5), "shaft_damping", ""),
    (lambda p: part(p, "BearingElement").update(mxx=[3.0] * 4), "mass coefficients", ""),
]


@pytest.mark.parametrize(("change", "words", "kind"), LISTED, ids=range(len(LISTED)))
def test_what_is_left_out_is_listed(change, words, kind, tmp_path):
    found = read_ross(changed(tmp_path, change))
    assert any(words in line for line in found.said)
    assert kind not in [item["kind"] for item in found.sections["effects"]]


REFUSED = [
    (lambda p: part(p, "BearingElement").update(n_link=6), "flexible_pedestal"),
    (lambda p: part(p, "ShaftElement").update(n=1), "each stretch must be one element"),
    (lambda p: [p.pop(name) for name in list(p) if name.startswith("Bearing")], "no bearing"),
    (lambda p: [p.pop(name) for name in list(p) if name.startswith("Shaft")], "no ShaftElement"),
    (lambda p: p.update(PointMass_1={"n": 6, "m": 0.7}), "flexible_pedestal"),
    (lambda p: p.update(MagneticThing_1={"n": 2, "gain": 3.0}), "MagneticThing"),
]


@pytest.mark.parametrize(("change", "words"), REFUSED, ids=range(len(REFUSED)))
def test_what_would_be_another_rotor_is_refused(change, words, tmp_path):
    with pytest.raises(RotorstudyError, match=words):
        read_ross(changed(tmp_path, change))


@pytest.mark.parametrize("text", ["", "not = = toml", "a = 1\n"])
def test_another_file_is_refused(text, tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(RotorstudyError):
        read_ross(path)
    with pytest.raises(RotorstudyError, match="does not exist"):
        read_ross(tmp_path / "none.toml")
