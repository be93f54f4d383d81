"""Files of records and spectra whose content is damaged, or of another form: one line, or finite numbers."""

import numpy as np
import pytest
from one_line_errors import run

from rotorstudy import measured_spectrum, read_measurement
from rotorstudy.commands.line import main
from rotorstudy.store import load, save

RIG = "examples/jeffcott.yaml"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Records, and the spectrum imported from them."""
    folder = tmp_path_factory.mktemp("good")
    records, spectrum = folder / "records.nc", folder / "spectrum.nc"
    run("simulate", RIG, "--speeds", "100", "150", "--rate", "2000", "--out", records)
    run("import", records, "--rig", RIG, "--out", spectrum)
    return records, spectrum


def with_first(name, value):
    """A change of a Dataset: the first value of a variable is replaced."""

    def change(data):
        values = data[name].values.astype(float)
        values.flat[0] = value
        return data.assign({name: (data[name].dims, values, data[name].attrs)})

    return change


def with_text(name):
    return lambda data: data.assign({name: (data[name].dims, np.full(data[name].shape, "a", object))})


def with_marks(values):
    return lambda data: data.assign(phase_mark_time=(("speed", "revolution"), np.tile(values, (2, 1))))


RECORDS = {
    "all samples 1e300": (lambda d: d.assign(displacement=d.displacement * 0 + 1e300), "dead probe"),
    "one speed 0": (with_first("speed", 0.0), "it must be positive"),
    "infinite time": (with_first("time", -np.inf), "time does not increase"),
    "a dimension more": (lambda d: d.assign(reference=d.reference.expand_dims(more=2, axis=2)), "reference has dimens"),
    "a scalar keyphasor": (lambda d: d.assign(keyphasor=3.0), "keyphasor has dimensions"),
    "text as samples": (with_text("keyphasor"), "needed are numbers"),
    "times of 1e-300": (lambda d: d.assign_coords(time=d.time * 1e-300), "does not increase strictly"),
    "a unit that is no text": (lambda d: d.assign(time=d.time.assign_attrs(units=[1.0, 2.0])), "needed is a text"),
    "marks at one instant": (with_marks(np.full(16, 0.5)), "phase marks do not increase"),
    "marks far outside": (with_marks(np.arange(16) * 1e307), "phase marks do not increase"),
    "a node that is no number": (lambda d: d.assign_coords(node=("node", [np.nan])), "unknown node"),
}
SPECTRA = {
    "no dimension node": (lambda d: d.isel(node=0), "has dimensions"),
    "no dimension harmonic": (lambda d: d.isel(harmonic=0), "has dimensions"),
    "no covariance": (lambda d: d.drop_vars("covariance"), "no variable 'covariance'"),
    "findings without a text": (lambda d: d.drop_vars("finding_text"), "finding_text"),
    "a finding without dimension": (lambda d: d.assign(finding_name="a"), "finding_name"),
    "NaN as node": (lambda d: d.assign_coords(node=("node", [np.nan])), "whole numbers"),
    "half a harmonic": (with_first("harmonic", 0.5), "whole numbers"),
    "speed 0": (with_first("speed", 0.0), "speed 0 rad/s"),
    "text as speed": (lambda d: d.assign_coords(speed=("speed", ["a", "b"])), "needed are numbers"),
    "text as amplitude": (with_text("amplitude"), "needed are numbers"),
    "amplitude 1e308": (with_first("amplitude", 1e308), "at most 1e+06"),
    "no vibration": (lambda d: d.assign(amplitude=d.amplitude * 0), "every harmonic is zero"),
    "infinite probe direction": (with_first("probe_direction", np.inf), "probe_direction is infinite"),
    "components of other harmonics": (lambda d: d.isel(component=slice(0, 4)), "needed are twice"),
}


DAMAGED = [(i, *damage) for i, damages in enumerate((RECORDS, SPECTRA)) for damage in damages.values()]


@pytest.mark.parametrize(("file", "change", "word"), DAMAGED, ids=[*RECORDS, *SPECTRA])
def test_damaged_records_and_spectra_are_refused_in_one_line(file, change, word, files, tmp_path, command):
    bad = tmp_path / "bad.nc"
    save(change(load(files[file])), bad)
    given = ["identify", bad, "--unknowns", "external_damping"] if file else ["import", bad, "--out", tmp_path / "o.nc"]
    err = command(*given, "--rig", RIG, status=1).err
    assert {one.name for one in tmp_path.iterdir()} <= {"bad.nc", "o_quality.html"}
    assert word in err and err.splitlines()[-1].startswith("error: ")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "without rows"),
        ("0,1,0,1e-5,0.1\n", "speed 0 rad/s"),
        ("100,nan,0,1e-5,0.1\n", "not finite"),
        ("100,1,0,1e308,0.1\n", "beyond 1e+100"),
        ("1e30,1,0,1e-5,0.1\n", "at most 1e+06"),
    ],
)
def test_damaged_tables_are_refused_in_one_line(text, word, tmp_path, command):
    table = tmp_path / "table.csv"
    rest = "".join(text.replace(",0,", f",{n},", 1) for n in (1, -1, 2, -2, 3, -3, 4, -4, 5, -5))
    table.write_text(f"speed_rad_per_s,node,harmonic,amplitude_m,phase_rad\n{text}{rest}")
    err = command("import", table, "--rig", RIG, "--out", tmp_path / "o.nc", status=1).err
    assert word in err and err.count("error: ") == 1
    assert [one.name for one in tmp_path.iterdir()] == ["table.csv"]


KEYPHASORS = {
    "one pulse": lambda sample, signal: sample == 500,
    "two pulses at once": lambda sample, signal: np.isin(sample, [500, 502]),
    "one at once after the other": lambda sample, signal: np.isin(sample, [500, 502, 504]),
    "every other sample": lambda sample, signal: sample % 2,
    "pulses ever rarer": lambda sample, signal: np.isin(sample, 2 ** np.arange(11)),
    "huge": lambda sample, signal: 1e308 * (2 * (sample % 2) - 1),
    "one sample of 1e308": lambda sample, signal: np.where(sample == 7, 1e308, signal),
    "missing from the middle": lambda sample, signal: np.where(sample < 1000, signal, np.nan),
    "as good as nothing": lambda sample, signal: 1e-308 * signal,
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", KEYPHASORS)
def test_a_keyphasor_that_fails_gives_an_error_finding_or_finite_harmonics(name, files, tmp_path):
    data = load(files[0]).drop_vars("reference")
    sample = np.arange(data.sizes["time"])
    wrong = [KEYPHASORS[name](sample, one) * 1.0 for one in data.keyphasor.values]
    save(data.assign(keyphasor=(("speed", "time"), np.array(wrong), data.keyphasor.attrs)), tmp_path / "bad.nc")
    found = read_measurement([tmp_path / "bad.nc"], RIG)
    assert found.errors or np.isfinite(found.spectrum.amplitude).all()


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("name", "value"), [("displacement", np.inf), ("displacement", 1e308), ("reference", np.inf)])
def test_an_infinite_sample_gives_one_line_or_finite_harmonics(name, value, files, tmp_path, capsys):
    save(with_first(name, value)(load(files[0])), tmp_path / "bad.nc")
    status = main(["import", str(tmp_path / "bad.nc"), "--rig", RIG, "--out", str(tmp_path / "s.nc")])
    assert capsys.readouterr().err.count("error: ") >= status
    assert status or np.isfinite(load(tmp_path / "s.nc").amplitude.values).all()


def test_bytes_changed_at_random_give_one_line_or_finite_harmonics(files, tmp_path, capsys):
    rng = np.random.default_rng(3)
    for content in (path.read_bytes() for path in files for _ in range(10)):
        damaged = bytearray(content)
        for at in rng.integers(0, len(damaged), 20):
            damaged[at] = rng.integers(0, 256)
        (tmp_path / "bad.nc").write_bytes(damaged)
        status = main(["identify", str(tmp_path / "bad.nc"), "--rig", RIG, "--unknowns", "external_damping"])
        shown = capsys.readouterr()
        assert sum(line.startswith("error: ") for line in shown.err.splitlines()) == status
        assert status or "nan" not in shown.out


def test_the_files_themselves_are_right(files):
    for path in files:
        assert np.isfinite(measured_spectrum([path], RIG)[0].amplitude).all()
