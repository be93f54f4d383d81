"""Rotordynamic analysis in closed form, and at its edges: without damping, enough bearings, or a form in time."""

import json

import numpy as np
import pytest
import yaml
from machines import disc, film, point, rig_of, shaft, springs
from one_line_errors import refused, run
from page_checks import problems

from rotorstudy import (
    NonlinearForce,
    Parameter,
    build_model,
    eigenvalues,
    harmonic_response,
    measured_spectrum,
    read_rig,
    registry,
)
from rotorstudy.model.kinds import Bearing
from rotorstudy.presentation.rotor_files import analyse_files, measured_vectors
from rotorstudy.presentation.rotor_page import check_words, resonances, summary
from rotorstudy.response.stability import damping_of_effects
from rotorstudy.response.whirl import Peak, critical_speeds, damped_modes, peaks, required_margin, separation_margin
from rotorstudy.store import as_complex
from rotorstudy.studies.rig_check import check_rig
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.studies.unbalance_response import probe_vectors

MASS, STIFFNESS = 2.0, 7.2e5
NATURAL = np.sqrt(STIFFNESS / MASS)  # 600 rad/s
ROTOR = point(MASS, STIFFNESS)


def jeffcott(*effects):
    return rig_of(ROTOR, [], *effects)


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
    """w_n (1 + c_E / c_I), where internal damping adds +c_E / 2m and external -c_E / 2m, to zeta^2 = 2e-3."""
    found = analyse_rotor(build_model(jeffcott(INTERNAL, EXTERNAL)))
    assert found.threshold == pytest.approx(NATURAL * (1 + 40 / 60), rel=1e-6)
    assert found.damping["internal_damping"] == pytest.approx(40 / (2 * MASS), rel=1e-2)
    assert found.damping["external_damping"] == pytest.approx(-40 / (2 * MASS), rel=1e-2)


def test_the_narrow_range_in_which_an_asymmetric_shaft_grows_is_found():
    """It ends where ((1 + e) w_n^2 - w^2) ((1 - e) w_n^2 - w^2) + (c w / m)^2 = 0; with more damping there is none."""
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


def test_the_parts_of_effects_in_the_growth_rate_are_those_of_their_work():
    """In closed form for one mass; on bearings a spring has none, and the parts together are the growth rate."""
    swirl = {"kind": "cross_coupling", "cross_coupling_N_per_m": 9e3}
    model = build_model(jeffcott(INTERNAL, EXTERNAL, swirl))
    (value,) = (one for one in eigenvalues(model, [900.0])[0] if one.imag > 0)
    external, internal = (one[f"{one['kind']}_N_s_per_m"] for one in (EXTERNAL, INTERNAL))
    parts = {"external_damping": -external, "internal_damping": internal * (900.0 / value.imag - 1)}
    expected = {**parts, "cross_coupling": 9e3 / value.imag}
    expected = {name: one / (2 * MASS) for name, one in expected.items()}
    assert damping_of_effects(model, 900.0) == pytest.approx(expected, rel=1e-9)
    bearings = springs([1, 5], (2e6, 3e6), (400.0, 300.0))
    rig = rig_of(
        shaft(0.5, 4, disc(3, 3.0, 0.0085, 0.0044)), bearings, {"kind": "shaft_damping", "shaft_damping_s": 1e-5}
    )
    anisotropic = {"kind": "support_anisotropy", "node": 5, "support_anisotropy_N_per_m": 3e5}
    for model in (build_model(rig), build_model(rig | {"effects": [*rig["effects"], anisotropic]})):
        found = damping_of_effects(model, 2100.0)
        assert sum(found.values()) == pytest.approx(eigenvalues(model, [2100.0]).real.max(), rel=1e-9)
        assert [name for name, one in found.items() if one > 0] == ["shaft_damping"] and len(found) == 3


def test_a_mode_that_does_not_oscillate_grows_by_a_negative_stiffness():
    pull = {"kind": "support_stiffness", "support_stiffness_N_per_m": -1.01 * MASS * NATURAL**2}
    found = damping_of_effects(build_model(jeffcott(EXTERNAL, pull)), 100.0)
    assert max(found, key=found.get) == pull["kind"]


def test_whirl_of_an_isotropic_rotor_is_circular_and_of_an_anisotropic_one_a_line():
    circles = damped_modes(build_model(jeffcott()), [100.0], 2)
    assert sorted(circles.direction[0]) == pytest.approx([-1, 1])
    lines = build_model(jeffcott({"kind": "support_anisotropy", "support_anisotropy_N_per_m": 1e5}))
    assert np.abs(damped_modes(lines, [100.0], 2).direction).max() < 1e-9


@pytest.mark.usefixtures("few_speeds")
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
    run("simulate", rig.path, "--speeds", "300", "700", "--out", records)
    spectrum, model, _ = measured_spectrum([records], rig)
    of_node = {1: harmonic_response(model, spectrum.speed, (1, -1))[..., 0].T}
    probes, expected = probe_vectors(of_node, model.structure.reading)
    assert probes == [(1, "x"), (1, "y")]
    assert np.abs(measured_vectors(spectrum, model.structure.reading) - expected).max() < 1e-6 * np.abs(expected).max()


def test_command_writes_page_data_and_figures(tmp_path, command):
    out = tmp_path / "analysis"
    given = ["analyse", "examples/two_discs.yaml", "--out", str(out), "--operating", "4000", "6000", "--rpm", "--json"]
    found = json.loads(command(*given).out)
    assert found["criticals"][0]["speed_rad_per_s"] == pytest.approx(3055.7 * np.pi / 30, rel=1e-3)
    assert {"separation_margin_share", "margin_required_by_API_617_share"} <= set(found["resonances"][0])
    other = json.loads(command(*given, "--units", "mil", "Hz").out)  # which numbers for a program do not follow
    assert other.pop("summary") != found.pop("summary") and other == found
    assert "peak (Hz)" in (out / "index.html").read_text(encoding="utf-8")
    assert (out / "rotor.nc").is_file()
    assert {path.name for path in (out / "figures").glob("*.png")} == {
        "rotor.png", "campbell.png", "mode_shapes.png", "bode.png", "polar.png", "stability.png"
    }  # fmt: skip
    assert "leave out switching" in (out / "index.html").read_text(encoding="utf-8")
    assert problems([out / "index.html"], tmp_path) == []


def test_impossible_ranges_of_speeds(tmp_path, capsys):
    for speeds in ((5.0, 2.0), (-1.0, 2.0)):
        refused(lambda: analyse_files("examples/jeffcott.yaml", tmp_path / "out", speeds), "give 0 < lowest < highest")
    run("analyse", "examples/jeffcott.yaml", "--out", tmp_path / "o", "--operating", "9", "3", status=1)
    assert "the lower one first" in capsys.readouterr().err


SHAFT = shaft(0.6, 4, disc(3), youngs_modulus_Pa=2.1e11, density_kg_per_m3=7800.0)
FILM = film(0.1, 0.02, 2e-4, 0.01, kind="squeeze_film", eccentricity_ratio=0.4, bearing_scale=1.0)


def test_an_undamped_resonance_has_no_bound():
    """Also where a speed of the analysis is the critical speed: from 100 to 696 rad/s they are 4 rad/s apart."""
    found = analyse_rotor(build_model(jeffcott(UNBALANCE)), 100.0, 696.0)
    assert [one.speed for one in found.criticals] == [pytest.approx(NATURAL, rel=1e-12)]
    shown = [(p.peak.speed, p.peak.amplitude, p.peak.amplification) for p in found.peaks]
    assert shown == [(pytest.approx(NATURAL), np.inf, np.inf)] * 2
    assert "No damping acts" in summary(found)[-1]
    rows = resonances(found._replace(operating=(100, 200)))
    needed = [(row["amplification_factor"], row["margin_required_by_API_617_share"]) for row in rows]
    assert needed == [(None, 0.26)] * 2
    damped = {"kind": "external_damping", "external_damping_N_s_per_m": 10.0}
    bounded = analyse_rotor(build_model(jeffcott(UNBALANCE, damped)), 100.0, 696.0)
    assert not any("No damping" in line for line in summary(bounded))


def test_a_probe_at_a_node_that_the_rig_lacks_is_named(tmp_path):
    rig = {"rotor": ROTOR, "measurement": {"probes": [{"channel": "A", "node": 9, "angle_deg": 0, "unit": "um"}]}}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    refused(lambda: analyse_files(tmp_path / "rig.yaml", tmp_path / "out"), "unknown node '9'")


@pytest.mark.parametrize("effect", [{**UNBALANCE, "eccentricity_m": 0.0}, {"kind": "runout", "runout_1X_m": 1e-6}])
def test_without_a_stated_unbalance_that_of_the_grade_is_taken_also_beside_a_runout(effect):
    found = analyse_rotor(build_model(jeffcott(effect)))
    assert found.unbalance.startswith("none is stated") and found.peaks


def test_of_a_term_with_a_nonlinear_force_the_linear_part_counts(monkeypatch):
    """A bearing with a stop that the shaft does not reach whirls as without the stop."""

    def stop(structure, node):
        push = NonlinearForce(
            structure.unit(node)[None], lambda z, velocity, still: -np.maximum(np.abs(z) - 1.0, 0) * z
        )
        linear = registry().get("bearing", "linear").function(structure, node)
        return [*linear, Parameter("stop", "N/m", (), 1.0, force=push)]

    monkeypatch.setitem(registry().plugins["bearing"], "stop", Bearing("stop", stop, source="none"))
    plain = springs([1, 5], damping=100.0)
    stopped = [{**one, "kind": "stop", "stop_N_per_m": 1e6} for one in plain]
    one, other = (
        analyse_rotor(build_model({"rotor": SHAFT, "bearings": bearings, "sensors": [3]}), 10.0, 1000.0)
        for bearings in (plain, stopped)
    )
    assert other.criticals == one.criticals and (one.left_out, other.left_out) == ([], ["stop"])
    assert other.threshold is None and other.loads == one.loads


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
    w = np.linspace(500, 800, 300001)
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


@pytest.mark.usefixtures("few_speeds")
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
