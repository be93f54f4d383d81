"""Chapter 4: printed spectra and scatter on the bound; its printed estimates: tests/workflow/test_workflow.py."""

from copy import deepcopy
from dataclasses import replace

import chapters
import numpy as np
import pytest
from chapters import REFERENCE

from rotorstudy import Problem, RotorstudyError, build_model, full_spectrum, registry
from rotorstudy.errors import UnidentifiableError
from rotorstudy.inference.linear import solve_linear
from rotorstudy.store import as_complex
from rotorstudy.studies.identify import monte_carlo
from rotorstudy.studies.simulate import case_records, kind_spectra
from thesis import errata
from thesis.chapter_tables import joint_share
from thesis.replay import records, replay_problem, rounding_draws, spectra

CASE = "20 to 50 Hz"


@pytest.fixture
def study():
    return chapters.study(4)


@pytest.fixture(scope="module")
def noisy():
    study = chapters.study(4)
    few = study.monte_carlo.model_copy(update={"levels_percent": [1.0]})
    return monte_carlo(study.model_copy(update={"monte_carlo": few}), "physical", CASE).isel(record=0, noise=0)


def test_maximum_likelihood_sits_on_the_bound_and_least_squares_does_not(noisy):
    for model in noisy.noise_model.values:
        ratio = (noisy.estimate.std("trial") / noisy.cramer_rao).sel(noise_model=model)
        # 500 trials know a standard deviation to 3.2 %
        assert np.abs(ratio.sel(estimator="maximum_likelihood") - 1).max() < 0.1, model
    worst = (noisy.estimate.std("trial") / noisy.cramer_rao).sel(noise_model="white in time", estimator="least_squares")
    assert worst.min() > 1.5 and worst.max() > 10


def test_intervals_of_both_estimators_hold(noisy):
    # 95 % of 500 trials: 92 to 98 % at three standard deviations
    assert float(noisy.coverage.min()) > 0.92 and float(noisy.coverage.max()) < 0.98


def test_the_reading_of_the_clock_matters(study):
    """Negative control: without the thesis's early clock the uncompensated estimates are not those printed."""
    kind = study.record.kinds["incomplete cycles"].model_copy(update={"clock_samples": {}})
    model = study.rig("thesis")
    taken = case_records(study, model, study.cases[CASE].speeds, kind, "from rest")
    problem = Problem(model, kind_spectra(study, kind, taken, "regression", ["none"])["none"], tuple(study.unknowns))
    damping = problem.names.index("external_damping")
    # 100 samples missing, as the message of a record without phase mark says; the thesis's clock adds another 100
    assert solve_linear(*problem.equations(), problem.names)[damping] == pytest.approx(7.34, abs=0.01)


def test_an_incomplete_record_without_reference_says_what_error_to_expect(study):
    kind = study.record.kinds["incomplete cycles"]
    (record,) = case_records(study, study.rig("physical"), [200.0], kind, "steady state")
    words = r"no reference signal.*keyphasor.*0\.17 degrees at 1X and 1\.2 at 7X.*damping"
    with pytest.raises(RotorstudyError, match=words):
        full_spectrum([replace(record, reference=None)], study.harmonics, registry().get("spectrum", "regression"))


def test_chapter_5_from_one_speed_names_the_pair():
    replay = chapters.replay(5)
    found = spectra(replay, records(replay, REFERENCE))
    compensated = as_complex(found.compensated.sel(version="corrected", data_set="fft", spectrum_method="regression"))
    draws = rounding_draws(replay, REFERENCE, "fft")
    problem = replay_problem(replay, ["15 Hz"], compensated, draws)
    with pytest.raises(UnidentifiableError) as caught:
        solve_linear(*problem.equations(), problem.names)
    assert set(caught.value.parameters) == {"eccentricity_real", "stiffness_loss_22_p1"}
    problem = replay_problem(replay, ["15 Hz", "20 Hz"], compensated, draws)
    assert np.isfinite(solve_linear(*problem.equations(), problem.names)).all()


def test_misprints_of_the_regression_matrix_move_the_estimates_and_the_right_one_does_not(study):
    model = study.rig("physical")
    problem = Problem(model, study.clean_spectrum(model, study.cases[CASE].speeds), tuple(study.unknowns))
    true = model.theta[model.position(study.unknowns)]
    assert errata.estimates_with_misprint(problem) == pytest.approx(true, rel=1e-9)
    for misprint in ({"real_from": errata.ROW_ABOVE}, {"swap_imag": True}):
        assert abs(errata.estimates_with_misprint(problem, **misprint)[0] - true[0]) > 0.2


def test_printed_noise_rows_are_closer_than_a_draw_of_the_stated_noise():
    generator = np.random.default_rng(5)
    spread = np.diag([1.0, 10.0, 0.1]) @ np.array([[1, 0, 0], [0.9, 0.4, 0], [0, 0, 1.0]])
    trials = generator.normal(size=(2000, 3)) @ spread.T
    exact = np.zeros(3)
    assert joint_share(0.02 * trials[0], exact, trials) < 0.01
    share = np.mean([joint_share(trial, exact, trials) for trial in trials[:200]])
    assert 0.42 < share < 0.58  # draws of the noise itself: uniform, 200 of them know the mean to 0.02


def test_weight_dominance_costs_what_vibration_is_against_the_deflection_not_what_the_crack_is(study):
    errors = {}
    for scale, eccentricity in ((1e-3, 3e-5), (1e-4, 3e-5), (1e-4, 3e-8)):
        rig = deepcopy(study.rigs["physical"])
        rig["effects"][2]["eccentricity_m"] = eccentricity
        for key in ("stiffness_loss_22_N_per_m", "stiffness_loss_44_N_m"):
            rig["cracks"][0][key] *= scale
        held, full = build_model(rig), build_model({**rig, "cracks": [{**rig["cracks"][0], "weight_dominance": False}]})
        spectrum = study.clean_spectrum(full, study.cases[CASE].speeds)
        problem = Problem(held, spectrum, tuple(study.unknowns))
        found = solve_linear(*problem.equations(), problem.names)[problem.names.index("stiffness_loss_22")]
        true = held.theta[held.position(["stiffness_loss_22"])][0]
        errors[scale, eccentricity] = abs(found / true - 1)
    assert errors[1e-3, 3e-5] > 1 and errors[1e-4, 3e-5] > 1
    assert errors[1e-4, 3e-8] < 0.01
