"""The covariance a spectrum method states on a short record.

The noise floor is the median over all lines of the periodogram. Of N lines the p harmonics asked for are not noise: the
fit of `regression` empties them, and the signal stands in them for `fft`; so they are left out. With them the median
would be the quantile (N/2 - p) / (N - p), or (N/2) / (N - p), of the noise. At p = 9 that is 9 % at 150 samples.
"""

import numpy as np
import pytest
from machines import HARMONICS

from rotorstudy import Record, registry
from rotorstudy.measurement.records import check_record
from rotorstudy.response.series import synthesize

SPEED, TRIALS = 88.0, 2000


def stated_over_actual(method, samples):
    """Stated variance over that of the errors, mean over the harmonics, and coverage of 95 % intervals."""
    time = np.arange(samples) * 2 * np.pi / SPEED / samples
    generator = np.random.default_rng(samples)
    noise = generator.standard_normal((2, TRIALS, samples))
    true = 100 * np.exp(1j * np.arange(len(HARMONICS)))
    signal = synthesize(true, SPEED, HARMONICS, time) + noise[0] + 1j * noise[1]
    check_record(Record(time, signal[:1], SPEED, (1,)), HARMONICS)  # accepted
    amplitude, covariance = registry().get("spectrum", method).function(signal, time, SPEED, HARMONICS)
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    errors = amplitude - true
    held = np.abs(errors.real) <= 1.959964 * np.sqrt(variance[:, : len(HARMONICS)])
    return variance.mean() / (np.mean(np.abs(errors) ** 2) / 2), held.mean()


@pytest.mark.parametrize("samples", [30, 150])
@pytest.mark.parametrize("method", ["fft", "regression"])
def test_the_stated_covariance_of_a_short_record_is_that_of_its_errors(method, samples):
    ratio, _ = stated_over_actual(method, samples)
    # 18 000 errors and 2000 medians leave 1 %, three times that allowed; a median of 21 lines is 3.4 % high by itself
    assert ratio == pytest.approx(1.0, abs=0.07)


def test_intervals_of_the_shortest_record_let_in_cover():
    _, share = stated_over_actual("regression", 2 * len(HARMONICS) + 1)
    # ten lines are left for the noise: the median of these has a spread of a third, and intervals cover some 90 %
    assert share > 0.85
