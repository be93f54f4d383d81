"""The probability that nothing is missing is over every cause of the library, whether it was fitted or not."""

import numpy as np
import pytest
from machines import jeffcott_rig, spectrum_of

from rotorstudy import build_model
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.investigate import investigate

SPEEDS, HARMONICS, NOISE = np.array([150.0, 300.0, 450.0, 600.0]), np.array([0, 1, -1, 2]), 1e-7
LINEARISED = 0.02  # an error of form and fits with shapes change the odds of those that are fitted


@pytest.mark.parametrize("seed", [2, 41])
def test_it_is_that_of_all_causes_summed_by_hand(seed):
    """Each cause in all its shapes with one prior probability; that over the fitted ones alone is too high."""
    model = build_model(jeffcott_rig())
    spectrum = spectrum_of(model, SPEEDS, HARMONICS, NOISE / np.sqrt(2), seed)
    diagnosis = investigate(spectrum, model)
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
