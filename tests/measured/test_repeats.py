"""Repeats at one speed are averaged; what they differ by from run to run is in the covariance."""

import numpy as np
from machines import readings
from one_line_errors import refused

from rotorstudy.measurement.corrections import averaged

NOISE, SCATTER = 1e-8, 2e-7  # m, of each part


def repeats(seed, scatter, speeds=(100.0, 150.0, 200.0), count=3):
    """`count` records at each speed, whose speeds differ by 0.02 %."""
    rng = np.random.default_rng(seed)
    speed = np.repeat(speeds, count) * (1 + 2e-4 * rng.random(len(speeds) * count))
    shape = (len(speed), 2, 2)
    size = np.hypot(NOISE, scatter)
    amplitude = 1e-5 + size * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    return readings(amplitude, speed, [1, -1], (2, 4), NOISE)


def test_the_mean_of_repeats_has_the_covariance_of_their_scatter():
    """The standardised error of the mean is that of a unit normal variable, widened as few repeats are uncertain."""
    off = []
    for seed in range(60):
        found, _ = averaged(repeats(seed, SCATTER), "x.csv")
        assert found.amplitude.shape == (3, 2, 2)
        off.append(found.whitened(found.amplitude - 1e-5))
    spread = np.mean(np.square(off))
    assert 0.8 < spread < 1.6  # freedom 12: variance overestimated by 12 / 10, and an inverse chi-square average


def test_repeats_within_their_noise_are_a_note_and_those_beyond_a_warning():
    (note,) = averaged(repeats(1, 0.0), "x.csv")[1]
    assert (note.severity, note.name) == ("note", "repeats")
    (warning,) = averaged(repeats(1, SCATTER), "x.csv")[1]
    assert (warning.severity, warning.name) == ("warning", "repeats differ")


def test_single_records_are_left_as_they_are():
    spectrum = repeats(1, SCATTER, count=1)
    found, findings = averaged(spectrum, "x.csv")
    assert found is spectrum and findings == []


def test_a_speed_measured_once_scatters_too():
    spectrum = repeats(1, SCATTER)
    part = spectrum.at_speeds(np.arange(7))  # the last speed once
    found, _ = averaged(part, "x.csv")
    std = np.sqrt(np.diagonal(found.covariance, axis1=-2, axis2=-1))
    assert np.allclose(std[2] / std[0], np.sqrt(3), rtol=0.05)


def test_the_same_record_twice_is_an_error():
    spectrum = repeats(1, SCATTER)
    refused(lambda: averaged(spectrum.at_speeds([0, 0, 3]), "x.csv"), "occurs twice")
