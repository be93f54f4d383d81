"""Every effect is the equation of its source, written down here a second time; every crack the stiffness it takes."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy import Model, Problem, Spectrum, Term, build_model, make_term, measured_response, registry
from rotorstudy.errors import UnidentifiableError
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.model.cracks import crack_parameters, crack_series, participation_factors
from rotorstudy.model.entries import apply_entries
from rotorstudy.response.coupling import forced_harmonics

SPEEDS = np.array([90.0, 200.0, 310.0, 450.0])  # below the critical speeds of both rotors
HARMONICS = np.array([0, 1, 2, 3, 5, 7, -1, -3, -5])
ROUND_OFF = 1e-12  # relative: 1e-16 a product, some hundred products and sums
ROUND_TRIP = 1e-7  # relative: round-off 1e-16 of the largest harmonic, of which the weakest effect moves some 1e-7
TILTING = {
    "kind": "offset_disc",
    "mass_kg": 2.0,
    "polar_moment_kg_m2": 0.0048,
    "diametral_moment_kg_m2": 0.0024,
    "a_m": 0.2,
    "b_m": 0.16,
    "diameter_m": 0.015,
}
PLAIN = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
ROTORS = {"plain": build_model({"rotor": PLAIN}).structure, "tilting": build_model({"rotor": TILTING}).structure}
CRACKS = list(registry().plugins["crack"].values())


@pytest.fixture(params=ROTORS)
def structure(request):
    return ROTORS[request.param]


def motion(speed, size, highest=3):
    """Harmonics -highest..highest and a static part over one turn: harmonics, static part, time, z, velocity."""
    random = np.random.default_rng(1)
    harmonics = np.arange(-30, 31)  # all that a shift by up to 27 can reach
    amplitude = random.standard_normal((len(harmonics), size, 2)) @ [1, 1j] * (abs(harmonics) <= highest)[:, None]
    static = random.standard_normal(size)
    time = np.arange(256) / 256 * 2 * np.pi / speed
    basis = np.exp(1j * np.outer(time, harmonics) * speed)
    return (
        harmonics,
        amplitude,
        static,
        time,
        basis @ amplitude + static,
        basis @ (1j * harmonics[:, None] * speed * amplitude),
    )


def columns(entries, size, deflection=None):
    """(speed, harmonic, row) harmonics of the force of a table, all speeds in one call."""
    every = [motion(speed, size) for speed in SPEEDS]
    deflection = every[0][2] if deflection is None else deflection
    return apply_entries(entries, np.array([m[1] for m in every]), SPEEDS, every[0][0], deflection)


def mismatch(entries, form, size):
    """Largest difference between the table and form(speed, time, z, velocity) -> (time, row), relative."""
    found, worst = columns(entries, size), 0.0
    for i, speed in enumerate(SPEEDS):
        harmonics, _, _, time, z, velocity = motion(speed, size)
        expected = np.exp(-1j * np.outer(harmonics, time) * speed) @ form(speed, time, z, velocity) / len(time)
        worst = max(worst, np.abs(found[i] - expected).max() / np.abs(expected).max())
    return worst


def at_disc(structure):
    return np.outer(structure.unit(1), structure.unit(1))


def turn(n, w, t):
    return np.exp(1j * n * w * t)[:, None]


def acceleration(w, z):
    """Second derivative of one turn."""
    return np.fft.ifft(-((np.fft.fftfreq(len(z), 1 / len(z))[:, None] * w) ** 2) * np.fft.fft(z, axis=0), axis=0)


def read(axis, motion):
    return motion.real if axis == "x" else motion.imag


def tilt(s):
    return s.unit(1, "tilt")


FORMS = {  # force of the unit amplitude in time, one for each parameter
    "external_damping": [lambda s, w, t, z, v: -v @ at_disc(s)],
    "internal_damping": [lambda s, w, t, z, v: -(v - 1j * w * z) @ at_disc(s)],
    "support_loss": [lambda s, w, t, z, v: z.real @ at_disc(s)],  # along x
    "bearing_coefficients": [
        lambda s, w, t, z, v, q=q, a=a, b=b: -(1j if a == "y" else 1) * read(b, (z, v)[q]) @ at_disc(s)
        for q in (0, 1)
        for a, b in ("xx", "xy", "yx", "yy")
    ],
    "seal": [
        lambda s, w, t, z, v: -(v - 0.45j * w * z) @ at_disc(s),
        # the second derivative in axes that turn at 0.45 w, with its Coriolis and centrifugal parts
        lambda s, w, t, z, v: -(acceleration(w, z) - 0.9j * w * v - 0.45**2 * w**2 * z) @ at_disc(s),
        lambda s, w, t, z, v: -z @ at_disc(s),
        # -F_x = k y and -F_y = -k x, and so for c (Childs 1993, chapter 4)
        lambda s, w, t, z, v: (-z.imag + 1j * z.real) @ at_disc(s),
        lambda s, w, t, z, v: (-v.imag + 1j * v.real) @ at_disc(s),
    ],
    "shaft_damping": [lambda s, w, t, z, v: -(v - 1j * w * z) @ s.stiffness],
    "unbalance": [lambda s, w, t, z, v: 2.0 * w**2 * turn(1, w, t) * s.unit(1)],
    "couple_unbalance": [lambda s, w, t, z, v: w**2 * turn(1, w, t) * tilt(s)],
    # the load at the node that bends the shaft by one there
    "bow": [lambda s, w, t, z, v: turn(1, w, t) * s.unit(1) / np.linalg.inv(s.stiffness)[0, 0]],
    "added_mass": [lambda s, w, t, z, v: (9.81 - acceleration(w, z)) @ at_disc(s)],
    "stiffness_error": [lambda s, w, t, z, v: -z @ s.stiffness],
    "support_stiffness": [lambda s, w, t, z, v: -z @ at_disc(s)],
    "gyroscopic_error": [lambda s, w, t, z, v: 1j * w * v @ s.gyroscopic],
    "speed_error": [lambda s, w, t, z, v: -2 * acceleration(w, z) @ s.mass + 2j * w * v @ s.gyroscopic],
    "support_anisotropy": [lambda s, w, t, z, v: (-z.real + 1j * z.imag) @ at_disc(s)],  # x is stiff, y soft
    "cross_coupling": [lambda s, w, t, z, v: (-z.imag + 1j * z.real) @ at_disc(s)],
    # the stiffness that x has more, y less, of an observer who turns with the shaft
    "shaft_asymmetry": [lambda s, w, t, z, v: -turn(1, w, t) * (z * turn(-1, w, t)).conj() @ s.stiffness],
    "parallel_misalignment": [lambda s, w, t, z, v, n=n: turn(n, w, t) * s.unit(1) for n in (2, 1, 3)],
    "angular_misalignment": [lambda s, w, t, z, v, n=n: turn(n, w, t) * tilt(s) for n in (1, 2)],
    "static_preload": [lambda s, w, t, z, v: turn(0, w, t) * s.unit(1)],
    "gravity_direction": [lambda s, w, t, z, v: turn(0, w, t) * 1j * 2.0 * 9.81 * s.unit(1)],
    # minus mass times acceleration of the base, which is -w^2 e^{jwt}
    "base_motion": [lambda s, w, t, z, v: 2.0 * w**2 * turn(1, w, t) * s.unit(1)],
}
SHOWN = {  # what the probe shows in addition
    "runout": [lambda w, t, z, v: turn(1, w, t)],
    "sensor_gap": [lambda w, t, z, v: turn(0, w, t)],
    "probe_gain": [lambda w, t, z, v: z.real + 1j * z.imag, lambda w, t, z, v: z.real - 1j * z.imag],
    "probe_angle": [lambda w, t, z, v: z.imag - 1j * z.real, lambda w, t, z, v: -1j * z.real],
    "probe_error": [lambda w, t, z, v: z.real, lambda w, t, z, v: z.imag],  # of x alone
    "swapped_probes": [lambda w, t, z, v: z.imag + 1j * z.real - z],
    "reversed_probe": [lambda w, t, z, v: -z.real + 1j * z.imag - z],
    "probe_vibration": [  # of x alone
        lambda w, t, z, v: np.cos(w * t)[:, None],
        lambda w, t, z, v: -np.sin(w * t)[:, None],
    ],
    "phase_reference": [lambda w, t, z, v: v / w],
    "delay": [lambda w, t, z, v: -v],
}


def parameters_of(name, structure, **options):
    return make_term("effect", {"kind": name, **options}, structure, structure.nodes).parameters


def check_form(parameters, forms, size):
    for parameter, form in zip(parameters, forms, strict=True):
        assert mismatch(parameter.entries, form, size) < ROUND_OFF
        off = [entry.times(1 + 1e-6) for entry in parameter.entries]
        assert mismatch(off, form, size) > ROUND_OFF


def has_place(name, structure):
    return registry().get("effect", name).places(structure, structure.nodes)


@pytest.mark.parametrize("name, rotor", [(n, r) for n in FORMS for r, s in ROTORS.items() if has_place(n, s)])
def test_effect_is_the_equation_of_its_source(name, rotor):
    structure = ROTORS[rotor]
    forms = [lambda *given, form=form: form(structure, *given) for form in FORMS[name]]
    check_form(parameters_of(name, structure), forms, len(structure.dofs))


@pytest.mark.parametrize("name", SHOWN)
def test_probes_show_what_their_source_says(name):
    check_form(parameters_of(name, ROTORS["plain"]), SHOWN[name], 1)


def test_every_effect_has_its_equation_written_a_second_time():
    elsewhere = {"crack_force", "breathing_crack", "breathing_crack_weight", "hysteretic_damping", "ac_coupling"}
    elsewhere |= {"pedestal_resonance"}
    assert set(registry().plugins["effect"]) == {*FORMS, *SHOWN, *elsewhere, *LOCAL}


@pytest.mark.parametrize("name, weight_dominance", [("breathing_crack", False), ("breathing_crack_weight", True)])
def test_breathing_crack_takes_stiffness_while_it_is_open(name, weight_dominance, structure):
    series = registry().get("crack", "switching").series(15)

    def form(speed, time, z, _):
        along = turn(1, speed, time)
        opening = sum(s * along**k for k, s in series.items()).real
        z = motion(speed, len(structure.dofs))[2] + 0 * z if weight_dominance else z
        return opening * along * (z / along).real @ pattern.T

    for parameter in parameters_of(name, structure):
        pattern = structure.stiffness_loss[parameter.name][0]
        check_form([parameter], [form], len(structure.dofs))


def test_hysteretic_damping_turns_its_sign_where_the_shaft_turns_with_the_whirl():
    (entry,) = parameters_of("hysteretic_damping", ROTORS["plain"])[0].entries
    factor = entry.gain_at(SPEEDS[:, None], HARMONICS) * entry.matrix[0, 0]
    assert factor == pytest.approx(np.tile(-1j * 7.6e5 * np.sign(HARMONICS - 1), (len(SPEEDS), 1)))


def test_ac_coupling_loses_the_mean_and_leads_by_45_degrees_at_its_corner():
    (entry,) = parameters_of("ac_coupling", ROTORS["plain"], corner_rad_per_s=90.0)[0].entries
    kept = 1 + entry.gain_at(SPEEDS[:, None], HARMONICS)
    assert np.abs(kept[:, 0]).max() < 1e-15
    assert kept[0, 1] == pytest.approx(np.exp(0.25j * np.pi) / np.sqrt(2))
    assert kept[:, HARMONICS == -1] == pytest.approx(kept[:, HARMONICS == 1].conj())  # x and y pass alike
    assert np.abs(kept[:, HARMONICS == 7] - 1).max() < 0.15


@pytest.mark.parametrize("crack", CRACKS, ids=lambda c: c.name)
@pytest.mark.parametrize("weight_dominance", [True, False])
def test_crack_is_the_stiffness_lost_along_a_direction_that_turns(crack, structure, weight_dominance):
    size, series = len(structure.dofs), crack_series(crack, 15, crack.example)

    def force(sign):
        def form(speed, time, z, _):
            turned = np.exp(1j * speed * time)[:, None]
            xi, eta, both = sum(s[:, None, None] * turned**k for k, s in series.items()).real
            z = motion(speed, size)[2] + 0 * z if weight_dominance else z  # the static deflection alone
            along, across = (z / turned).real, (z / turned).imag
            lost = xi * along + both * across + 1j * (both * along + eta * across)
            return sign * turned * lost @ pattern.T

        return form

    for parameter in crack_parameters(crack, structure, weight_dominance, **crack.example):
        pattern = structure.stiffness_loss[parameter.name][0]
        assert mismatch(parameter.entries, force(1), size) < ROUND_OFF
        assert mismatch(parameter.entries, force(-1), size) > 1


def test_crack_force_with_the_factors_of_a_crack_is_that_crack(structure):
    crack, size = registry().get("crack", "switching"), len(structure.dofs)
    factors = dict(zip(range(-9, 12), participation_factors(crack, range(-9, 12), order=9), strict=True))
    series = crack.series(9)
    assert factors == {n: (series.get(n, 0) + series.get(n - 2, 0)) / 2 for n in range(-9, 12)}
    given = registry().get("effect", "crack_force").function(structure, participation=factors)
    for one, other in zip(given, crack_parameters(crack, structure, order=9), strict=True):
        found, expected, fewer = (
            columns(entries, size, np.arange(1.0, size + 1))  # a vertical deflection, as the factors p_n assume
            for entries in (one.entries, other.entries, other.entries[:-2])
        )
        assert np.abs(found - expected).max() < ROUND_OFF * np.abs(expected).max()
        assert np.abs(found - fewer).max() > 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("name", ROTORS)
def test_rotor_is_a_mechanical_system(name):
    found = ROTORS[name]

    def mechanical(s):
        symmetric = all(np.array_equal(m, m.T) and np.isrealobj(m) for m in (s.mass, s.stiffness, s.gyroscopic))
        return symmetric and (np.linalg.eigvalsh(s.mass) > 0).all() and (np.linalg.eigvalsh(s.stiffness) > 0).all()

    assert mechanical(found)
    assert not mechanical(replace(found, mass=-found.mass))
    assert not mechanical(replace(found, stiffness=found.stiffness + 1j))
    for pattern, unit, typical in found.stiffness_loss.values():
        assert (np.linalg.eigvalsh(pattern) >= 0).all() and unit and typical > 0  # a crack cannot stiffen


def surroundings(structure):
    """Known terms that shake the rotor at many harmonics and damp it."""
    factors = dict.fromkeys(map(int, HARMONICS), 0.1)
    losses = registry().get("effect", "crack_force").function(structure, participation=factors)
    items = [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
        {"kind": "crack_force", "participation": factors, **{p.key: p.typical for p in losses}},
    ]
    return tuple(make_term("effect", {**item, "label": "known"}, structure, structure.nodes) for item in items)


def round_trip(kind, parameters, structure, estimator, acts_on="rotor", share=0.7):
    """Estimated over true amplitudes minus one; the truth is a share of the typical values that a fit starts from."""
    values = {p.name: p.typical * (share * np.exp(0.5j) if p.is_complex else share) for p in parameters}
    sought = Term(kind, tuple(parameters), {}, acts_on, "checked")
    true = Model(structure, (*surroundings(structure), replace(sought, values=values)))
    model = Model(structure, (*surroundings(structure), sought))
    harmonics = np.union1d(HARMONICS, forced_harmonics(true))
    shown = measured_response(true, SPEEDS, harmonics)
    spectrum = Spectrum(shown, SPEEDS, harmonics, true.sensors, independent_covariance(np.zeros(shown.shape)))
    names = model.unknown_names()
    expected = true.theta[true.position(names)]
    return registry().get("estimator", estimator).function(Problem(model, spectrum, names)).theta / expected - 1


# forces in time: tests/physics/test_alternating.py and test_transverse_crack.py
LOCAL = {"rub", "looseness", "cubic_stiffness", "transverse_crack"}
AFFINE = [effect for effect in registry().plugins["effect"].values() if effect.name not in LOCAL]


PLACED = [(e, name) for e in AFFINE for name, rotor in ROTORS.items() if e.places(rotor, rotor.nodes)]


def test_only_what_acts_on_tilts_finds_no_place_on_a_rotor():
    """So that the test below leaves nothing out that it could try."""
    without = {(e.name, name) for e in AFFINE for name in ROTORS} - {(e.name, name) for e, name in PLACED}
    assert {name for _, name in without} == {n for n, s in ROTORS.items() if not any(m == "tilt" for _, m in s.dofs)}
    assert {name for name, _ in without} == {"angular_misalignment", "couple_unbalance", "gyroscopic_error"}


@pytest.mark.parametrize(("effect", "rotor"), PLACED, ids=lambda part: getattr(part, "name", part))
def test_effect_comes_back_on_every_rotor_by_every_estimator_that_can(effect, rotor):
    structure = ROTORS[rotor]
    output = effect.acts_on == "output"
    # free crack forces at all harmonics cannot be told apart on the disc that tilts: see the next test
    options = {"harmonics": [1, 3, -1]} if effect.name == "crack_force" else {}
    places = effect.places(structure, structure.nodes)
    # a fit for two losses of a full crack has another minimum 40 % off
    share = 0.95 if effect.name == "breathing_crack" and len(structure.dofs) > 1 else 0.7
    parameters = parameters_of(effect.name, structure, **places[0], **options)
    reads = [np.any(e.matrix[:, 1:]) for p in parameters for e in p.entries if e.reads_motion or e.on == "static"]
    for estimator in ["maximum_likelihood"] if output or any(reads) else ["least_squares", "maximum_likelihood"]:
        off = round_trip(effect.name, parameters, structure, estimator, effect.acts_on, share)
        assert np.abs(off).max() < ROUND_TRIP


def test_both_parts_of_a_complex_amplitude_without_value_are_unknown():
    term = make_term("effect", {"kind": "unbalance"}, ROTORS["plain"], (1,))
    assert Model(ROTORS["plain"], (term,)).unknown_names() == ("eccentricity_real", "eccentricity_imag")


@pytest.mark.parametrize("n", [0, 2])
def test_free_crack_forces_are_refused_where_the_speed_cannot_tell_deflection_and_tilt_apart(n):
    """At 0X, and at 2X for a polar moment twice the diametral one, the tilt has no inertia: one shape at all speeds."""
    parameters = registry().get("effect", "crack_force").function(ROTORS["tilting"], harmonics=[1, n])
    with pytest.raises(UnidentifiableError, match="trade off") as refused:
        round_trip("crack_force", parameters, ROTORS["tilting"], "least_squares")
    assert refused.value.parameters == tuple(f"stiffness_loss_{k}_p{n}[checked]" for k in ("22", "44"))


@pytest.mark.parametrize("crack", CRACKS, ids=lambda c: c.name)
@pytest.mark.parametrize("estimator", ["least_squares", "maximum_likelihood"])
def test_crack_comes_back(crack, structure, estimator):
    parameters = crack_parameters(crack, structure, **crack.example)
    if len(parameters) > 1 and {entry.shift for entry in parameters[0].entries} <= {0, 2}:
        with pytest.raises(UnidentifiableError, match="trade off"):  # as two tests above
            round_trip(crack.name, parameters, structure, estimator)
        return
    assert np.abs(round_trip(crack.name, parameters, structure, estimator)).max() < ROUND_TRIP


@pytest.mark.parametrize("crack", CRACKS, ids=lambda c: c.name)
@pytest.mark.parametrize("estimator", ["least_squares", "maximum_likelihood"])
def test_crack_in_full_comes_back(crack, estimator):
    """Without weight dominance; every harmonic is measured, so that the equations are linear in it."""
    parameters = crack_parameters(crack, ROTORS["plain"], weight_dominance=False, **crack.example)
    assert np.abs(round_trip(crack.name, parameters, ROTORS["plain"], estimator)).max() < ROUND_TRIP


def test_a_table_that_changes_between_simulation_and_identification_does_not_come_back():
    (parameter,) = registry().get("effect", "internal_damping").function(ROTORS["plain"])
    calls = iter(range(10**6))
    fickle = [replace(entry, gain=lambda speed: (1 + next(calls)) * np.ones_like(speed)) for entry in parameter.entries]
    found = round_trip("fickle", [replace(parameter, entries=tuple(fickle))], ROTORS["plain"], "least_squares")
    assert np.abs(found).max() > 1e-3
