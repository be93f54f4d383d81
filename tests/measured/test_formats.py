"""A record written in any format, with any conventions, gives the harmonics it was made of."""

from itertools import zip_longest

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from machine import HARMONICS, PROBES, SPEEDS, channels, mark_times, model, records, section, write, write_rig
from one_line_errors import refused
from scipy.stats import chi2

from rotorstudy import measured_response, read_measurement, simulate_records
from rotorstudy.measurement.conventions import Conventions, Keyphasor, Probe
from rotorstudy.measurement.records import records_dataset
from rotorstudy.measurement.spectrum import components
from rotorstudy.store import save
from thesis.scoreboard import published


def true():
    return measured_response(model(), SPEEDS, HARMONICS)


def whitened(spectrum, expected):
    off = components(spectrum.amplitude - expected)  # (speed, component, sensor)
    return np.einsum("vsij,vjs->vsi", spectrum.whitener, off)


def agrees(measurement):
    """Harmonics of all three speeds within their covariance: 120 squares. One in a thousand good records on either side
    is outside the chi-square bounds; an estimated covariance of 15 to 40 blocks widens them by about a tenth."""
    squares = np.sum(whitened(measurement.spectrum, true()) ** 2)
    low, high = chi2.ppf([0.001, 0.999], 120)
    return 0.9 * low < squares < 1.1 * high


def underscored(probes):
    return [{**probe, "channel": probe["channel"].replace(" ", "_")} for probe in probes]


@pytest.mark.parametrize("kind", ["csv", "mat", "uff"])
def test_odd_conventions_come_back_in_every_format(kind, tmp_path):
    if kind == "uff":
        pytest.importorskip("pyuff")
    probes = underscored(section()["probes"]) if kind == "mat" else section()["probes"]
    rig = write_rig(tmp_path / "rig.yaml", probes=probes)
    paths = [write(kind, tmp_path, record) for record in records()]
    measurement = read_measurement(paths[::-1], rig)
    assert measurement.findings == []
    assert measurement.spectrum.speed == pytest.approx(SPEEDS, rel=1e-6)
    assert agrees(measurement)


def test_units_in_the_header_need_not_be_in_the_rig_file(tmp_path):
    """Nor the other way round; a unit that contradicts the rig file is said, and not that a channel is unknown."""
    units = {name: unit for name, *_, unit, _ in PROBES} | {"time": "s", "key": "V", "speed": "rpm"}
    paths = [write("csv", tmp_path, record) for record in records()]
    for path in paths:
        head, _, rest = path.read_text().partition("\n")
        path.write_text(",".join(f"{name} ({units[name]})" for name in head.split(",")) + "\n" + rest)
    assert agrees(read_measurement(paths, write_rig(tmp_path / "rig.yaml")))
    other = paths[0].read_text().replace("(mil)", "(mm)")
    paths[0].write_text(other)
    refused(lambda: read_measurement(paths, tmp_path / "rig.yaml"), "states the unit 'mm' for channel 'disc 2 left'")


@pytest.mark.parametrize(
    "wrong",
    [
        {"rotation": "with_angles"},
        {"gravity_angle_deg": 170.0},
        {"keyphasor": {"channel": "key", "sensor_angle_deg": 90.0}},
        {"keyphasor": {"channel": "key", "sensor_angle_deg": 95.0, "mark_angle_deg": 30.0}},
        {"probes": [{**probe, "sign": 1} for probe in section()["probes"]]},
        {"probes": [{**probe, "angle_deg": probe["angle_deg"] + 3} for probe in section()["probes"]]},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_a_wrong_convention_does_not_agree(wrong, tmp_path):
    paths = [write("csv", tmp_path, record) for record in records()]
    measurement = read_measurement(paths, write_rig(tmp_path / "rig.yaml", **wrong))
    assert measurement.errors or not agrees(measurement)


def test_the_projects_own_records_and_netcdf_with_probes(tmp_path):
    made = records()
    own, odd = tmp_path / "own.nc", tmp_path / "odd.nc"
    save(records_dataset(made), own)
    projects = {"rotation": "with_angles", "gravity_angle_deg": 0.0}
    rig = write_rig(tmp_path / "own.yaml", probes=[], keyphasor={"channel": "keyphasor"}, **projects)
    measurement = read_measurement(own, rig)
    assert measurement.findings == [] and agrees(measurement)

    factor = {"mm": 1.0, "mil": 2.54e-2, "um": 1e-3, "V": 1 / 7.874}  # all in mm, as the file states
    units = {name: factor[unit] * sign for name, _, _, unit, sign in PROBES}
    left, right = (
        np.array([[units[name] * channels(r)[name] for name in (f"disc 1 {side}", f"disc 2 {side}")] for r in made])
        for side in ("left", "right")
    )
    shown = ("speed", "direction", "node", "time"), np.stack([left, right], 1), {"units": "mm"}
    pulses = ("speed", "time"), [channels(r)["key"] for r in made], {"units": "V"}
    where = {"speed": ("speed", np.array(SPEEDS) * 30 / np.pi, {"units": "rpm"}), "node": [2, 4]}
    where |= {"direction": ["left", "right"], "time": ("time", made[0].time * 1e3, {"units": "ms"})}
    data = xr.Dataset({"displacement": shown, "keyphasor": pulses}, where)
    data.to_netcdf(odd)
    probes = [{"channel": "left", "angle_deg": -45.0}]
    probes += [{"channel": "right", "node": node, "angle_deg": angle} for node, angle in ((2, 45.0), (4, 30.0))]
    rig = write_rig(tmp_path / "odd.yaml", probes=probes)
    measurement = read_measurement(odd, rig)
    assert measurement.findings == [] and agrees(measurement)

    coarse = (np.round(8000 * mark_times(r)) / 8000 for r in made)  # s, as from samples of the pulses
    times = np.transpose([*zip_longest(*coarse, fillvalue=np.nan)])  # fewer at a low speed
    marked = data.drop_vars("keyphasor").assign(phase_mark_time=(("speed", "revolution"), times))
    marked.to_netcdf(tmp_path / "marks.nc")
    measurement = read_measurement(tmp_path / "marks.nc", rig)
    assert measurement.findings == [] and agrees(measurement)


def test_a_reference_signal_serves_where_there_is_no_keyphasor(tmp_path):
    made = simulate_records(model(), SPEEDS, HARMONICS, records()[0].time, start_angle_rad=0.4, keyphasor_wanted=False)
    save(records_dataset(made), tmp_path / "own.nc")
    rig = write_rig(tmp_path / "rig.yaml", probes=[], keyphasor={}, rotation="with_angles", gravity_angle_deg=0.0)
    found = read_measurement(tmp_path / "own.nc", rig)
    assert found.findings == []
    assert found.spectrum.amplitude == pytest.approx(true(), abs=5e-11)  # unlisted harmonics leak by a sample


def test_mirrored_and_turned_tables_of_harmonics(tmp_path):
    """A table in the user's plane, rounded: within its rounding."""
    z, rows = true(), []
    mark = np.pi - np.pi / 2 + np.pi / 6  # reference line as the mark passes: back from down by 90, and 30 for the mark
    for i, w in enumerate(SPEEDS):
        for k, n in enumerate(HARMONICS):
            for s, node in enumerate((2, 4)):
                seen = np.conj(z[i, k, s] * np.exp(1j * n * mark)) * np.exp(1j * np.pi)
                row = {"speed_Hz": repr(float(w / 2 / np.pi)), "node": node, "harmonic": -n}
                row |= {"amplitude_um": f"{abs(seen) * 1e6:.3f}", "phase_deg": f"{np.rad2deg(np.angle(seen)) + 20:.1f}"}
                rows.append(row | {"reference_phase_deg": "20.0"})
    pd.DataFrame(rows).to_csv(tmp_path / "table.csv", index=False)
    measurement = read_measurement(tmp_path / "table.csv", write_rig(tmp_path / "rig.yaml"))
    assert [finding.severity for finding in measurement.findings] == ["note", "note"]
    assert np.abs(measurement.spectrum.amplitude - z).max() < 0.5e-9 + 4.3e-6 * np.deg2rad(0.05)
    large = np.abs(z) > 5e-8  # of the others the rounding of the amplitude is no small part
    off = whitened(measurement.spectrum, z)
    both = np.concatenate([large, large], axis=1)
    ratio = np.mean(np.moveaxis(off, 1, 2)[both] ** 2)
    assert 0.4 < ratio < 1.3  # uniform; the rounding of the reference phase, here exact, is in the covariance too


@pytest.mark.parametrize("chapter", [3, 5])
def test_the_examples_of_printed_spectra_are_those_of_the_reference(chapter, request):
    root = request.config.rootpath
    found = read_measurement(
        root / f"examples/chapter_{chapter}_spectrum.csv", root / f"examples/chapter_{chapter}_rig.yaml"
    )
    assert not found.errors and len(found.spectrum.speed) == {3: 4, 5: 3}[chapter]
    printed = published(root / "workflow/reference")
    printed = printed[printed.table.str.startswith(f"{chapter}.") & (printed.method == "fft")]
    for i, w in enumerate(found.spectrum.speed):
        case = printed[printed.case == f"{w / 2 / np.pi:.0f} Hz"]
        for k, n in enumerate(found.spectrum.harmonics):
            value = case[case["item"] == str(n)].groupby("quantity").published.first()
            if (chapter, i, n) != (3, 0, 0):  # a misprint of the phase
                angle = value["phase"] - value["reference phase"]
                assert found.spectrum.amplitude[i, k, 0] == pytest.approx(value["amplitude"] * np.exp(1j * angle))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rotaton": "with_angles"}, ["unknown key 'rotaton'", "did you mean 'rotation'"]),
        ({"rotation": "clockwise"}, ["rotation", "'with_angles' or 'against_angles'"]),
        ({"keyphasor": {"chanel": "key"}}, ["'keyphasor.chanel'", "did you mean 'keyphasor.channel'"]),
        ({"probes": [{"channel": "a", "angle": 3.0}]}, ["'angle'", "'angle_deg'", "probes[0]"]),
        ({"probes": {"channel": "a"}}, ["probes", "list"]),
        ({"probes": [{**p, "channel": "disc 1 lefd"} for p in section()["probes"]]}, ["'disc 1 left'", "lefd"]),
        ({"probes": [{**p, "channel": "key"} for p in section()["probes"]]}, ["'key' is that of two probes"]),
        ({"probes": section()["probes"][:3], "harmonics": [1, 2]}, ["node 4", "single probe", "take both"]),
        ({"probes": [{**p, "unit": None} for p in section()["probes"]]}, ["no unit", "state 'unit:'"]),
        ({"probes": [{**p, "unit": "V"} for p in section()["probes"]]}, ["sensitivity_V_per_m"]),
        ({"probes": [{**p, "node": 7} for p in section()["probes"]]}, ["unknown node '7'", "probes must sit"]),
        ({"keyphasor": {"channel": "kex"}}, ["'kex'", "did you mean 'key'"]),
        ({"time_channel": "zeit"}, ["time channel 'zeit'"]),
        ({"harmonics": [0, 2]}, ["harmonic 1 is missing"]),
        ({"csv": {"separator": ";"}}, ["unknown probe channel"]),
        ({"speeds_Hz": {"a": 1.0}, "speeds_rpm": {"a": 60.0}}, ["'a'", "two units"]),
    ],
)
def test_what_does_not_fit_the_file_is_named(changes, words, tmp_path):
    rig = write_rig(tmp_path / "rig.yaml", **changes)
    path = write("csv", tmp_path, records(speeds=[80.0])[0])
    refused(lambda: read_measurement(path, rig), *words)


def test_a_file_of_another_kind_is_named(tmp_path):
    (tmp_path / "a.xlsx").touch()
    rig, words = write_rig(tmp_path / "rig.yaml"), ("unknown kind of record file '.xlsx'", ".csv")
    refused(lambda: read_measurement(tmp_path / "a.xlsx", rig), *words)


def test_every_key_is_documented(request):
    page = (request.config.rootpath / "docs" / "measured_records.md").read_text()
    keys = [*Conventions.model_fields, *Probe.model_fields, *Keyphasor.model_fields]
    assert [name for name in keys if f"`{name}`" not in page] == []
