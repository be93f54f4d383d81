"""Tables of a probe's amplitude and phase in the units and signs that balancers use."""

import numpy as np
import pytest
import yaml
from one_line_errors import refused, run

from rotorstudy import read_measurement
from rotorstudy.measurement.channel_names import as_known
from rotorstudy.measurement.conventions import CsvLayout
from rotorstudy.measurement.tables import open_table

SPEEDS = np.array([90.0, 150.0, 210.0])  # rad/s
FORWARD, BACKWARD = np.array([3e-6, 8e-6j, -5e-6 + 1e-6j]), np.array([1e-6j, -2e-6, 1e-6])
PROBES = {"left": -45.0, "right": 60.0}
MARK = np.deg2rad(50.0)  # angle of the reference line when the mark passes: sensor at 70, mark at 20 degrees


def vector(probe, speed):
    """Peak and phase lead of what a probe reads, from its signal over one revolution since the mark passed."""
    since = 2 * np.pi * np.arange(64) / 64
    angle, i = since + MARK, list(SPEEDS).index(speed)
    orbit = FORWARD[i] * np.exp(1j * angle) + BACKWARD[i] * np.exp(-1j * angle)
    reading = np.real(orbit * np.exp(-1j * np.deg2rad(PROBES[probe])))
    return 2 * np.mean(reading * np.exp(-1j * since))


WAYS = {
    "peak, m, lead, rad": ({}, "amplitude_m", "phase_rad", lambda v, w: (abs(v), np.angle(v))),
    "peak-to-peak, mil, lag": ({"table_amplitude": "peak_to_peak", "table_phase": "lag"}, "amplitude_mil", "phase_deg",
                               lambda v, w: (2 * abs(v) / 25.4e-6, -np.rad2deg(np.angle(v)))),
    "rms, um": ({"table_amplitude": "rms"}, "amplitude_um", "phase_deg",
                lambda v, w: (1e6 * abs(v) / np.sqrt(2), np.rad2deg(np.angle(v)))),
    "rms velocity, mm/s, lag": ({"table_amplitude": "rms", "table_phase": "lag"}, "velocity_mm_per_s", "phase_deg",
                                lambda v, w: (1e3 * w * abs(v) / np.sqrt(2), -np.rad2deg(np.angle(1j * v)))),
}  # fmt: skip


def table(way, probes=tuple(PROBES)):
    _, size, phase, written = WAYS[way]
    every = [(speed, probe, *written(vector(probe, speed), speed)) for speed in SPEEDS for probe in probes]
    rows = [f"{w * 30 / np.pi:.9f},{probe},{amount:.9f},{turn:.7f}" for w, probe, amount, turn in every]
    return "\n".join([f"speed_rpm,probe,{size},{phase}", *rows])


def rig(folder, way="peak, m, lead, rad", probes=PROBES, measured=None, **more):
    measurement = {
        "probes": measured or [{"channel": name, "node": 1, "angle_deg": angle} for name, angle in probes.items()],
        "keyphasor": {"sensor_angle_deg": 70, "mark_angle_deg": 20},
        **WAYS[way][0],
        **more,
    }
    effects = [{"kind": "external_damping", "external_damping_N_s_per_m": 20.0}, {"kind": "unbalance"}]
    content = {"rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 8e4}, "effects": effects}
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump({**content, "measurement": measurement}))
    return path


HEAD = "speed_rpm,probe,amplitude_um,phase_deg"
BELOW = {"csv": {"unit_rows": 1}}


def read(folder, text, *options, **more):
    path = folder / "run.csv"
    path.write_text(text)
    return read_measurement([path], rig(folder, *options, **more))


@pytest.mark.parametrize("way", WAYS)
def test_two_probes_give_the_orbit(way, tmp_path):
    """Digits of 1e-9 m in the first way, of 1e-9 in its unit in the others."""
    found = read(tmp_path, table(way), way).spectrum
    assert list(found.harmonics) == [1, -1] and found.speed == pytest.approx(SPEEDS, rel=1e-8)
    assert found.amplitude[:, 0, 0] == pytest.approx(FORWARD, abs=2e-9)
    assert found.amplitude[:, 1, 0] == pytest.approx(BACKWARD, abs=2e-9)


def test_one_probe_gives_what_it_shows(tmp_path):
    found = read(tmp_path, table("rms, um", ["right"]).replace(",right,", ",").replace("probe,", ""), "rms, um",
                 {"right": 60.0}).spectrum  # fmt: skip
    assert found.single_probes == [1] and found.directions == pytest.approx([np.deg2rad(60)])
    expected = np.array([vector("right", speed) for speed in SPEEDS]) / 2 * np.exp(-1j * MARK)
    assert np.exp(-1j * np.deg2rad(60)) * found.amplitude[:, 0, 0] == pytest.approx(expected, abs=1e-12)


def test_the_covariance_is_that_of_the_digits(tmp_path):
    """Of random values rounded to the printed digits: whitened errors have unit variance (5 sigma of 4 times 400)."""
    generator = np.random.default_rng(1)
    true = generator.uniform(5, 20, (400, 2)) * np.exp(1j * generator.uniform(0, 6, (400, 2)))
    every = [(1000 + i, name, one) for i, pair in enumerate(true) for name, one in zip(PROBES, pair, strict=True)]
    rows = [f"{rpm},{name},{abs(one):.0f},{np.rad2deg(np.angle(one)):.0f}" for rpm, name, one in every]
    spectrum = read(tmp_path, "\n".join([HEAD, *rows])).spectrum
    angles = np.deg2rad(list(PROBES.values()))
    inverse = np.linalg.inv(np.column_stack([np.cos(angles), np.sin(angles)]))
    x, y = inverse @ (true.T * 1e-6 / 2 * np.exp(-1j * MARK))
    exact = np.stack([x + 1j * y, x.conj() + 1j * y.conj()], axis=1)[..., None]
    off = spectrum.whitened(spectrum.amplitude - exact)
    assert len(off) == 1600 and np.mean(off**2) == pytest.approx(1, abs=5 * np.sqrt(2 / 1600))


@pytest.mark.parametrize(
    ("change", "more", "words"),
    [
        (("amplitude_um", "amplitude_inch"), {}, ["unknown column 'amplitude_inch'", "amplitude_mil"]),
        (("amplitude_um", "velocity_mm"), {}, ["unknown column 'velocity_mm'", "did you mean 'velocity_mm_per_s'"]),
        (("amplitude_um", "amplitude_inch"), {}, ["did you mean 'amplitude_mil' (its end is its unit)?"]),
        (("phase_deg", "amplitude_um"), {}, ["two columns are named 'amplitude_um'; keep one"]),
        (("phase_deg", "phase_grad"), {}, ["unknown column 'phase_grad'"]),
        (("speed_rpm", "speed"), {}, ["unknown column 'speed'", "speed_rpm"]),
        (("amplitude_um", "amp_um"), {}, ["unknown column 'amp_um'", "did you mean 'amplitude_um'"]),
        ((",left,", ",lefd,"), {}, ["unknown probe 'lefd'", "did you mean 'left'"]),
        ((), {"table_amplitude": "p-p"}, ["table_amplitude", "'peak', 'peak_to_peak' or 'rms'"]),
        ((), {"harmonics": [1, -1, 2, -2]}, ["harmonics", "2", "tables of probes have [1]"]),
        ((), {"probes": {}}, ["no probes", "list them"]),
        (("phase_deg", "phase_rad"), {}, ["'phase_rad' has", "more than two turns", "'phase_deg'"]),
        (("\n", "\n-"), {}, ["line 2: the speed -", " rpm", "is not positive; correct it"]),
        (("left,", "left,-"), {}, ["line 2: the amplitude is negative; leave the cell empty"]),
        (("deg\n", "deg\nrpm,,um pp,deg lead\n"), BELOW, ["header says peak to peak"]),
        (("deg\n", "deg\nrpm,,um rms,deg lag\n"), BELOW, ["header says lag"]),
        (("deg\n", "deg\nrpm,,mil rms,deg\n"), BELOW, ["'amplitude_um' has the unit 'mil rms' below it"]),
        (("deg\n", "deg\nHz,,um rms,deg\n"), BELOW, ["'speed_rpm' has the unit 'Hz' below it"]),
        (("deg\n", "deg\nrpm,,um,rad\n"), BELOW, ["'phase_deg' has the unit 'rad' below it"]),
    ],
)
def test_what_is_wrong_in_a_table_is_named(change, more, words, tmp_path):
    text = table("rms, um")
    assert read(tmp_path, text.replace("deg\n", "deg\nrpm,,µm rms,deg\n"), "rms, um", **BELOW).spectrum  # the control
    refused(lambda: read(tmp_path, text.replace(*change) if change else text, "rms, um", **more), *words)


def test_amplitudes_of_zero_are_told(tmp_path):
    rows = [f"{rpm},{probe},0,0" for rpm in (1000, 2000) for probe in PROBES]
    [error] = read(tmp_path, "\n".join([HEAD, *rows])).errors
    assert "no vibration" in error.text


def test_a_row_that_is_missing_or_doubled_is_named(tmp_path):
    lines = table("rms, um").splitlines()
    less, more = (lines[:-1], SPEEDS[:2], "1 of 3 speeds"), ([*lines, lines[-1]], SPEEDS, "1 of 4 speeds")
    for some, speeds, left in (less, more):
        found = read(tmp_path, "\n".join(some), "rms, um")
        assert found.spectrum.speed == pytest.approx(speeds)
        finding = next(one for one in found.findings if one.name == "missing readings")
        assert left in finding.text and "2005.35 rpm, 1X of 'right'" in finding.text.replace(
            " (repeat 2), 1X of 'left'", ", 1X of 'right'"
        )
    everywhere = [line for line in lines if "859" in line or "right" not in line]
    refused(lambda: read(tmp_path, "\n".join(everywhere), "rms, um"), "need the same probes")


@pytest.mark.parametrize(("share", "dead"), [(0.0, True), (0.2, False)])
def test_a_dead_probe_is_left_out(tmp_path, share, dead):
    """A probe with a fifth of the motion of the other is none: an orbit may be flat."""
    rows = [row.split(",") for row in table("rms, um").splitlines()]
    sizes = {speed: float(size) for speed, name, size, _ in rows[1:] if name == "left"}
    for row in rows[1:]:
        row[2] = f"{share * sizes[row[0]]:.2f}" if row[1] == "right" else row[2]
    found = read(tmp_path, "\n".join(",".join(row) for row in rows), "rms, um", table_noise_m=2e-7)
    assert [one.severity for one in found.findings if one.name == "dead probe"] == ["warning"] * dead
    assert np.isfinite(found.spectrum.directions).all() == dead


def test_a_speed_written_again_is_a_repeat(tmp_path):
    """All readings below those of the first, or each below its own: the same two spectra at every speed."""
    head, *rows = table("rms, um").splitlines()
    other = [row.replace(row.split(",")[-1], str(float(row.split(",")[-1]) + 2)) for row in rows]
    once = [read(tmp_path, "\n".join([head, *some]), "rms, um").spectrum for some in (rows, other)]
    blocks = read(tmp_path, "\n".join([head, *rows, *other]), "rms, um").spectrum
    pairs = [row for pair in zip(rows, other, strict=True) for row in pair]
    assert np.array_equal(blocks.amplitude, read(tmp_path, "\n".join([head, *pairs]), "rms, um").spectrum.amplitude)
    assert np.array_equal(blocks.amplitude[::2], once[0].amplitude)
    assert np.array_equal(blocks.amplitude[1::2], once[1].amplitude)


def test_a_table_of_a_probe_is_identified(tmp_path, command):
    """Of a rotor's own response: the commands read it as any record."""
    speeds = np.linspace(120, 280, 15)
    exact = 2.0 * 1.5e-5 * speeds**2 / (8e4 - 2.0 * speeds**2 + 20j * speeds) * np.exp(-1j * (np.deg2rad(-45) - MARK))
    rows = ["speed_rad_per_s,probe,amplitude_um,phase_deg"]
    rows += [f"{w},left,{1e6 * abs(v):.2f},{np.rad2deg(np.angle(v)):.1f}" for w, v in zip(speeds, exact, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join(rows))
    path = rig(tmp_path, probes={"left": -45.0})
    arguments = ["identify", str(tmp_path / "run.csv"), "--rig", str(path), "--unknowns", "eccentricity"]
    printed = command(*arguments, "external_damping").out.splitlines()
    assert float(printed[0].split()[1]) == pytest.approx(15.0, rel=1e-3)  # µm
    assert float(printed[3].split()[1]) == pytest.approx(20.0, rel=2e-3)


def wide(name="peak-to-peak, mil, lag", unit="mil pp", row=False):
    """The table with a column for each probe, below two lines of the monitoring system; units in a row of their own."""
    _, _, _, written = WAYS[name]
    rows = ["Machine,fan", "Date,today"]
    units = ["rpm", *[unit, "deg lag"] * len(PROBES)]
    names = ["Speed", *(f"{p} 1X {what}" for p in PROBES for what in ("Amp", "Phase"))]
    joined = [f"{one} ({below})" for one, below in zip(names, units, strict=True)]
    rows += [",".join(names), ",".join(units)] if row else [",".join(joined)]
    for speed in SPEEDS:
        cells = [f"{cell:.7f}" for probe in PROBES for cell in written(vector(probe, speed), speed)]
        rows.append(",".join([f"{speed * 30 / np.pi:.9f}", *cells]))
    return "\n".join(rows)


def read_wide(folder, text):
    return read(folder, text, "peak-to-peak, mil, lag", csv={"skip_rows": 2})


@pytest.mark.parametrize("row", [False, True])
def test_a_table_with_a_column_for_each_probe_is_read(tmp_path, row):
    (tmp_path / "table.csv").write_text(wide(row=row))
    path = rig(tmp_path, "peak-to-peak, mil, lag", csv={"skip_rows": 2, "unit_rows": int(row)})
    found = read_measurement([tmp_path / "table.csv"], path).spectrum
    assert found.harmonics.tolist() == [1, -1]
    np.testing.assert_allclose(found.amplitude[:, 0, 0], FORWARD, atol=2e-11)
    np.testing.assert_allclose(found.amplitude[:, 1, 0], BACKWARD, atol=2e-11)
    run("new", "rig", "guessed", "--records", tmp_path / "table.csv", "--folder", tmp_path)
    section = yaml.safe_load((tmp_path / "guessed.yaml").read_text())["measurement"]
    assert [probe["channel"] for probe in section["probes"]] == list(PROBES)
    assert (section["table_amplitude"], section["table_phase"]) == ("peak_to_peak", "lag")
    assert section["csv"] == {"skip_rows": 2} | ({"unit_rows": 1} if row else {})


def test_units_tell_the_columns_of_a_wide_table_without_the_words_amp_and_phase(tmp_path):
    text = wide().replace("Amp (mil pp)", "[mils p-p]").replace("Phase (deg lag)", "[deg lag]")
    text = text.replace("Speed (rpm)", "N [rpm]")
    np.testing.assert_allclose(read_wide(tmp_path, text).spectrum.amplitude[:, 0, 0], FORWARD, atol=2e-11)
    refused(lambda: read_wide(tmp_path, text.replace("deg lag", "deg lead")), "its header says lead")
    (tmp_path / "alone.csv").write_text(text.replace("right 1X [deg lag]", "right 1Y [deg lag]"))  # no half of a pair
    text = open_table(tmp_path / "alone.csv", CsvLayout(skip_rows=2)).text
    assert [*zip(text["probe"], text["harmonic"], strict=True)] == len(SPEEDS) * [("left", "1")]


@pytest.mark.parametrize(
    ("texts", "kind"),
    [
        ("pp,p-p,p/p,PP,pk-pk,pkpk,peak-to-peak,p2p,Spp,SS,DA,pk pk,p to p", "peak_to_peak"),
        ("rms,RMS,eff", "rms"),
        ("pk,peak,0-pk,0-p,zero-to-peak", "peak"),
    ],
)
def test_a_kind_of_amplitude_in_a_header_may_not_contradict_the_rig(texts, kind, tmp_path):
    units = [form.format(text) for text in texts.split(",") for form in ("um {}", "um_{}", "µm, {}")]
    for unit in units:
        head = f'Speed (rpm),"left 1X Amp ({unit})",left 1X Phase (deg)'
        both = "\n".join([head, "900,1,2", "1000,2,3", "1100,3,4"])
        of = {one: {"probes": {"left": 0.0}, "table_amplitude": one} for one in ("peak", "rms", "peak_to_peak")}
        assert read(tmp_path, both, **of.pop(kind)).spectrum is not None, unit
        for stated in of.values():
            refused(lambda: read(tmp_path, both, **stated), f"its header says {kind.replace('_', ' ')}")


def test_units_and_speeds_of_the_rig_may_not_contradict_a_table(tmp_path):
    probes = [{"channel": name, "node": 1, "angle_deg": angle, "unit": "um"} for name, angle in PROBES.items()]
    way, text = "peak-to-peak, mil, lag", table("peak-to-peak, mil, lag")
    words = "states the unit 'mil' for channel 'left', the rig 'um'"
    refused(lambda: read(tmp_path, text, way, probes=PROBES, measured=probes), words)
    other = {"channel": "not in the table", "node": 1, "angle_deg": 0.0, "unit": "um"}
    stated = [*(probe | {"unit": "mil"} for probe in probes), other]
    assert read(tmp_path, text, way, measured=stated).spectrum is not None
    refused(lambda: read(tmp_path, text, way, speeds_rpm={"run.csv": 900.0}), "a table has its own speeds")


@pytest.mark.parametrize(
    "names",
    [
        ["time", "DE 1X", "DE 1Y", "keyphasor"],
        ["speed_rpm", "probe", "harmonic", "amplitude_mil", "phase_deg"],
        ["Speed (rpm)", "DE X 1X Amp (mil pp)"],  # no phase
        ["time [s]", "DE 1X [um]", "DE 2X [um]", "Speed [rpm]"],  # probes X of bearings 1 and 2
    ],
)
def test_other_files_are_no_wide_tables(names, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("\n".join([",".join(names), *3 * [",".join("1" * len(names))]]))
    found = open_table(path, CsvLayout())
    assert found is None or (list(found.text) == names and "harmonic" in names)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (("deg lag", "deg lead"), "its header says lead, and 'measurement: table_phase:' .* is lag"),
        (("Speed (rpm)", "Speed (krpm)"), "no column of the speed in rpm, Hz or rad/s"),
        (("deg lag", "gon"), r"has the unit '\(gon\)'; known are deg and rad"),
        (("deg lag", "rev lag"), r"has the unit '\(rev lag\)'; known are deg and rad"),
        (("mil pp", "furlong"), r"column 'left 1X Amp \(furlong\)' has the unit '\(furlong\)'; known are m, mm"),
        ((" (mil pp)", ""), r"column 'left 1X Amp' has no unit; .*'csv: \{unit_rows: 1\}'"),
        (("right 1X Amp (mil", "right 1X Amp (um"), r"'left 1X Amp \(mil pp\)' is in mil, 'right .* in um"),
        (("right 1X Amp (mil pp", "right 1X Amp (mil rms"), "'left .*' peak to peak and 'right .*' rms are stated"),
        (("right 1X Phase (deg lag", "right 1X Phase (deg lead"), "'left .*' lag and 'right .*' lead are stated"),
        (("mil pp", "mil pp x10"), "has the unit .*x10"),
        (("mil pp", "0.1 mil pp"), r"has the unit '\(0.1 mil pp\)'"),
        (("mil pp", "mil half pp"), r"has the unit '\(mil half pp\)'"),
        (("deg lag", "0.1 deg lag"), r"has the unit '\(0.1 deg lag\)'"),
        (("deg lag", "x pi rad"), r"has the unit '\(x pi rad\)'"),
        (("deg lag", "-deg"), r"has the unit '\(-deg\)'"),
        (("Speed (", "Speed x1000 ("), "no column of the speed"),
        (("Speed (", "Speed/1000 ("), "no column of the speed"),
        (("Speed (rpm)", "Speed rpm/10"), "no column of the speed"),
        (("Speed (rpm)", "rpm x100"), "no column of the speed"),
        ((" 1X ", " -1X "), "must name probe and harmonic"),  # of a full spectrum: backward
        ((" 1X ", " 1 "), "must name probe and harmonic"),  # the number of a channel
        ((" 1X ", " "), r"such as 'right Phase \(deg lag\)' must name probe and harmonic"),
        (("right 1X Amp", "up 1X Amp"), r"amplitude of probe 'up' at 1X, and no column is its phase, .*add it"),
        ((f"{SPEEDS[1] * 30 / np.pi:.9f},", "none at all,"), r"line 5, column 'Speed \(rpm\)': 'none at all' is not"),
    ],
)
def test_a_wide_table_that_cannot_be_read_says_which_column(tmp_path, changed, said):
    refused(lambda: read_wide(tmp_path, wide().replace(*changed)), match=said)


def test_a_wide_table_of_two_speeds_that_differ_is_refused(tmp_path):
    lines = wide().splitlines()
    speeds = [float(line.split(",")[0]) for line in lines[3:]]

    def with_another(times):
        both = [f"{lines[2]},Gear (rpm)", *(f"{r},{times * w}" for r, w in zip(lines[3:], speeds, strict=True))]
        return read_wide(tmp_path, "\n".join([*lines[:2], *both]))

    assert "Gear (rpm)" in next(one.text for one in with_another(1.001).findings if one.name == "columns not read")
    refused(lambda: with_another(3.0), "'Speed (rpm)' and 'Gear (rpm)' are speeds that differ")


READINGS = [(rpm, 40.5 + k, 20.25 + k) for k, rpm in enumerate((804, 904, 1104, 1204, 1404))]


def rows_of_both(readings, speed="{:g}"):
    rows = [f"{speed.format(w)},{p},{size:g},{turn:g}" for w, size, turn in readings for p in PROBES]
    return "\n".join([HEAD, *rows])


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (rows_of_both(READINGS), None),
        (rows_of_both([*READINGS[:2], (1104, 0, 0), *READINGS[3:]]), "readings of zero"),
        (rows_of_both([(804, 0, 0), *READINGS[1:]]), None),  # a machine may be still at its slowest speed
        (rows_of_both([(w, size, np.deg2rad(turn) + 3) for w, size, turn in READINGS]), "phases in radians"),
        (rows_of_both([(w / 1000, size, turn) for w, size, turn in READINGS]), "unusual speed"),
        (rows_of_both([(w * 45 / np.pi, size, turn) for w, size, turn in READINGS]), "unusual speed"),  # rpm as rad/s
    ],
)
def test_readings_that_may_mean_something_else_are_told(tmp_path, text, name):
    found = {one.name for one in read(tmp_path, text, "rms, um", table_phase="lead").findings}
    assert {"readings of zero", "phases in radians", "unusual speed", "not stated"} & found == ({name} - {None})


BOTH = {"table_phase": "lag", "table_amplitude": "rms"}


@pytest.mark.parametrize(("way", "taken"), [({}, "'table_amplitude: peak', 'table_phase: lead'"), (BOTH, None)])
def test_conventions_that_nothing_states_are_told(tmp_path, way, taken):
    said = [one.text for one in read(tmp_path, rows_of_both(READINGS), **way).findings if one.name == "not stated"]
    assert len(said) == bool(taken) and all(taken in text for text in said)


@pytest.mark.parametrize(("decimal", "grouped"), [(".", "1.104"), (",", "1,104"), (",", "1,104,000")])
def test_speeds_in_groups_of_digits_are_refused(tmp_path, decimal, grouped):
    """904 and 1.104, as an office program writes thousands; not 904.000 and 1.104."""
    rows = [f"{speed};{p};41;20" for speed in ("804", "904", grouped, "1.204".replace(".", decimal)) for p in PROBES]
    text = "\n".join(["speed_rpm;probe;amplitude_um;phase_deg", *rows])
    words = "'1.104' beside whole numbers below 1000|'1,104,000' is not a number"
    refused(lambda: read(tmp_path, text, csv={"separator": ";", "decimal": decimal}), match=words)
    assert read(tmp_path, rows_of_both(READINGS, "{:.3f}")).spectrum is not None


def test_amplitudes_of_orbits_are_radii(tmp_path):
    text = "speed_rpm,node,harmonic,amplitude_um,phase_deg\n904,1,1,2.5,30\n904,1,-1,0.5,40"
    assert read(tmp_path, text, harmonics=[1, -1]).spectrum is not None
    given = {"harmonics": [1, -1], "table_amplitude": "peak_to_peak"}
    refused(lambda: read(tmp_path, text, **given), "a table of orbits, whose amplitudes are radii")


@pytest.mark.parametrize("blank", ["", "n.a.", "NaN", "--"])
def test_a_speed_with_an_empty_cell_is_left_out(tmp_path, blank):
    lines = wide().splitlines()
    lines[4] = ",".join([*lines[4].split(",")[:-1], blank])
    found = read_wide(tmp_path, "\n".join([*lines, ",,,,", ""]))
    assert found.spectrum.speed == pytest.approx(SPEEDS[[0, 2]])
    (finding,) = (one for one in found.findings if one.name == "missing readings")
    assert "1 of 3 speeds are left out" in finding.text and "at 1432.39 rpm, 1X of 'right'." in finding.text


def test_velocities_of_a_wide_table_and_their_kind_below_them(tmp_path):
    way = "rms velocity, mm/s, lag"
    found = read(tmp_path, wide(way, "mm/s rms"), way, csv={"skip_rows": 2}).spectrum
    np.testing.assert_allclose(found.amplitude[:, 0, 0], FORWARD, atol=2e-11)
    head, *rows = table(way).splitlines()
    text = "\n".join([head, "rpm,,mm/s rms,deg", *rows])
    refused(lambda: read(tmp_path, text, table_phase="lag", **BELOW), "header says rms")


@pytest.mark.parametrize("in_rig", ["{}", "{} (um)", "{} [um pp]"])
@pytest.mark.parametrize("in_file", ["{}", "{} (um)"])
def test_a_unit_in_brackets_is_no_part_of_the_name_of_a_probe(in_rig, in_file, tmp_path):
    way, path = "rms, um", tmp_path / "table.csv"
    text = table(way)
    for name in PROBES:
        text = text.replace(f",{name},", f",{in_file.format(name)},")
    path.write_text(text)
    probes = {in_rig.format(name): angle for name, angle in PROBES.items()}
    measurement = read_measurement([path], rig(tmp_path, way, probes))
    harmonics = list(measurement.spectrum.harmonics)
    assert measurement.spectrum.amplitude[:, harmonics.index(1), 0] == pytest.approx(FORWARD, abs=1e-11)


def test_names_that_differ_by_more_than_one_unit_are_told_apart():
    assert as_known(["t (s)", "DE X [mil pp]", "key (V)"], ["DE X", "key", "t"]) == ["t", "DE X", "key"]
    assert as_known(["DE X", "DE X (um)"], ["DE X"]) == ["DE X", "DE X (um)"]  # one is it to the letter
    assert as_known(["DE X (mil)", "DE X (um)"], ["DE X"]) == ["DE X (mil)", "DE X (um)"]  # which one?
    assert as_known(["DE X"], ["DE X (mil)", "DE X (um)"]) == ["DE X"]
    assert as_known(["DE (V)", "DE (H)"], ["DE"]) == ["DE (V)", "DE (H)"]  # directions
    assert as_known(["DE (NS) (um)"], ["DE (NS)", "DE"]) == ["DE (NS)"]
