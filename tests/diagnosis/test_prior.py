"""What one command learns of a rig, the next one knows: values and their covariance travel in the rig file."""

import numpy as np
import pytest
import yaml
from machines import SLOW, jeffcott_rig, joined, spectrum_of
from one_line_errors import refused, run

from rotorstudy import Problem, RotorstudyError, build_model, load_rig
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.result import Verdict
from rotorstudy.inference.fit import fit
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.inference.prior import Prior, prior_of
from rotorstudy.model.estimated_rig import rig_with_estimate
from rotorstudy.model.uncertainty import uncertainty_section
from rotorstudy.store import load

HARMONICS, NOISE = np.array([0, 1, -1, 2, 3]), 2e-9
RIG = jeffcott_rig(5e-6, 0.52, internal=20.0, cracks=[{"kind": "switching", "stiffness_loss_N_per_m": 2.5e5}])
MODEL = build_model(RIG)
KNOWN = ("external_damping", "eccentricity_real", "eccentricity_imag")


def noisy(model, speeds, seed):
    return spectrum_of(model, speeds, HARMONICS, NOISE / np.sqrt(2), seed)


def from_file(rig):
    """A rig as the next command reads it."""
    return build_model(yaml.safe_load(yaml.safe_dump(rig)))


def test_a_posterior_taken_as_a_prior_gives_the_joint_fit():
    first, second = noisy(MODEL, [590.0], 1), noisy(MODEL, [300.0], 2)
    found = output_error_fit(Problem(MODEL, first, MODEL.names))
    prior = prior_of(from_file(rig_with_estimate(RIG, MODEL, MODEL.names, found.theta, found.covariance)), {})
    assert prior.names == MODEL.names
    assert prior.mean == pytest.approx(found.theta, rel=1e-12)
    scale = np.outer(found.std, found.std)
    assert prior.covariance / scale == pytest.approx(found.covariance / scale, rel=0, abs=1e-12)
    joint = output_error_fit(Problem(MODEL, joined(first, second), MODEL.names))
    chained = fit(MODEL, second, prior)
    # the harmonics are not linear in the amplitudes, which the first data leave open by up to 0.3 %: to first order by
    # as little of their standard deviations may the two posteriors differ
    assert (np.abs(chained.free - joint.theta) < 3e-3 * joint.std).all()
    assert np.sqrt(np.diag(chained.covariance)) == pytest.approx(joint.std, rel=3e-3)
    without = fit(MODEL, second, Prior(prior.names, prior.mean, np.diag(np.diag(prior.covariance))))
    off = np.abs(without.free - joint.theta) / joint.std  # negative control: correlations lost
    assert off.max() > 1


def test_an_identified_rig_is_what_a_diagnosis_starts_from():
    found = output_error_fit(Problem(MODEL, noisy(MODEL, [300.0, 590.0], 3), KNOWN))
    model = from_file(rig_with_estimate(RIG, MODEL, KNOWN, found.theta, found.covariance))
    settings = Settings(uncertainty={"default": 0.05}, leave_out=SLOW, most_causes=1)
    verdict = investigate(noisy(MODEL, [200.0, 400.0, 500.0], 4), model, settings=settings)
    prior = verdict.search.prior
    assert prior.part(KNOWN).covariance == pytest.approx(found.covariance, rel=1e-9)
    assert prior.by_name["internal_damping"] == pytest.approx((20.0, 1.0))  # not identified: as `diagnosis` says
    assert verdict.verdict.verdict == "nothing"
    # negative control: a rig said to be known as well, but wrong, is contradicted
    wrong = rig_with_estimate(RIG, MODEL, KNOWN, found.theta * [1.2, 1, 1], found.covariance)
    settings = settings.model_copy(update={"model_error": 0.0, "model_floor": 0.0})
    verdict = investigate(noisy(MODEL, [200.0, 400.0, 500.0], 4), from_file(wrong), settings=settings)
    assert verdict.verdict.verdict != "nothing"


def test_an_extended_rig_carries_the_covariance_of_the_fit_and_is_identified_again():
    item = {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 3e4, "support_anisotropy_phase_rad": 0.7}
    truth = build_model({**RIG, "effects": [*RIG["effects"], {**item, "label": "found 1"}]})
    speeds = [150.0, 250.0, 350.0, 450.0, 560.0]
    settings = {"uncertainty": {"default": 0.05, "rotor": 0}, "leave_out": SLOW, "most_causes": 1}
    diagnosis = investigate(noisy(truth, speeds, 5), MODEL, settings=settings)
    rig = extended_rig(RIG, diagnosis)
    model = from_file(rig)
    assert model.names == truth.names
    prior, best = prior_of(model, {}), diagnosis.best
    (cause,) = diagnosis.search.best.causes
    here = prior.part(["external_damping", *(u.name for u in model.terms[-1].unknowns)])
    theta, covariance = best.of(["external_damping", *cause.names])
    assert here.mean == pytest.approx(theta, rel=1e-9)
    assert here.covariance == pytest.approx(covariance, rel=1e-6)
    found = output_error_fit(Problem(model, noisy(truth, [200.0, 400.0], 6), model.names))
    spread, off = found.covariance + prior.part(model.names).covariance, found.theta - model.theta
    assert off @ np.linalg.solve(spread, off) < 40  # chi-square of 7: once in a million


def test_values_that_were_not_estimated_keep_what_the_rig_says_of_them():
    stated = {"parameters": ["internal_damping", "external_damping"], "standard_deviations": [1.0, 2.0],
              "correlations": [[1.0], [0.5, 1.0]]}  # fmt: skip
    given = {**RIG, "prior": stated}
    covariance = np.diag([4.0, np.inf])
    names, values = ("external_damping", "stiffness_loss"), np.array([90.0, np.nan])
    rig = rig_with_estimate(given, build_model(given), names, values, covariance)
    assert rig["cracks"] == RIG["cracks"]  # left open by the data
    assert rig["effects"][1]["external_damping_N_s_per_m"] == 90.0
    assert rig["prior"]["parameters"] == ["external_damping", "internal_damping"]
    assert rig["prior"]["standard_deviations"] == [2.0, 1.0]
    assert rig["prior"]["correlations"] == [[1.0], [0.0, 1.0]]


def test_a_loss_that_was_estimated_no_longer_follows_from_a_depth():
    depth = {"kind": "strip_integration", "depth_ratio": 0.5, "span_m": 0.4, "diameter_m": 0.015,
             "youngs_modulus_Pa": 2e11}  # fmt: skip
    given = {**RIG, "rotor": {**RIG["rotor"], "stiffness_N_per_m": 3.5e5},
             "cracks": [{"kind": "switching", "depth": depth}]}  # fmt: skip
    model = build_model(given)
    (name,) = (n for n in model.names if "loss" in n)
    rig = rig_with_estimate(given, model, (name,), np.array([1e4]), np.array([[1e4]]))
    assert "depth" not in rig["cracks"][0]
    again = from_file(rig)
    assert again.theta[again.position([name])] == pytest.approx(1e4)


GOOD = {"parameters": ["external_damping", "internal_damping"], "standard_deviations": [2.0, 1.0]}


def test_a_loss_of_a_crack_that_a_fit_ends_below_zero_is_stated_as_none():
    """Negative control: a rig that states it is refused, in which no share of an infinite stiffness is told."""
    (name,) = (one for one in MODEL.names if "stiffness_loss" in one)
    rig = rig_with_estimate(RIG, MODEL, (name,), np.array([-1e4]), np.array([[1e10]]))
    assert rig["cracks"][0]["stiffness_loss_N_per_m"] == 0 and build_model(rig)
    wrong = {**RIG, "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": -1e4}]}
    with pytest.raises(RotorstudyError, match="a crack loses from nothing") as said:
        build_model(wrong)
    assert "inf" not in str(said.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parameters": ["external_dampin", "internal_damping"]}, "did you mean 'external_damping'"),
        ({"parameters": ["external_damping", "external_damping"]}, "given twice"),
        ({"standard_deviations": [2.0]}, "1 standard deviations .* for 2 parameters"),
        ({"standard_deviations": [2.0, 0.0]}, "standard_deviations"),
        ({"standard_deviations": [2.0, float("nan")]}, "standard_deviations"),
        ({"correlations": [[1.0], [0.5]]}, "lower triangle"),
        ({"correlations": [[1.0, 0.5], [0.4, 1.0]]}, "symmetric"),
        ({"correlations": [[1.0], [0.5, 2.0]]}, "diagonal"),
        ({"correlations": [[1.0], [1.5, 1.0]]}, "positive definite"),
        ({"correlations": [[1.0], [1.0 - 2e-16, 1.0]]}, "positive definite"),
        ({"correlations": [[1.0], [float("inf"), 1.0]]}, "correlations"),
        ({"correlation": [[1.0], [0.5, 1.0]]}, "did you mean 'correlations'"),
    ],
)
def test_an_impossible_prior_is_refused(change, words):
    assert build_model({**RIG, "prior": GOOD}).uncertainty.covariance == pytest.approx(np.diag([4.0, 1.0]))
    refused(lambda: build_model({**RIG, "prior": {**GOOD, **change}}), match=words)


@pytest.mark.parametrize("off", [0.0, 1e-5, 1e-3])
def test_a_covariance_that_is_singular_or_indefinite_by_round_off_is_written_so_that_it_can_be_read(off):
    correlation = np.array([[1, 1, 0.5], [1, 1, 0.5 - off], [0.5, 0.5 - off, 1]])
    std = np.array([2.0, 1e-7, 1e-7])
    section = uncertainty_section(KNOWN, correlation * np.outer(std, std))
    prior = prior_of(from_file({**RIG, "prior": section}), {"default": 0.0}).part(KNOWN)
    assert np.isfinite(prior.whitener).all()
    assert prior.covariance / np.outer(prior.std, prior.std) == pytest.approx(correlation, abs=1e-8 + off)


def test_a_rig_whose_values_are_all_held_has_a_verdict_that_can_be_read_back():
    settings = Settings(uncertainty={"default": 0.0}, nuisance={}, most_causes=1)
    verdict = investigate(noisy(MODEL, [300.0, 590.0], 1), MODEL, settings=settings).verdict
    assert verdict.verdict == "nothing" and verdict.parameter_p_value == 1.0
    assert Verdict.model_validate_json(verdict.model_dump_json()) == verdict


def test_a_prior_needs_values_and_says_whose():
    rig = {**RIG, "effects": [{"kind": "internal_damping"}, *RIG["effects"][1:]], "prior": GOOD}
    refused(lambda: build_model(rig), match=r"internal_damping .*has no value")


def test_the_whole_matrix_and_the_lower_triangle_say_the_same():
    given = [[1.0, 0.5], [0.5, 1.0]], [[1.0], [0.5, 1.0]]
    whole, lower = (build_model({**RIG, "prior": {**GOOD, "correlations": one}}) for one in given)
    assert (whole.uncertainty.covariance == lower.uncertainty.covariance).all()
    assert whole.uncertainty.covariance[0, 1] == 1.0
    _, prior = base_model(lower, Settings())
    assert prior.part(["internal_damping", "external_damping"]).covariance[0, 1] == 1.0


def test_identify_writes_a_rig_that_states_what_it_found(tmp_path, command):
    rig, records, out = tmp_path / "rig.yaml", tmp_path / "records.nc", tmp_path / "identified_rig.yaml"
    rig.write_text(yaml.safe_dump({**RIG, "measurement": {"harmonics": HARMONICS.tolist()}}))
    run("simulate", rig, "--speeds", "200", "400", "--noise", "1", "--rate", "2000", "--out", records)
    identify = ["identify", str(records), "--rig", str(rig), "--unknowns", "external_damping", "eccentricity"]
    run(*identify, "--out", tmp_path / "found.nc", "--rig-out", out)
    model, found = load_rig(out), load(tmp_path / "found.nc")
    assert model.uncertainty.names == KNOWN
    assert model.theta[model.position(["external_damping"])] == pytest.approx(found.estimate.values[0], rel=1e-12)
    assert model.uncertainty.covariance[0, 0] ** 0.5 == pytest.approx(found.standard_deviation.values[0], rel=1e-12)
    assert model.theta[model.position(["internal_damping"])] == 20.0
    assert "--rig-out" in command(*identify, "--rig-out", rig, status=1).err
