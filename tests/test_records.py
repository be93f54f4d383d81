"""Records: the phase they carry, what leaks, and how honest the stated covariance is."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, LINEAR, METHODS
from one_line_errors import refused

from rotorstudy import Record, full_spectrum, load_rig, measured_response, registry, simulate_records
from rotorstudy.measurement import records
from rotorstudy.measurement.harmonics import white_noise_covariance
from rotorstudy.measurement.keyphasor import phase_from_keyphasor
from rotorstudy.measurement.spectrum import components
from rotorstudy.response import stability
from rotorstudy.response.series import synthesize

RIG = "examples/jeffcott.yaml"
SPEED = 100.0
TURNS = 2 * np.pi / SPEED * 20 * np.arange(4000) / 4000  # twenty whole turns


@pytest.fixture(scope="module")
def model(request):
    return load_rig(request.config.rootpath / RIG)


@pytest.fixture(scope="module")
def true(model):
    return measured_response(model, [SPEED], HARMONICS)[0]


def test_records_of_many_speeds_are_made_a_few_at_a_time(model, monkeypatch):
    """So that the memory does not grow with the number of speeds; each speed has the record that it has alone."""
    speeds, asked = [60.0, 90.0, 100.0, 200.0, 300.0], []
    together = simulate_records(model, speeds, HARMONICS, TURNS)
    monkeypatch.setattr(records, "SPEEDS_AT_ONCE", 2)
    monkeypatch.setattr(stability, "NUMBERS_AT_ONCE", 1)
    own = records.measured_response
    monkeypatch.setattr(records, "measured_response", lambda *given: asked.append(given[1]) or own(*given))
    for one, other in zip(simulate_records(model, speeds, HARMONICS, TURNS), together, strict=True):
        assert np.array_equal(one.displacement, other.displacement) and one.speed == other.speed
    assert asked == [[60.0, 90.0], [100.0, 200.0], [300.0]]


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
@pytest.mark.parametrize("phase", ["reference", "keyphasor"])
def test_a_late_record_is_put_right_by_either_phase_reference(model, true, method, phase):
    late = simulate_records(model, [SPEED], HARMONICS, TURNS, start_angle_rad=0.7)
    found = full_spectrum(late, HARMONICS, method, phase).amplitude[0]
    # pulse flanks are found by straight lines between samples 0.03 rad apart, on pulses 0.1 rad wide: the mark is known
    # to 2e-4 rad, seven times that at 7X; the reference signal is exact
    rel, share = (1e-10 if phase == "reference" else 2e-3, 0) if method in LINEAR else (0, 4e-3)
    allowed = {"rel": rel, "abs": share * np.abs(true).max()}
    assert found == pytest.approx(true, **allowed)
    plain = full_spectrum(late, HARMONICS, method, "none").amplitude[0]
    if method in LINEAR:
        allowed = {"rel": 1e-10}
    assert plain == pytest.approx(true * np.exp(0.7j * np.array(HARMONICS))[:, None], **allowed)
    assert np.abs(plain - true).max() > 0.5 * np.abs(true).max()  # negative control


def test_whole_turns_keep_unlisted_harmonics_out():
    time = TURNS[:-90]
    every = [*HARMONICS, 9, -7]
    record = Record(time, synthesize(np.ones(len(every)), SPEED, every, time)[None], SPEED, (1,))
    method = registry().get("spectrum", "regression")
    as_it_is = full_spectrum([record], HARMONICS, method, "none", whole_revolutions=False).amplitude[0, :, 0]
    cut = full_spectrum([record], HARMONICS, method, "none").amplitude[0, :, 0]
    assert np.abs(as_it_is - 1).max() > 1e-3
    assert cut == pytest.approx(np.ones(len(HARMONICS)), rel=1e-9)


def test_lines_nobody_asked_for_do_not_count_as_noise():
    residual = 1e-3 * np.cos(60 * TURNS) + 1e-6 * np.random.default_rng(1).normal(size=TURNS.shape)
    stated = white_noise_covariance(residual, np.eye(1) / len(TURNS), [20])[0, 0]
    assert stated == pytest.approx(1e-12 / 2 / len(TURNS), rel=0.1)  # half of a real signal's variance in each part


def test_keyphasor_jitter_is_stated():
    """Pulse times with noise: the spread of the mean offset over many records is the stated one."""
    generator, phases, stated = np.random.default_rng(4), [], []
    time = np.arange(8000) * 1e-4
    for _ in range(100):
        marks = np.arange(1, 12) * 2 * np.pi / SPEED + 2e-4 * generator.normal(size=11)
        pulses = np.exp(-0.5 * ((time[:, None] - marks) / 1e-3) ** 2).sum(axis=1)
        record = Record(time[:7200], np.zeros((1, 7200), complex), SPEED, (1,), None, pulses[:7200])
        phase, covariance = phase_from_keyphasor(record, [1, 3])
        phases.append(phase)
        stated.append(covariance)
    scatter, mean = np.cov(np.transpose(phases)), np.mean(stated, axis=0)
    assert scatter[0, 0] == pytest.approx(mean[0, 0], rel=0.5)  # 100 records: 14 % of a variance, three of these
    assert mean[1, 1] == pytest.approx(9 * mean[0, 0])


def drifting_record(w, label, drift, jitter_s, start_angle_rad):
    """A shaft whose angle is start + w t (1 + drift t / T), with a pulse each time it passes a whole turn."""
    time = np.arange(6000) * 30 * 2 * np.pi / w / 6000
    angle = start_angle_rad + w * time * (1 + drift * time / time[-1])
    amplitude = np.exp(1j * np.arange(len(HARMONICS))) / (1 + np.arange(len(HARMONICS)))
    late = np.interp(angle, 2 * np.pi * np.arange(-2, 60), jitter_s * np.random.default_rng(9).normal(size=62))
    off = np.angle(np.exp(1j * (angle - w * late)))
    pulses = np.exp(-0.5 * (off / 0.1) ** 2)
    signal = synthesize(amplitude, 1.0, HARMONICS, angle)
    return amplitude, Record(time, signal[None], label, (1,), None, pulses, "drifting")


@pytest.mark.parametrize("start", [0.0, 0.7, 4.0])
@pytest.mark.parametrize("label", [SPEED, 1.001 * SPEED, 0.999 * SPEED])
@pytest.mark.parametrize("name", ["order_tracking", "sine_fit"])
def test_a_wrong_label_and_a_late_start_leave_amplitude_and_phase_right(name, label, start):
    true, record = drifting_record(SPEED, label, 0.0, 0.0, start)
    method = registry().get("spectrum", name)
    found = full_spectrum([record], HARMONICS, method, "keyphasor").amplitude[0, :, 0]
    assert np.abs(found - true).max() < 2e-3  # marks known to 2e-4 rad, see above, here of harmonics up to 7
    fixed = full_spectrum([replace(record, keyphasor=None)], HARMONICS, registry().get("spectrum", "fft"), "none")
    if label != SPEED:
        assert np.abs(np.abs(fixed.amplitude[0, :, 0]) - np.abs(true)).max() > 5e-3  # negative control


@pytest.mark.parametrize("jitter_s", [0.0, 1e-5])
def test_order_tracking_follows_a_slow_drift(jitter_s):
    true, record = drifting_record(SPEED, 1.001 * SPEED, 0.02, jitter_s, 0.7)
    found = full_spectrum([record], HARMONICS, registry().get("spectrum", "order_tracking"), "keyphasor")
    off = components(found.amplitude[0] - true[:, None])[:, 0]
    std = np.sqrt(np.diag(found.covariance[0, 0]))
    assert (np.abs(off) < 5 * std + 2e-3).all()
    fixed = full_spectrum([record], HARMONICS, registry().get("spectrum", "sine_fit"), "keyphasor")
    assert np.abs(fixed.amplitude[0, :, 0] - true).max() > 0.1  # negative control: no one speed fits


def test_drifting_marks_still_catch_missing_and_double_pulses():
    _, record = drifting_record(SPEED, 1.001 * SPEED, 0.02, 0.0, 0.7)
    method, turn = registry().get("spectrum", "order_tracking"), 2 * np.pi / SPEED
    for wrong, words in (
        (np.where(np.abs(record.time - 10.3 * turn) < 0.5 * turn, 0, record.keyphasor), "one a revolution"),
        (record.keyphasor + np.exp(-0.5 * ((record.time - 10.3 * turn) / (0.01 * turn)) ** 2), "one a revolution"),
        (np.where(record.time < 4.3 * turn, 0, record.keyphasor), "cut the record"),
        (None, "no keyphasor"),
    ):
        refused(lambda: full_spectrum([replace(record, keyphasor=wrong)], HARMONICS, method, "keyphasor"), words)
    fast = replace(record, speed=2 * SPEED)
    refused(lambda: full_spectrum([fast], HARMONICS, method, "keyphasor"), "Correct the speed")
