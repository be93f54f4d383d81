"""Wrong speeds, records, spectra and unknowns: none escapes as another error, or passes with a wrong number."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from machines import HARMONICS as H
from machines import METHODS, jeffcott_rig, point, spectrum_of
from one_line_errors import refused

from rotorstudy import Problem, Record, build_model, full_spectrum, measured_response, read_measurement, registry
from rotorstudy.measurement.records import keyphasor_signal, records_dataset, reference_signal
from rotorstudy.response.series import synthesize
from rotorstudy.store import save

RIG = jeffcott_rig(5e-6, 0.5)
W = 88.0
TURN = 2 * np.pi / W
TIME = np.arange(4000) * 10 * TURN / 4000  # ten whole turns
REGRESSION = registry().get("spectrum", "regression")
ESTIMATORS = list(registry().plugins["estimator"].values())
MODEL = build_model(RIG)


@pytest.mark.parametrize("speed", [0.0, -5.0, np.nan, np.inf])
def test_a_speed_at_which_there_are_no_harmonics_is_refused(speed):
    refused(lambda: measured_response(MODEL, [88.0, speed], [1]), f"speed {speed:g} rad/s", "> 0")


def test_resonance_without_damping_is_refused():
    undamped = jeffcott_rig(1e-6, external=None, rotor=point(1.0, 1e4))
    assert np.isfinite(measured_response(build_model(undamped), [99.0], [1])).all()
    with np.errstate(all="ignore"):
        refused(lambda: measured_response(build_model(undamped), [100.0], [1]), "100 rad/s")


def record(samples=4000, turns=10.0, **changes):
    time = np.arange(samples) * (turns * TURN / samples)
    parts = {"time": time, "displacement": synthesize(np.ones(len(H)), W, H, time)[None], "speed": W, "sensors": (1,)}
    parts |= {"reference": reference_signal(W, H, time), "keyphasor": keyphasor_signal(W, time + 0.01)}
    parts["where"] = "rec.nc"
    for name, change in changes.items():
        parts[name] = change(parts[name]) if callable(change) else change
    return Record(**parts)


def hole(signal):
    signal = np.array(signal)
    signal[..., 100] = np.nan
    return signal


def without_pulses(signal):
    signal = signal.copy()
    signal[: len(signal) // 2] = 0
    return signal


def marks(*turns):
    """A keyphasor with a pulse at each of these turns."""
    return sum(keyphasor_signal(W, TIME - t * TURN) * (abs(TIME - t * TURN) < TURN / 2) for t in turns)


REGULAR = np.arange(10) + 0.3


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_the_record_itself_is_right(method):
    for phase in ("reference", "keyphasor", "none"):
        assert np.abs(full_spectrum([record()], H, method, phase).amplitude) == pytest.approx(1.0, rel=1e-2)


@pytest.mark.parametrize(
    ("wrong", "phase", "words"),
    [
        (record(speed=0.0), "none", ["rec.nc", "speed 0", "> 0"]),
        (record(speed=-88.0), "none", ["speed -88", "> 0"]),
        (record(samples=12), "none", ["12 samples are too few for 9 harmonics", "19"]),
        (record(turns=0.8), "none", ["0.80 revolutions", "at least one"]),
        (record(samples=120), "none", ["harmonic 7", "Nyquist", "up to"]),
        (record(displacement=hole), "none", ["displacement has NaN", "first at"]),
        (record(reference=hole), "reference", ["reference has NaN"]),
        (record(keyphasor=hole), "keyphasor", ["keyphasor has NaN"]),
        (record(reference=None), "reference", ["no reference signal", "keyphasor"]),
        (record(keyphasor=None), "keyphasor", ["no keyphasor", "reference"]),
        (record(keyphasor=without_pulses), "keyphasor", ["5 keyphasor pulses in 10.0 revolutions", "one a revolution"]),
        (record(keyphasor=keyphasor_signal(2 * W, TIME)), "keyphasor", ["keyphasor pulses", "one a revolution"]),
        (record(keyphasor=lambda s: 0 * s), "keyphasor", ["0 keyphasor pulses"]),
        (record(keyphasor=marks(*np.delete(REGULAR, [3, 4, 5]))), "keyphasor", ["rec.nc", "keyphasor"]),
        (record(keyphasor=marks(*REGULAR, 4.8)), "keyphasor", ["rec.nc", "keyphasor"]),  # half-way between two
        # one lost and one spurious: the count is right, the marks are not
        (record(keyphasor=marks(*np.delete(REGULAR, 6), 4.8)), "keyphasor", ["rec.nc", "keyphasor"]),
        (record(reference=lambda s: 0 * s), "reference", ["reference signal has no harmonic"]),
        (record(time=lambda t: t**1.01), "none", ["not evenly spaced"]),
        (record(time=lambda t: t[:-1]), "none", ["samples of displacement but 3999 of time"]),
        (record(reference=lambda s: s[:-1]), "reference", ["3999 samples of reference but 4000 of time"]),
        (record(displacement=record().displacement[0]), "none", ["rec.nc", "displacement"]),
        (record(sensors=(1, 2)), "none", ["rec.nc", "sensors"]),
        (record(time=np.where(TIME[5] == TIME, np.nan, TIME)), "none", ["rec.nc", "time"]),
        (record(time=0 * TIME), "none", ["rec.nc", "time"]),
        (record(time=TIME[::-1]), "none", ["rec.nc", "increasing"]),
        (record(speed=np.nan), "none", ["rec.nc", "speed nan"]),
        (record(), "refrence", ["unknown phase 'refrence'", "did you mean 'reference'"]),
    ],
    ids=lambda part: part[0] if isinstance(part, list) else "",
)
def test_a_wrong_record_is_refused(wrong, phase, words):
    refused(lambda: full_spectrum([wrong], H, REGRESSION, phase), *words)


@pytest.mark.parametrize("harmonics", [[], [1, 1, 2], [1.5]])
def test_harmonics_that_are_not_distinct_whole_numbers_are_refused(harmonics):
    refused(lambda: measured_response(MODEL, [88.0], harmonics), "harmonic")
    refused(lambda: full_spectrum([record()], harmonics, REGRESSION, "none"), "harmonic")


def test_no_records_at_all_are_refused(tmp_path):
    refused(lambda: full_spectrum([], H, METHODS[0], "none"), "no record")
    data = records_dataset([record(), record(speed=100.0)]).isel(speed=slice(0, 0))
    save(data, tmp_path / "empty.nc")
    rig = tmp_path / "rig.yaml"
    rig.write_text(yaml.safe_dump(RIG))
    refused(lambda: read_measurement(tmp_path / "empty.nc", rig), "no record")
    refused(lambda: read_measurement([], rig), "no record")


def test_one_missing_pulse_is_bridged():
    low = [0, 1, 2, -1]
    expected = np.exp(2j * np.pi * 0.3 * np.array(low))[:, None]
    for pulses in (REGULAR, np.delete(REGULAR, 4)):
        found = full_spectrum([record(keyphasor=marks(*pulses))], low, METHODS[0], "keyphasor").amplitude[0]
        # flanks by straight lines between samples 0.016 rad apart on pulses 0.1 rad wide: 0.016^2 / 0.1 / 8 at worst
        assert found == pytest.approx(expected, abs=2e-3)


def spectrum(**changes):
    return replace(spectrum_of(MODEL, [88.0, 308.0], H, 1e-9), **changes)


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: e.name)
@pytest.mark.parametrize(
    ("wrong", "names", "words"),
    [
        (spectrum(amplitude=spectrum().amplitude * np.nan), ("external_damping",), ["NaN"]),
        (spectrum(covariance=spectrum().covariance * np.nan), ("external_damping",), ["covariance"]),
        (spectrum(sensors=(2,)), ("external_damping",), ["sensors"]),
        (spectrum(speed=np.array([88.0, 0.0])), ("external_damping",), ["speed 0", "> 0"]),
        (spectrum(), (), ["unknown"]),
        (spectrum(), ("external_dampin",), ["did you mean 'external_damping'"]),
        (spectrum(), ("external_damping", "external_damping"), ["external_damping"]),
    ],
    ids=["NaN harmonics", "NaN covariance", "other sensors", "speed zero", "no unknowns", "misspelt", "twice"],
)
def test_a_problem_that_cannot_be_solved_is_refused(estimator, wrong, names, words):
    assert estimator.function(Problem(MODEL, spectrum(), ("external_damping",))).theta == pytest.approx(100.0)
    refused(lambda: estimator.function(Problem(MODEL, wrong, names)), *words)
