"""Files read in the wrong way: wrong layout, units, angles, sampling rate, or twice. Each is told with its remedy."""

import numpy as np
import pytest
from machine import TIME, channels, records, section, write, write_rig
from one_line_errors import refused

from rotorstudy import measured_spectrum, read_measurement
from rotorstudy.measurement.conventions import Probe
from rotorstudy.measurement.plausibility import check_probes
from rotorstudy.measurement.quality import spikes

SPEED = 80.0
IN_RADIANS = [{**probe, "angle_deg": float(np.deg2rad(probe["angle_deg"]))} for probe in section()["probes"]]


@pytest.mark.parametrize(
    ("alter", "stated", "said"),
    [
        (lambda text: text.replace(",", ";"), {}, r'unknown probe channel .* looks like \'csv: {"separator": ";"}'),
        (lambda text: text.replace(",", ";").replace(".", ","), {}, '"separator": ";", "decimal": ","'),
        (lambda text: text.replace(",", ";").replace(".", ","), {"csv": {"separator": ";"}}, '"decimal": ","'),
        (
            lambda text: text.replace("\n", "\ns,V,mm,mil,um,V,rpm\n", 1),
            {},
            r'line 2, column .*\'V\' is not a number.*{"unit_rows": 1}',
        ),
        (str, {"speed_unit": "Hz"}, "in rpm, and stated in Hz"),
        (str, {"sample_rate_Hz": 4e6, "time_channel": "none"}, "a sampling rate in Hz?"),
        (str, {"sample_rate_Hz": 4e6}, "'time' has 4000 samples per second, and the rig states sample_rate_Hz = 4e.06"),
        (str, {"speeds_rpm": {"run_80.csv": 600.0}}, r"states a speed of 763.9 rpm .*, the rig 600 rpm"),
        (lambda text: text.replace("speed", "speed (Hz)", 1), {"speed_channel": "speed (Hz)"}, "the unit 'Hz' .*'rpm'"),
        (
            lambda text: text.replace("\n", "\ns,V,mm,mil,mil,V,rpm\n", 1),
            {"csv": {"unit_rows": 1}},
            "the unit 'mil' .*'um'",
        ),
        (lambda text: text.replace("key", "disc 1 left", 1), {}, "two columns are named 'disc 1 left'"),
    ],
)
def test_a_file_read_in_the_wrong_way_is_told_with_the_remedy(tmp_path, alter, stated, said):
    path = write("csv", tmp_path, records(speeds=[SPEED], time=TIME[:4000])[0])
    path.write_text(alter(path.read_text()))
    refused(lambda: measured_spectrum(path, write_rig(tmp_path / "rig.yaml", **stated)), match=said)


@pytest.mark.parametrize(
    ("stated", "name"),
    [
        ({"sample_rate_Hz": 4e6, "time_channel": "none", "speed_channel": None}, "unusual speed"),
        ({"sample_rate_Hz": 4.0, "time_channel": "none", "speed_channel": None}, "unusual speed"),
        ({"sample_rate_Hz": 4000.0}, None),
        ({"probes": IN_RADIANS}, "probe angles"),
        ({}, None),  # the negative control
    ],
)  # fmt: skip
def test_what_is_odd_about_a_rig_file_is_a_finding(tmp_path, stated, name):
    path = write("csv", tmp_path, records(speeds=[SPEED], time=TIME[:4000])[0])
    found = {one.name for one in read_measurement(path, write_rig(tmp_path / "rig.yaml", **stated)).findings}
    assert {"unusual speed", "probe angles"} & found == ({name} if name else set())


@pytest.mark.parametrize("value", [-999.0, 9999.0, -32768.0, 0.0])
def test_single_samples_that_are_no_motion_are_missing(tmp_path, value):
    """As recorders mark a missing sample. The harmonics are those of the record without them, within their errors."""
    (record,) = records(speeds=[SPEED], time=TIME[:4000])
    sound, rig = channels(record), write_rig(tmp_path / "rig.yaml")
    damaged = sound["disc 2 right"].copy()
    at = [777, 1500, 1501] if value else sorted(np.argsort(np.abs(damaged))[-3:])  # 0 is seen where others are not
    damaged[at] = value
    found = read_measurement(write("csv", tmp_path, record, **{"disc 2 right": damaged}), rig)
    (told,) = (one for one in found.findings if one.name == "spikes")
    assert "3 samples, the first" in told.text and f"sample {at[0] + 1}" in told.text and "'disc 2 right'" in told.where
    plain = read_measurement(write("csv", tmp_path, record), rig).spectrum
    assert np.abs(found.spectrum.whitened(found.spectrum.amplitude - plain.amplitude)).max() < 1


@pytest.mark.parametrize(("angles", "count"), [((0.0, 1.6), 1), ((0.0, 90.0), 0)])
def test_probes_at_one_angle_are_told_where_they_have_no_node(angles, count):
    probes = [Probe(channel=name, angle_deg=angle) for name, angle in zip("xy", angles, strict=True)]
    assert [one.where for one in check_probes(probes, "rig.yaml")] == count * ["rig.yaml"]


def test_noise_impacts_and_drift_are_no_spikes():
    random, angle = np.random.default_rng(1), np.arange(20000) / 20000 * 40 * 2 * np.pi
    impacts = np.cos(angle) + 4 * np.exp(-0.5 * (np.angle(np.exp(1j * angle)) / 0.2) ** 2)
    for signal in (random.normal(size=1_000_000), impacts, np.cos(angle) + angle / 50, np.zeros(99), [np.nan] * 99):
        assert not spikes(np.array(signal), 5).any()
        if np.isfinite(signal).all():  # of twelve bits, of which a tenth is used; and of two
            assert not any(spikes(np.round(np.array(signal) / digit), 5).any() for digit in (0.005, 0.7))
    assert spikes(np.r_[np.cos(angle), -9.0], 5).sum() == 1


@pytest.mark.parametrize("pieces", [5, 50])
@pytest.mark.parametrize("first", [9000, 9030, 9060, 9090, 9125])
def test_a_dropout_of_zeros_is_missing_whatever_the_signs_at_its_ends(first, pieces):
    """Also if it fills a piece; one begins at a zero crossing."""
    noise = np.random.default_rng(1).normal(size=20000) / 300
    signal = np.cos(np.arange(20000) / 20000 * 40 * 2 * np.pi) + noise
    signal[first : first + 900] = 0.0
    assert np.flatnonzero(spikes(signal, pieces)).tolist() == list(range(first, first + 900))


@pytest.mark.parametrize("value", [0.0, None])
@pytest.mark.parametrize(("every", "samples"), [(1, 250), (1, 4000), (5, 50), (25, 11)])
def test_a_value_that_is_held_is_missing_also_from_one_zero_crossing_to_the_next(every, samples, value):
    """From half a revolution of 500, 100 or 20 samples on; at the begin zero or the last value."""
    angle = np.arange(50000)[::every] / 500 * 2 * np.pi
    signal = np.cos(angle) + np.random.default_rng(1).normal(size=len(angle)) / 3000
    first = 18125 // every + (0 if value == 0 else 20 // every)
    signal[first : first + samples] = signal[first] if value is None else value
    assert np.flatnonzero(spikes(signal, 5)).tolist() == list(range(first, first + samples))


@pytest.mark.parametrize("digit", [0.005, 0.1, 0.3, 0.7, 1.5])
def test_values_that_rounding_clipping_or_rest_repeat_are_not_held(digit):
    """Up to three levels in all; a run-up from standstill, of which the first revolutions are below a digit."""
    angle = np.arange(50000) / 500 * 2 * np.pi
    grown = np.linspace(0, 1, 50000) * np.cos(angle**2 / 600)
    signals = [np.cos(angle) + 0.2 * np.cos(2 * angle + 1), np.random.default_rng(1).normal(size=1_000_000), grown]
    for signal in (*signals, np.r_[np.full(9000, 0.001), grown], np.r_[grown, np.full(9000, grown[-1])]):
        assert not spikes(np.round(signal / digit) * digit + 1, 50).any()
    assert not spikes(np.clip(signals[0], -digit, digit), 50).any()


def test_import_refuses_a_record_given_twice(tmp_path, command):
    rig, path = write_rig(tmp_path / "rig.yaml"), write("csv", tmp_path, records(speeds=[SPEED], time=TIME[:4000])[0])
    said = command("import", path, path, "--rig", rig, "--out", tmp_path / "spectrum.nc", status=1).err
    assert "the same record occurs twice" in said and not (tmp_path / "spectrum.nc").exists()
