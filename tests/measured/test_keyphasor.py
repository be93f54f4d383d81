"""Pulses of a phase mark, read to the angle of the shaft."""

import numpy as np
import pytest
from machine import MARKS, STEADY, TIME

from rotorstudy.measurement.conventions import Keyphasor
from rotorstudy.measurement.keyphasor import count_revolutions, find_pulses


def test_the_angle_survives_missing_and_doubled_pulses():
    """The same marks, some lost and some added: the same angle within the noise of the marks."""
    clean = count_revolutions(MARKS)
    spoilt = count_revolutions(np.sort([*np.delete(MARKS, [3, 9, 10, 25]), MARKS[7] + 0.03, MARKS[18] + 0.02]))
    assert (spoilt.missing, spoilt.doubled) == (4, 2) and (clean.missing, clean.doubled) == (0, 0)
    assert spoilt.angle(TIME) == pytest.approx(clean.angle(TIME), abs=1e-9)
    assert clean.speed(1.0) == pytest.approx(STEADY)


@pytest.mark.parametrize(("edge", "offset"), [("center", 0.0), ("rising", -0.1), ("falling", 0.1)])
@pytest.mark.parametrize("sign", [1, -1])
def test_edges_of_a_pulse(edge, offset, sign):
    """A trapezium 0.3 rad wide at its foot and 0.1 at its top has its half height 0.1 rad either side."""
    away = np.abs((STEADY * TIME + np.pi) % (2 * np.pi) - np.pi)
    signal = sign * np.clip((0.15 - away) / 0.1, 0, 1)
    found = find_pulses(signal, TIME, Keyphasor(edge=edge)).time
    expected = (offset * (1 if edge == "center" else sign)) / STEADY
    late = (found * STEADY + np.pi) % (2 * np.pi) - np.pi
    assert late[1:-1] == pytest.approx(expected * STEADY, abs=2e-3)


@pytest.mark.parametrize("shape", ["sharp", "round"])
@pytest.mark.parametrize("per_turn", [30, 60, 120])
def test_the_stated_resolution_of_the_marks_covers_their_error(shape, per_turn):
    """A speed that fits the sampling rate: all marks have the same error, which no scatter shows."""
    generator, errors, stated = np.random.default_rng(1), [], []
    for _ in range(200):
        angle = 2 * np.pi * (np.arange(3 * per_turn) + generator.uniform()) / per_turn
        away, width = np.angle(np.exp(1j * angle)), 0.25 + 0.1 * generator.uniform()
        signal = (np.abs(away) < width) * 1.0 if shape == "sharp" else np.exp(-0.5 * (away / 0.1) ** 2)
        found = find_pulses(signal, angle, Keyphasor())
        errors.append(np.angle(np.exp(1j * found.time[0])))
        stated.append(found.resolution)
    size, said = np.sqrt(np.mean(np.square(errors))), np.sqrt(np.mean(np.square(stated)))
    if shape == "sharp":  # 200 draws: 5 %; in a pulse of few samples the two edges are not quite independent
        assert said == pytest.approx(size, rel=0.25)
    else:  # never much too small where it matters, a hundredth of a sample
        assert said > 0.8 * size or size < 0.01 * 2 * np.pi / per_turn
