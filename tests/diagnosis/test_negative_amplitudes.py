"""A damping or a stiffness that is built in cannot be negative, together with what the rig has of the same."""

import numpy as np
import pytest
from machines import jeffcott_rig, spectrum_of
from scipy.integrate import quad
from scipy.optimize import lsq_linear
from scipy.stats import norm

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.odds import log_limited
from rotorstudy.diagnosis.search.screening import Projected, screen
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.levenberg_marquardt import levenberg_marquardt
from rotorstudy.inference.prior import Prior
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model

SPEEDS, HARMONICS = np.array([300.0, 450.0, 600.0, 750.0, 900.0]), np.array([0, 1, -1, 2, -2])
MODEL = build_model(jeffcott_rig(2e-5))
SETTINGS = Settings(uncertainty={"default": 1e-3})


def explained(effect, value, noise):
    """The limited amplitude of an effect as fitted to records in which it has a given value."""
    cause = candidate(MODEL, effect, {"node": 1})
    (limited,) = cause.positive
    theta = np.concatenate([MODEL.theta, [value if name == limited else 0.0 for name in cause.names]])
    work = begin(MODEL, spectrum_of(MODEL.plus(cause.term), SPEEDS, HARMONICS, noise, theta=theta), SETTINGS)
    return work.explain((cause,), {}).fit.values[limited]


@pytest.mark.parametrize("effect", ["parallel_misalignment", "angular_misalignment"])
def test_a_coupling_has_no_negative_stiffness(effect):
    rotor = {"kind": "offset_disc", "mass_kg": 2.0, "polar_moment_kg_m2": 5e-3, "diametral_moment_kg_m2": 2.5e-3}
    rotor |= {"k22_N_per_m": 3.5e5, "k24_N": 2e4, "k44_N_m": 1.7e4}
    model = build_model({"rotor": rotor})
    (limited,) = candidate(model, effect, {"node": 1}).positive
    assert limited.startswith("coupling_stiffness")


@pytest.mark.parametrize(
    ("effect", "change", "held"),
    [
        ("parallel_misalignment", -2e3, 0.0),
        ("parallel_misalignment", 2e3, 2e3),
        ("external_damping", -90.0, -90.0),  # of 100 N s/m that the rig states
        ("external_damping", -110.0, -100.0),
    ],
)
def test_a_fit_holds_an_amplitude_at_zero_with_what_the_rig_has_of_the_same(effect, change, held):
    assert explained(effect, change, 1e-8) == pytest.approx(held, rel=0.01, abs=1.0)


def test_the_evidence_of_an_amplitude_held_at_zero_is_that_of_the_part_of_its_posterior_above_zero():
    """Against a quadrature over a posterior that is normal but for the limit, far below zero, beside it and above."""
    rng = np.random.default_rng(5)
    columns, noise = rng.normal(size=(40, 2)), rng.normal(size=40)
    prior = Prior.independent({"limited": (0.0, 3.0), "free": (0.0, 3.0)})
    for true in (-2.0, -0.3, 0.0, 0.4):
        measured = columns @ [true, 1.0] + noise

        def predict(theta):
            return theta @ columns.T, np.broadcast_to(columns, (1, *columns.shape))

        start, names = np.array([[1.0, 0.0]]), ("limited", "free")
        lower = np.array([0.0, -np.inf])
        found = levenberg_marquardt(predict, measured[None], start, names, prior=prior, lower=lower)
        rows = np.vstack([columns, np.eye(2) / 3.0])
        right = np.concatenate([measured, np.zeros(2)])
        assert found.theta[0] == pytest.approx(lsq_linear(rows, right, (lower, np.inf)).x, abs=1e-6)
        covariance = np.linalg.inv(rows.T @ rows)
        step = covariance @ rows.T @ (right - rows @ found.theta[0])
        added = log_limited(found.theta[0, 0], step[0], np.sqrt(covariance[0, 0]), 0.0)
        held = -0.5 * np.sum((right - rows @ found.theta[0]) ** 2) + added
        mean = covariance @ rows.T @ right
        least = -0.5 * np.sum((right - rows @ mean) ** 2)
        share = quad(norm(mean[0], np.sqrt(covariance[0, 0])).pdf, 0, np.inf)[0]
        assert held == pytest.approx(least + np.log(2 * share), abs=1e-6)  # half of the prior is above zero


def test_a_screened_amplitude_is_as_uncertain_as_all_amplitudes_of_its_cause_leave_it():
    """Against the share of draws of the posterior; columns nearly alike leave its sign open, each alone would not."""
    cause, rng = candidate(MODEL, "parallel_misalignment", {"node": 1}), np.random.default_rng(31)
    (limited,) = cause.positive
    std = np.array([cause.prior[name][1] for name in cause.names])
    alike = rng.normal(size=200)
    columns = {name: (alike + 0.05 * rng.normal(size=200)) / s for name, s in zip(cause.names, std, strict=True)}
    true = np.where([name == limited for name in cause.names], -1.0, 1.0) * std
    residual = np.column_stack(list(columns.values())) @ true + rng.normal(size=200)
    projected = Projected(residual, columns, dict.fromkeys(MODEL.names, 0.0))
    scaled = np.column_stack([columns[name] for name in cause.names]) * std
    covariance = np.linalg.inv(np.eye(len(std)) + scaled.T @ scaled)
    drawn = rng.multivariate_normal(covariance @ scaled.T @ residual, covariance, 100_000)
    place = cause.names.index(limited)
    share = np.mean(drawn[:, place] > 0)
    judged = screen(projected, cause)
    found = judged.evidence - screen(projected, cause._replace(positive={})).evidence
    assert 0.05 < share < 0.95
    assert found == pytest.approx(np.log(2 * share), abs=0.005)  # of draws; half of the prior is above zero
    others_known = norm.cdf(judged.start[place] / judged.detection[place])
    assert abs(np.log(others_known / share)) > 0.05


@pytest.mark.parametrize(("stiffness", "named"), [(4e4, True), (-4e4, False)])
def test_a_coupling_of_negative_stiffness_is_not_named(stiffness, named):
    cause = candidate(MODEL, "parallel_misalignment", {"node": 1})
    hidden = {"coupling_stiffness": stiffness, "misalignment_force_2X": 20.0}
    values = [hidden.get(p.name, 0.0) for p in cause.term.parameters for _ in range(2 if p.is_complex else 1)]
    theta = np.concatenate([MODEL.theta, values])
    measured = spectrum_of(MODEL.plus(cause.term), SPEEDS, HARMONICS, 1e-8, theta=theta)
    alone = [name for name, effect in registry().plugins["effect"].items() if name != cause.effect and effect.candidate]
    settings = {"uncertainty": {"default": 1e-3}, "leave_out": alone}  # no other effect, nor the rig, explains it
    found = investigate(measured, MODEL, settings=settings).verdict
    assert (found.verdict == "cause") == named
    assert all(c.parameters["coupling_stiffness"].value >= 0 for c in found.causes)
