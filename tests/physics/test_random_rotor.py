"""All readings of the table agree on rotors nobody chose: balance in time, integration, derivatives, equations."""

from dataclasses import replace

import numpy as np
import pytest
from machines import errors_of_derivatives, spectrum_of
from random_rotor import SENSORS, on_translations, random_model

from rotorstudy import Entry, Model, Problem, RotorstudyError, full_spectrum, registry, simulate_records, time_response
from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.linear import solve_linear
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.measured import measured_response

SPEED, ORDER = 110.0, 30  # the response of these rotors falls below 1e-10 of its largest harmonic before the 15th


@pytest.fixture(scope="module", params=range(1, 4), ids=lambda seed: f"seed {seed}")
def model(request):
    return random_model(request.param)


def shown(name, value, entry, unit="1"):
    """A term of the probes, with one amplitude."""
    return Term(name, (Parameter(name, unit, (entry,), 0.1, np.iscomplexobj(value)),), {name: value}, "output")


def chain(model):
    """Probes with a gap, a gain error and a wrong angle, which act on what the rotor does."""
    here, both = np.array([0.0, 1.0]), np.eye(2)
    gap = shown("gap", (1 + 2j) * 1e-4, Entry(here, on="one"), unit="m")
    return model.plus(gap, shown("gain", 0.1 + 0.05j, Entry(both)), shown("angle", 0.05, Entry(1j * both, on="conj")))


def test_time_integration_settles_to_the_response():
    model, turn = random_model(1), 2 * np.pi / SPEED
    settled = time_response(model, SPEED, 24 * turn + np.arange(256) * turn / 256)
    found = harmonic_response(model, [SPEED], range(-6, 7), order=ORDER)[0]
    expected = (np.fft.fft(settled, axis=0) / 256)[np.arange(-6, 7)]
    # transients have fallen by e^-60t, 1e-35, the integrator errs by 1e-10 a step and forgets
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_derivatives_are_those_of_the_response(model):
    model = chain(model)
    found = errors_of_derivatives(model, [SPEED, 140.0], [0, 1, 2, 3, -1], 2e-5 * np.array(model.typical))
    # central differences err by the square of the step, 4e-10, times up to a hundred near resonance, and by
    # round-off, 1e-16 / 2e-5, of a response that a parameter may change by no more than a thousandth
    assert found.max() < 1e-6, dict(zip(model.names, found, strict=True))


FEW = [0, 1, 2, -1]  # of thirty-one that are coupled; some without their mirror image
FORCES = ("eccentricity_real", "eccentricity_imag", "couple")
DAMPINGS = ("external_damping", "internal_damping")


def identified(model, spectrum, names=FORCES):
    return solve_linear(*regression(model, spectrum, names).real_system(), names)


def test_every_amplitude_comes_back_although_the_tilt_is_hidden(model):
    names = on_translations(model)
    assert {"couple", "stiffness_loss", "turning_damper"} < set(names)
    found = identified(model, spectrum_of(model, [80.0, SPEED, 140.0], range(-15, 16), 1e-8), names)
    # round-off of 1e-16, magnified by how alike the columns of ten effects are
    assert found == pytest.approx(model.theta[model.position(names)], rel=1e-6)


def test_hidden_coordinates_and_hidden_harmonics_are_eliminated_together(model):
    """The forces come back, also that on the tilt."""
    spectrum = spectrum_of(model, [80.0, SPEED, 140.0], FEW, 1e-8)
    found = identified(model, spectrum)
    assert found == pytest.approx(model.theta[model.position(FORCES)], rel=1e-8)  # round-off times the elimination
    for term in model.terms:  # negative control: every known effect a hundredth off
        if term.kind in ("unbalance", "couple"):
            continue
        values = {name: 1.01 * value for name, value in term.values.items()}
        wrong = replace(model, terms=tuple(replace(t, values=values) if t is term else t for t in model.terms))
        assert np.abs(identified(wrong, spectrum) / found - 1).max() > 1e-7, term.kind


@pytest.mark.parametrize("measured", [FEW, range(-3, 4)], ids=["few", "both ways"])
def test_unknown_damping_is_not_got_wrong_in_silence_where_coupled_harmonics_are_hidden(model, measured):
    """It acts on the hidden harmonics too, so the equations left after elimination are not linear in it."""
    spectrum = spectrum_of(model, [80.0, SPEED, 140.0], measured, 1e-8)
    try:
        found = identified(model, spectrum, DAMPINGS)
    except RotorstudyError as error:
        assert "external_damping" in str(error) and "maximum_likelihood" in str(error)
    else:
        assert found == pytest.approx(model.theta[model.position(DAMPINGS)], rel=1e-6)


def test_the_output_fit_finds_what_the_equations_cannot(model):
    """Effects that act on the hidden tilt, and probe errors, all at once from starts a tenth off."""
    model = chain(model)
    names = ("damping", "added_mass", "gap_real", "gain_real", "angle", "eccentricity_real")
    true = model.theta[model.position(names)]
    problem = Problem(model, spectrum_of(model, [80.0, SPEED, 140.0], FEW, 1e-8), names)
    assert output_error_fit(problem, start=1.1 * true).theta == pytest.approx(true, rel=1e-6)


@pytest.mark.parametrize("harmonic", [0, 1, -1, 3])
def test_a_harmonic_does_not_depend_on_what_else_is_asked_for(model, harmonic):
    alone = measured_response(model, [SPEED], [harmonic])
    among = measured_response(model, [SPEED], [2, harmonic, -3])
    assert alone[:, 0] == pytest.approx(among[:, 1], rel=1e-12)


def plain(*terms):
    """The random structure with damping, an unbalance and a couple, nothing that couples harmonics."""
    model = random_model(1)
    some = [t for t in model.terms if t.kind in ("external_damping", "damping", "unbalance", "couple")]
    return Model(model.structure, (*some, *terms), SENSORS)


@pytest.mark.parametrize(("on", "shift", "harmonic", "source"), [("z", 1, 2, 1), ("conj", 0, -1, 1), ("conj", 3, 2, 1)])
def test_a_probe_that_moves_harmonics_shows_them_though_nobody_asked_for_their_source(on, shift, harmonic, source):
    entry = Entry(np.eye(2), on=on, shift=shift)
    model = plain(shown("probe", 0.1, entry))
    moved = 0.1 * measured_response(plain(), [SPEED], [source])[0, 0]
    found = measured_response(model, [SPEED], [harmonic])[0, 0]
    assert found == pytest.approx(moved if on == "z" else moved.conj(), rel=1e-12)


def test_simulated_records_hold_every_harmonic_a_probe_shows():
    model = plain(shown("probe", 0.1, Entry(np.eye(2), on="conj")))
    time = np.arange(200) * 2 * np.pi / SPEED / 100
    records = simulate_records(model, [SPEED], [1, -1], time)
    found = full_spectrum(records, [1, -1], registry().get("spectrum", "regression"), "none").amplitude
    assert found == pytest.approx(measured_response(model, [SPEED], [1, -1]), rel=1e-9)
