"""Every fault of a record is named, and a good record is not accused of any."""

import ast
from dataclasses import replace
from pathlib import Path
from string import Formatter

import numpy as np
import pytest
import xarray as xr
import yaml
from machine import HARMONICS, MARKS, STEADY, TIME, UNITS, channels, pulses, records, section, write, write_rig
from one_line_errors import refused
from page_checks import problems

from rotorstudy import load_spectrum, read_measurement
from rotorstudy.measurement import findings as table
from rotorstudy.measurement.plausibility import check_order, check_sense
from rotorstudy.measurement.quality import check_speed_label, flat_top
from rotorstudy.measurement.raw_record import _by_the_clock
from rotorstudy.measurement.records import records_dataset
from rotorstudy.store import save


def findings(tmp_path, record=None, rig_changes=None, **changes):
    """Findings of one record, channels of which are replaced, as {name: severity}."""
    path = write("csv", tmp_path, record or records(speeds=[STEADY])[0], name="run", **changes)
    measurement = read_measurement(path, write_rig(tmp_path / "rig.yaml", **(rig_changes or {})))
    assert all(len(finding.text) > 20 and "run.csv" in finding.where for finding in measurement.findings)
    return {finding.name: finding.severity for finding in measurement.findings}


def original():
    return channels(records(speeds=[STEADY])[0])


@pytest.mark.parametrize("seed", range(6))
def test_good_records_have_no_findings(seed, tmp_path):
    """At noise from a tenth of the usual to four times it."""
    record = records(seed, [50.0 + 10 * seed], noise=5e-8 * 40 ** (seed / 5))[0]
    assert findings(tmp_path, record) == {}


def draws(seed, size=TIME.size):
    return np.random.default_rng(seed).normal(size=size)


def clipped(part):
    left = original()["disc 1 left"]
    return {"disc 1 left": np.minimum(left, left.mean() + part * (left.max() - left.mean()))}


def with_gap(samples):
    left = original()["disc 1 left"].copy()
    left[1000 : 1000 + samples] = np.nan
    return {"disc 1 left": left}


def of_twelve_bits():
    left = original()["disc 1 left"]
    digit = np.ptp(left) / 400  # a tenth of its range is used
    return {"disc 1 left": np.round(left / digit) * digit}


def undershot(share):
    return {"key": pulses(MARKS)["key"] - share * pulses(MARKS + 0.3 / STEADY)["key"]}


def swapped(*pairs):
    """Angles of the two probes of some discs, by the first, the wrong way round."""
    probes = section()["probes"]
    for i in pairs:
        one, other = probes[i : i + 2]
        one["angle_deg"], other["angle_deg"] = other["angle_deg"], one["angle_deg"]
    return {"probes": probes}


POSITIVE = {"keyphasor": section()["keyphasor"] | {"polarity": "positive"}}
WRONG_LABEL = {"speed label": "error"}
DEAD = {"dead probe": "warning", "single probe": "note"}
FAULTS = {  # changes of channels, findings, changes of the rig file
    "clipping at 95 %": (lambda: clipped(0.95), {"clipping": "error"}),
    "clipping at 80 %": (lambda: clipped(0.8), {"clipping": "error"}),
    "twelve bits": (of_twelve_bits, {}),
    "constant": (lambda: {"disc 1 left": np.full(len(TIME), 0.3)}, DEAD),
    "noise only": (lambda: {"disc 1 left": draws(3)}, DEAD),
    "one cable twice": (lambda: {"disc 1 right": -original()["disc 1 left"] / 7.874}, {"one signal": "warning"}),
    "weak": (
        lambda: {"disc 1 left": np.mean(original()["disc 1 left"]) + 2e-3 * original()["disc 1 left"]},
        {"weak probe": "warning"},
    ),
    "a few samples missing": (lambda: with_gap(100), {"gaps": "warning"}),
    "many samples missing": (lambda: with_gap(2000), {"gaps": "error"}),
    "label": (lambda: {"speed": original()["speed"] * 1.03}, WRONG_LABEL),
    "label in rad/s": (lambda: {"speed": np.full(len(TIME), STEADY)}, {}, {"speed_unit": "rad/s"}),
    "label in rad/s as Hz": (lambda: {"speed": np.full(len(TIME), STEADY)}, WRONG_LABEL, {"speed_unit": "Hz"}),
    "label in rad/s as rpm": (lambda: {"speed": np.full(len(TIME), STEADY)}, WRONG_LABEL),
    "dead keyphasor": (lambda: {"key": np.full(len(TIME), 1.0)}, {"dead keyphasor": "error"}),
    "noisy dead keyphasor": (lambda: {"key": draws(2)}, {"dead keyphasor": "error"}),
    "three pulses missing": (lambda: pulses(np.delete(MARKS, [4, 11, 12])), {"missing pulses": "warning"}),
    "two pulses beside": (
        lambda: pulses(np.sort([*MARKS, MARKS[5] + 0.02, MARKS[20] + 0.03])),
        {"doubled pulses": "warning"},
    ),
    "jitter": (lambda: pulses(MARKS + 0.1 / STEADY * draws(4, 30)), {"keyphasor jitter": "warning"}),
    "an AC-coupled keyphasor": (lambda: {"key": np.gradient(pulses(MARKS)["key"])}, {"keyphasor polarity": "warning"}),
    "pulses with half an undershoot": (lambda: undershot(0.5), {"keyphasor polarity": "warning"}),
    "pulses with a small undershoot": (lambda: undershot(0.2), {}),
    "pulses": (lambda: pulses(MARKS, noise=0.05), {}),
    "downward pulses": (lambda: pulses(MARKS, -1, noise=0.05), {}),
    "downward pulses from -8 V": (lambda: pulses(MARKS, -1, -8.0, noise=0.05), {}),
    "pulses as stated": (lambda: pulses(MARKS), {}, POSITIVE),
    "downward pulses stated upward": (lambda: pulses(MARKS, -1), {"keyphasor polarity": "error"}, POSITIVE),
    "a square wave": (lambda: {"key": np.sign(np.sin(STEADY * TIME))}, {"keyphasor polarity": "warning"}),
    "two marks a turn": (
        lambda: pulses(np.sort([*MARKS, *(MARKS - np.pi / STEADY)])),
        WRONG_LABEL | {"non-synchronous line": "warning"},
    ),
    "a vibration that grows": (
        lambda: {"disc 1 left": original()["disc 1 left"] * (1 + 0.05 * TIME)},
        {"not steady": "warning"},
    ),
    "reversed rotation": (dict, {"sense of rotation": "error"}, {"rotation": "with_angles"}),
    "all probes swapped": (dict, {"sense of rotation": "error"}, swapped(0, 2)),
    "two probes swapped": (dict, {"swapped probes": "error"}, swapped(0)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named_and_nothing_else(fault, tmp_path):
    changes, expected, *of_rig = FAULTS[fault]
    assert findings(tmp_path, None, *of_rig, **changes()) == expected


@pytest.mark.parametrize(("marks", "said"), [(6, "6 marks a revolution"), (4.5, "correct the label")])
def test_several_marks_a_revolution_are_told_by_the_stated_speed(marks, said):
    (found,) = check_speed_label(100.0, 100.0 * marks, "here")
    assert said in found.text


@pytest.mark.parametrize("digits", [4, 5, 12])
def test_times_that_a_file_rounds_are_those_of_the_clock(digits, tmp_path):
    """To 0.4 of a step there were six lines beside the harmonics. Times of an uneven clock are left as they are."""
    assert findings(tmp_path, None, time=np.round(TIME + 0.7, digits)) == {}
    uneven = TIME + 1e-5 * np.sin(STEADY * TIME)
    assert _by_the_clock(uneven) is uneven
    assert _by_the_clock(np.round(uneven, 5)) != pytest.approx(TIME, abs=4e-6)
    assert _by_the_clock(np.round(TIME, digits)) == pytest.approx(TIME, abs=1e-6)


def of_all_speeds(tmp_path, probes, quiet):
    """(severity, name) of the findings on probes, and the Spectrum; `probes` show noise alone at the speeds `quiet`."""
    generator, units = np.random.default_rng(5), {p["channel"]: UNITS[p["unit"]] for p in section()["probes"]}
    still = {name: 1e-6 * units[name] * generator.normal(size=len(TIME)) for name in probes}
    paths = [write("csv", tmp_path, one, **(still if one.speed in quiet else {})) for one in records()]
    found = read_measurement(paths, write_rig(tmp_path / "rig.yaml"))
    told = {"dead probe", "weak probe", "noise floor"}
    return {(f.severity, f.name) for f in found.findings if f.name in told}, found.spectrum


DISC_1 = ("disc 1 left", "disc 1 right")


def test_a_shaft_that_is_quiet_at_one_speed_has_no_dead_probes(tmp_path):
    """Neither probe of a node shows any vibration beyond a noise of a few per cent of that at other speeds.

    Negative control: one probe that shows noise while the other vibrates, or both at all speeds.
    """
    told, spectrum = of_all_speeds(tmp_path, DISC_1, quiet=[60.0])
    assert told == {("warning", "noise floor")} and len(spectrum.speed) == 3
    told, spectrum = of_all_speeds(tmp_path, DISC_1[:1], quiet=[60.0])
    assert ("error", "dead probe") in told and len(spectrum.speed) == 2
    told, _ = of_all_speeds(tmp_path, DISC_1, quiet=[60.0, 80.0, 100.0])
    assert ("error", "dead probe") in told


def test_short_and_coarse_records(tmp_path):
    def at(samples, step=1):
        (one,) = records(speeds=[STEADY], time=TIME[:samples])
        thin = {"displacement": one.displacement[:, ::step], "reference": one.reference[::step]}
        return replace(one, time=one.time[::step], **thin)

    assert findings(tmp_path, at(1500)) == {"few revolutions": "warning"}  # 314 samples a turn
    assert findings(tmp_path, at(350))["too few revolutions"] == "error"
    assert findings(tmp_path, at(10000, 31))["sampling rate"] == "error"  # ten a turn are too few for 7X


@pytest.mark.parametrize(("drift", "severity"), [(0.002, None), (0.02, "warning"), (0.1, "error")])
def test_a_changing_speed(drift, severity, tmp_path):
    """Angle w t (1 + d t / 2 T): the speed changes by d over the record."""
    marks = np.interp(2 * np.pi * np.arange(1, 32), STEADY * (TIME + drift * TIME**2 / 2 / TIME[-1]), TIME)
    assert findings(tmp_path, **pulses(marks[marks < TIME[-1] - 0.01])).get("speed drift") == severity


@pytest.mark.parametrize("unit", ["mm", "um"])
def test_an_undeclared_unit_is_found(unit, tmp_path):
    factor = {"mm": 1e3, "um": 1e6}[unit]
    record = records(speeds=[STEADY])[0]
    values = {name: value * factor for name, value in meters(record).items()}
    probes = [{key: p[key] for key in ("channel", "node", "angle_deg")} | {"unit": "m"} for p in section()["probes"]]
    path = write("csv", tmp_path, record, **values)
    measurement = read_measurement(path, write_rig(tmp_path / "rig.yaml", probes=probes))
    (finding,) = measurement.findings
    assert finding.name == "units" and f"{unit} taken as m?" in finding.text
    good = read_measurement(write("csv", tmp_path, record, **meters(record)), tmp_path / "rig.yaml")
    assert good.findings == []


def test_a_unit_is_found_by_the_weight_where_the_rig_predicts_no_vibration(tmp_path):
    """Values in mm taken as µm; the right unit is the negative control."""
    path = tmp_path / "run.csv"
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        "rotor: {kind: jeffcott, mass_kg: 2.0, stiffness_N_per_m: 7e5}\nmeasurement: {harmonics: [1, -1], "
        "probes: [{channel: x, node: 1, angle_deg: 0, unit: um}], keyphasor: {channel: key}}\n"
    )
    for size, expected in ((20e-3, ["units"]), (20.0, [])):
        rows = [f"{k / 1000},{size * np.cos(0.3 * k + 1):.7g},{5 * (0.3 * k % (2 * np.pi) < 0.5)}" for k in range(999)]
        path.write_text("\n".join(["time,x,key", *rows]))
        found = [one for one in read_measurement(path, rig).findings if one.name == "units"]
        assert [one.name for one in found] == expected


def test_a_mark_that_does_not_pass_once_a_revolution_is_told():
    amplitude = np.full((2, 4, 2), 1e-9)
    amplitude[:, 2] = 1e-6  # 2X above 1X at both speeds and nodes
    (one,) = check_order(amplitude, np.array([1, -1, 2, -2]), "here")
    assert one.name == "phase mark" and "once in 2 revolutions" in one.text
    amplitude[1, 0, 0] = 1e-6  # the negative control: not at one node at one speed
    assert check_order(amplitude, np.array([1, -1, 2, -2]), "here") == []
    assert check_order(amplitude[:, :2], np.array([1, -1]), "here") == []


def meters(record):
    found = channels(record)
    return {p["channel"]: found[p["channel"]] / UNITS[p["unit"]] * p["sign"] for p in section()["probes"]}


def test_backward_whirl_that_the_rig_expects_is_no_fault():
    forward, backward = np.full((3, 2), 1e-6), np.full((3, 2), 5e-6)
    assert check_sense(forward, backward, np.array([True, True]), (2, 4), "here") == []
    assert len(check_sense(forward, backward, np.array([False, False]), (2, 4), "here")) == 1


def long_record():
    """Of fine resolution, in which six of 12,000 samples have the same greatest value."""
    values = np.sin(np.linspace(0, 60, 12000))
    values[100:700:100] = 1.001
    return values


WAVE = np.sin(2 * np.pi * np.linspace(0, 50, 20001))
# of 16 bits: nine samples had the greatest value and two the next, but six one of the next two
ONE_BY_ONE = [9, 2, 4, 7, 9, 7, 4, 4, 5, 7, 5, 6, 5, 8, 5, 5, 2, 6, 7, 4, 10000]
REPEATED = np.tile(WAVE[:50] + 0.3 * np.cos(0.6 * np.arange(50)), 40)  # 50 samples a revolution, without noise
TOPS = [  # and what they are cut at
    (WAVE, 0.97), (np.round(WAVE * 100) / 100, 0.97), (np.round(WAVE * 1000), 970.0), (long_record(), 0.9999),
    (-np.repeat(np.arange(len(ONE_BY_ONE)), ONE_BY_ONE).astype(float), -10.0),
    (REPEATED, 0.7 * REPEATED.max()),
]  # fmt: skip


@pytest.mark.parametrize(("values", "most"), TOPS, ids=range(len(TOPS)))
def test_samples_that_meet_at_the_top_are_clipping_only_where_it_is_flat(values, most):
    assert not flat_top(values)
    assert flat_top(np.minimum(values, most))


def test_import_from_the_command_line(tmp_path, command):
    rig = write_rig(tmp_path / "rig.yaml")
    paths = [str(write("csv", tmp_path, record)) for record in records()]
    out = tmp_path / "spectrum.nc"
    printed = command("import", *paths, "--rig", rig, "--out", out)
    assert "3 speed(s)" in printed.out and printed.err == ""
    assert load_spectrum(out).amplitude.shape == (3, len(HARMONICS), 2)
    page = (tmp_path / "spectrum_quality.html").read_text()
    assert problems([tmp_path / "spectrum_quality.html"], tmp_path) == []
    assert page.count("data-charts=") == 1 and ".csv: no problem was found</h1>" in page and len(page) < 500_000
    out.unlink()

    bad = str(write("csv", tmp_path, records(speeds=[STEADY])[0], name="bad", **clipped(0.8)))
    arguments = ["import", paths[0], bad, "--rig", str(rig), "--out", str(out), "--quality", str(tmp_path / "q.html")]
    printed = command(*arguments, status=1)
    assert not out.exists() and "clipping" in printed.err and "no spectrum was written" in printed.err
    assert "clipped by the probe" in (tmp_path / "q.html").read_text()
    assert "would overwrite an input" in command("import", bad, "--rig", rig, "--out", bad, status=1).err
    given = yaml.safe_load(Path(rig).read_text())
    for left in ([], given["bearings"][:1]):
        free = given | {"bearings": left, "effects": given["effects"][1:]}  # no cross force
        (tmp_path / "free.yaml").write_text(yaml.safe_dump(free))
        said = command("import", paths[0], "--rig", tmp_path / "free.yaml", "--out", out, status=1).err
        assert "free.yaml: the bearings and feet do not hold the rotor" in said and not out.exists()


def test_a_spectrum_file_that_is_none_is_named(tmp_path):
    refused(lambda: load_spectrum(tmp_path / "none.nc"), "does not exist")
    save(records_dataset(records(speeds=[STEADY])), tmp_path / "records.nc")
    refused(lambda: load_spectrum(tmp_path / "records.nc"), "rotorstudy import")
    made = {name: ("speed", np.ones(2)) for name in ("amplitude", "covariance")}
    xr.Dataset(made).to_netcdf(tmp_path / "other.nc")
    needed = ["amplitude has dimensions ('speed',)", "needed are ('speed', 'harmonic'"]
    refused(lambda: load_spectrum(tmp_path / "other.nc"), *needed)


def told():
    """(key, names of its values, None if they are not written there) of every finding in the code."""
    for path in Path(table.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "told":
                names = [keyword.arg for keyword in node.keywords]
                if isinstance(node.args[0], ast.Constant):
                    yield node.args[0].value, None if None in names else {*names}


def test_every_row_of_the_table_of_findings_is_said_with_its_values():
    every = list(told())
    for key, names in every:
        wanted = {name for _, name, *_ in Formatter().parse(table.SAID[key][1]) if name}
        assert names is None or names == wanted, key
    written = " ".join(path.read_text() for path in Path(table.__file__).parent.glob("*.py") if path.stem != "findings")
    unsaid = {key for key in table.SAID if key.partition(" (")[0] not in written}
    assert len(every) > 30 and not unsaid


def test_round_off_is_no_amplitude():
    """Of a table without backward 1X the page says 0, not 4e-15."""
    facts = table.node_facts(np.array([2e-5, 3e-21 + 4e-21j]), None, [1, -1])
    assert (facts.forward_1x, facts.backward_1x) == (2e-5, 0.0)
    assert table.node_facts(np.array([2e-5, 3e-11j]), None, [1, -1]).backward_1x == 3e-11
    assert np.isnan(table.node_facts(np.array([np.nan, 3e-11]), None, [1, -1]).forward_1x)
