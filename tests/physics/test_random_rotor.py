"""All readings of the table agree on rotors nobody chose, and with closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from machines import HARMONICS, errors_of_derivatives, jeffcott, spectrum_of
from random_rotor import SENSORS, four_coordinates, on_translations, random_model

from rotorstudy import (
    Entry,
    Model,
    Problem,
    RotorstudyError,
    full_spectrum,
    harmonic_response,
    measured_response_and_jacobian,
    registry,
    simulate_records,
    time_response,
)
from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.linear import solve_linear
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.model.terms import Parameter, Term, with_entries
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


SHOWN = np.arange(-5, 6)
ROUND_OFF = 1e-10  # 1e-16 times the condition of 31 coupled harmonics, the highest with 200 times the inertia


@pytest.fixture(params=[four_coordinates(1), four_coordinates(2), random_model(1)], ids=["four", "four too", "crack"])
def coupled(request):
    return request.param


def rewritten(coupled, rule):
    """The model with each entry replaced by what `rule` makes of it."""
    return replace(coupled, terms=tuple(with_entries(term, lambda entry: [rule(entry)]) for term in coupled.terms))


def response(coupled):
    return harmonic_response(coupled, [SPEED], SHOWN)[0]


def differs(found, expected):
    """Largest difference relative to the largest harmonic."""
    return np.abs(found - expected).max() / np.abs(expected).max()


def in_frequency(entry):
    """d/dt written as a gain that depends on the harmonic: harmonic n of e^{jkwt} x' is j (n - k) w x_{n-k}."""
    if entry.on == "one":
        return replace(entry, gain=lambda w, n: entry.gain_at(w, n), frequency_only=True)

    def gain(w, n):
        return entry.gain_at(w, n) * ((n - entry.shift) * w) ** entry.order

    return replace(entry.times(1j**entry.order), order=0, gain=gain, frequency_only=True)


def test_a_derivative_is_a_gain_of_the_harmonic(coupled):
    same = rewritten(coupled, in_frequency)
    assert differs(response(same), response(coupled)) < ROUND_OFF
    found, expected = (measured_response_and_jacobian(m, [SPEED], SHOWN)[1] for m in (same, coupled))
    for p, name in enumerate(coupled.names):
        assert differs(found[..., p], expected[..., p]) < 100 * ROUND_OFF, name  # a derivative adds a second solve


def exact(coupled):
    return spectrum_of(coupled, [80.0, SPEED], np.arange(-15, 16), 1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_and_gives_the_same_equations_for_the_unknowns(seed):
    coupled = four_coordinates(seed)
    names = ("swirl", "turning", "backward", "push_real", "push_imag")
    (a, b), (same_a, same_b) = (
        Problem(m, exact(coupled), names).equations() for m in (coupled, rewritten(coupled, in_frequency))
    )
    for p, name in enumerate(names):
        assert differs(same_a[:, p], a[:, p]) < ROUND_OFF, name
    assert differs(same_b, b) < ROUND_OFF


def test_trials_at_once_equal_trials_one_by_one_in_a_coupled_rotor(coupled):
    theta = coupled.theta * (1 + 0.05 * np.random.default_rng(3).standard_normal((2, 3, len(coupled.theta))))
    together, slopes = measured_response_and_jacobian(coupled, [80.0, SPEED], SHOWN, theta)
    for trial in np.ndindex(2, 3):
        one, slope = measured_response_and_jacobian(coupled, [80.0, SPEED], SHOWN, theta[trial])
        assert differs(together[trial], one) < ROUND_OFF
        assert differs(slopes[trial] * coupled.typical, slope * coupled.typical) < ROUND_OFF
    assert differs(together[0, 0], together[1, 2]) > 1e-3  # negative control: trials differ


M, K, C_E, C_H, DK, E, G = 2.0, 7.6e5, 100.0, 20.0, 2.5e5, 5e-6 * np.exp(1j * np.pi / 6), 9.81


def switching_series(order):
    """s_k of sigma = 1/2 + (2/pi)(cos - cos3 / 3 + ...), written down independently of the plugin."""
    series = {0: 0.5}
    for i, k in enumerate(range(1, order + 1, 2)):
        series[k] = series[-k] = (-1) ** i / (np.pi * k)
    return series


def closed_form(w, n):
    """Eqs. (2.24) to (2.26)."""
    s = switching_series(99)
    p = (s.get(n, 0) + s.get(n - 2, 0)) / 2
    force = p * DK * M * G / K + (M * E * w**2 if n == 1 else 0) + (1j * w * C_H * M * G / K if n == 0 else 0)
    return force / (K - M * (n * w) ** 2 + 1j * n * w * C_E + 1j * (n - 1) * w * C_H)


@pytest.mark.parametrize("w", [88.0, 308.0])
def test_weight_dominant_rotor_has_the_closed_form(w):
    found = harmonic_response(jeffcott(), [w], HARMONICS)[0, :, 0]
    assert found == pytest.approx([closed_form(w, n) for n in HARMONICS], rel=1e-12)  # round-off


def test_displacement_counts_from_the_static_line_of_the_uncracked_rotor():
    still = jeffcott(stiffness_loss=0.0)
    theta = still.theta * 0
    assert np.abs(harmonic_response(still, [88.0], [0], theta)).max() < 1e-20
    loose = replace(still, structure=replace(still.structure, stiffness=np.zeros((1, 1))))
    assert loose.structure.static_deflection == 0  # not supported: no static line, all counts from zero
