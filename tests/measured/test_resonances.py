"""Critical speeds, split and amplification factors of 1X over speed, against a rotor integrated in time."""

from functools import cache

import numpy as np
import pytest
from machine import swept
from machines import readings
from scipy.integrate import quad

from rotorstudy import read_measurement
from rotorstudy.measurement.resonances import check_resonances, find_resonances, modal_passage, vectors_1x

CRITICAL, DECAY = np.array([162.0, 172.0]), np.array([3.0, 6.0])  # rad/s, 1/s: 95 rpm apart, factors of 27 and 14


def steady(speed):
    """Vector (speed,) m of a probe at 45 degrees of a rotor on anisotropic supports; unbalance 1e-5 m."""
    each = 1e-5 * speed**2 / (CRITICAL[:, None] ** 2 - speed**2 + 2j * DECAY[:, None] * speed)
    return (each[0] - 1j * each[1]) * np.sqrt(0.5)  # y reads a quarter period later


@cache
def run_up(rate, noise=2e-8):
    """Speeds and vectors of a probe at 45 degrees by its signal over a revolution, in a run-up integrated in time."""
    first, last, step = 110.0, 260.0, 1e-3
    time = np.arange(0, (last - first) / rate, step)
    angle = first * time + rate * time**2 / 2
    along_x_and_y = swept(CRITICAL**2, 2 * DECAY, 1e-5 * np.array([1, -1j]), first, rate, time).real
    reading = along_x_and_y.sum(axis=0) * np.sqrt(0.5) + noise * np.random.default_rng(1).normal(size=len(time))
    pieces = np.split(np.arange(len(time)), np.flatnonzero(np.diff(angle // (2 * np.pi))) + 1)[:-1]
    found = []
    for piece in pieces:
        turning = angle[piece]
        basis = np.column_stack([np.cos(turning), -np.sin(turning), np.ones(len(piece))])
        real, imag, _ = np.linalg.lstsq(basis, reading[piece], rcond=None)[0]
        found.append((first + rate * time[piece].mean(), real + 1j * imag))
    speed, vector = np.array(found).T
    return speed.real, vector


def assert_is_rotor(found, rate):
    """Within 4 standard deviations, and what windows of a revolution (5 % of a factor) and the poles (0.1 %) leave."""
    rate_std, speed_std, factor_std = found.std
    assert len(found.speed) == 2
    assert (np.abs(found.speed - CRITICAL) < 4 * speed_std + 1e-3 * CRITICAL).all()
    assert (np.abs(found.amplification - CRITICAL / (2 * DECAY)) < 4 * factor_std + 0.05 * found.amplification).all()
    assert abs(found.rate - rate) <= 4 * rate_std + 0.01 * abs(rate)


def test_two_modes_and_the_rate_of_a_fast_run_up():
    """0.7 times the squared bandwidth: the peak shows 60 rpm beyond the first critical speed, and beats follow."""
    speed, vector = run_up(25.0)
    found = find_resonances(speed, vector[None], True)
    assert_is_rotor(found, 25.0)
    assert (found.std[1] < 0.6).all()  # 6 rpm


def test_steady_vectors_are_not_taken_as_swept():
    generator, speed = np.random.default_rng(2), np.linspace(110, 260, 80)
    noise = 1e-7 * (generator.normal(size=80) + 1j * generator.normal(size=80))
    found = find_resonances(speed, (steady(speed) + noise)[None], True)
    assert_is_rotor(found, 0.0)


def test_vectors_without_a_resonance_have_none():
    """The highest of 60 values of noise exceeds the lowest beside it three times, as a peak does."""
    speed, generator = np.linspace(20, 100, 40), np.random.default_rng(1)
    assert find_resonances(speed, steady(speed)[None], True) is None
    assert find_resonances(speed[:5], steady(speed)[None, :5], True) is None
    for _ in range(3):
        noise = 1e-6 * (generator.normal(size=(1, 60)) + 1j * generator.normal(size=(1, 60)))
        assert find_resonances(np.linspace(300, 900, 60), noise, False) is None
    still = readings(np.zeros((2, 2, 1), complex), [100.0, 200.0], [1, -1], (1,), 0.0)
    assert list(check_resonances(still, True, "table")) == []


@pytest.mark.parametrize("rate", [25.0, -8.0])
def test_the_passage_is_its_integral(rate):
    for offset in (-20.0, 0.0, 15.0):
        parts = [
            quad(lambda t, p=part, w=offset: p(np.exp(-(3 + 1j * w) * t + 0.5j * rate * t * t)), 0, 12, limit=2000)[0]
            for part in (np.real, np.imag)
        ]
        assert modal_passage(offset, 3.0, rate) == pytest.approx(3 * complex(*parts), abs=1e-6)
    assert modal_passage(5.0, 3.0, 1e-6) == pytest.approx(modal_passage(5.0, 3.0, 0.0), abs=1e-6)


def test_the_measured_run_up_says_what_its_page_says(request):
    """Of a rotor kit; the steady figures of its page follow from the same table."""
    folder = request.config.rootpath / "examples" / "rk4_run_up"
    page = (folder / "README.md").read_text()
    found = read_measurement([folder / "run_up.csv"], folder / "rig.yaml")
    told = {f.name: f.text for f in found.findings}
    assert f"> critical speeds: {told['critical speeds'].split(';')[0]}\n" in page
    assert f"> sweep too fast: {told['sweep too fast'].split(':')[0]}\n" in page
    steady_fit = find_resonances(found.spectrum.speed, np.array(list(vectors_1x(found.spectrum).values())), False)
    assert f"one mode at {steady_fit.speed[0] * 30 / np.pi:.0f} rpm" in page
    assert f"residual of {1e6 * steady_fit.noise:.1f} µm" in page


def test_orbits_on_anisotropic_supports_show_both_critical_speeds():
    """Their backward parts are conj(X) + j conj(Y) over 2, whose phase would lead as that of the forward ones lags."""
    speed = np.linspace(110.0, 260.0, 120)
    x, y = 1e-5 * speed**2 / (CRITICAL[:, None] ** 2 - speed**2 + 2j * DECAY[:, None] * speed) * [[1], [-1j]]
    amplitude = np.stack([x + 1j * y, x.conj() + 1j * y.conj()], axis=1)[..., None] / 2
    spectrum = readings(amplitude, speed, [1, -1], (1,), 2e-8, seed=2)
    assert_is_rotor(find_resonances(speed, np.array(list(vectors_1x(spectrum).values())), False), 0.0)
