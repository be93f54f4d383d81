"""`rotorstudy new rig`: a rig that every command reads, and what it guesses of record files in many layouts."""

import re

import numpy as np
import pytest
import yaml
from one_line_errors import refused, run

from rotorstudy import load_rig, read_measurement, simulate_records
from rotorstudy.authoring.new_rig import PLANES, new_rig
from rotorstudy.measurement.channel_names import angle_in, plane_in, unit_in
from rotorstudy.measurement.guess import guess_measurement
from rotorstudy.model.shown_units import units_of

SPEED = 300.0  # rad/s
TIME = np.arange(1000) / 2000
ANGLES = {"X": -45.0, "Y": 45.0}  # from straight up, to the left


@pytest.fixture(scope="module")
def signals(tmp_path_factory):
    """The example machine turning to the left: micrometres (time,) of the probes 3X, 3Y, 9X and 9Y, and pulses."""
    folder = tmp_path_factory.mktemp("machine")
    (record,) = simulate_records(load_rig(new_rig("machine", folder).path), [SPEED], [1, -1], TIME)
    random, found = np.random.default_rng(1), {"key": 5.0 * record.keyphasor}
    for node in (3, 9):
        z = record.displacement[record.sensors.index(node)]
        for name, angle in ANGLES.items():  # x points down: straight up is half a revolution from it
            along = (z * np.exp(-1j * (np.pi + np.deg2rad(angle)))).real
            found[f"{node}{name}"] = 1e6 * along + 0.01 * random.normal(size=len(TIME)) + 3
    return found


def csv(path, columns, separator=",", decimal=".", above=(), units=None):
    cells = [[f"{v:.6g}".replace(".", decimal) for v in row] for row in zip(*columns.values(), strict=True)]
    rows = [separator.join(row) for row in (columns, *([units] if units else []), *cells)]
    path.write_text("\n".join([*above, *rows]) + "\n", encoding="utf-8")
    return path


def test_a_semicolon_table_with_a_row_of_units_is_read_as_guessed(signals, tmp_path, command):
    """The guess reads the file: orbits and phase are those of the machine; the picture and the sentences are there."""
    mils = {f"Brg {node} {name}": signals[f"{node}{name}"] / 25.4 for node in (3, 9) for name in "XY"}
    columns = {"Time": TIME * 1e3, **mils, "Trigger": signals["key"]}
    path = csv(tmp_path / "run.csv", columns, ";", ",", ["Recorder 7", ""], ["ms", *["mil"] * 4, "V"])
    printed = command("new", "rig", "mine", "--records", path, "--folder", tmp_path).out
    told = ("semicolons, decimal ','", "header in line 3", "'Time' in ms", "'Trigger'", "45° right of the top, in mil")
    assert all(words in printed for words in told)
    assert (tmp_path / "mine_probes.png").stat().st_size > 5000
    found = read_measurement([path], tmp_path / "mine.yaml")
    assert [f.name for f in found.errors] == [] and found.spectrum.sensors == (3, 9)
    model = load_rig(tmp_path / "mine.yaml")
    (again,) = simulate_records(model, [SPEED], [1, -1], TIME)
    whole = round(20 * 2 * np.pi / SPEED * 2000)  # samples of 20 revolutions
    for k, z in enumerate(again.displacement):
        one = np.mean((z * np.exp(-1j * SPEED * TIME))[:whole])
        measured = found.spectrum.amplitude[0, list(found.spectrum.harmonics).index(1), k]
        assert measured == pytest.approx(-one, rel=0.02)  # the mark's sensor is at the top, half a revolution from x


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["DE 45", "DE 135", "NDE 135"], {"DE 45": (3, -45), "DE 135": (3, 45), "NDE 135": (9, 45)}),  # from the right
        (["45 deg brg", "315 deg brg"], {"45 deg brg": (3, 45), "315 deg brg": (3, -45)}),  # from the top
        (["ch 17", "ch 18"], {"ch 17": (3, -45), "ch 18": (3, 45)}),  # no angles: by the order
    ],
)
def test_angles_in_the_names_of_probes_are_used(names, found, tmp_path):
    rows = [f"{rpm},{name},1.5,20" for rpm in (1000, 1200, 1400) for name in names]
    (tmp_path / "run.csv").write_text("\n".join(["speed_rpm,probe,amplitude_mil,phase_deg", *rows]))
    section, _ = guess_measurement(tmp_path / "run.csv", PLANES)
    assert {p["channel"]: (p["node"], p["angle_deg"]) for p in section["probes"]} == found


@pytest.mark.parametrize("change", ["one plane", "time twice", "infinity"])
def test_the_rig_of_any_record_reads_it_or_says_what_is_wrong_with_its_time(change, signals, tmp_path):
    columns = {"time": TIME, "3X (um)": signals["3X"].copy(), "3Y (um)": signals["3Y"], "key": signals["key"]}
    if change == "infinity":
        columns["3X (um)"][7] = np.inf
    if change == "time twice":
        columns["time"] = np.r_[TIME[:500], TIME[499:-1]]
    path = csv(tmp_path / "run.csv", columns)
    rig, said, _ = new_rig("mine", tmp_path, [path])
    assert yaml.safe_load(rig.read_text())["sensors"] == [3]
    if change != "time twice":
        assert read_measurement([path], rig).spectrum.speed == pytest.approx([SPEED], rel=1e-3)
        return
    assert any("'time' does not increase in even steps" in line for line in said)
    refused(lambda: read_measurement([path], rig), "time does not increase strictly")


def test_a_column_with_a_text_is_left_out_with_the_reason(tmp_path):
    path = tmp_path / "run.csv"
    rows = [f"{k},{'a' if k == 9 else k % 7},{5 * (k % 5 == 0)}" for k in range(99)]
    path.write_text("\n".join(["time,x,key", *rows]))
    words = "no column may be a probe", "line 11, column 'x': 'a' is not a number"
    refused(lambda: new_rig("mine", tmp_path, [path]), *words)


def test_the_pulses_of_a_second_mark_are_no_probe(signals, tmp_path):
    given = {"t": TIME, "X": signals["3X"], "Y": signals["3Y"], "key": signals["key"], "tacho": signals["key"]}
    given["trigger of 2"] = signals["9X"]
    found = guess_measurement(csv(tmp_path / "run.csv", given), PLANES)
    assert [one["channel"] for one in found.section["probes"]] == ["X", "Y", "trigger of 2"]  # the last is no pulses
    assert found.section["keyphasor"]["channel"] == "key" and "not used: tacho (constant" in " ".join(found.said)


def test_a_probe_with_impacts_is_no_phase_mark(signals, tmp_path):
    """Sharp on one side, and before the mark, whose name says nothing."""
    impacts = np.cos(SPEED * TIME) + 4 * np.exp(-0.5 * (np.angle(np.exp(1j * SPEED * TIME)) / 0.2) ** 2)
    given = {"t": TIME, "X (um)": impacts, "Y (um)": signals["3Y"], "A3": signals["key"]}
    found = guess_measurement(csv(tmp_path / "run.csv", given), PLANES).section
    assert found["keyphasor"]["channel"] == "A3" and [p["channel"] for p in found["probes"]] == ["X (um)", "Y (um)"]


def test_a_uff_file_is_guessed_by_its_labels(signals, tmp_path):
    """Each signal once, though its node and direction are another name of it; and the unit that a label states."""
    uff = pytest.importorskip("uff_files")
    sets = [uff.signal_set(f"DE {name}", i, TIME, signals[f"3{name}"]) for i, name in enumerate("XY", start=1)]
    sets = [one | {"ordinate_axis_units_lab": "mil"} for one in sets]  # by the size of the numbers they would be um
    uff.write_sets(tmp_path / "run.uff", [*sets, uff.signal_set("key", 9, TIME, signals["key"])])
    rig = new_rig("mine", tmp_path, [tmp_path / "run.uff"]).path
    section = yaml.safe_load(rig.read_text())["measurement"]
    assert section["keyphasor"]["channel"] == "key"
    assert [(p["channel"], p["node"], p["unit"]) for p in section["probes"]] == [("DE X", 3, "mil"), ("DE Y", 3, "mil")]
    assert read_measurement([tmp_path / "run.uff"], rig).spectrum.speed == pytest.approx([SPEED], rel=1e-3)


def test_a_shaft_that_turns_the_other_way_is_noticed(signals, tmp_path):
    """Mirrored left and right, the same signals are those of a shaft that turns to the right."""
    mirrored = {f"{node}{name} (um)": signals[f"{node}{other}"] for node in (3, 9) for name, other in ("YX", "XY")}
    path = csv(tmp_path / "run.csv", {"time": TIME, **mirrored, "key": signals["key"]})
    rig, said, _ = new_rig("mine", tmp_path, [path])
    assert yaml.safe_load(rig.read_text())["measurement"]["rotation"] == "against_angles"
    assert said[-1].startswith("sense of rotation: against")
    assert read_measurement([path], rig).errors == []


def test_a_table_of_a_balancing_instrument(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("speed_rpm;probe;amplitude_mil;phase_deg\n" + "".join(
        f"{rpm};{probe};0,{size};{phase}\n" for rpm in (1000, 2000) for probe, size, phase in
        (("1X", 62, 41), ("1Y", 58, 131), ("2X", 40, 35), ("2Y", 41, 126))))  # fmt: skip
    rig, said, _ = new_rig("mine", tmp_path, [path])
    section = yaml.safe_load(rig.read_text())["measurement"]
    assert section["csv"] == {"separator": ";", "decimal": ","} and section["table_amplitude"] == "peak_to_peak"
    found = read_measurement([path], rig)
    assert found.errors == [] and found.spectrum.amplitude.shape == (2, 2, 2)
    assert any("peak to peak" in line for line in said)
    shown = units_of(yaml.safe_load(rig.read_text()))
    assert (shown.length, shown.unbalance, shown.amplitude) == ("mil", "oz in", "peak_to_peak")  # as the table


@pytest.mark.parametrize("bearings", ["linear", "film"])
def test_every_command_accepts_a_new_rig(bearings, tmp_path, command):
    """As written, and with the oil films that its comment offers."""
    path = new_rig("mine", tmp_path).path
    if bearings == "film":
        text = re.sub(r"  - \{kind: linear.*\n", "", path.read_text())
        text = re.sub(r"  # (- \{kind: short_journal.*)", r"  \1", text)
        assert text.count("kind: short_journal") == 2
        path.write_text(text)
    records = str(tmp_path / "r.nc")
    run("simulate", path, "--speeds", "250", "300", "350", "--duration", "0.5", "--noise", "1", "--out", records)
    run("import", records, "--rig", path, "--out", tmp_path / "s.nc")
    unknown = "bearing_stiffness[left]" if bearings == "linear" else "bearing_scale[left]"
    run("identify", records, "--rig", path, "--unknowns", unknown)
    command("balance", records, "--rig", path, "--planes", "5")


HEADS = {  # of exporters: lines above the numbers, their separator, factors of time and displacements, first column
    "LabVIEW": ("LabVIEW Measurement\t\nSamples\t9\t9\t9\t\nX_Value\tDE X\tDE Y\tKey\tComment", "\t", 1, 1, None),
    "PicoScope": ("Time,DE X,DE Y,Key\n(ms),(µm),(µm),(V)\n", ",", 1e3, 1, None),
    "Keysight": ("x-axis,DE X,DE Y,Key\nsecond,Volt,Volt,Volt", ",", 1, 7.874e-3, None),
    "DEWESoft": ("Sample rate: 2000\n\nData1\nTime (s)\tDE X (um)\tDE Y (um)\tKey (V)", "\t", 1, 1, None),
    "imc": ("No.;time [ms];DE X [µm];DE Y [µm];Key [V]", ";", 1e3, 1, lambda i: f"{i}"),
    "units first": ("s,mil,mil,V\nTime,DE X,DE Y,Key", ",", 1, 1 / 25.4, None),
}


@pytest.mark.parametrize("name", HEADS)
def test_exports_are_read_as_guessed(name, signals, tmp_path):
    head, separator, times, sizes, first = HEADS[name]
    columns = [times * TIME, sizes * signals["3X"], sizes * signals["3Y"], signals["key"]]
    rows = [separator.join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True)]
    rows = rows if first is None else [f"{first(i)}{separator}{row}" for i, row in enumerate(rows)]
    path, plain = tmp_path / "run.csv", tmp_path / "plain.csv"
    path.write_text("\n".join([head, *rows]))
    csv(plain, {"time": TIME, "DE X (um)": signals["3X"], "DE Y (um)": signals["3Y"], "key": signals["key"]})
    found, known = (read_measurement([one], new_rig(one.stem, tmp_path, [one]).path).spectrum for one in (path, plain))
    assert found.speed == pytest.approx(known.speed, rel=1e-4) and found.sensors == known.sensors == (3,)
    assert found.amplitude == pytest.approx(known.amplitude, abs=1e-8)


@pytest.mark.parametrize(("names", "unknown"), [("time,x,y", "time, x, y"), ("time (s),x (um),y (um)", None)])
def test_a_unit_that_the_file_does_not_state_is_told_to_be_a_guess(names, unknown, signals, tmp_path):
    csv(tmp_path / "run.csv", dict(zip(names.split(","), (TIME, signals["3X"], signals["3Y"]), strict=True)))
    said = [line for line in new_rig("mine", tmp_path, [tmp_path / "run.csv"]).guessed if line.startswith("units")]
    assert said == [f"units: the file states none for {unknown}; those above are guesses (NOT known)"] * bool(unknown)


@pytest.mark.parametrize("first", [lambda i: f"2024-03-05 10:11:{12 + i / 2000:09.6f}", str])
def test_no_sampling_rate_is_made_up(first, signals, tmp_path):
    """Dates, and numbers of samples, are no times in seconds."""
    rows = [f"{first(i)},{signals['3X'][i]},{signals['3Y'][i]},{signals['key'][i]}" for i in range(len(TIME))]
    (tmp_path / "run.csv").write_text("\n".join(["Stamp,DE X (um),DE Y (um),key", *rows]))
    path, said, _ = new_rig("mine", tmp_path, [tmp_path / "run.csv"])
    assert any("NOT read before sample_rate_Hz is stated" in line for line in said)
    words = "unknown time channel 'time'", "state 'sample_rate_Hz:'"
    refused(lambda: read_measurement([tmp_path / "run.csv"], path), *words)


@pytest.mark.parametrize("text", ["", "nothing\nhere\n", "0,1\n1,2\n2,3\n"])
def test_a_file_without_a_table_below_names_is_refused(text, tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(text)
    words = "no table of numbers below a row of names|the file is empty"
    refused(lambda: guess_measurement(path, PLANES), match=words)
    refused(lambda: new_rig("mine", tmp_path, [path]), match=words)
    assert not (tmp_path / "mine.yaml").exists()


@pytest.mark.parametrize(
    ("name", "plane", "angle", "unit"),
    [
        ("1X", ("1",), -45.0, None),
        ("Brg2_Y [um]", ("brg", "2"), 45.0, "um"),
        ("DE vert (mils)", ("de",), 0.0, "mil"),
        ("NDE horizontal", ("nde",), -90.0, None),
        ("probe 3 60L", ("probe", "3"), 60.0, None),
        ("disc 1 left", ("disc", "1"), 45.0, None),
        ("channel 4", ("channel", "4"), None, None),
        ("y (m)", (), 45.0, "m"),
        ("casing X mm/s", ("casing",), -45.0, "other"),
    ],
)
def test_what_the_name_of_a_channel_says(name, plane, angle, unit):
    assert (plane_in(name), angle_in(name), unit_in(name)) == (plane, angle, unit)


def test_names_that_cannot_be_written(tmp_path, command):
    new_rig("mine", tmp_path)
    for name, words in (("mine", "exists"), ("a/b", "without folders"), (".yaml", "without folders")):
        refused(lambda: new_rig(name, tmp_path), words)
    given = ["new", "crack", "my_crack", "--records", "x.csv", "--folder", tmp_path]
    assert "are for `new rig`" in command(*given, status=1).err


def test_a_table_of_harmonics_has_nodes_and_no_probes(tmp_path):
    """Its columns `node` and `harmonic` are no signals; one without nodes is of the first plane."""
    path = tmp_path / "harmonics.csv"
    head = "speed_rpm,node,harmonic,amplitude_um,phase_deg\n"
    path.write_text(f"{head}1000,1,1,2.5,30\n1000,1,-1,0.5,60\n1000,2,1,3.5,20\n1000,2,-1,1,5\n")
    found = guess_measurement(path, PLANES)
    assert "probes" not in found.section and found.section["node_of_label"] == {1: 3, 2: 9}
    rig = new_rig("mine", tmp_path, [path]).path
    run("import", path, "--rig", rig, "--out", tmp_path / "spectrum.nc")
    path.write_text(f"{head.replace('node,', '')}1000,1,2.5,30\n1000,-1,0.5,60\n1200,1,3,40\n1200,-1,1,5\n")
    assert guess_measurement(path, PLANES).section["table_node"] == 3
