"""Nodes with one probe, probes at different nodes, three probes at one, and dead probes."""

import numpy as np
import pytest
from machine import PROBES, TIME, channels, records, section, write, write_rig
from machines import all_but, faulty
from one_line_errors import refused, run

from rotorstudy import Problem, Spectrum, measured_spectrum, read_measurement
from rotorstudy.diagnosis.verdict.dataset import verdict_dataset
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.errors import UnidentifiableError
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.inference.prediction import predicted
from rotorstudy.measurement.harmonics import estimate
from rotorstudy.store import as_complex

UNKNOWNS = ("eccentricity[1]_real", "eccentricity[1]_imag", "internal_damping")


def probes(*names):
    """Probes of the machine by the names of their channels."""
    return [probe for probe in section()["probes"] if probe["channel"] in names]


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Folder with one record at each of three speeds, and their paths."""
    folder = tmp_path_factory.mktemp("machine")
    return folder, [write("csv", folder, record) for record in records()]


def read(machine, *names, **changes):
    folder, paths = machine
    return measured_spectrum(paths, write_rig(folder / "rig.yaml", probes=probes(*names), **changes))


def test_the_components_of_a_probe_are_those_of_its_own_signal():
    """Written out from the real signal: sqrt(2) r_n and r_0 of any orbit, and nothing of the motion across."""
    harmonics, a = np.array([0, 1, -1, 2, -2, 7]), 0.7
    generator = np.random.default_rng(1)
    orbit = generator.normal(size=6) + 1j * generator.normal(size=6)
    angle = np.arange(4096) * 2 * np.pi / 4096
    paired = slice(0, 5)
    signal = np.real(np.exp(-1j * a) * (orbit[paired] @ np.exp(1j * np.outer(harmonics[paired], angle))))
    lines = np.fft.fft(signal) / len(signal)
    spectrum = Spectrum(orbit[None, :, None], np.array([100.0]), harmonics, (3,), np.eye(12)[None, None], np.array([a]))
    expected = [lines[0].real, *(np.sqrt(2) * lines[[1, 2]].real), *(np.sqrt(2) * lines[[1, 2]].imag)]
    assert spectrum.whitened(orbit[None, :, None]) == pytest.approx(expected, rel=1e-8)
    assert spectrum.data_count == 5
    along = spectrum.shown(orbit[None, :, None])
    assert along[0, 1:3, 0] == pytest.approx(np.exp(1j * a) * np.array([lines[1], lines[1].conj()]), rel=1e-12)
    assert spectrum.whitened(along) == pytest.approx(expected, rel=1e-8)


def test_whitened_data_belong_to_their_harmonic():
    """At a node with an orbit and at one with a probe: a change of harmonic 2 shows at 2, and at -2 of the probe."""
    harmonics, directions = np.array([0, 1, -1, 2, -2]), np.array([np.nan, 0.3])
    covariance = np.broadcast_to(np.eye(10), (1, 2, 10, 10))
    amplitude = np.zeros((1, 5, 2), complex)
    amplitude[0, 3] = 3.0
    spectrum = Spectrum(amplitude, np.array([10.0]), harmonics, (1, 2), covariance, directions)
    sigma = spectrum.by_harmonic(spectrum.whitened(amplitude))[0]
    expected = np.zeros((5, 2))
    expected[3], expected[4, 1] = (3 / np.sqrt(2), 1.5), 1.5
    assert sigma == pytest.approx(expected, rel=1e-6)


def test_the_covariance_of_a_probe_is_that_of_its_noise():
    """Unit variance of whitened harmonics to 5 sigma; not of the mean, whose covariance expects slow noise too."""
    generator, harmonics, a = np.random.default_rng(2), np.array([1, -1, 2, -2, 3, -3]), 2.0
    angle, found = 2 * np.pi * 20 * np.arange(400) / 400, []
    for _ in range(150):
        noise = estimate(np.exp(1j * a) * generator.normal(size=400), angle, 20, harmonics, a)
        one = Spectrum(noise.amplitude[None, :, None], np.ones(1), harmonics, (1,), noise.covariance[None, None],
                       np.array([a]))  # fmt: skip
        found.append(one.whitened(one.amplitude))
    correlation = np.transpose(found) @ np.array(found) / len(found)
    assert np.trace(correlation) / 6 == pytest.approx(1, abs=5 * np.sqrt(2 / 900))
    assert np.abs(correlation - np.diag(np.diag(correlation))).max() < 5 / np.sqrt(150)


@pytest.mark.parametrize(
    "names",
    [
        ("disc 1 left", "disc 2 right"),  # one a node, in different directions
        ("disc 1 left", "disc 1 right", "disc 2 left"),  # two and one
    ],
)
def test_unbalance_and_damping_from_single_probes(names, machine):
    spectrum, model, findings = read(machine, *names)
    assert spectrum.data_count < 2 * spectrum.amplitude.size
    assert "single probe" in {finding.name for finding in findings}
    found = output_error_fit(Problem(model, spectrum, UNKNOWNS))
    true = np.array([2.5e-5 * np.cos(0.785398), 2.5e-5 * np.sin(0.785398), 10.0])
    assert (np.abs(found.theta - true) < 4 * found.std).all()
    orbit, whole, _ = read(machine, *(name for name, *_ in PROBES))
    both = output_error_fit(Problem(whole, orbit, UNKNOWNS))
    assert (found.std > both.std).all() and (found.std < 10 * both.std).all()
    # the misfit is that of the probes' own data
    freedom = spectrum.data_count - len(UNKNOWNS)
    assert found.misfit == pytest.approx(freedom, abs=5 * np.sqrt(2 * freedom))


def test_a_third_probe_at_a_node_adds_to_the_orbit(machine):
    folder, _ = machine
    record = records(speeds=[80.0])[0]
    signals = channels(record)
    # straight up, from the two at 45 degrees
    third = 1e6 * np.sin(np.pi / 4) * (signals["disc 1 right"] / 1e3 - signals["disc 1 left"] / 7874)
    path = write("csv", folder, record, name="three", top=third)
    three = [*section()["probes"], {"channel": "top", "node": 2, "angle_deg": 0.0, "unit": "um"}]
    found, *_ = measured_spectrum([path], write_rig(folder / "three.yaml", probes=three))
    plain, *_ = measured_spectrum([path], write_rig(folder / "two.yaml"))
    assert found.single_probes == [] and found.amplitude == pytest.approx(plain.amplitude, rel=1e-9)


@pytest.mark.parametrize("dead", [np.full(len(TIME), 0.3), np.full(len(TIME), np.nan)])
def test_a_dead_probe_is_left_out(dead, machine):
    folder, _ = machine
    paths = [write("csv", folder, r, name=f"dead_{r.speed:g}", **{"disc 1 left": dead}) for r in records()]
    found = read_measurement(paths, write_rig(folder / "rig.yaml"))
    assert ("warning", "dead probe") in {(f.severity, f.name) for f in found.findings} and not found.errors
    alone, *_ = read(machine, "disc 1 right", "disc 2 left", "disc 2 right")
    assert found.spectrum.single_probes == [2]
    assert found.spectrum.amplitude == pytest.approx(alone.amplitude, rel=1e-12)
    assert list(found.rig.structure.reading.probes_at(2)) == ["disc 1 right"]


def test_what_one_probe_cannot_tell_is_said(machine):
    """A forward and a backward runout look the same to one probe; an orbit separates them."""
    extra = [{"kind": "runout", "node": 2, "harmonic": n, "label": str(n)} for n in (1, -1)]
    unknowns = [f"runout_{n}X[{n}]_{part}" for n in (1, -1) for part in ("real", "imag")]
    for names, told in ((["disc 1 left", "disc 2 left"], True), ([name for name, *_ in PROBES], False)):
        spectrum, model, _ = read(machine, *names)
        problem = Problem(faulty(model, *extra), spectrum, tuple(unknowns))
        if told:
            with pytest.raises(UnidentifiableError, match="trade off"):
                output_error_fit(problem)
        else:
            output_error_fit(problem)


def test_the_imported_spectrum_is_that_of_the_records(machine):
    """Of a node with one probe and one with two."""
    folder, paths = machine
    rig = write_rig(folder / "rig.yaml", probes=probes("disc 1 left", "disc 2 left", "disc 2 right"))
    out = folder / "spectrum.nc"
    run("import", *paths, "--rig", rig, "--out", out)
    again, model, _ = measured_spectrum([out], rig)
    plain, _, _ = measured_spectrum(paths, rig)
    assert again.sensors == plain.sensors
    for part in ("amplitude", "speed", "harmonics", "covariance", "directions"):
        assert np.array_equal(getattr(again, part), getattr(plain, part), equal_nan=True)
    assert model.structure.reading.axis(2) == pytest.approx(np.exp(1j * plain.directions[0]))


def test_a_verdict_shows_of_the_model_what_the_probe_shows(machine):
    """Of the machine's own rig noise is left; its whole orbit differs from the motion along the probe far more."""
    spectrum, model, _ = read(machine, "disc 1 left", "disc 2 left", "disc 2 right", harmonics=[1, -1])
    found = investigate(spectrum, model, settings={"leave_out": all_but("delay")})
    data = verdict_dataset(found, spectrum)
    measured, base = as_complex(data.measured), as_complex(data.base)
    assert np.abs(measured - base).max() < 0.05 * np.abs(measured).max()
    orbit = predicted(found.best.model, spectrum, found.best.theta)
    assert np.abs(measured - orbit)[..., 0].max() > 0.3 * np.abs(measured[..., 0]).max()


def test_what_a_single_probe_does_not_allow_is_named(machine):
    refused(lambda: read(machine, "disc 1 left", "disc 2 left", harmonics=[1, 2]), "harmonics n and -n together")
    spectrum, model, _ = read(machine, "disc 1 left", "disc 2 left")
    words = "single probe, and the equations of motion need the orbit"
    refused(lambda: Problem(model, spectrum, UNKNOWNS).equations(), words)
