"""The diagnosis as an engineer runs it: records on disk, the command line, a folder with verdict, rig and page."""

import inspect
import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml
from machines import SLOW, jeffcott_rig, point
from one_line_errors import run
from page_checks import BROWSER, problems, seen_in_browser, sheets

from rotorstudy import build_model, measured_response, read_measurement
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.verdict import result
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words, place, sizes
from rotorstudy.diagnosis.verdict.causes import _by_variant, _variant, together
from rotorstudy.diagnosis.verdict.dataset import equivalent_residual_force
from rotorstudy.diagnosis.verdict.result import Cause, Verdict
from rotorstudy.diagnosis.verdict.words import detection_limits, summary
from rotorstudy.presentation.captions import DIAGNOSIS_FIGURES
from rotorstudy.presentation.diagnosis_page import diagnosis_page
from rotorstudy.store import as_complex, load

SPEEDS = [100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0]
RIG = jeffcott_rig(5e-6, 0.52, internal=20.0, measurement={"harmonics": [0, 1, -1, 2, -2, 3, -3]})
ASYMMETRY = {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.03, "shaft_asymmetry_phase_rad": 0.7}
PRELOAD = {"kind": "static_preload", "static_preload_N": 3.0, "static_preload_phase_rad": -1.0}
FILES = {"verdict.json", "verdict.nc", "extended_rig.yaml", "index.html"}
PICTURES = {f"{name}.{k}" for name in DIAGNOSIS_FIGURES for k in ("png", "svg")}


def write_rig(path, *effects, **changes):
    path.write_text(yaml.safe_dump({**RIG, "effects": [*RIG["effects"], *effects], **changes}))
    return path


def simulate(folder, *effects):
    """Records of the rig with effects it does not know of, 1 % noise."""
    rig = write_rig(folder / "truth.yaml", *effects)
    options = ["--noise", "1", "--seed", "1", "--rate", "2000", "--out", str(folder / "records.nc")]
    assert main(["simulate", str(rig), "--speeds", *map(str, SPEEDS), *options]) == 0
    return folder / "records.nc"


def diagnose(records, rig, out, *options):
    run("diagnose", records, "--rig", rig, "--out", out, *options)
    return json.loads((out / "verdict.json").read_text())


def named(verdict):
    return {cause["effect"] for cause in verdict["causes"]}


def could_be(verdict):
    return named(verdict) | {cause["effect"] for cause in verdict["ambiguous_with"]}


def page_of(verdict, out):
    """The page of another verdict on what is in a folder."""
    figures = {name: out / "figures" / f"{name}.png" for name in DIAGNOSIS_FIGURES}
    return diagnosis_page(verdict, load(out / "verdict.nc"), figures, "rig")


@pytest.fixture(scope="module")
def asymmetric(tmp_path_factory):
    """A shaft whose asymmetry the rig does not know, diagnosed; the verdict and the folder it is in."""
    folder = tmp_path_factory.mktemp("diagnosis")
    out = folder / "asymmetric"
    return diagnose(simulate(folder, ASYMMETRY), write_rig(folder / "rig.yaml"), out), out


def test_a_hidden_effect_is_found_with_its_size(asymmetric):
    verdict, _ = asymmetric
    assert verdict["verdict"] == "cause" and named(verdict) == {"shaft_asymmetry"}
    found = verdict["causes"][0]["parameters"]
    for name, true in (("shaft_asymmetry", 0.03), ("shaft_asymmetry_phase", 0.7)):
        assert abs(found[name]["value"] - true) < 5 * found[name]["std"]
    assert verdict["gain"]["ratio"] < 0.1
    assert verdict["summary"].startswith("Something is missing, and it is most likely shaft asymmetry (0.0")
    assert "2387 rpm (250 rad/s), held out of every fit" in verdict["summary"]


def test_everything_is_written_and_the_page_needs_no_other_file(asymmetric, tmp_path):
    verdict, out = asymmetric
    assert {path.name for path in out.iterdir()} == FILES | {"figures"}
    assert {path.name for path in (out / "figures").iterdir()} == PICTURES
    assert not list(out.parent.glob(".*partial"))
    page = (out / "index.html").read_text()
    assert page.count("data:image/png;base64,") == 4 and 'src="figures' not in page
    assert problems([out / "index.html"], tmp_path) == []
    shown = ("What the simulation gets wrong", "Detection limits", "default: 0.1", verdict["summary"][:60])
    assert all(text in page for text in shown)


def test_verdict_json_has_what_the_documentation_says(asymmetric):
    verdict, _ = asymmetric
    assert verdict["format_version"] == 3 and verdict["broken_plugins"] == []
    (cause,) = verdict["causes"]
    known = {"value", "std", "unit", "part", "interval_95"}
    assert 0.9 < cause["posterior_probability"] <= 1 and all(set(one) == known for one in cause["parameters"].values())
    wrong, of_several = verdict["settings"]["model_inadequacy"]
    assert cause["probability"] == pytest.approx((1 - wrong) * cause["posterior_probability"]) and wrong < of_several
    assert {one["part"] for one in cause["parameters"].values()} == {"magnitude", "phase"}
    assert {"dead", "known_by_prior_alone", "traded_off"} <= set(verdict["identifiability"])
    assert {"before_m", "after_m", "before_sigma", "after_sigma", "rise_probability"} <= set(verdict["gain"])
    assert {*verdict} == {*result.Verdict.model_fields}
    docs = (Path(__file__).parents[2] / "docs" / "diagnosis.md").read_text()
    assert [key for key in verdict["settings"] if f"`{key}`" not in docs] == []
    lines = pairwise(map(str.strip, inspect.getsource(result.Verdict).splitlines()))
    told = {line.partition(":")[0] for above, line in lines if "  # " in line or above.startswith("# ")}
    assert [key for key in result.Verdict.model_fields if key not in told] == ["format_version"]


def test_what_the_records_exclude_is_stated_with_the_reason(asymmetric):
    """An asymmetric shaft makes a backward 1X that an isotropic effect cannot make."""
    verdict, out = asymmetric
    assert verdict["excluded"]
    odds = [one["log_odds"] for one in verdict["excluded"]]
    assert odds == sorted(odds) and odds[0] > 0
    assert all(one["cause"]["effect"] != "shaft_asymmetry" for one in verdict["excluded"])
    for one in verdict["excluded"]:
        assert one["harmonic"] is None or (one["sigma"] > 2 and one["node"] == 1)
    assert "Effects that the records exclude" in (out / "index.html").read_text()


def test_a_verdict_comes_back_from_its_file(asymmetric):
    _, out = asymmetric
    text = (out / "verdict.json").read_text()
    found = Verdict.model_validate_json(text)
    assert found.model_dump_json(indent=1) + "\n" == text
    assert found.causes[0].parameters["shaft_asymmetry_phase"].part == "phase"


def test_verdict_nc_holds_maps_spectra_and_fits_with_units(asymmetric):
    verdict, out = asymmetric
    data = load(out / "verdict.nc")
    assert all("units" in data[name].attrs for name in data.variables)
    assert {"rotorstudy_version", "configuration_sha256", "records"} <= set(data.attrs)
    before, after = data.residual_before, data.residual_after
    assert before.dims == after.dims == ("speed", "harmonic", "node")
    assert before.sel(harmonic=2).min() > 20 and after.max() < 5
    force = np.hypot(*np.moveaxis(data.equivalent_residual_force_before.sel(harmonic=2).values, -1, 0))
    sag = 9.81 * 2.0 / 7.6e5  # the asymmetry turns the static deflection into a force at 2X: epsilon k sag and more
    assert np.all(force > 0.9 * 0.03 * 7.6e5 * sag)
    assert list(data.held_out.values) == [0, 0, 0, 1, 0, 0, 0]
    assert int(data.is_best.sum()) == 1 and data.attrs["format_version"] == 3
    best = data.isel(explanation=int(np.argmax(data.is_best.values)))
    assert float(best.log_posterior_odds) == verdict["log_posterior_odds"] == float(data.log_posterior_odds.max())
    assert "shaft asymmetry, real part" in data.label.values and "mass" not in data.label.values


def test_the_view_of_each_speed_shows_what_the_file_holds(asymmetric):
    _, out = asymmetric
    text = (out / "index.html").read_text()
    (found,) = re.findall(r'data-charts="diagnosis">.*?<script type="application/json">(.*?)</script>', text, re.DOTALL)
    view = json.loads(found)
    data = load(out / "verdict.nc")
    s, k, n = 4, 0, view["harmonic"].index(-2)
    assert view["speed"][s] == "2865 rpm (300 rad/s), fitted" and view["node"][k] == "1"
    stored = data.isel(speed=s, node=k, harmonic=n)
    for name in ("measured", "base", "extended"):
        shown = complex(view["values"][name]["real"][s][k][n], view["values"][name]["imag"][s][k][n])
        assert shown == pytest.approx(1e6 * complex(as_complex(stored[name])), rel=1e-3)
    assert view["sigma"][0][2][s][k][n] == pytest.approx(float(stored.residual_before), rel=1e-3)
    assert view["speed"][view["start"][0]].endswith("held out of every fit")


@pytest.mark.skipif(not BROWSER, reason="no Chromium found: pages are read, not opened")
def test_the_view_of_each_speed_follows_its_controls(asymmetric, tmp_path):
    measured, console = seen_in_browser([asymmetric[1] / "index.html"], tmp_path)
    assert all(one["moved"] for one in measured) and console == []


@pytest.mark.skipif(not BROWSER, reason="no Chromium found: pages are read, not opened")
def test_the_page_of_a_diagnosis_prints_on_one_sheet(asymmetric, tmp_path):
    """Verdict, picture, what next, what could hide; the evidence is folded. With it open, it takes more."""
    page = (asymmetric[1] / "index.html").read_text()
    assert sheets(page, tmp_path) == 1 < sheets(page, tmp_path, unfolded=True)


@pytest.mark.usefixtures("unrendered", "unhidden")
def test_the_extended_rig_is_accepted_again_and_lacks_nothing(asymmetric, tmp_path):
    _, out = asymmetric
    extended = out / "extended_rig.yaml"
    run("simulate", extended, "--speeds", "100", "--out", tmp_path / "again.nc")
    again = diagnose(out.parent / "records.nc", extended, tmp_path / "again")
    assert again["verdict"] == "nothing" and again["causes"] == again["findings"] == []
    assert again["summary"].startswith("Nothing is missing")
    assert "Smallest sizes detected with a probability of 95 %" in again["summary"]
    verdict = Verdict.model_validate_json((tmp_path / "again" / "verdict.json").read_text())
    said = {row.effect for row in detection_limits(verdict)}
    assert "swapped_probes" in {row.effect for row in verdict.detection_limit} - said  # they have no size


@pytest.mark.usefixtures("unrendered", "unhidden")
def test_without_the_true_effect_in_the_library_no_wrong_cause_is_sure(asymmetric, tmp_path):
    """The negative control: unknown, or a confounder that the effect declares."""
    rig = write_rig(tmp_path / "rig.yaml", diagnosis={"leave_out": ["shaft_asymmetry"]})
    verdict = diagnose(asymmetric[1].parent / "records.nc", rig, tmp_path / "left_out")
    confounders = {"support_anisotropy", "breathing_crack", "parallel_misalignment"}
    if "breathing_crack" in named(verdict):  # an open one, with what makes up for half its loss, is an asymmetric shaft
        confounders |= {"stiffness_error", "support_stiffness", "added_mass"}
    if verdict["verdict"] != "unknown":
        assert verdict["verdict"] in ("cause", "ambiguous") and named(verdict)
        assert named(verdict) <= confounders
    assert "shaft_asymmetry" not in could_be(verdict)
    assert verdict["settings"]["leave_out"] == ["shaft_asymmetry"]


@pytest.mark.usefixtures("unrendered", "unhidden")
def test_a_skew_of_the_probes_is_found_or_not_ruled_out(tmp_path):
    rig, skew = write_rig(tmp_path / "rig.yaml", diagnosis={"leave_out": SLOW}), {"kind": "probe_angle"}
    skew |= {"probe_rotation_rad": 0.0, "probe_skew_rad": 0.08}
    verdict = diagnose(simulate(tmp_path, skew), rig, tmp_path / "out")
    assert verdict["verdict"] in ("cause", "ambiguous") and "probe_angle" in could_be(verdict)
    assert verdict["gain"]["ratio"] < 0.3


@pytest.mark.usefixtures("unrendered", "unhidden")
def test_a_change_of_unbalance_from_an_imported_spectrum(tmp_path):
    """The rig knows its unbalance well; since then it has changed. The spectrum is imported first."""
    uncertainty = {"default": 0.1, "eccentricity": 0.02}
    rig = write_rig(tmp_path / "rig.yaml", diagnosis={"uncertainty": uncertainty, "leave_out": SLOW})
    change = {"kind": "unbalance", "label": "change", "eccentricity_m": 4e-6, "eccentricity_phase_rad": 2.0}
    records, spectrum = simulate(tmp_path, change), tmp_path / "spectrum.nc"
    run("import", records, "--rig", rig, "--out", spectrum)
    verdict = diagnose(spectrum, rig, tmp_path / "out", "--hold-out", 200, 300)
    assert verdict["verdict"] in ("cause", "ambiguous") and "unbalance" in could_be(verdict)
    assert np.allclose(verdict["gain"]["speeds"], [200, 300], rtol=1e-4) and verdict["gain"]["ratio"] < 0.5


def test_missing_force_is_the_force_that_was_left_out():
    """On a rotor that couples harmonics, measured at every node: back to rounding, and nothing elsewhere."""
    harmonics = [0, 1, -1, 2, -2, 3, -3]
    uneven = {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 5e4}
    base = {"rotor": point(), "effects": [*RIG["effects"], uneven]}
    model = build_model(base)
    hidden = build_model({**base, "effects": [*base["effects"], PRELOAD]})
    off = measured_response(hidden, SPEEDS, harmonics) - measured_response(model, SPEEDS, harmonics)
    force = equivalent_residual_force(model, model.theta, np.array(SPEEDS), harmonics, off)
    assert np.allclose(force[:, 0, 0], 3.0 * np.exp(-1j), rtol=1e-9)
    assert np.abs(force[:, 1:]).max() < 1e-9


def cause(effect, where, parameters, **more):
    """A certain Cause; parameters : name -> value, standard deviation, unit and part."""
    rows = {name: dict(zip(("value", "std", "unit", "part"), one, strict=True)) for name, one in parameters.items()}
    return Cause(effect=effect, where=where, parameters=rows, posterior_probability=1.0, probability=0.92, **more)


def test_the_stiff_direction_is_an_angle_and_not_the_phase():
    """Turning the stiff direction by an angle turns the phase of the amplitude by twice that."""
    parameters = {"support_anisotropy": (2e4, 100.0, "N/m", "magnitude")}
    parameters |= {"support_anisotropy_phase": (np.deg2rad(70.0), np.deg2rad(2.0), "rad", "phase")}
    words = cause_in_words(cause("support_anisotropy", {"node": 1}, parameters))
    assert words == "support anisotropy at node 1 (20000 ± 100 N/m along 35.0 ± 1.0 °)"
    model = build_model({**RIG, "effects": [{"kind": "support_anisotropy", "support_anisotropy_N_per_m": 2e4,
                                             "support_anisotropy_phase_rad": np.deg2rad(70.0)}]})  # fmt: skip
    (entry,) = model.rotor_unknowns[0].entries
    direction = np.exp(1j * np.deg2rad(35.0))
    force = entry.matrix[0, 0] * 2e4 * np.exp(1j * np.deg2rad(70.0)) * np.conj(direction)
    assert np.allclose(force, -2e4 * direction, rtol=1e-12)  # against a push along 35 degrees, as a spring


@pytest.mark.parametrize("kind", ["nothing", "cause", "ambiguous", "unknown"])
def test_the_first_lines_say_what_to_do_next_whatever_the_verdict(kind, asymmetric):
    verdict, out = asymmetric
    other = {**verdict["causes"][0], "effect": "support_anisotropy", "where": {"node": 1}, "parameters": {}}
    changed = {**verdict, "verdict": kind}
    changed |= {"causes": []} if kind == "nothing" else {}
    if kind == "ambiguous":
        pair = [{key: cause[key] for key in ("effect", "where")} for cause in (verdict["causes"][0], other)]
        told = {"causes": pair, "measurement": "exchange the two probes"}
        changed |= {"ambiguous_with": [other], "separating_measurement": [told]}
    page = page_of(Verdict(**changed), out)
    first = page[: page.index("What the simulation gets wrong")]
    assert "What next" in first
    assert {"nothing": "detection limits", "cause": "95 %", "ambiguous": "Exchange the two probes",
            "unknown": "docs/adding_a_model.md"}[kind] in first  # fmt: skip
    assert ("shaft asymmetry or support anisotropy at node 1" in first) == (kind == "ambiguous")


def test_a_cause_that_is_not_in_doubt_is_said_first(asymmetric):
    """Beside one of two others; where all are in doubt, they are one explanation."""
    (sure,) = asymmetric[0]["causes"]
    likely = {"posterior_probability": 0.8, "probability": 0.74}
    other = {**sure, "effect": "bow", "where": {"element": 1}, "parameters": {}} | likely
    third = {**other, "effect": "runout", "where": {"node": 1}}

    def said(probability):
        causes = [{**sure, "posterior_probability": probability, "probability": 0.92 * probability}, other]
        ambiguous = {**asymmetric[0], "verdict": "ambiguous", "causes": causes, "ambiguous_with": [third]}
        return summary(Verdict(**ambiguous))

    assert said(0.9995).startswith("Something is missing: shaft asymmetry (0.0")
    likely = "(probability 92 %) and another cause, most likely (probability 74 %) bow"
    assert likely in said(0.9995) and "But runout at node 1 cannot be ruled out." in said(0.9995)
    assert "The most likely cause (probability 74 %) is shaft asymmetry" in said(0.85)
    assert "cannot be ruled out. Adding the most likely causes lowers the error" in said(0.85)


def test_a_broken_plugin_is_named_on_the_page_and_in_the_words(asymmetric):
    verdict, out = asymmetric
    broken = Verdict(**{**verdict, "broken_plugins": ["plugin effects/odd.py:7: division by <zero>"]})
    page = page_of(broken, out)
    assert "effects/odd.py:7: division by &lt;zero&gt;" in page and "Repair the broken plugins" in page
    assert "Broken plugins" in summary(broken) and "Broken plugins" not in verdict["summary"]


def test_records_simulated_by_an_extended_rig_are_read_in_their_own_axes(tmp_path):
    """The probes and phase mark that a rig file names are of the machine's records, not of simulated ones."""
    angles = {"A": 45.0, "B": 135.0}
    section = {"rotation": "against_angles", "gravity_angle_deg": -90.0, "harmonics": [0, 1, -1],
               "probes": [{"channel": a, "node": 1, "angle_deg": d, "unit": "mm"} for a, d in angles.items()],
               "keyphasor": {"channel": "key", "mark_angle_deg": 20.0}}  # fmt: skip
    rig = write_rig(tmp_path / "rig.yaml", measurement=section)
    run("simulate", rig, "--speeds", "100", "200", "--out", tmp_path / "records.nc")
    found = read_measurement([tmp_path / "records.nc"], rig).spectrum
    expected = measured_response(build_model(RIG), [100.0, 200.0], found.harmonics)
    assert np.abs(found.amplitude - expected).max() < 1e-3 * np.abs(expected).max()


def test_a_phase_that_the_records_leave_open_is_not_written_as_a_number():
    said = {}
    for name, std in (("known", 0.1), ("open", 5000.0)):
        parameters = {"unbalance": (2e-6, 1.5e-6, "kg m", "magnitude"), "unbalance_phase": (0.5, std, "rad", "phase")}
        unbalance = cause("unbalance", {"node": 1}, parameters)
        said[name] = sizes(unbalance), cause_in_words(unbalance)
    assert said["known"][0] == {
        "size": "2.0 ± 1.5 g mm (95 %: 0.0 to 4.9 g mm)",
        "phase": "28.6 ± 5.7 ° (95 %: 17.4 to 39.9 °)",
    }
    assert said["open"][0]["phase"] == "not known" and said["open"][1].endswith("at any angle)")


def test_a_cause_has_one_pair_of_brackets_and_units_instead_of_endings_of_names():
    def said(where, label="", **shapes):
        parameters = {name: (value, None, "", "shape") for name, value in shapes.items()}
        return cause_in_words(cause("pedestal_resonance", where, parameters, label=label))

    shape = {"natural_frequency_rad_per_s": 1400.0, "bearing_time_s": 0.0005, "damping_ratio": 0.03}
    text = "natural frequency 13400 rpm, bearing time 0.5 ms, damping ratio 0.03"
    assert said({"node": 4}, **shape) == f"pedestal resonance at node 4 ({text})"
    assert said({"node": 4}, "bearing node 4", **shape) == f"pedestal resonance at node 4 (bearing; {text})"
    two = said({"node": 4, "harmonic": [2, 3]}, "disc A", damping_ratio=0.03)
    assert two == "pedestal resonance at node 4 (disc A, harmonics 2 and 3; damping ratio 0.03)"


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ([{"element": 4}, {"node": 3}, {"element": 1, "last_element": 2}], "in elements 1 to 2 and 4 and at node 3"),
        ([{"element": 3, "last_element": 5}, {"element": 1, "last_element": 5}], "in elements 1 to 5 and 3 to 5"),
        ([{"element": 5, "last_element": 8}], "in elements 5 to 8"),
        ([{"element": 5}, {"node": 3}, {"node": 2}], "in element 5 and at nodes 2 and 3"),
        ([{"element": 7}, {"element": 5}], "in elements 5 and 7"),
    ],
)
def test_a_fault_of_several_parts_says_each_of_its_places(places, words):
    assert place(cause("bow", together(places), {})) == f"bow {words}"


def cracked(breathing, log_odds):
    """An explanation by a crack of some law."""
    crack = Candidate("transverse_crack", {}, None, {}, variant={"breathing": breathing})
    return Explanation((crack,), None, log_odds)


@pytest.mark.parametrize(("behind", "others"), [(1.0, [{"breathing": "sudden"}]), (10.0, [])])
def test_laws_within_reach_are_named_too(behind, others):
    """The law of a crack is named alone only where the others are improbable."""
    best = cracked("gradual", 100.0)
    shapes = [cracked("sudden", 99.0 - behind), cracked("gradual", 99.0), cracked("none", 60.0)]
    elsewhere = Explanation((*best.causes, Candidate("bow", {}, None, {})), None, 100.0)
    among = [best, cracked("sudden", 100.0 - behind), *shapes, elsewhere]
    ruled_in = _by_variant(best, "transverse_crack", among, 0.99)
    assert ruled_in[0] is best
    found = [_variant(one, "transverse_crack") for one in ruled_in[1:]]
    assert found == others
    crack = cause("transverse_crack", {}, {}, variant=best.causes[0].variant, other_variants=found)
    assert cause_in_words(crack).endswith(f"breathing gradual{' or sudden' * bool(others)})")
