"""What is built in cannot be negative, together with what the rig has of it; a support loses no more than it has."""

from dataclasses import replace

import numpy as np
import pytest
from machines import OFFSET_DISC, all_but, disc, jeffcott_rig, rig_of, shaft, spectrum_of, springs, unbalance
from scipy.stats import norm

from rotorstudy import Entry, Parameter, build_model, registry
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.form_fit import fitted_with_form
from rotorstudy.diagnosis.search.impossible import _is_idle, is_negative, loses_more_than_all
from rotorstudy.diagnosis.search.odds import Explanation, _log_beyond, log_possible
from rotorstudy.diagnosis.search.screening import Projected, screen
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.model.kinds import Effect

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS = np.array([300.0, 450.0, 600.0, 750.0, 900.0]), np.array([0, 1, -1, 2, -2])
MODEL = build_model(jeffcott_rig(2e-5))
SIGNIFICANCE = Settings().significance


def fitted(model, cause, values, noise, speeds=SPEEDS, harmonics=HARMONICS):
    """A cause fitted to the records of a model with it, of amplitudes with these values."""
    extended, theta = model.plus(cause.term), np.append(model.theta, values)
    measured = spectrum_of(extended, speeds, harmonics, noise, theta=theta)
    return Explanation((cause,), fit(extended, measured, Prior.independent(cause.prior), start=theta), 0.0)


def explained(effect, value, noise):
    """An effect whose first amplitude is a given one, fitted to its records, and the standard deviation of that."""
    cause = candidate(MODEL, effect, {"node": 1})
    (place,) = (i for i, name in enumerate(cause.names) if name in cause.positive)
    found = fitted(MODEL, cause, value * np.eye(len(cause.names))[place], noise)
    return found, np.sqrt(found.fit.covariance[place, place])


@pytest.mark.parametrize("effect", ["parallel_misalignment", "angular_misalignment"])
def test_a_coupling_has_no_negative_stiffness(effect):
    (limited,) = candidate(build_model({"rotor": OFFSET_DISC}), effect, {"node": 1}).positive
    assert limited.startswith("coupling_stiffness")


@pytest.mark.parametrize(("share", "expected"), [(0.5, False), (2.0, True)])
def test_powers_of_one_law_are_positive_together(share, expected):
    """A support that stiffens ever more slowly has a negative cube; with one of twice its square it would soften."""
    cause = candidate(MODEL, "cubic_stiffness", {"node": 1})
    size = {name: std for name, (_, std) in cause.prior.items()}
    values = [1e-3 * size[name] * (1.0 if "quadratic" in name else -share) for name in cause.names]
    found = fitted(MODEL, cause, values, 1e-12)
    assert found.fit.free == pytest.approx(values, rel=0.01)
    assert is_negative(found, SIGNIFICANCE) == expected


@pytest.mark.parametrize(("sigma", "expected"), [(-2.0, False), (-4.0, True), (40.0, False)])
def test_an_amplitude_is_negative_only_beyond_its_standard_deviation(sigma, expected):
    _, std = explained("parallel_misalignment", 0.0, 1e-6)
    found, _ = explained("parallel_misalignment", sigma * std, 1e-6)
    assert is_negative(found, SIGNIFICANCE) == expected


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


@pytest.mark.parametrize(("change", "expected"), [(-90.0, False), (-110.0, True)])
def test_what_the_rig_has_of_the_same_counts_with_it(change, expected):
    """A rotor that has 10 N s/m where the rig states 100 is possible."""
    found, std = explained("external_damping", change, 1e-8)
    assert std < 1  # the sign is known
    assert is_negative(found, SIGNIFICANCE) == expected


KNOWN = {"uncertainty": {"default": 1e-3}, "leave_out": all_but("parallel_misalignment")}  # nothing else explains it


def coupled(stiffness):
    """Records of a coupling with a stiffness that may be negative."""
    cause = candidate(MODEL, "parallel_misalignment", {"node": 1})
    hidden = {"coupling_stiffness": stiffness, "misalignment_force_2X": 20.0}
    values = [hidden.get(p.name, 0.0) for p in cause.term.parameters for _ in range(2 if p.is_complex else 1)]
    theta = np.concatenate([MODEL.theta, values])
    return cause, spectrum_of(MODEL.plus(cause.term), SPEEDS, HARMONICS, 1e-8, theta=theta)


@pytest.mark.parametrize("may_be_negative", [False, True])
def test_a_fit_ends_at_zero_where_less_cannot_be(may_be_negative):
    cause, measured = coupled(-4e4)
    settings = Settings(**KNOWN)
    work = begin(MODEL, with_model_error(measured, settings), settings)
    (limited,) = cause.positive
    cause = cause._replace(positive={} if may_be_negative else cause.positive)
    found = fitted_with_form(work, (cause,), work.base.values)
    assert found.fit.values[limited] == pytest.approx(-4e4 if may_be_negative else 0.0, rel=0.01)


def test_a_cause_that_a_fit_holds_at_zero_is_none():
    """Negative control: with the amplitude that it has."""
    found, _ = explained("external_damping", 40.0, 1e-8)
    assert not _is_idle(found)
    assert _is_idle(replace(found, fit=replace(found.fit, free=0.0 * found.fit.free)))


@pytest.mark.parametrize("beyond", [0.0, 1.0, 3.0, 6.0])
def test_what_is_held_at_zero_is_as_probable_as_the_part_of_its_posterior_above(beyond):
    """The normal posterior of one amplitude whose mean is some standard deviations below zero, in closed form."""
    std, cost = 0.7, beyond**2  # the cost at zero is that much above the least
    held = -cost / 2 + log_possible(0.0, std) + _log_beyond(0.0, std, -beyond / std)
    assert held == pytest.approx(norm.logcdf(-beyond) + np.log(2))
    assert _log_beyond(20 * std, std, -beyond / std) == 0.0  # a fit that ended far above zero was not held there


def test_either_amplitude_of_a_crack_is_positive_by_itself_whatever_opens_it():
    """Powers of one law are positive together, which two directions of a loss are not."""
    known = [{"crack": "breathing", "opened_by": one} for one in ("weight", "deflection")]
    found = [candidate(MODEL, "breathing_crack", {}, variant=variant).positive for variant in known]
    assert [list(one.values()) for one in found] == 2 * [[{}, {}]]
    both = candidate(MODEL, "cubic_stiffness", {"node": 1}).positive  # negative control
    assert all(same for same in both.values())


@pytest.mark.parametrize("uncertainty", [0.0, 0.02])
def test_a_lower_bound_counts_what_the_rig_has_also_where_that_is_held(uncertainty):
    settings = Settings(**KNOWN | {"uncertainty": {"default": uncertainty}, "leave_out": all_but("external_damping")})
    measured = spectrum_of(build_model(jeffcott_rig(2e-5, external=40.0)), SPEEDS, HARMONICS, 1e-8)
    work = begin(MODEL, with_model_error(measured, settings), settings)
    (cause,) = work.candidates
    found = fitted_with_form(work, (cause,), work.base.values)
    assert found.fit.values[cause.names[0]] == pytest.approx(-60.0, rel=0.1)  # of 100 N s/m


@pytest.mark.parametrize(("stiffness", "named"), [(4e4, True), (-4e4, False)])
def test_a_coupling_of_negative_stiffness_is_not_named(stiffness, named):
    cause, measured = coupled(stiffness)
    found = investigate(measured, MODEL, settings=KNOWN).verdict
    assert ({c.effect for c in found.causes} == {cause.effect}) == named
    assert (found.verdict == "cause") == named


BEARINGS = springs((1, 3, 5), (1e6, 1.6e6), (300.0, 300.0))  # of which one may give way, and the rotor does not fall
ROTOR = shaft(0.8, 4, disc(2, 2.0, 4e-3, 2.1e-3), youngs_modulus_Pa=2.1e11, density_kg_per_m3=7800.0)
HELD = build_model(rig_of(ROTOR, BEARINGS, unbalance(2, 2e-5, 0.4), sensors=[2, 4]))
SLOWER = np.array([60.0, 100.0, 140.0])


def loss(lost, node, along):
    """A loss along a direction, fitted to records of the same loss with little noise."""
    cause = candidate(HELD, "support_loss", {"node": node}, {"direction_rad": along})
    return fitted(HELD, cause, [lost], 1e-9, SLOWER, HARMONICS[:3])


@pytest.mark.parametrize(("along", "all_of_it"), [(0.0, 1e6), (np.pi / 2, 1.6e6)])
@pytest.mark.parametrize(("share", "expected"), [(0.9, False), (1.1, True)])
def test_a_bearing_loses_at_most_its_stiffness_along_a_direction(along, all_of_it, share, expected):
    found = loss(share * all_of_it, 3, along)
    assert found.fit.theta[-1] == pytest.approx(share * all_of_it, rel=1e-2)
    assert loses_more_than_all(found, HELD.structure, SLOWER) == expected


def test_where_there_is_no_bearing_there_is_nothing_to_lose():
    assert loses_more_than_all(loss(3e4, 2, 0.3), HELD.structure, SLOWER)


def test_a_magnetic_pull_takes_nothing_from_a_support(monkeypatch):
    """The shaft holds it, as an electric machine is held between its bearings."""

    def pull(structure, node: int | None = None):
        here = np.outer(structure.unit(node), structure.unit(node))
        return [Parameter("pull", "N/m", (Entry(here),), typical=1e4)]

    monkeypatch.setitem(registry().plugins["effect"], "pull", Effect("pull", pull, source="none", positive=True))
    found = fitted(HELD, candidate(HELD, "pull", {"node": 2}), [3e4], 1e-9, SLOWER, HARMONICS[:3])
    assert found.fit.theta[-1] == pytest.approx(3e4, rel=1e-2)
    assert not loses_more_than_all(found, HELD.structure, SLOWER)
