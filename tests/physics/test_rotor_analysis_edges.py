"""Rotordynamic analysis of rotors without damping, without enough bearings, and on films stated in frequency only."""

import numpy as np
import pytest
import yaml
from machines import disc, film, rig_of, shaft, springs
from one_line_errors import refused

from rotorstudy import build_model
from rotorstudy.presentation.rotor_files import analyse_files
from rotorstudy.presentation.rotor_page import check_words, resonances, summary
from rotorstudy.response.whirl import critical_speeds
from rotorstudy.studies.rig_check import check_rig
from rotorstudy.studies.rotor_analysis import analyse_rotor

MASS, STIFFNESS = 2.0, 3.2e5
NATURAL = np.sqrt(STIFFNESS / MASS)  # 400 rad/s
ROTOR = {"kind": "jeffcott", "mass_kg": MASS, "stiffness_N_per_m": STIFFNESS}
UNBALANCE = {"kind": "unbalance", "mass_kg": MASS, "eccentricity_m": 1e-5}
SHAFT = shaft(0.6, 4, disc(3), youngs_modulus_Pa=2.1e11, density_kg_per_m3=7800.0)
FILM = film(0.1, 0.02, 2e-4, 0.01, kind="squeeze_film", eccentricity_ratio=0.4, bearing_scale=1.0)


def test_an_undamped_resonance_has_no_bound():
    """Also where a speed of the analysis is the critical speed: from 100 to 696 rad/s they are 4 rad/s apart."""
    found = analyse_rotor(build_model({"rotor": ROTOR, "effects": [UNBALANCE]}), 100.0, 696.0)
    assert [one.speed for one in found.criticals] == [pytest.approx(NATURAL, rel=1e-12)]
    shown = [(p.peak.speed, p.peak.amplitude, p.peak.amplification) for p in found.peaks]
    assert shown == [(pytest.approx(NATURAL), np.inf, np.inf)] * 2
    assert "No damping acts" in summary(found)[-1]
    rows = resonances(found, (100, 200))
    assert [(row["amplification factor (1)"], row["required (API 617)"]) for row in rows] == [(None, "26 %")] * 2
    damped = {"kind": "external_damping", "external_damping_N_s_per_m": 10.0}
    bounded = analyse_rotor(build_model({"rotor": ROTOR, "effects": [UNBALANCE, damped]}), 100.0, 696.0)
    assert not any("No damping" in line for line in summary(bounded))


def test_a_probe_at_a_node_that_the_rig_lacks_is_named(tmp_path):
    rig = {"rotor": ROTOR, "measurement": {"probes": [{"channel": "A", "node": 9, "angle_deg": 0, "unit": "um"}]}}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    refused(lambda: analyse_files(tmp_path / "rig.yaml", tmp_path / "out"), "unknown node '9'")


@pytest.mark.parametrize("effect", [{**UNBALANCE, "eccentricity_m": 0.0}, {"kind": "runout", "runout_1X_m": 1e-6}])
def test_without_a_stated_unbalance_that_of_the_grade_is_taken_also_beside_a_runout(effect):
    found = analyse_rotor(build_model({"rotor": ROTOR, "effects": [effect]}))
    assert found.unbalance.startswith("none is stated") and found.peaks


@pytest.mark.parametrize("speeds", [(None, None), (10.0, 1000.0)])
def test_a_rotor_on_one_bearing_is_refused(speeds):
    rig = {"rotor": SHAFT, "bearings": springs([1]), "sensors": [3]}
    refused(lambda: analyse_rotor(build_model(rig), *speeds), "do not hold the rotor")


def test_the_film_of_a_damper_acts_on_the_response_and_its_damping_on_the_whirl():
    """A Jeffcott rotor with a squeeze film: (k + w a k_f - w^2 m + j w a c_f) R = m e w^2, with its k_f, c_f.

    The half film: a = viscosity D/2 (L/c)^3, k_f = 2 e / (1 - e^2)^2 and c_f = pi/2 (1 - e^2)^-1.5.
    """
    damper = {**FILM, "length_m": 0.01, "centring_stiffness_N_per_m": 0.0}
    found = analyse_rotor(build_model(rig_of(ROTOR, [damper], UNBALANCE)))
    size, e = 0.01 * 0.05 * (0.01 / 2e-4) ** 3, 0.4
    damping = size * np.pi / 2 * (1 - e * e) ** -1.5
    assert found.criticals[0].damping_ratio == pytest.approx(damping / (2 * MASS * NATURAL), rel=1e-6)
    assert (found.left_out, found.timeless) == ([], ["squeeze_film"])
    w = np.linspace(300, 600, 300001)
    film = w * size * 2 * e / (1 - e * e) ** 2 + 1j * w * damping
    response = np.abs(MASS * 1e-5 * w**2 / (STIFFNESS + film - MASS * w**2))
    peak = found.peaks[0].peak
    assert peak.speed == pytest.approx(w[response.argmax()], rel=1e-3)  # between speeds 1.2e-3 of it apart
    assert peak.amplitude == pytest.approx(response.max(), rel=1e-3)


def test_a_rotor_on_pedestals_alone_has_the_critical_speeds_of_the_whole_structure():
    """Those of the rotor on a foundation that has the masses of the pedestals; isotropic, so that they are circles."""
    pedestal = {"kind": "flexible_pedestal", "bearing_stiffness_N_per_m": {"xx": 1e6}, "pedestal_mass_kg": {"xx": 1.0},
                "pedestal_stiffness_N_per_m": {"xx": 1e7}, "bearing_damping_N_s_per_m": {"xx": 20.0},
                "bearing_scale": 1.0}  # fmt: skip
    rig = {"rotor": SHAFT, "bearings": [{**pedestal, "node": n, "label": str(n)} for n in (1, 5)], "sensors": [3]}
    found = analyse_rotor(build_model(rig), 10.0, 1500.0)
    feet = [{**one, "mass_kg": 1.0} for one in springs({1: "foot 1", 5: "foot 5"}, 1e7, 0.0)]
    standing = build_model({**rig, "bearings": springs((1, 5), 1e6, 0.0), "foundation": feet})
    true = critical_speeds(standing, 1500.0)[0]
    first = found.criticals[0]
    assert np.abs(true / first.speed - 1).min() < 1e-4 and 0 < first.damping_ratio < 0.05
    assert "approximate for whirl at other frequencies" in " ".join(summary(found)) and found.threshold is None
    held = [load.force.real for load in found.loads]
    assert sum(held) == pytest.approx(found.weight, rel=1e-9) and min(held) > 0
    stiff = {**rig, "bearings": [{**b, "pedestal_stiffness_N_per_m": {"xx": 1e12}} for b in rig["bearings"]]}
    other = analyse_rotor(build_model(stiff), 10.0, 1500.0).criticals[0]  # negative control
    assert np.abs(true / other.speed - 1).min() > 0.005


def test_growth_with_a_crack_leaves_out_hysteretic_damping():
    crack = {"kind": "switching", "element": 2, "angle_rad": 1.0, "stiffness_loss": 0.1, "weight_dominance": False}
    lossy = {"kind": "hysteretic_damping", "loss_factor": 0.01}
    rig = {"rotor": SHAFT, "bearings": springs((1, 5)), "sensors": [3], "cracks": [crack], "effects": [lossy]}
    found = analyse_rotor(build_model(rig), 100.0, 300.0)
    assert (found.left_out, found.timeless, found.threshold) == (["switching"], ["hysteretic_damping"], None)


def test_critical_speeds_on_a_bearing_that_is_isotropic_at_some_speeds_only():
    """In its isotropic part the forward critical speed is that of the isotropic bearing."""
    ends = [100.0, 500.0, 800.0]

    def model(last):
        table = {"kind": "speed_tabulated", "speeds_rad_per_s": ends, "bearing_scale": 1.0}
        springs = {"xx": [1e6, 1e6, last], "yy": [1e6] * 3}
        bearings = [{**table, "node": n, "label": str(n), "stiffness_N_per_m": springs} for n in (1, 5)]
        return build_model({"rotor": SHAFT, "bearings": bearings, "sensors": [3]})

    speeds = np.linspace(100, 800, 50)
    [isotropic], [mixed] = (critical_speeds(model(last), 800.0, speeds=speeds) for last in (1e6, 1.2e6))
    assert len(mixed) == 2  # backward and forward
    assert mixed[1] == pytest.approx(isotropic[0], rel=1e-9)


@pytest.mark.usefixtures("unrendered", "few_speeds")
def test_a_slender_shaft_is_drawn_and_a_vertical_one_names_its_bearings(tmp_path):
    """A shaft of 30 diameters is not drawn to scale; without weight each bearing still has its own node."""
    thick = shaft(0.6, 4)
    rig = {"rotor": thick, "bearings": springs((1, 5)), "effects": []}
    rig["rotor"]["gravity_m_per_s2"] = 0.0
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(rig))
    found = analyse_files(path, tmp_path / "out", [10.0, 300.0])
    assert [(load.node, load.force) for load in found.loads] == [(1, 0), (5, 0)]
    assert "-0 N" not in " ".join(check_words(check_rig(path)))
    rig["rotor"]["gravity_m_per_s2"] = 9.81  # negative control
    path.write_text(yaml.safe_dump(rig))
    assert [(one.node, one.force.real > 1) for one in analyse_rotor(build_model(rig)).loads] == [(1, True), (5, True)]
