"""Units of a balancer: unbalance in g mm, degrees, rpm, and numbers as people write them."""

import numpy as np
import pytest
import yaml
from machines import disc, jeffcott_rig, shaft, springs
from one_line_errors import refused

from rotorstudy import build_model, load_rig
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.verdict.cause_words import place
from rotorstudy.diagnosis.verdict.result import Place
from rotorstudy.model.estimated_rig import rig_with_values
from rotorstudy.store import load


def rig(**unbalance):
    return jeffcott_rig(None, None, {"kind": "unbalance", **unbalance})


@pytest.mark.parametrize(
    "given",
    [
        {"unbalance_g_mm": 30.0, "unbalance_phase_deg": 90.0},
        {"unbalance_kg_m": 3e-5, "eccentricity_phase_deg": 90},
        {"mass_kg": 0.5, "unbalance_g_mm": 7.5, "eccentricity_phase_rad": np.pi / 2},
    ],
)
def test_an_unbalance_of_30_g_mm_is_15_um_of_2_kg(given):
    assert build_model(rig(**given)).theta[1:] == pytest.approx([0, 1.5e-5], abs=1e-18)


def test_an_option_in_degrees():
    crack = {"kind": "open", "stiffness_loss_N_per_m": 1e5}
    both = [build_model({**rig(eccentricity_m=0.0), "cracks": [{**crack, key: value}]})
            for key, value in (("angle_deg", 30), ("angle_rad", np.pi / 6))]  # fmt: skip
    first, second = (model.terms[0].parameters[0].entries[1].matrix for model in both)
    assert first == pytest.approx(second, rel=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"unbalance_g_mm": 30.0, "eccentricity_m": 1e-5}, ["unbalance_g_mm", "eccentricity_m", "same quantity"]),
        ({"unbalance_g_cm": 30.0}, ["unknown key 'unbalance_g_cm'"]),
        ({"unbalance_g_mm": "much"}, ["unbalance_g_mm = 'much'", "must be a finite number"]),
        ({"unbalance_phase_deg": 30.0}, ["no magnitude"]),
    ],
)
def test_a_wrong_key_of_an_unbalance_is_named(given, words):
    refused(lambda: build_model(rig(**given)), *words)


def test_an_estimate_replaces_the_key_it_was_given_by():
    given = rig(unbalance_g_mm=30.0, unbalance_phase_deg=90.0)
    found = rig_with_values(given, build_model(given), {"eccentricity_real": 1e-5})
    assert found["effects"][1].keys() == {"kind", "eccentricity_m", "eccentricity_phase_rad"}
    assert build_model(found).theta[1:] == pytest.approx([1e-5, 1.5e-5])


def test_speeds_in_rpm(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(rig(unbalance_g_mm=30.0)).replace("100.0", "1e2"))
    assert load_rig(path).theta[0] == 100
    options = ["--rate", "1000", "--duration", "0.2", "--out", str(tmp_path / "records.nc")]
    assert main(["simulate", str(path), "--speeds", "1000", "3000", "--rpm", *options]) == 0
    assert load(tmp_path / "records.nc").speed.values == pytest.approx([100 * np.pi / 3, 100 * np.pi])


def test_a_cause_is_named_by_the_label_of_the_disc_or_bearing():
    discs = disc(2, 1.0, 1e-3, 5e-4, label="fan"), disc(3, 1.0, 1e-3, 5e-4)
    rotor, bearings = shaft(0.2, 4, *discs, outer_diameter_m=0.01), springs({1: "DE", 5: "rear bearing"})
    structure = build_model({"rotor": rotor, "bearings": bearings}).structure
    assert structure.labels == {1: "bearing DE", 2: "fan", 5: "rear bearing"}
    assert [one.node for one in structure.discs] == [2, 3]
    told = {2: "at node 2 (fan)", 3: "at node 3", (2, 3): "at nodes 2 and 3"}
    for node, words in told.items():
        where = {"node": node if isinstance(node, int) else list(node)}
        found = Place(effect="unbalance", where=where, label=structure.label_at(where))
        assert place(found) == f"unbalance {words}"
