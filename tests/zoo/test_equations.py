"""Every effect is the equation of its source, written down here a second time; every crack the stiffness it takes."""

import numpy as np
import pytest
from machines import OFFSET_DISC, point
from one_line_errors import refused
from scipy.linalg import sqrtm

from rotorstudy import build_model, eigenvalues, harmonic_response, make_term, registry
from rotorstudy.model.cracks import crack_parameters, crack_series, participation_factors
from rotorstudy.model.entries import apply_entries

ROUND_OFF = 1e-12  # relative: 1e-16 a product, some hundred products and sums
SPEEDS = np.array([90.0, 200.0, 310.0, 450.0])  # below the critical speeds of both rotors
HARMONICS = np.array([0, 1, 2, 3, 5, 7, -1, -3, -5])
ROTORS = {name: build_model({"rotor": one}).structure for name, one in (("plain", point()), ("tilting", OFFSET_DISC))}
# forces in time: tests/physics/test_alternating.py and test_transverse_crack.py
LOCAL = {"rub", "looseness", "support_clearance", "cubic_stiffness", "transverse_crack"}
CRACKS = list(registry().plugins["crack"].values())


def at_disc(structure):
    return np.outer(structure.unit(1), structure.unit(1))


def parameters_of(name, structure, **options):
    return make_term("effect", {"kind": name, **options}, structure, structure.nodes).parameters


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
    velocity = basis @ (1j * harmonics[:, None] * speed * amplitude)
    return harmonics, amplitude, static, time, basis @ amplitude + static, velocity


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
    "mass_proportional_damping": [lambda s, w, t, z, v: -v @ s.mass],
    "stiffness_proportional_damping": [lambda s, w, t, z, v: -v @ s.stiffness],
    "modal_damping": [lambda s, w, t, z, v: -2 * v @ (s.mass @ sqrtm(np.linalg.solve(s.mass, s.stiffness))).T],
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
    "shaft_runout": [lambda w, t, z, v, n=n: turn(n, w, t) for n in (1, -1)],  # of one plane
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
    elsewhere |= {"pedestal_resonance", "bearing_change", "foundation_change"}
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
    shaft = ROTORS["tilting"]
    (entry,) = parameters_of("hysteretic_damping", shaft)[0].entries
    factor = entry.gain_at(SPEEDS[:, None], HARMONICS)[..., None, None] * entry.matrix
    expected = -1j * np.sign(HARMONICS - 1)[:, None, None] * shaft.stiffness
    assert factor == pytest.approx(np.tile(expected, (len(SPEEDS), 1, 1, 1)))


def test_hysteretic_damping_exists_in_frequency_only():
    damped = {"kind": "hysteretic_damping", "loss_factor": 0.01}
    unbalance = {"kind": "unbalance", "eccentricity_m": 1e-5}
    model = build_model({"rotor": point(), "effects": [damped, unbalance]})
    assert np.isfinite(harmonic_response(model, [150.0], HARMONICS)).all()
    refused(lambda: eigenvalues(model, [150.0]), "'loss_factor' makes the model time-varying or frequency-dependent")


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
