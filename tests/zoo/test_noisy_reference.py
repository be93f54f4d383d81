"""Through the whole of `full_spectrum`: the stated covariance when displacement and phase reference are both noisy."""

import numpy as np
import pytest

from rotorstudy import Record, full_spectrum, registry
from rotorstudy.measurement.records import reference_signal
from rotorstudy.measurement.spectrum import components
from rotorstudy.response.series import synthesize

SPEED, TRIALS, SAMPLES = 90.0, 600, 1024
TIME = np.arange(SAMPLES) * 4 * 2 * np.pi / SPEED / SAMPLES  # four whole turns
# the others are for records with a keyphasor (marks), or see the unlisted half of a real signal as spikes or as speed
METHODS = [m for m in registry().plugins["spectrum"].values() if not (m.tolerates_wrong_speed or m.tolerates_outliers)]


def trials(method, harmonics, reference_noise):
    """Errors (trial, component) and their stated covariance, the mean of all trials."""
    random = np.random.default_rng(5)
    true = 0.5 + random.random(len(harmonics)) + 1j * random.random(len(harmonics))
    late = 0.7 / SPEED
    clean = synthesize(true, SPEED, harmonics, TIME + late)
    reference = reference_signal(SPEED, harmonics, TIME + late)
    errors, stated = [], []
    for x, y, r in random.standard_normal((TRIALS, 3, SAMPLES)):
        noisy = clean + 0.05 * (x + 1j * y)
        record = Record(TIME, noisy[None], SPEED, (1,), reference + reference_noise * r)
        found = full_spectrum([record], harmonics, method, "reference")
        errors.append(components(found.amplitude[0] - true[:, None])[:, 0])
        stated.append(found.covariance[0, 0])
    return np.array(errors), np.mean(stated, axis=0)


def deviation(errors, stated):
    """Seen over stated variance minus one, mean over components; worst entry of the whitened covariance minus one."""
    whitened = np.linalg.solve(np.linalg.cholesky(stated), errors.T)
    seen = whitened @ whitened.T / TRIALS
    return np.trace(seen) / len(seen) - 1, np.abs(seen - np.eye(len(seen))).max()


# a sample variance is off by sqrt(2 / trials); six deviations and 3 % for the median noise floor among 1024 bins
ENTRY = 6 * np.sqrt(2 / TRIALS) + 0.03


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
@pytest.mark.parametrize("reference_noise", [0.0, 0.3])
def test_the_stated_covariance_is_the_scatter(method, reference_noise):
    """Whatever the noise the phase of a real reference is opposite at -nX, and that of its mean is none."""
    errors, stated = trials(method, [0, 1, 2, 3, -1, -3], reference_noise)
    mean, worst = deviation(errors, stated)
    assert abs(mean) < ENTRY / 2 and worst < ENTRY
    assert deviation(errors, 0.4 * stated)[1] > ENTRY  # negative control
