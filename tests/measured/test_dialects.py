"""A table in any dialect of text files gives the numbers that were written, or is refused in one line."""

import csv
import io
import os

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from one_line_errors import refused
from scipy.io import savemat

from rotorstudy import RotorstudyError, read_measurement
from rotorstudy.measurement.channel_names import stated_units
from rotorstudy.measurement.conventions import Conventions, CsvLayout
from rotorstudy.measurement.files import open_csv, open_matlab, open_uff
from rotorstudy.measurement.guess import guess_measurement
from rotorstudy.measurement.table_spectra import read_table
from rotorstudy.measurement.tables import open_table
from rotorstudy.measurement.text_table import guess_layout, header_of, rows_of

EXAMPLES = int(os.environ.get("ROTORSTUDY_FUZZ", "60"))
PLANES = (3, 9)
WAVES = [
    [k / 2000, 1.5 * np.cos(0.3 * k), 2.5 * np.sin(0.3 * k) - 9, 1004.5 + k, 5.0 * (k % 21 == 0)] for k in range(99)
]
PHASES = [(rpm, k, 0.5 + k, 20.5 + rpm / 100) for rpm in (904, 1004, 1204) for k in range(2)]
TABLES = {  # names, units, rows of numbers and texts
    "waveform": (["Time", "Brg X", "Brg Y", "Speed", "Key"], ["s", "um", "um", "rpm", "V"], WAVES),
    "harmonics": (
        ["speed_rpm", "node", "harmonic", "amplitude_um", "phase_deg"],
        ["rpm", "", "", "um", "deg"],
        [[rpm, 3, n, 1.5 + abs(n), 20.5 * n] for rpm in (904, 1004) for n in (0, 1, -1)],
    ),
    "probes": (
        ["speed_rpm", "probe", "amplitude_um", "phase_deg"],
        ["rpm", "", "um", "deg"],
        [[rpm, ("DE X", "DE Y")[k], size, turn] for rpm, k, size, turn in PHASES],
    ),
    "wide": (
        ["Speed (rpm)", "DE X 1X Amp (um pp)", "DE X 1X Phase (deg)", "DE Y 1X Amp (um pp)", "DE Y 1X Phase (deg)"],
        ["rpm", "um pp", "deg", "um pp", "deg"],
        [[rpm, 0.5, 20.5, 1.5 + rpm, 30.5] for rpm in (904, 1004, 1204)],
    ),
}
RIG = """
rotor: {{kind: jeffcott, mass_kg: 2.0, stiffness_N_per_m: 7e5}}
measurement:
  probes: [{{channel: '{}', node: 1, angle_deg: 0, unit: um}}]
  time_channel: '{}'
  keyphasor: {{channel: '{}'}}
  harmonics: [1, -1]
"""
PLAIN = {"separator": ",", "decimal": ".", "thousands": "", "quotes": "", "encoding": "utf-8", "newline": "\n"}
PLAIN |= {"above": 0, "units": False, "comment": "", "trailing": "", "blank": "", "header": "", "change": None}


def speed_read(path, probe="x", time="time", key="key"):
    """The speed of a record, rad/s, by a rig with channels of these names."""
    (path.parent / "rig.yaml").write_text(RIG.format(probe, time, key))
    (speed,) = read_measurement([path], path.parent / "rig.yaml").spectrum.speed
    return speed


TURNS = np.arange(900)  # samples of 0.01 s, ten a revolution
SHOWN, MARKS = np.cos(0.8 * TURNS) + 0.1 * (TURNS % 3), 5.0 * (TURNS % 10 == 0)
SPEED = pytest.approx(2 * np.pi * 10, rel=1e-3)


def write_columns(path, names, *columns):
    np.savetxt(path, np.column_stack(columns), "%.6f", ",", header=names, comments="")
    return path


def written(path, table, dialect):
    """Write a table in a dialect."""
    names, units, rows = TABLES[table]
    d = PLAIN | dialect

    def cell(value):
        if isinstance(value, str):
            return value
        text = f"{value:,.12g}" if d["thousands"] else f"{value:.12g}"
        return text.translate({ord("."): d["decimal"], ord(","): d["thousands"]})

    above = [[f"Recorder {k}"] for k in range(d["above"])]
    heads = [names, *([units] if d["units"] else [])]
    body = [[cell(value) for value in row] for row in rows]
    if d["blank"]:
        heads, body = ([[*row[:2], "", *row[2:]] for row in part] for part in (heads, body))
    heads = [row + [""] * ("header" in d["trailing"]) for row in heads]
    body = [row + [""] * ("rows" in d["trailing"]) for row in body]
    if d["change"]:
        body[2] = d["change"](body[2])
    text = io.StringIO()
    quoting = csv.QUOTE_ALL if d["quotes"] == "all" else csv.QUOTE_MINIMAL
    writer = csv.writer(text, delimiter=d["separator"], quoting=quoting, lineterminator="\n")
    writer.writerows([*above, *heads, *body[:4]])
    text.write(f"{d['comment']} changed the range\n" if d["comment"] else "")
    writer.writerows(body[4:])
    text.write("\n\n" if d["blank"] == "lines" else "")
    path.write_bytes((d["header"] + text.getvalue()).replace("\n", d["newline"]).encode(d["encoding"]))
    return path


def numbers(path):
    """All numbers that the package reads from a file by its own guess of the layout."""
    layout = guess_layout(path)
    if table := open_table(path, layout):
        given = guess_measurement(path, PLANES).section
        conventions = Conventions(
            **given | {"csv": layout, "keyphasor": {}, "harmonics": given.get("harmonics", [1, -1])}
        )
        of_speeds = read_table(table, conventions, PLANES)[0]
        return np.array([[one.speed, *next(iter(one.nodes.values())).amplitude] for one in of_speeds])
    found = open_csv(path, Conventions(csv=layout))
    return np.array([found.values(name) for name in found.names if not name.startswith("Unnamed: ")])


READ = {
    "semicolons": {"separator": ";"},
    "tabs": {"separator": "\t"},
    "bars": {"separator": "|"},
    "colons": {"separator": ":"},
    "decimal commas": {"separator": ";", "decimal": ","},
    "quoted decimal commas": {"decimal": ",", "quotes": "all"},
    "quotes": {"quotes": "all"},
    "byte order mark": {"encoding": "utf-8-sig"},
    "UTF-16": {"encoding": "utf-16"},
    "UTF-16 without a mark": {"encoding": "utf-16-le"},
    "CRLF": {"newline": "\r\n"},
    "CR": {"newline": "\r"},
    "row of units": {"units": True},
    "units in Windows-1252": {"units": True, "encoding": "cp1252", "header": "Gerät µ\n"},
    "lines above": {"above": 3},
    "comment above": {"header": "# exported, by hand\n"},
    "comment between": {"comment": "#"},
    "comment of MATLAB": {"comment": "%"},
    "separator after the rows": {"trailing": "rows"},
    "separator after the header": {"trailing": "header"},
    "separator after every line": {"trailing": "header and rows", "units": True, "separator": ";"},
    "blank column": {"blank": "column"},
    "blank lines": {"blank": "lines"},
    "empty cells after a row": {"change": lambda row: [*row, "", ""]},
}
REFUSED = {
    "a value more": {"change": lambda row: [*row, "7"]},
    "a value less": {"change": lambda row: row[:-1]},
    "a cell in two": {"change": lambda row: [row[0], "0", *row[1:]]},
    "an index without a name": {"index": True},
    "thousands with commas": {"separator": ";", "thousands": ","},
    "thousands with points": {"separator": ";", "thousands": ".", "decimal": ","},
    "thousands with spaces": {"separator": ";", "thousands": " "},
    "thousands with apostrophes": {"separator": ";", "thousands": "'"},
    "a number with an underscore": {"change": lambda row: ["1_0", *row[1:]]},
    "a Fortran exponent": {"change": lambda row: ["1.5D-3", *row[1:]]},
    "a minus of typesetting": {"change": lambda row: ["\N{MINUS SIGN}1.5", *row[1:]]},
    "a unit in a cell": {"change": lambda row: [f"{row[0]} um", *row[1:]]},
    "a word for a reading": {"change": lambda row: ["OVR", *row[1:]]},
    "an open quote": {"open": True},
}


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("name", READ)
def test_a_dialect_gives_the_numbers_of_the_plain_table(name, table, tmp_path):
    plain = numbers(written(tmp_path / "plain.csv", table, {}))
    found = numbers(written(tmp_path / "run.csv", table, READ[name]))
    assert np.array_equal(found, plain) and plain.size > 5


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("name", REFUSED)
def test_a_table_that_may_mean_another_is_refused_with_its_line(name, table, tmp_path):
    dialect = dict(REFUSED[name])
    index, quote = dialect.pop("index", False), dialect.pop("open", False)
    path = written(tmp_path / "run.csv", table, dialect)
    lines = path.read_text().splitlines()
    if index:
        lines[1:] = [f"{i},{line}" for i, line in enumerate(lines[1:])]
    if quote:
        lines[3] = '"' + lines[3]
    path.write_text("\n".join(lines))
    refused(lambda: numbers(path), match=r"line \d+|no table of numbers")


@settings(deadline=None, derandomize=EXAMPLES < 1000, max_examples=EXAMPLES)
@given(st.sampled_from(sorted(TABLES)), st.lists(st.sampled_from(sorted({**READ, **REFUSED})), max_size=5))
def test_mixed_dialects_give_the_same_numbers_or_one_line(tmp_path_factory, table, names):
    folder = tmp_path_factory.getbasetemp()
    dialect = {key: value for name in names for key, value in {**READ, **REFUSED}[name].items() if key in PLAIN}
    assume(dialect.get("thousands") != dialect.get("decimal", "."))
    plain = numbers(written(folder / "plain.csv", table, {}))
    try:
        found = numbers(written(folder / "mixed.csv", table, dialect))
    except (RotorstudyError, csv.Error, UnicodeEncodeError) as error:  # the last two: it cannot be written
        assert "\n" not in str(error)
        return
    assert np.array_equal(found, plain), dialect


@pytest.mark.parametrize("dialect", [{"separator": " "}, {"separator": " ", "header": "# "}])
def test_columns_of_spaces_as_numpy_writes_them(dialect, tmp_path):
    path = tmp_path / "run.csv"
    np.savetxt(path, WAVES, header="t x y rpm key", comments=dialect.get("header", ""))
    values = numbers(path)
    assert values == pytest.approx(np.transpose(WAVES)) and header_of(path, guess_layout(path))[0][0] == "t"
    assert "columns separated by spaces" in guess_measurement(path, PLANES).said[0]


@pytest.mark.parametrize("table", TABLES)
def test_a_row_of_numbers_is_not_taken_for_units(table, tmp_path):
    path, stated = written(tmp_path / "run.csv", table, {}), CsvLayout(unit_rows=1)
    refused(lambda: list(rows_of(path, stated)), "line 2: numbers, and not units")
    assert len(list(rows_of(written(path, table, {"units": True}), stated))) == len(TABLES[table][2])


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("time,x (nm)", "channel 'x (nm)' is in 'nm', which is not read; convert it to one of m, mm, um, mil"),
        ("time,x (thou)", "states the unit 'mil' for channel 'x (thou)', the rig 'um'"),
        ("time,x (V)", "states the unit 'V' for channel 'x (V)', the rig 'um'"),
        ("time (us),x", "channel 'time (us)' is in 'us', which is not read; convert it to one of s, ms"),
        ("time (um),x", "channel 'time (um)' is in 'um', which is not read"),
        ("time (msec),x", 1000.0),
        ("time_ms,x", 1000.0),
        ("time,x_mil", "states the unit 'mil' for channel 'x_mil', the rig 'um'"),
        ("time,x mm pp", "states the unit 'mm'"),
        ("time,x (mm_pp)", "states the unit 'mm'"),
        ("time,x (Vdc)", "states the unit 'V'"),
        ("time,x (mm/sec)", "states the unit 'mm/s'"),
        ("time,x (um/s)", "is in 'um/s', which is not read"),
        ("time,x (mV/um)", "is in 'mV/um', which is not read"),
        ("time,x (mil x 10)", "is in 'mil x 10', which is not read"),
        ("time,x/10 (um)", "is in 'x/10 (um)', which is not read"),
        ("time,DE 10^-2 mm", "is in 'DE 10^-2 mm', which is not read"),
        ("time,x um/10", "is in 'x um/10', which is not read"),
        ("time,x10 (um)", 1.0),  # a probe of bearing 10
        ("time,x (milli-inch)", "is in 'inch', which is not read"),
        ("time,x (umpp)", 1.0),
        ("time,x (um zero to peak)", 1.0),
        ("time,x (at the top)", 1.0),
        ("time,x LP 100 Hz", 1.0),
        ("time (seconds),x (µm pp)", 1.0),
        ("time,x (V),y (H)", 1.0),  # vertical and horizontal
        ("time,x (left)", 1.0),
    ],
)
def test_a_unit_in_a_file_is_read_or_refused(names, words, tmp_path):
    time, x, *rest = names.split(",")
    heads = ",".join([time, x, "key", *rest])
    path = write_columns(tmp_path / "run.csv", heads, TURNS / 100, SHOWN, MARKS, *[TURNS] * len(rest))
    if isinstance(words, str):
        refused(lambda: speed_read(path, x, time), words)
    else:
        assert speed_read(path, x, time) / words == SPEED


def test_units_above_the_names_and_in_other_formats_count(tmp_path):
    (tmp_path / "run.csv").write_text("s,mil,V\ntime,x,key\n" + "0,1,2\n1,2,3\n")
    stated = Conventions(csv=CsvLayout(skip_rows=1))
    assert open_csv(tmp_path / "run.csv", stated).units == {"time": "s", "x": "mil", "key": "V"}
    savemat(tmp_path / "run.mat", {"r": {"time_ms": np.arange(9.0), "x_mil": np.arange(9.0)}})
    assert open_matlab(tmp_path / "run.mat", None).units == {"r.time_ms": "ms", "r.x_mil": "mil"}
    uff = pytest.importorskip("uff_files")
    one = uff.signal_set("x", 1, np.arange(9.0), np.ones(9)) | {"abscissa_axis_units_lab": "ms"}
    uff.write_sets(tmp_path / "run.uff", [one])
    assert open_uff(tmp_path / "run.uff", None).units["time"] == "ms"


@pytest.mark.parametrize(
    ("names", "factor", "own"),
    [
        ("time,x,time,key", 0.5, "time #2"),
        ("time,x,time2,key", 0.5, "time2"),
        ("X_Value,x,X_Value,key", 0.5, "X_Value #2"),  # of LabVIEW
        ("time,x,time,key", 1.0, None),  # the negative controls
        ("time (s),x,time (ms),key", 1000.0, None),
        ("time,x,key,time", 0.5, None),
        ("a1,x,a2,key", None, None),  # no times
    ],
)
def test_a_channel_with_times_of_its_own_is_refused_unless_they_are_those_of_all(names, factor, own, tmp_path):
    columns = {"x": SHOWN, "key": MARKS}
    own_times = factor * TURNS / 100 if factor else TURNS % 7
    first, *others = names.split(",")
    columns = [columns.get(name, own_times) for name in others]
    path = write_columns(tmp_path / "run.csv", names, TURNS / 100, *columns)
    first += " #1" * (names.count(first) == 2 and f"{first}2" not in names)
    if own:
        refused(lambda: speed_read(path, time=first), f"run.csv: channel 'key' has times of its own, '{own}'")
    else:
        assert speed_read(path, time=first) == SPEED


@pytest.mark.parametrize("factor", [1.0, 0.5])
def test_times_of_a_struct_count_for_its_signals_and_columns_of_a_matrix_have_none(factor, tmp_path):
    time, path = TURNS / 100, tmp_path / "run.mat"
    matrix = np.column_stack([time, SHOWN, factor * time, MARKS])
    savemat(path, {"m": matrix, "x": {"t": time, "v": SHOWN}, "k": {"t": factor * time, "v": MARKS}})
    assert speed_read(path, "m(:,2)", "m(:,1)", "m(:,4)") == SPEED
    if factor == 1:
        assert speed_read(path, "x.v", "x.t", "k.v") == SPEED
    else:
        refused(lambda: speed_read(path, "x.v", "x.t", "k.v"), "'k.v' has times of its own, 'k.t'")


def test_signals_of_other_lengths_and_times_are_refused(tmp_path):
    """The columns of MATLAB and UFF files, which have no rows."""
    uff = pytest.importorskip("uff_files")
    savemat(tmp_path / "run.mat", {"time": np.arange(9.0), "x": np.arange(8.0), "key": np.arange(9.0)})
    assert [len(open_matlab(tmp_path / "run.mat", None).values(name)) for name in ("time", "x")] == [9, 8]
    refused(lambda: speed_read(tmp_path / "run.mat"), "all channels must have the same samples")
    x = np.arange(50) / 100
    probe = {"channel": "b", "angle_deg": 0, "unit": "um"}
    for change, words in (
        ({"x": 2 * x, "abscissa_inc": 0.02}, "other times"),
        ({"data": np.exp(1j * x), "ord_data_type": 6}, "complex values"),
        ("cut", "has 32 values, and states 50"),
        ({"abscissa_spec_data_type": 19}, "another quantity than time"),
        ({"ordinate_spec_data_type": 12}, "data set 'b' is of a displacement, .* by the unit 'um'"),
    ):
        path = _two_sets(uff, tmp_path / "run.uff", x, change)
        refused(lambda: open_uff(path, Conventions(probes=[probe])), match=words)
    assert len(open_uff(_two_sets(uff, tmp_path / "run.uff", x, {}), None).values("b")) == 50


def _two_sets(uff, path, x, change):
    """A UFF file of the signals a and b, the second with a change."""
    path.unlink(missing_ok=True)
    first, second = (uff.signal_set(name, node, x, np.cos(x)) for node, name in enumerate("ab", start=1))
    uff.write_sets(path, [first, second | ({} if change == "cut" else change)])
    if change == "cut":
        lines = path.read_text().splitlines()
        path.write_text("\n".join([*lines[:-6], *lines[-1:]]) + "\n")  # without 18 samples
    return path


@pytest.mark.parametrize(
    ("head", "row", "names", "units"),
    [
        ("time x y\n# 1000 Hz", "{0} {0} {1}", ["time", "x", "y"], ["", "", ""]),  # a comment, and no row of units
        ("Time,X", "12:30:0{0}.5,1.25", ["Time", "X"], ["", ""]),  # times of day are no columns
        ("time:x", "{0}:{1}", ["time", "x"], ["", ""]),
    ],
)
def test_comments_and_times_of_day_do_not_change_the_layout(head, row, names, units, tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("\n".join([head, *(row.format(i, i + 1) for i in range(9))]) + "\n")
    assert header_of(path, guess_layout(path))[:2] == (names, units)


def test_a_plane_in_brackets_is_no_unit_where_the_unit_follows():
    names = ["DE (NS) (um)", "NDE (IN) [um]", "DE (in)", "t (hours)"]
    assert stated_units(names, [""] * 4) == ["um", "um", "in", "hours"]
