"""Every plugin of the zoo keeps the invariants of its kind; plugins made wrong on purpose do not."""

import subprocess
import sys
from dataclasses import replace

import checks
import numpy as np
import pytest

from rotorstudy import Entry, Parameter, build_model, make_term
from rotorstudy.cracks import crack_parameters
from rotorstudy.options import check_options
from rotorstudy.plugins import Bearing, Crack, Effect, Estimator, SpectrumMethod, registry

ZOO = list(registry())
OPTIONS = {  # of rotors whose options cannot all be 1
    "jeffcott": {"mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
    "offset_disc": {
        "mass_kg": 2.0,
        "polar_moment_kg_m2": 0.0048,
        "diametral_moment_kg_m2": 0.0024,
        "a_m": 0.2,
        "b_m": 0.16,
        "diameter_m": 0.015,
    },
}


def of_kind(*kinds):
    return [pytest.param(plugin, id=plugin.name) for kind, plugin in ZOO if kind in kinds]


def get(kind, name):
    return registry().get(kind, name)


def structure_of(rotor):
    options = OPTIONS.get(rotor.name) or checks.required_options(rotor.function, ())
    return rotor.function(**check_options(rotor.function, options, rotor.name))


STRUCTURES = [pytest.param(structure_of(plugin), id=plugin.name) for kind, plugin in ZOO if kind == "rotor"]
JEFFCOTT = structure_of(get("rotor", "jeffcott"))
LINEAR, LIKELY = get("estimator", "least_squares"), get("estimator", "maximum_likelihood")


def surroundings(structure):
    """Known terms that make the rotor shake at many harmonics, and damp it."""
    crack = {"kind": "crack_force", "participation": dict.fromkeys(map(int, checks.HARMONICS), 0.1)}
    loss = {
        p.key: p.typical for p in get("effect", "crack_force").function(structure, participation=crack["participation"])
    }
    items = [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
        {**crack, **loss},
    ]
    return tuple(make_term("effect", {**item, "label": "known"}, structure, structure.nodes) for item in items)


@pytest.mark.parametrize("plugin", of_kind("rotor", "crack", "bearing", "effect", "spectrum", "estimator"))
def test_plugin_says_what_it_is_and_where_from(plugin):
    checks.check_stated(plugin)


def test_the_zoo_loads_whole():
    assert registry().failures == []


@pytest.mark.parametrize("structure", STRUCTURES)
def test_rotor_is_a_mechanical_system(structure):
    checks.check_rotor(structure)


@pytest.mark.parametrize("crack", of_kind("crack"))
def test_crack_opening_and_series_are_one_thing(crack):
    checks.check_crack(crack)


@pytest.mark.parametrize("crack", of_kind("crack"))
@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("weight_dominance", [True, False])
def test_crack_force_is_the_stiffness_lost_along_the_turning_crack(crack, structure, weight_dominance):
    parameters = crack_parameters(crack, structure, weight_dominance)
    series = crack.series(15)

    def form(name, speed, time, z, _):
        pattern = structure.stiffness_loss[name][0]
        z = structure.static_deflection + 0 * z if weight_dominance else z
        turned = np.exp(1j * speed * time)[:, None]
        opening = sum(s * turned**k for k, s in series.items()).real  # the series; its limit is checked above
        return opening * turned * (z / turned).real @ pattern.T

    checks.check_parameters(parameters, len(structure.dofs))
    checks.check_force(parameters, form, len(structure.dofs))


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("effect", of_kind("effect"))
def test_effect_acts_on_harmonics_as_in_time(effect, structure):
    checks.check_effect(effect, structure)


FORMS = {  # force of the unit amplitude, from the equations of the sources
    "external_damping": lambda s, w, t, z, v: -v @ np.outer(s.unit(1), s.unit(1)),
    "internal_damping": lambda s, w, t, z, v: -(v - 1j * w * z) @ np.outer(s.unit(1), s.unit(1)),
    "unbalance": lambda s, w, t, z, v: np.outer(np.exp(1j * w * t), 2.0 * w**2 * s.unit(1)),
    # load at the node that bends it by one there
    "bow": lambda s, w, t, z, v: np.outer(
        np.exp(1j * w * t), s.unit(1) / (s.unit(1) @ np.linalg.inv(s.stiffness) @ s.unit(1))
    ),
    "runout": lambda s, w, t, z, v: np.exp(1j * w * t)[:, None],
    "sensor_gap": lambda s, w, t, z, v: np.ones((len(t), 1)),
}


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("name", FORMS)
def test_effect_is_the_equation_of_its_source(name, structure):
    effect = get("effect", name)
    output = effect.acts_on == "output"
    parameters = effect.function(structure.nodes if output else structure)
    size = 1 if output else len(structure.dofs)
    checks.check_force(parameters, lambda _, *given: FORMS[name](structure, *given), size)
    wrong = [replace(p, entries=tuple(e.times(1.001) for e in p.entries)) for p in parameters]
    with pytest.raises(AssertionError, match="off by"):
        checks.check_force(wrong, lambda _, *given: FORMS[name](structure, *given), size)


def test_crack_force_with_given_factors_is_a_weight_dominant_crack():
    crack = get("crack", "switching")
    series = crack.series(9)
    factors = {n: (series.get(n, 0) + series.get(n - 2, 0)) / 2 for n in range(-9, 12)}
    for structure in (param.values[0] for param in STRUCTURES):
        size = len(structure.dofs)
        given = get("effect", "crack_force").function(structure, participation=factors)
        exact = crack_parameters(crack, structure, order=9)
        for one, other in zip(given, exact, strict=True):
            found = checks.columns(one.entries, checks.SPEEDS, size)
            checks.agree(found, checks.columns(other.entries, checks.SPEEDS, size), checks.ROUND_OFF, "crack force")


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("effect", of_kind("effect", "bearing"))
def test_effect_comes_back_from_a_round_trip(effect, structure):
    estimators = [LIKELY] if getattr(effect, "acts_on", "rotor") == "output" else [LINEAR, LIKELY]
    for estimator in estimators:
        checks.check_round_trip(effect, structure, surroundings(structure), estimator)


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("crack", of_kind("crack"))
def test_crack_comes_back_from_a_round_trip(crack, structure):
    for estimator in (LINEAR, LIKELY):
        checks.check_round_trip(crack, structure, surroundings(structure), estimator)


@pytest.mark.parametrize("crack", of_kind("crack"))
def test_crack_in_full_comes_back_from_a_round_trip(crack):
    """Without weight dominance: every harmonic measured, so the equations are linear in it."""
    for estimator in (LINEAR, LIKELY):
        checks.check_round_trip(crack, JEFFCOTT, surroundings(JEFFCOTT), estimator, weight_dominance=False)


@pytest.mark.parametrize("method", of_kind("spectrum"))
def test_spectrum_is_exact_on_whole_turns(method):
    checks.check_spectrum_exact(method)


@pytest.mark.parametrize("method", of_kind("spectrum"))
def test_spectrum_states_its_covariance_right(method):
    checks.check_spectrum_covariance(method)


NAMES = ("internal_damping", "external_damping", "eccentricity_real", "eccentricity_imag", "stiffness_loss")
MODEL = build_model(
    {
        "rotor": {"kind": "jeffcott", **OPTIONS["jeffcott"]},
        "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": 2.5e5}],
        "effects": [
            {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
            {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
            {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
        ],
    }
)


@pytest.mark.parametrize("estimator", of_kind("estimator"))
def test_estimator_is_exact_without_noise(estimator):
    checks.check_estimator(estimator, MODEL, NAMES)


@pytest.mark.parametrize("estimator", of_kind("estimator"))
def test_estimator_states_its_covariance_right(estimator):
    checks.check_estimator_covariance(estimator, MODEL, NAMES)


# negative controls: the same checks on plugins made wrong


def breathing(angle):
    """Opens and shuts as a cosine."""
    return (1 + np.cos(angle)) / 2


def breathing_series(order):
    return {0: 0.5, 1: 0.25, -1: 0.25}


def test_a_right_crack_passes():
    checks.check_crack(Crack("breathing", breathing, "Mayes", breathing_series))


@pytest.mark.parametrize(
    ("function", "series", "words"),
    [
        (lambda a: 1.01 * breathing(a), breathing_series, "not 0 and 1"),
        (lambda a: breathing(a / 2), breathing_series, "after a turn"),
        (lambda a: breathing(a + 0.01), breathing_series, "that of the opening"),
        (lambda a: breathing(a + np.pi / 2), lambda order: {0: 0.5, 1: 0.25j, -1: 0.25j}, "that of the opening"),
        (breathing, lambda order: {0: 0.5, 1: 0.25}, "conjugate"),
        (breathing, lambda order: {**breathing_series(order), order + 1: 0.0}, "above"),
        (breathing, lambda order: {k: s * (1 - 1e-9 * order) for k, s in breathing_series(order).items()}, "depends"),
        (lambda a: np.full_like(a, np.nan), breathing_series, "nan"),
        (lambda a: 0.5, breathing_series, "shape"),
    ],
)
def test_a_wrong_crack_is_found(function, series, words):
    with pytest.raises(AssertionError, match=words):
        checks.check_crack(Crack("wrong", function, "none", series))


def damper(*entries, unit="N s/m", typical=1.0):
    return Effect("wrong", lambda structure: [Parameter("wrong", unit, entries, typical)], "none")


ONE = np.ones((1, 1))


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (damper(Entry(-ONE, order=1, gain=lambda speed: speed / np.max(speed))), "off by"),  # sees the other speeds
        (damper(Entry(-ONE, order=1), unit=""), "unit"),
        (damper(Entry(-ONE, order=1), typical=0.0), "typical"),
        (damper(Entry(-ONE[0], order=1)), "matrix"),
        (damper(Entry(np.full((1, 1), np.nan))), "off by"),
        (damper(), "no table"),
        (Effect("wrong", lambda structure: [], "none"), "no parameter"),
    ],
)
def test_a_wrong_effect_is_found(effect, words):
    checks.check_effect(damper(Entry(-ONE, order=1)), JEFFCOTT)
    with pytest.raises(AssertionError, match=words):
        checks.check_effect(effect, JEFFCOTT)


def test_an_effect_whose_sign_depends_on_its_surroundings_fails_the_round_trip():
    signs = iter([1, -1])

    def fickle(structure):
        """Not the same table twice: what was simulated is not what is identified."""
        gain = lambda speed: next(signs) * np.ones_like(speed)  # noqa: E731
        return [Parameter("wrong", "N s/m", (Entry(-ONE, order=1, gain=gain),), 10.0)]

    with pytest.raises((AssertionError, StopIteration)):
        checks.check_round_trip(Effect("fickle", fickle, "none"), JEFFCOTT, surroundings(JEFFCOTT), LINEAR)


def test_a_right_bearing_passes_and_a_wrong_one_does_not():
    def plain(structure, node=1):
        """Spring and dashpot on the ground."""
        here = np.outer(structure.unit(node), structure.unit(node))
        return [
            Parameter("bearing_stiffness", "N/m", (Entry(-here),), 1e5),
            Parameter("bearing_damping", "N s/m", (Entry(-here, order=1),), 100.0),
        ]

    checks.check_round_trip(Bearing("plain", plain, "none"), JEFFCOTT, surroundings(JEFFCOTT), LINEAR)
    checks.check_effect(Bearing("plain", plain, "none"), JEFFCOTT)
    with pytest.raises(AssertionError, match="distinct"):
        checks.check_effect(Bearing("wrong", lambda structure: 2 * plain(structure), "none"), JEFFCOTT)


def test_a_wrong_rotor_is_found():
    checks.check_rotor(JEFFCOTT)
    for wrong in ({"mass": -JEFFCOTT.mass}, {"stiffness": -JEFFCOTT.stiffness}, {"mass": 1j * JEFFCOTT.mass}):
        with pytest.raises(AssertionError):
            checks.check_rotor(replace(JEFFCOTT, **wrong))


def changed(plugin, change):
    """The spectrum method with its result changed."""
    return SpectrumMethod("wrong", lambda *given: change(given, *plugin.function(*given)), "none")


@pytest.mark.parametrize("method", of_kind("spectrum"))
def test_a_wrong_spectrum_is_found(method):
    def late(given, amplitude, covariance):
        return amplitude * np.exp(-1j * np.asarray(given[3]) * given[2] * given[1][0]), covariance

    for wrong in (late, lambda given, a, c: (a.conj(), c), lambda given, a, c: (a * (1 + 1e-9), c)):
        with pytest.raises(AssertionError):
            checks.check_spectrum_exact(changed(method, wrong))
    mixed = np.eye(18) + 0.5 * np.eye(18)[::-1]
    for wrong in (lambda given, a, c: (a, 1.2 * c), lambda given, a, c: (a, c @ mixed)):
        with pytest.raises(AssertionError):
            checks.check_spectrum_covariance(changed(method, wrong))


def test_a_wrong_estimator_is_found():
    def off(problem):
        found = LINEAR.function(problem)
        return replace(found, theta=found.theta * (1 + 1e-5))

    def sure(problem):
        found = LINEAR.function(problem)
        return replace(found, covariance=0.8 * found.covariance)

    with pytest.raises(AssertionError, match="off by"):
        checks.check_estimator(Estimator("off", off, "none"), MODEL, NAMES)
    with pytest.raises(AssertionError, match="of the stated"):
        checks.check_estimator_covariance(Estimator("sure", sure, "none"), MODEL, NAMES)


def test_a_nameless_or_silent_plugin_is_found():
    for wrong in (
        Crack("two words", breathing, "Mayes"),
        Crack("breathing", breathing, " "),
        Crack("breathing", lambda angle: angle, "Mayes"),
    ):
        with pytest.raises(AssertionError):
            checks.check_stated(wrong)


# what loading costs


def imported_by(code):
    found = subprocess.run(
        [sys.executable, "-c", f"import sys; before = set(sys.modules); {code}; print(*(set(sys.modules) - before))"],
        capture_output=True,
        text=True,
        check=True,
    )
    return {name.split(".")[0] for name in found.stdout.split()}


def test_loading_the_zoo_imports_nothing_heavy():
    heavy = {"scipy", "xarray", "matplotlib", "pandas", "pydantic", "netCDF4"}
    assert not imported_by("from rotorstudy import registry; assert registry().plugins['crack']") & heavy
    assert "scipy" in imported_by("import scipy.sparse")  # the probe sees what there is


def test_importing_the_package_imports_only_the_standard_library():
    foreign = imported_by("import rotorstudy") - set(sys.stdlib_module_names)
    assert foreign == {"rotorstudy"}
    assert "numpy" in imported_by("from rotorstudy import Entry")
