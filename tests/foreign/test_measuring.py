"""The measuring chain: what each imperfection does to a harmonic, exactly."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy.blind.machines.measuring import Chain, Probe, at_angle, coloured, keyphasor, record, surface_runout
from rotorstudy.blind.machines.stepping import Steady

SPEED = 100.0
FORWARD, SECOND = 2e-5 * np.exp(0.4j), 3e-6  # of the motion, m
GOOD = (Probe(0.0), Probe(np.pi / 2))


def steady():
    angle = 2 * np.pi * np.arange(64) / 64
    z = 1e-5 + FORWARD * np.exp(1j * angle) + SECOND * np.exp(2j * angle)
    u = np.stack([z.real, z.imag, 0 * angle, 0 * angle], axis=1)[None]
    return Steady(np.array([SPEED]), angle, u, 0 * u, np.zeros(1), np.zeros(1))


def harmonic(chain, probes=GOOD, k=1):
    """Complex amplitude of x + j y at k, with the phase counted from the centre of the pulses."""
    result = record(np.random.default_rng(1), steady(), [0], {0: probes}, chain)
    high = result["keyphasor"] > 2.5
    time = result["time"]
    edges = np.diff(high.astype(int), axis=1)[0]
    up, down = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    down = down[down > up[0]][: len(up)]
    centres = (time[up[: len(down)]] + time[down] + 1 / chain.rate) / 2
    slope, start = np.polyfit(centres, 2 * np.pi * np.arange(len(centres)), 1)
    part = slice(up[0], up[0] + round(20 * 2 * np.pi / SPEED * chain.rate))
    angle = slope * time[part] + start + chain.sensor_angle - chain.mark_angle
    z = result["displacement"][0, 0, 0, part] + 1j * result["displacement"][0, 0, 1, part]
    return np.mean(z * np.exp(-1j * k * angle))


CLEAN = Chain(rate=SPEED / (2 * np.pi) * 512)


def test_a_clean_chain_reads_the_motion():
    assert harmonic(CLEAN) == pytest.approx(2e-5 * np.exp(0.4j), rel=5e-3)
    marked = replace(CLEAN, mark_angle=0.7, sensor_angle=-0.3)
    assert harmonic(marked) == pytest.approx(2e-5 * np.exp(0.4j), rel=5e-3)
    assert harmonic(CLEAN, k=-1) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize(
    ("changes", "factor"), [({"phase_offset": 0.2}, np.exp(-0.2j)), ({"delay": 1e-3}, np.exp(-1j * SPEED * 1e-3))]
)
def test_phase_errors(changes, factor):
    assert harmonic(replace(CLEAN, **changes)) == pytest.approx(2e-5 * np.exp(0.4j) * factor, rel=8e-3)


def test_probe_errors():
    gain = harmonic(CLEAN, (Probe(0.0, gain=1.1), Probe(np.pi / 2, gain=1.1)))
    assert abs(gain) == pytest.approx(2.2e-5, rel=5e-3)
    back = harmonic(CLEAN, (Probe(0.0), Probe(np.pi / 2, reversed=True)), k=-1)
    assert abs(back) == pytest.approx(2e-5, rel=5e-3)
    swapped = harmonic(replace(CLEAN, swapped=(0,)), k=-1)
    assert abs(swapped) == pytest.approx(2e-5, rel=5e-3)
    turned = harmonic(CLEAN, (Probe(0.0, angle_error=0.1), Probe(np.pi / 2, angle_error=0.1)))
    assert turned == pytest.approx(2e-5 * np.exp(0.3j), rel=8e-3)
    runout = surface_runout(np.random.default_rng(0), (0.0, np.pi / 2), 1e-6)
    seen = harmonic(CLEAN, (Probe(0.0, runout=runout[0]), Probe(np.pi / 2, runout=runout[1])))
    assert abs(seen - harmonic(CLEAN)) == pytest.approx(abs(runout[0][1]), rel=1e-2)


def test_noise_is_of_the_given_size_and_colour():
    noise = coloured(np.random.default_rng(2), (200, 1024))
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    power = np.mean(np.abs(np.fft.rfft(noise)) ** 2, axis=0)
    assert power[4] / power[64] == pytest.approx(16.0, rel=0.4)


def test_pulses_and_interpolation():
    angle = np.linspace(0, 20 * np.pi, 20001)
    pulses = keyphasor(angle, CLEAN)
    assert np.count_nonzero(np.diff((pulses > 2.5).astype(int)) == 1) == 10
    assert np.mean(pulses > 2.5) == pytest.approx(0.2 / (2 * np.pi), rel=0.02)
    turn = 2 * np.pi * np.arange(32) / 32
    np.testing.assert_allclose(at_angle(np.cos(3 * turn + 0.1), angle, 5), np.cos(3 * angle + 0.1), atol=1e-12)
