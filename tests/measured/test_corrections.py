"""Repeats at one speed are averaged, slow-roll vectors subtracted, and a mean that no film can have left out."""

import numpy as np
import pytest
import yaml
from machines import film, readings, rig_of, shaft
from one_line_errors import refused

from rotorstudy import build_model, measured_spectrum
from rotorstudy.measurement.corrections import averaged, check_slow_roll, without_missing_mean, without_slow_roll
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.units import spin

SPEEDS, HARMONICS, NODES = np.array([30.0, 40.0, 200.0, 300.0]), np.array([0, 1, -1, 2]), (1, 3)
RUNOUT = np.array([[1e-6, 2e-6], [3e-6j, 1e-6], [1e-6, -1e-6j], [2e-7, 0]])  # (harmonic, node)
FILM = film(0.05, 0.02, 5e-5, 0.02)
SPRING = {"kind": "linear", "bearing_stiffness_N_per_m": 2e7, "bearing_damping_N_s_per_m": 2e3}


def rig(bearing):
    bearings = [{**bearing, "node": node, "label": str(node)} for node in NODES]
    loaded = {"kind": "unbalance", "node": 2, "unbalance_g_mm": 100.0}
    return rig_of(shaft(0.6, 2, outer_diameter_m=0.05), bearings, loaded, sensors=[*NODES])


RIG = build_model(rig(SPRING))


def spectrum(amplitude, variance=1e-16):
    return readings(amplitude, SPEEDS, HARMONICS, NODES, variance**0.5)


def test_the_vectors_are_the_mean_at_slow_roll_and_their_noise_is_counted():
    moving = np.array([0, 0, 1, 2])[:, None, None] * np.full((4, 4, 2), 1e-5)
    scatter = 1e-8 * np.array([1, -1, 0, 0])[:, None, None]
    found, (note,) = without_slow_roll(spectrum(moving + RUNOUT + scatter), RIG, 400.0, "records")
    assert found.speed.tolist() == [200.0, 300.0] and note.name == "slow roll subtracted"
    assert np.abs(found.amplitude[:, 1:] - moving[2:, 1:]).max() < 1e-18
    assert np.abs(found.amplitude[:, 0] - moving[2:, 0] - RUNOUT[0]).max() < 1e-18  # the mean is no runout
    variance = np.diagonal(found.covariance, axis1=-2, axis2=-1).reshape(2, 2, 2, 4)
    assert np.allclose(variance[..., 1:], 1.5e-16 / 2) and np.allclose(variance[..., 0], 1e-16 / 2)
    assert without_slow_roll(found, RIG, None, "records") == (found, [])
    for below in (100.0, 1e4):
        refused(lambda: without_slow_roll(spectrum(moving), RIG, below, "records"), "below it")


@pytest.mark.parametrize("bearing", [FILM, SPRING])
def test_a_slow_roll_beyond_a_critical_speed_is_told_and_the_half_speed_motion_of_films_is_none(bearing):
    model = build_model(rig(bearing))
    assert check_slow_roll(SPEEDS[:2], model, "records") == []
    critical = analyse_rotor(model, 50.0, 2000.0).resonant[0].speed
    assert check_slow_roll([0.95 * critical], model, "records") == []
    (told,) = check_slow_roll([30.0, 1.05 * critical], model, "records")
    assert told.severity == "warning" and spin(critical) in told.text


def test_a_table_with_a_row_at_slow_roll(tmp_path):
    given = rig(SPRING) | {"measurement": {"harmonics": [1], "slow_roll_below_rpm": 400}}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(given))
    rows = [(300, 1.0), (1500, 11.0), (3000, 21.0)]
    lines = [f"{speed},{node},1,{size},0" for speed, size in rows for node in NODES]
    (tmp_path / "t.csv").write_text("speed_rpm,node,harmonic,amplitude_um,phase_deg\n" + "\n".join(lines))
    found, _, findings = measured_spectrum([tmp_path / "t.csv"], tmp_path / "rig.yaml")
    assert np.allclose(found.amplitude[:, 0, 0], [1e-5, 2e-5]) and len(found.speed) == 2
    assert "slow roll subtracted" in [finding.name for finding in findings]


@pytest.mark.parametrize(
    ("bearing", "mean", "is_left_out"), [(FILM, 1e-8, True), (FILM, 1e-6, False), (SPRING, 0, False)]
)
def test_a_mean_that_is_zero_at_every_speed_is_none_on_films(bearing, mean, is_left_out):
    """On springs a sound machine shows none; on films one speed with a mean is enough."""
    amplitude = np.full((4, 4, 2), 1e-5 + 0j)
    amplitude[:, 0] = 0
    amplitude[-1, 0, 1] = mean
    data = spectrum(amplitude)
    found, notes = without_missing_mean(data, build_model(rig(bearing)), "records")
    assert (0 not in found.harmonics) == is_left_out and [n.name for n in notes] == ["AC coupling"] * is_left_out
    assert not is_left_out or without_missing_mean(found, build_model(rig(bearing)), "records") == (found, [])


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


def test_repeats_within_their_noise_are_a_note_and_those_beyond_a_warning_and_single_records_none():
    (note,) = averaged(repeats(1, 0.0), "x.csv")[1]
    assert (note.severity, note.name) == ("note", "repeats")
    (warning,) = averaged(repeats(1, SCATTER), "x.csv")[1]
    assert (warning.severity, warning.name) == ("warning", "repeats differ")
    single = repeats(1, SCATTER, count=1)
    assert averaged(single, "x.csv") == (single, [])


def test_a_speed_measured_once_scatters_too():
    found, _ = averaged(repeats(1, SCATTER).at_speeds(np.arange(7)), "x.csv")  # the last speed once
    std = np.sqrt(np.diagonal(found.covariance, axis1=-2, axis2=-1))
    assert np.allclose(std[2] / std[0], np.sqrt(3), rtol=0.05)
