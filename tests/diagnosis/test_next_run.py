"""The run that is advised decides as often as stated: simulated, and judged by fits of all data together."""

from types import SimpleNamespace

import numpy as np
import pytest
from machines import SLOW, faulty, jeffcott_rig, joined, rig_of, shaft, spectrum_of, unbalance
from scipy.stats import binom

from rotorstudy import build_model, make_term
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import STATED_SET, investigate
from rotorstudy.diagnosis.verdict.next_run import explanations_in_question, further_run, with_term
from rotorstudy.diagnosis.verdict.words import next_steps
from rotorstudy.inference import predictive as coming
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted
from rotorstudy.inference.predictive import Predictive, decision_probability, predictive
from rotorstudy.inference.prior import Prior

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS, NOISE = np.array([200.0, 220.0, 240.0]), np.array([0, 1, -1, 2]), 2e-7
MODEL = build_model(jeffcott_rig())
RUNS = 100  # simulated
ONE_IN_A_THOUSAND = (5e-4, 1 - 5e-4)


def diagnosed(speeds, **hidden):
    """Diagnosis of a rotor with an effect that is not in its model, and the Spectrum measured."""
    measured = spectrum_of(faulty(MODEL, hidden), speeds, HARMONICS, NOISE / np.sqrt(2), 1)
    settings = {"uncertainty": {"default": 0.02}, "most_causes": 1, "leave_out": SLOW}
    return investigate(measured, MODEL, settings=settings), measured


@pytest.fixture(scope="module")
def bow_or_runout():
    """A bow, which far below the critical speed a runout imitates."""
    return diagnosed(SPEEDS, kind="bow", bow_m=2e-6)


def run_at(diagnosis, measured, speed, term=None):
    """Fits and weights of the explanations, with a trial unbalance if any, and the Spectrum of a run at a speed."""
    fits, weights = explanations_in_question(diagnosis.search, STATED_SET)
    base, *fits = (with_term(one, term) if term else one for one in (diagnosis.search.base, *fits))
    run, _ = further_run(diagnosis.search, measured, base, fits, weights, np.array([speed]))
    return fits, weights, run


def share_decided(diagnosis, measured, speed, term=None):
    """Shares of simulated runs that decide, and of those that then name what is true; a trial is fitted alone."""
    fits, weights, run = run_at(diagnosis, measured, speed, term)
    before, draws, decided, right = diagnosis.search.spectrum, np.random.default_rng(7), 0, 0
    noise = np.linalg.cholesky(run.full_covariance()[0])
    for _ in range(RUNS):
        true = draws.choice(len(fits), p=weights)
        theta = fits[true].theta.copy()
        free = fits[true].model.position(fits[true].names)
        theta[free] = draws.multivariate_normal(fits[true].free, fits[true].covariance, method="cholesky")
        real, imaginary = (noise @ draws.normal(size=len(noise))).reshape(2, len(HARMONICS), -1)
        new = run.with_amplitude(predicted(fits[true].model, run, theta) + real + 1j * imaginary)
        if term:
            known = [Prior(one.names, one.free, one.covariance) for one in fits]
            again = [
                fit(one.model, new, prior, start=one.theta).evidence for one, prior in zip(fits, known, strict=True)
            ]
        else:
            both = joined(before, new)
            again = [fit(one.model, both, one.prior, start=one.theta).evidence - one.evidence for one in fits]
        odds = np.log(weights) + again
        posterior = np.exp(odds - np.logaddexp.reduce(odds))
        decided += posterior.max() >= STATED_SET
        right += posterior[true] >= STATED_SET
    return decided / RUNS, right / max(decided, 1)


def test_the_advised_run_decides_as_often_as_stated_and_rightly(bow_or_runout):
    diagnosis, measured = bow_or_runout
    assert diagnosis.verdict.verdict == "ambiguous"
    assert {c.effect for c in (*diagnosis.verdict.causes, *diagnosis.verdict.ambiguous_with)} >= {"bow", "runout"}
    advised = next(run for run in diagnosis.verdict.next_runs if run.trial is None)
    decided, right = share_decided(diagnosis, measured, advised.speed)
    low, high = binom.ppf(ONE_IN_A_THOUSAND, RUNS, advised.decision_probability) / RUNS
    assert advised.decision_probability > 0.2 and low <= decided <= high
    assert right >= binom.ppf(1e-3, int(decided * RUNS), STATED_SET) / (decided * RUNS)


def test_a_trial_unbalance_decides_as_often_as_stated():
    """It adds forward motion, of which an anisotropic support makes backward motion, an added mass none."""
    uneven = {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 3e4}
    diagnosis, measured = diagnosed(np.array([150.0, 300.0, 450.0]), **uneven)
    advised = next(run for run in diagnosis.verdict.next_runs if run.trial)
    item = {"kind": "unbalance", **advised.trial.where, "label": "trial", "mass_kg": 1e-3,
            "eccentricity_m": advised.trial_unbalance / 1e-3}  # fmt: skip
    term = make_term("effect", item, MODEL.structure, MODEL.sensors)
    decided, _ = share_decided(diagnosis, measured, advised.speed, term)
    low, high = binom.ppf(ONE_IN_A_THOUSAND, RUNS, advised.decision_probability) / RUNS
    assert low <= decided <= high
    fits, weights, run = run_at(diagnosis, measured, advised.speed)
    (without,) = predictive(fits, run)
    assert decision_probability(without, weights, STATED_SET) < advised.decision_probability  # negative control


def test_a_run_where_it_was_measured_already_does_not_decide(bow_or_runout):
    """The negative control."""
    diagnosis, measured = bow_or_runout
    fits, weights, run = run_at(diagnosis, measured, SPEEDS[1])
    (one,) = predictive(fits, run)
    stated = decision_probability(one, weights, STATED_SET)
    decided, _ = share_decided(diagnosis, measured, SPEEDS[1])
    assert stated < 0.05 and decided <= binom.ppf(1 - 5e-4, RUNS, stated + 1 / RUNS) / RUNS
    assert coming.expected_log_odds(one, weights) < 0.7 * diagnosis.verdict.next_runs[0].expected_log_odds


def test_the_page_and_the_summary_of_what_to_do_name_the_run(bow_or_runout):
    verdict = bow_or_runout[0].verdict
    first = verdict.next_runs[0]
    (text, *_) = next_steps(verdict)
    assert text.startswith("Run at ") and f"({first.speed:.4g} rad/s)" in text
    assert "to 1, decided with a probability of" in text
    speeds = [run.speed for run in verdict.next_runs]
    assert all(0.25 * SPEEDS[0] <= speed <= 1.3 * SPEEDS[-1] + 1e-9 for speed in speeds)


def test_divergence_is_the_mean_log_ratio_of_two_normal_densities():
    """Of N(0, 1) and N(m, s^2): ln s + (1 + m^2) / (2 s^2) - 1/2; and the mean over draws in several dimensions."""
    run = Predictive(np.array([[0.0], [1.5]]), np.array([[[1.0]], [[4.0]]]))
    found = coming.divergence(run)
    assert found[0, 1] == pytest.approx(np.log(2) + (1 + 1.5**2) / 8 - 0.5)
    assert found[1, 0] == pytest.approx(-np.log(2) + (4 + 1.5**2) / 2 - 0.5)
    assert np.diag(found) == pytest.approx(0)
    draws = np.random.default_rng(2)
    roots = draws.normal(size=(2, 3, 3))
    run = Predictive(draws.normal(size=(2, 3)), np.eye(3) + roots @ np.swapaxes(roots, -1, -2))
    data = draws.multivariate_normal(run.mean[0], run.covariance[0], size=20000)
    density = coming.log_densities(run, data)
    ratio = density[:, 0] - density[:, 1]
    assert ratio.mean() == pytest.approx(coming.divergence(run)[0, 1], abs=4 * ratio.std() / np.sqrt(len(ratio)))
    weights = np.array([0.8, 0.2])
    expected = weights @ (np.log([4, 0.25]) + coming.divergence(run)[[0, 1], [1, 0]])
    assert coming.expected_log_odds(run, weights) == pytest.approx(expected)


def test_speeds_beyond_the_table_of_a_bearing_are_left_out():
    table = {"speeds_rad_per_s": [0.0, 300.0], "stiffness_N_per_m": {"xx": [1e6, 2e6], "yy": [1e6, 2e6]}}
    bearings = [{"kind": "speed_tabulated", "node": n, "label": str(n), "bearing_scale": 1.0} | table for n in (1, 3)]
    model = build_model(rig_of(shaft(0.6, 2), bearings, unbalance(2, 1e-5), sensors=[2]))
    measured = spectrum_of(model, SPEEDS, HARMONICS, NOISE)
    held = fit(model, measured, Prior.independent({"eccentricity_real": (1e-5, 1e-6)}), steps=0)
    found = SimpleNamespace(settings=Settings(), form_error_by_harmonic=0.0)
    speeds = np.array([250.0, 299.0, 301.0, 390.0])
    run, each = further_run(found, measured, held, [held, held], np.array([0.5, 0.5]), speeds)
    assert run.speed.tolist() == [250.0, 299.0] and each.shape == (2, 2, len(HARMONICS), 1)
