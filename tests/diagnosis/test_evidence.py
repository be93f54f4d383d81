"""Causes are weighed by the probability of the data, which is known exactly where everything is linear and normal."""

from dataclasses import replace

import numpy as np
import pytest
from machines import all_but, disc, faulty, jeffcott_rig, readings, shaft, spectrum_of, springs
from scipy.stats import multivariate_normal, norm

from rotorstudy import build_model, measured_response, registry
from rotorstudy.diagnosis.search.candidates import SPREADS, candidate, candidates
from rotorstudy.diagnosis.search.odds import SCALES, PriorOdds, log_possible, log_scales, odds_of
from rotorstudy.diagnosis.search.search import begin, search
from rotorstudy.diagnosis.search.shown_forces import motions_by_free_forces
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import carried_order, neighbourhood, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import components
from rotorstudy.model.registry import Registry, plugin_folders, using
from rotorstudy.response.neighbourhood import carried_motion

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS, NOISE = np.array([150.0, 300.0, 450.0]), np.array([0, 1, -1, 2]), 1e-7
MODEL = build_model(jeffcott_rig())


def noisy(model, seed, speeds=SPEEDS):
    return spectrum_of(model, speeds, HARMONICS, NOISE / np.sqrt(2), seed)


def test_evidence_is_the_probability_of_the_data_of_a_linear_model():
    """Eccentricity acts linearly: the data are normal with the covariance of the noise plus that of the prior."""
    data = noisy(MODEL, 1)
    prior = {"eccentricity_real": (4e-6, 2e-6), "eccentricity_imag": (0.0, 1e-6)}
    found = fit(MODEL, data, Prior.independent(prior))

    def flat(amplitude):
        return components(amplitude).ravel()

    theta = np.array(MODEL.theta)
    columns, place = [], MODEL.position(prior)
    theta[place] = [mean for mean, _ in prior.values()]
    middle = flat(measured_response(MODEL, SPEEDS, HARMONICS, theta))
    for p, (_, std) in zip(place, prior.values(), strict=True):
        moved = theta.copy()
        moved[p] += std
        columns.append(flat(measured_response(MODEL, SPEEDS, HARMONICS, moved)) - middle)
    columns, size = np.array(columns).T, len(middle)
    noise = NOISE**2 / 2 * np.eye(size)
    exact = multivariate_normal(middle, noise + columns @ columns.T, allow_singular=True).logpdf(flat(data.amplitude))
    constant = -0.5 * size * np.log(np.pi * NOISE**2)
    assert found.evidence == pytest.approx(exact - constant, rel=1e-6)


def test_a_prior_of_unknown_width_is_the_mean_over_widths():
    covariance, mean = np.array([[0.02]]), np.array([0.3])
    precision = 1 / covariance[0, 0] - 1  # of the data
    middle = mean[0] / covariance[0, 0] / precision
    density = [norm(0, np.sqrt(1 / precision + scale**2)).pdf(middle) for scale in SCALES]
    assert log_scales(mean, covariance, np.array([0])) == pytest.approx(np.log(np.mean(density) / density[0]), rel=1e-9)


def test_amplitudes_that_share_an_unknown_width_have_the_mean_over_its_values():
    data = np.diag([9.0, 4.0, 0.5]) + 0.2  # precision that they give
    middle, covariance = np.array([0.9, -0.4, 2.0]), np.linalg.inv(np.eye(3) + data)
    density = [multivariate_normal(cov=np.linalg.inv(data) + x**2 * np.eye(3)).pdf(middle) for x in (*SPREADS, 1.0)]
    found = log_scales(covariance @ data @ middle, covariance, np.zeros(3, int), np.array(SPREADS))
    assert found == pytest.approx(np.log(np.mean(density[:-1]) / density[-1]))


def test_an_amplitude_on_the_wrong_side_costs_its_deviations_and_never_overflows():
    assert log_possible(50.0, 1.0) == pytest.approx(np.log(2))
    assert log_possible(0.0, 1.0) == pytest.approx(0.0)
    assert -55 < log_possible(-10.0, 1.0) < -50
    assert np.isfinite(log_possible(-1e4, 1.0))


def test_every_effect_is_as_likely_as_another_whatever_its_places():
    data = noisy(MODEL, 2)
    work = search(begin(MODEL, with_model_error(data, Settings()), Settings()))
    share = {}
    for cause in {(c.cause, *c.variant.values()): c for c in work.candidates}.values():  # each in one shape
        share[cause.effect] = share.get(cause.effect, 0) + work.prior_odds.of(cause)
    rates = {name: registry().get("effect", name).base_rate for name in share}
    assert share == pytest.approx({name: rate / sum(rates.values()) for name, rate in rates.items()})
    assert list(rates.values()).count(1.0) > 0.8 * len(rates)
    rarer = replace(work, settings=Settings(base_rates={"unbalance": 0.1}))
    (first, *_) = [c for c in work.candidates if c.effect == "unbalance"]
    assert 0.1 < rarer.prior_odds.of(first) / work.prior_odds.of(first) < 0.11
    assert work.best.causes == () and sum(w for _, w in work.posterior()) + work.outside_probability == pytest.approx(1)


def test_an_unbalance_is_expected_where_the_mass_is_whatever_the_mesh():
    """With all places alike, a finer mesh would make the shaft ever more likely than the disc."""

    def of_the_disc(elements, **chosen):
        rotor = shaft(0.6, 2 * elements, disc(elements + 1, 2.0, 1e-3, 6e-4), outer_diameter_m=0.01)
        model = build_model({"rotor": rotor, "bearings": springs((1, 2 * elements + 1), 1e7, 10.0)})
        found = [c for c in candidates(model, Settings())[0] if c.effect == "unbalance"]
        settings = Settings(**chosen)
        prior = {c.where["node"]: PriorOdds(found, settings, model.structure).of(c) for c in found}
        assert sum(prior.values()) == pytest.approx(1)
        return prior[elements + 1]

    of_shaft = 7850 * np.pi / 4 * 0.01**2 * 0.6  # kg
    share = (2.0 + of_shaft / 12) / (2.0 + of_shaft)  # the element on either side of 12 lends half its mass
    assert of_the_disc(6) == pytest.approx(0.9 * share + 0.1 / 13, rel=1e-3)
    assert of_the_disc(12) == pytest.approx(of_the_disc(6), rel=0.02)
    assert of_the_disc(6, expected_place=0.0) == pytest.approx(1 / 13)


@pytest.mark.parametrize(("soft", "more"), [(False, []), (True, [{"node": 3}, {"node": 4}, {"element": 3}])])
def test_a_coupling_is_expected_at_an_end_of_the_shaft_or_at_a_softer_element(soft, more):
    stretch = {"length_m": 0.1, "outer_diameter_m": 0.02}
    softer = [{**stretch, "outer_diameter_m": 0.01 if soft and n == 2 else 0.02} for n in range(6)]
    rotor = shaft(0.6, 6, disc(5, 2.0)) | {"elements": softer}
    model = build_model({"rotor": rotor, "bearings": springs((2, 6), 1e7, 10.0)})
    for name in ("parallel_misalignment", "angular_misalignment"):
        found = [c for c in candidates(model, Settings())[0] if c.effect == name]
        odds = [PriorOdds(found, Settings(), model.structure).of(c) for c in found]
        expected = [c.where in [{"node": 1}, {"node": 7}, *more] for c in found]
        assert sum(expected) == 2 + len(more) and np.sum(odds, where=expected) > 0.9
        assert np.max(odds, where=~np.array(expected), initial=0) < 0.02


def test_amplitudes_that_cannot_be_negative_say_so():
    limited = {c.effect for c in candidates(MODEL, Settings())[0] if c.positive}
    assert {"internal_damping", "external_damping", "rub", "delay"} <= limited
    assert not limited & {"stiffness_error", "support_stiffness", "unbalance", "probe_gain"}


def test_the_model_error_of_a_harmonic_that_is_nearly_zero_is_not():
    """A share of itself says nothing there; a gap at 0X is no vibration."""
    amplitude = np.tile(np.array([1e-3, 1e-5, 0, 0])[None, :, None], (3, 1, 1)).astype(complex)
    settings = Settings(model_error=0.01, model_floor=1e-3, covariance_error=0.0)
    spectrum = readings(amplitude, SPEEDS, HARMONICS, MODEL.sensors, NOISE / np.sqrt(2))
    wide = with_model_error(spectrum, settings).covariance - spectrum.covariance
    assert np.sqrt(2 * wide[0, 0, 2, 2]) == pytest.approx(1e-8)
    assert np.sqrt(2 * wide[0, 0, 1, 1]) == pytest.approx(np.hypot(1e-7, 1e-8))


ONE = Settings(uncertainty={"default": 0.02}, most_causes=1)


def rubbing(**options):
    """A search, carried out, in records of the rotor that touches a ring of 3 um."""
    records = noisy(faulty(MODEL, {"kind": "rub", "clearance_m": 3e-6, **options}), 4)
    return search(begin(MODEL, with_model_error(records, ONE), ONE))


def test_the_shape_of_a_contact_is_found_though_it_bends_its_columns():
    work = rubbing(rub_stiffness_N_per_m=2e5, friction_ratio=0.2)
    assert "rub, node 1" in {name for e, share in work.posterior() if share > 0.05 for name in e.named}
    best = max((e for e in work.explanations if e.named == {"rub, node 1"}), key=odds_of)
    (cause,) = best.causes
    # the damping of the base moves with the friction
    shape = cause.shape | {"clearance_m": 3e-6, "friction_ratio": 0.2, "offset_ratio": 0.0}
    true = candidate(work.rig, "rub", cause.where, shape, cause.term.label, ONE.prior_width)
    assert odds_of(best) > odds_of(work.explain((true,), best.fit.values)) - 0.5
    assert abs(cause.shape["clearance_m"] - 3e-6) < 3 * cause.shape_std["clearance_m"]
    assert best.fit.cost < len(best.fit.residual) + 3 * np.sqrt(2 * len(best.fit.residual))


def test_a_ring_off_centre_is_found_with_its_side():
    work = rubbing(rub_stiffness_N_per_m=1e6, offset_ratio=0.5, contact_angle_rad=2.0)
    (cause,) = work.best.causes
    assert cause.effect == "rub"
    assert cause.shape["clearance_m"] == pytest.approx(3e-6, rel=0.35)
    assert cause.shape["contact_angle_rad"] == pytest.approx(2.0, abs=0.4)
    assert work.best.fit.cost < len(work.best.fit.residual) + 3 * np.sqrt(2 * len(work.best.fit.residual))


def test_a_free_force_at_the_node_gives_its_motion():
    """With the records of the rotor itself it is none; with those of a rotor that is pushed, the pushed motion."""
    push = {"kind": "parallel_misalignment", "label": "p", "misalignment_force_2X_N": 4.0, "harmonics": [2]}
    pushed = faulty(MODEL, push)
    for model in (MODEL, pushed):
        data = noisy(model, None)
        held = Prior.independent({"external_damping": (100.0, 1.0)})
        fitted = fit(MODEL, data, held, steps=0)
        near = neighbourhood(MODEL, data, fitted.theta)
        (found,) = motions_by_free_forces(fitted, data, [MODEL.structure.unit(1)], near)
        true = carried_motion(model, SPEEDS, HARMONICS, order=carried_order(data)).amplitude
        assert np.abs(found.amplitude - true).max() < 1e-9 * np.abs(true).max()


BROKEN = """import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


def stated(structure):
    {words}
    return {{}}


@Effect(source="a test", stated=stated)
def broken(structure, node: int | None = None):
    \"\"\"Fails {when}.\"\"\"
    {body}
    here = -np.outer(structure.unit(node), structure.unit(node))
    return [Parameter("broken", "N/m", (Entry(here, on="conj", gain=gain),), typical=1e4, is_complex=True)]
"""


FEW = all_but("support_anisotropy", "external_damping", "unbalance", "bow")


@pytest.mark.parametrize(
    ("when", "body", "words", "line"),
    [
        ("when its table is made", "gain = structure.no_such_thing", "", 14),
        ("when its table is used", "gain = lambda speed: speed.no_such_thing()", "", 14),
        ("with NaN", "gain = lambda speed: np.nan * speed", "", 14),
        ("by leaving", "gain = lambda speed: exit(3)", "", 14),
        ("when it is put in words", "gain = None", "structure.no_such_thing", 7),
        ("not", "gain = None", "", None),  # negative control
    ],
)
def test_a_broken_plugin_is_named_with_its_line_and_the_rest_of_the_library_is_searched(
    tmp_path, when, body, words, line
):
    file = tmp_path / "broken.py"
    file.write_text(BROKEN.format(when=when, body=body, words=words))
    item = {"kind": "support_anisotropy", "label": "hidden", "support_anisotropy_N_per_m": 3e4}
    settings = ONE.model_copy(update={"leave_out": FEW})
    with using(Registry(plugin_folders(), entry_points=False, files=[file])):
        found = investigate(noisy(faulty(MODEL, item), 5), MODEL, hold_out=[], settings=settings)
    work = found.search
    assert [cause.effect for cause in work.best.causes] == ["support_anisotropy"]
    if line:
        (text,) = found.verdict.broken_plugins
        assert f"{file}:{line}" in text
    else:
        assert work.broken == [] and found.verdict.ambiguous_with[0].effect == "broken"  # it is the same


LINEARISED = 0.02  # an error of form and fits with shapes change the odds of those that are fitted


@pytest.mark.parametrize("seed", [2, 41])
def test_the_probability_that_nothing_is_missing_is_over_all_causes_fitted_or_not(seed):
    """Each in all its shapes with one prior probability, by hand; that over the fitted ones alone is too high."""
    spectrum = noisy(MODEL, seed, np.append(SPEEDS, 600.0))
    diagnosis = investigate(spectrum, MODEL)
    assert diagnosis.verdict.verdict == "nothing"
    search, data = diagnosis.search, verdict_dataset(diagnosis, spectrum)
    evidence = {}
    for cause, screened in zip(search.candidates, search.screened, strict=True):
        evidence.setdefault((cause.cause, *cause.variant.values()), []).append(np.exp(screened.evidence))
    prior = {(c.cause, *c.variant.values()): np.exp(search.prior_odds.log_odds((c,))) for c in search.candidates}
    assert sum(prior.values()) == pytest.approx(1.0)
    by_hand = 1 / (1 + sum(prior[key] * np.mean(one) for key, one in evidence.items()) + np.exp(search.log_outside))
    best = data.posterior_probability.values[data.is_best.values == 1]
    assert best == pytest.approx(by_hand, abs=LINEARISED)
    total = data.posterior_probability.sum() + data.not_fitted_probability
    of_fitted = next(share for one, share in search.posterior() if not one.causes)
    assert total == pytest.approx(1 - search.outside_probability * (1 - data.not_fitted_probability.item()))
    assert of_fitted - by_hand > LINEARISED
