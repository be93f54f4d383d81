"""Intervals of what is identified stay within what is possible."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from rotorstudy.commands.shared import estimate_rows
from rotorstudy.model.rig import build_model

RIG = Path(__file__).parents[1] / "examples" / "jeffcott.yaml"


def rig_of_a_shaft(**more):
    cross = {"bearing_stiffness_xy_N_per_m": 3e6, "bearing_stiffness_yx_N_per_m": -3e6}
    direct = {"bearing_stiffness_xx_N_per_m": 1e7, "bearing_stiffness_yy_N_per_m": 1e7}
    damping = {"bearing_damping_xx_N_s_per_m": 9.0, "bearing_damping_yy_N_s_per_m": 9.0}
    damping |= {"bearing_damping_xy_N_s_per_m": 0.0, "bearing_damping_yx_N_s_per_m": 0.0}
    full = {"kind": "linear", "coefficients": "full", **direct, **cross, **damping}
    return {
        "rotor": {
            "kind": "finite_element",
            "outer_diameter_m": 0.03,
            "elements": [{"length_m": 0.4, "count": 2}],
        },
        "bearings": [{**full, "node": 1, "label": "left", **more}, {**full, "node": 3, "label": "right"}],
        "effects": [
            {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": 5.0, "label": "air"},
            {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": 2.0, "label": "seal"},
            {"kind": "support_stiffness", "node": 2, "support_stiffness_N_per_m": 1e5},
            {"kind": "unbalance", "node": 2, "unbalance_g_mm": 40},
        ],
    }


def test_springs_and_dampers_of_bearings_are_not_negative_and_cross_couplings_may_be():
    model = build_model(rig_of_a_shaft())
    least = model.least_possible(model.theta)
    for kind, node in product(("stiffness", "damping"), ("left", "right")):
        assert all(least[f"bearing_{kind}_{way}[{node}]"] == 0 for way in ("xx", "yy"))
        assert f"bearing_{kind}_xy[{node}]" not in least
    assert "support_stiffness" not in least  # a magnetic pull is a negative one
    assert least["eccentricity"] == 0 and "eccentricity_real" not in least
    # two dampers at one place are not negative together
    assert (least["external_damping[air]"], least["external_damping[seal]"]) == (-2.0, -5.0)
    seal = build_model(rig_of_a_shaft(bearing_stiffness_xx_N_per_m=-1e5))  # stated as negative: then it may be
    assert "bearing_stiffness_xx[left]" not in seal.least_possible(seal.theta)


def test_an_interval_ends_at_what_is_possible_and_what_lies_below_is_told():
    estimates = [("a", 1.0, 1.0, "N/m"), ("b", 1.0, 1.0, "N/m"), ("c", -5.0, 1.0, "N/m")]
    rows, warnings = estimate_rows(estimates, {"a": 0.0, "c": 0.0})
    (low, high), free, below = (row["interval_95"] for row in rows)
    assert low == 0.0 and high == pytest.approx(2.96, abs=1e-3) and free[0] == pytest.approx(-0.96, abs=1e-3)
    assert below == pytest.approx([-6.96, -3.04], abs=1e-3)  # not moved to where no estimate is
    assert len(warnings) == 1 and warnings[0].startswith("c cannot be so low")


def test_identify_states_no_negative_damping_and_says_if_the_records_ask_for_it(tmp_path, command):
    text = RIG.read_text()
    for true in (0.5, 20.0, -60.0):
        path = tmp_path / "true.yaml"
        path.write_text(text.replace("internal_damping_N_s_per_m: 20.0", f"internal_damping_N_s_per_m: {true}"))
        command("simulate", path, "--speeds", "88", "308", "--noise", "60", "--seed", "3", "--out", tmp_path / "r.nc")
        said = command("identify", tmp_path / "r.nc", "--rig", RIG, "--unknowns", "internal_damping", "--json").out
        found = json.loads(said)
        (low, high), warnings = found["estimates"][0]["interval_95"], found["warnings"]
        assert (low >= 0 and high > 0) is (true > 0)
        assert any("internal_damping cannot be so low" in one for one in warnings) is (true < 0)
        assert found["degrees_of_freedom"] > 0 and np.isfinite(found["misfit"])
