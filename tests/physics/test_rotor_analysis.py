"""Rotordynamic analysis against closed forms of the Jeffcott rotor and of single resonances."""

import json

import numpy as np
import pytest
from machines import disc, shaft, springs
from one_line_errors import refused
from page_checks import problems

from rotorstudy import build_model, harmonic_response, measured_spectrum, read_rig
from rotorstudy.commands.line import main
from rotorstudy.presentation.rotor_files import analyse_files, measured_vectors
from rotorstudy.response.stability import damping_of_effects
from rotorstudy.response.whirl import Peak, damped_modes, peaks, required_margin, separation_margin
from rotorstudy.store import as_complex
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.studies.unbalance_response import probe_vectors

MASS, STIFFNESS = 2.0, 7.2e5
NATURAL = np.sqrt(STIFFNESS / MASS)


def jeffcott(*effects):
    return {"rotor": {"kind": "jeffcott", "mass_kg": MASS, "stiffness_N_per_m": STIFFNESS}, "effects": list(effects)}


INTERNAL = {"kind": "internal_damping", "internal_damping_N_s_per_m": 60.0}
EXTERNAL = {"kind": "external_damping", "external_damping_N_s_per_m": 40.0}
UNBALANCE = {"kind": "unbalance", "mass_kg": MASS, "eccentricity_m": 1e-5}


def test_critical_speed_of_the_jeffcott_rotor_and_its_damping():
    """External damping alone: p^2 + 2 zeta w_n p + w_n^2 = 0, so the damped frequency is w_n sqrt(1 - zeta^2)."""
    found = analyse_rotor(build_model(jeffcott(EXTERNAL, UNBALANCE)))
    ratio = 40.0 / (2 * np.sqrt(MASS * STIFFNESS))
    assert [one.speed for one in found.criticals] == [pytest.approx(NATURAL * np.sqrt(1 - ratio**2), rel=1e-9)]
    assert found.criticals[0].damping_ratio == pytest.approx(ratio, rel=1e-9)
    assert found.criticals[0].direction == pytest.approx(1)


def test_half_power_width_gives_the_damping_of_a_light_resonance():
    """AF = 1 / (2 zeta) up to relative terms of zeta^2, beside the interpolation between the speeds."""
    speed, ratio = np.linspace(0.8, 1.2, 4001), 0.01
    [peak] = peaks(speed, speed**2 / np.abs(1 - speed**2 + 2j * ratio * speed))
    assert peak.amplification == pytest.approx(1 / (2 * ratio), rel=1e-3)
    assert peak.speed == pytest.approx(1, abs=3e-4)


def test_a_curve_that_rests_while_it_rises_has_no_peak_there():
    amplitude = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 1.0])
    assert [one.amplitude for one in peaks(np.arange(6.0), amplitude)] == [3.0]


def test_a_peak_without_both_half_power_points_has_no_amplification_factor():
    speed = np.linspace(0.8, 1.005, 4001)
    [peak] = peaks(speed, 1 / np.abs(1 - speed**2 + 2j * 0.01 * speed))
    assert np.isnan(peak.amplification)
    assert np.isnan(required_margin(peak, (2.0, 3.0)))


def test_a_maximum_between_critical_speeds_is_no_resonance():
    """Overhung rotor: beside the node of a mode, the response has a zero and a maximum where no mode swings."""
    overhung = shaft(1.5, 6, disc(7, 15.3, 0.12, 0.062), outer_diameter_m=0.025)
    model = build_model({"rotor": overhung, "bearings": springs((1, 5), (2e7, 1e7), (1e3, 1e3))})
    found = analyse_rotor(model, highest=700.0)
    speed, response = found.data.response_speed.values, np.abs(as_complex(found.data.unbalance_response))
    maxima = {peak.speed for one in response.T for peak in peaks(speed, one)}
    shown = {one.peak.speed for one in found.peaks}
    assert shown < maxima
    nearest = {at: min(abs(one.speed / at - 1) for one in found.criticals) for at in maxima}
    assert max(nearest[at] for at in shown) < 1e-3 < max(nearest.values())
    assert min(nearest[at] for at in maxima - shown) > 1e-3
    assert {min(found.criticals, key=lambda one: abs(one.speed - at)) for at in shown} == {*found.criticals}


def test_separation_margins():
    """API 617: 17 (1 - 1/(AF - 1.5)) % below the operating range, 10 % more above it."""
    below, above = Peak(80.0, 1.0, 3.5), Peak(130.0, 1.0, 3.5)
    assert separation_margin(80.0, (100.0, 110.0)) == pytest.approx(0.2)
    assert separation_margin(105.0, (100.0, 110.0)) == 0
    assert required_margin(below, (100.0, 110.0)) == pytest.approx(0.085)
    assert required_margin(above, (100.0, 110.0)) == pytest.approx(0.185)
    assert required_margin(Peak(80.0, 1.0, 2.4), (100.0, 110.0)) == 0


def test_threshold_of_stability_and_what_causes_it():
    """Jeffcott rotor: w_n (1 + c_E / c_I); each damping adds about its own share to the growth rate, of opposite sign.

    At the threshold the forward mode is undamped: the internal damping adds +c_E / 2m, the external one -c_E / 2m,
    over the change of w_n by damping, of relative size zeta^2 = 2e-3.
    """
    found = analyse_rotor(build_model(jeffcott(INTERNAL, EXTERNAL)))
    assert found.threshold == pytest.approx(NATURAL * (1 + 40 / 60), rel=1e-6)
    assert found.damping["internal_damping"] == pytest.approx(40 / (2 * MASS), rel=1e-2)
    assert found.damping["external_damping"] == pytest.approx(-40 / (2 * MASS), rel=1e-2)


def test_the_narrow_range_in_which_an_asymmetric_shaft_grows_is_found():
    """In axes that turn with the shaft it ends where ((1 + e) w_n^2 - w^2) ((1 - e) w_n^2 - w^2) + (c w / m)^2 = 0.

    It is 1 % of a range of speeds of which every 40th is looked at. More damping, c w_n / m > e w_n^2, leaves none.
    """
    share = 0.01

    def analysed(damping):
        asymmetry = {"kind": "shaft_asymmetry", "shaft_asymmetry": share}
        external = {"kind": "external_damping", "external_damping_N_s_per_m": damping}
        return analyse_rotor(build_model(jeffcott(asymmetry, external, UNBALANCE)))

    middle = NATURAL**2 - (4.0 / MASS) ** 2 / 2
    half = np.sqrt(middle**2 - (1 - share**2) * NATURAL**4)
    found = analysed(4.0)
    grows = found.data.growth_speed[found.data.growth_rate > 0]
    assert found.threshold == grows[0] == pytest.approx(np.sqrt(middle - half), rel=1e-3)  # 256 steps a turn: 4e-4
    assert grows[-1] == pytest.approx(np.sqrt(middle + half), rel=1e-3)
    assert analysed(1.1 * share * MASS * NATURAL).threshold is None


def test_damping_of_effects_is_the_difference_of_eigenvalues():
    model = build_model(jeffcott(INTERNAL, EXTERNAL))
    stiffer = build_model(jeffcott({**INTERNAL, "internal_damping_N_s_per_m": 60.06}, EXTERNAL))
    growth = [damped_modes(one, [900.0], 2).eigenvalue.real.max() for one in (model, stiffer)]
    slope = (growth[1] - growth[0]) / 0.001
    assert damping_of_effects(model, 900.0)["internal_damping"] == pytest.approx(slope, rel=1e-3)


def test_whirl_of_an_isotropic_rotor_is_circular_and_of_an_anisotropic_one_a_line():
    rotor = {"rotor": {"kind": "jeffcott", "mass_kg": MASS, "stiffness_N_per_m": STIFFNESS}}
    circles = damped_modes(build_model(rotor), [100.0], 2)
    assert sorted(circles.direction[0]) == pytest.approx([-1, 1])
    lines = build_model({**rotor, "effects": [{"kind": "support_anisotropy", "support_anisotropy_N_per_m": 1e5}]})
    assert np.abs(damped_modes(lines, [100.0], 2).direction).max() < 1e-9


def test_bearings_carry_the_weight_as_levers_say():
    model = read_rig("examples/two_discs.yaml").model
    found = analyse_rotor(model.without(["switching"]))
    left, right = (load.force for load in found.loads)
    position = np.array([model.structure.node_positions[node] for node, _ in model.structure.dofs])
    weight = model.structure.static_load
    moment = (position * model.structure.along) @ weight + weight @ (1 - model.structure.along)
    assert (left + right).real == pytest.approx(found.weight, rel=1e-9)
    assert right.real == pytest.approx(moment / 0.6, rel=1e-3)  # tilts have a part of the distributed weight
    assert abs(left.imag) < 1e-9


def test_measured_points_lie_on_the_response(tmp_path):
    """Records simulated from the same rig, without noise: equal to the response up to the 9 harmonics they hold."""
    records, rig = tmp_path / "records.nc", read_rig("examples/jeffcott.yaml")
    assert main(["simulate", str(rig.path), "--speeds", "300", "700", "--out", str(records)]) == 0
    spectrum, model, _ = measured_spectrum([records], rig)
    of_node = {1: harmonic_response(model, spectrum.speed, (1, -1))[..., 0].T}
    probes, expected = probe_vectors(of_node, model.structure.reading)
    assert probes == [(1, "x"), (1, "y")]
    assert np.abs(measured_vectors(spectrum, model.structure.reading) - expected).max() < 1e-6 * np.abs(expected).max()


def test_command_writes_page_data_and_figures(tmp_path, command):
    out = tmp_path / "analysis"
    given = ["analyse", "examples/two_discs.yaml", "--out", str(out), "--operating", "4000", "6000", "--rpm", "--json"]
    found = json.loads(command(*given).out)
    assert found["criticals"][0]["speed (rpm)"] == pytest.approx(3055.7, rel=1e-3)
    assert {"separation margin", "required (API 617)"} <= set(found["resonances"][0])
    assert (out / "rotor.nc").is_file()
    assert {path.name for path in (out / "figures").glob("*.png")} == {
        "rotor.png", "campbell.png", "mode_shapes.png", "bode.png", "polar.png", "stability.png"
    }  # fmt: skip
    assert "leave out switching" in (out / "index.html").read_text(encoding="utf-8")
    assert problems([out / "index.html"], tmp_path) == []


def test_impossible_ranges_of_speeds(tmp_path, capsys):
    for speeds in ((5.0, 2.0), (-1.0, 2.0)):
        refused(lambda: analyse_files("examples/jeffcott.yaml", tmp_path / "out", speeds), "give 0 < lowest < highest")
    assert main(["analyse", "examples/jeffcott.yaml", "--out", str(tmp_path / "o"), "--operating", "9", "3"]) == 1
    assert "the lower one first" in capsys.readouterr().err
