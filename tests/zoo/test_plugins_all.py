"""Every plugin of the zoo holds every invariant of its kind; a wrong one of each kind does not."""

import inspect
import subprocess
import sys
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from rotorstudy import Entry, Estimate, Parameter, Term, registry
from rotorstudy.authoring.invariants import (
    BrokenInvariant,
    bearing_is_what_it_claims,
    bench_structure,
    broken_invariants,
    check_carries,
    check_finite,
    check_load,
    check_matrices,
    check_positive_damping,
    check_round_trip,
    check_symmetric,
    check_table,
    check_units,
    invariants_of,
    numbers_checked,
)
from rotorstudy.errors import PluginError
from rotorstudy.model.kinds import KINDS, Crack, Effect, Estimator, SpectrumMethod
from rotorstudy.model.terms import planar_entries

ZOO = registry()
STRUCTURE = bench_structure()
BY_ENGINE = ("structure", "sensors", "angle", "depth_ratio")  # arguments that are no options
UNITS = {"kg", "m", "m2", "m3", "s2", "N", "Pa", "ratio", "share", "xx", "xy", "yx", "yy", "participation", "s"}


def test_the_whole_zoo_loads():
    assert ZOO.failures == []
    assert {"jeffcott"} <= set(ZOO.plugins["rotor"]) and {"switching"} <= set(ZOO.plugins["crack"])
    effects = {"unbalance", "external_damping", "internal_damping", "bow", "sensor_gap", "runout"}
    assert effects <= set(ZOO.plugins["effect"])
    assert {"regression", "fft"} <= set(ZOO.plugins["spectrum"])
    assert {"least_squares", "maximum_likelihood"} <= set(ZOO.plugins["estimator"])


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_hook_is_documented(kind):
    from rotorstudy.model.kinds import Hooks

    assert getattr(Hooks, f"rotorstudy_{kind}").__doc__
    assert KINDS[kind].__doc__


@pytest.mark.parametrize(
    ("plugin", "check"),
    [pytest.param(p, check, id=f"{kind}-{p.name}-{check.__name__}") for kind, p in ZOO for check in invariants_of(p)],
)
def test_it_holds_every_invariant_of_its_kind(plugin, check):
    check(plugin)


def one_sided_confounders(effects):
    """Twins that do not exist, do not name back, or of which is not said what separates them."""
    return [
        (effect.name, confounder)
        for effect in effects.values()
        for confounder, separation in effect.confounders
        if confounder not in effects or len(separation) < 11 or effect.name not in dict(effects[confounder].confounders)
    ]


def test_twins_name_each_other_and_what_separates_them_is_said():
    effects = ZOO.plugins["effect"]
    assert one_sided_confounders(effects) == []
    assert one_sided_confounders({**effects, "bow": replace(effects["bow"], confounders=())})
    assert one_sided_confounders({name: effect for name, effect in effects.items() if name != "runout"})
    assert one_sided_confounders({**effects, "bow": replace(effects["bow"], confounders=(("runout", "size"),))})


def test_there_are_effects_enough_to_diagnose_with():
    offered = [effect for effect in ZOO.plugins["effect"].values() if effect.candidate]
    assert len(offered) >= 30
    assert {effect.acts_on for effect in offered} == {"rotor", "output"}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"places": lambda structure, sensors: []}, "no place"),
        ({"places": lambda structure, sensors: [{}, {}]}, "twice"),
        ({"places": lambda structure, sensors: [{"node": 7}]}, "own place"),
        ({"shape": {"clearance_m": (0, 1)}}, "no option"),
        ({"shape": {"node": (1, 0)}}, "range"),
        ({"checked": ""}, "'checked' is empty"),
    ],
)
def test_an_effect_that_states_too_little_fails(wrong, said, monkeypatch):
    good = replace(ZOO.get("effect", "external_damping"), name="wrong")
    monkeypatch.setitem(ZOO.plugins["effect"], "wrong", good)
    assert not broken_invariants(good)
    assert said in " ".join(broken_invariants(replace(good, **wrong)).values())


def test_places_are_the_nodes_the_sensors_or_the_elements():
    from rotorstudy import build_model

    rotor = {"kind": "finite_element", "elements": [{"length_m": 0.6, "count": 3}], "outer_diameter_m": 0.02}
    free = build_model({"rotor": rotor}).structure
    effects = ZOO.plugins["effect"]

    def found(name):
        return effects[name].places(free, (2, 3))

    assert found("unbalance") == [{"node": node} for node in (1, 2, 3, 4)]
    assert found("probe_gain") == [{"node": node} for node in (2, 3)]
    assert found("bow") == [{"node": node} for node in (2, 3)]  # a shaft without supports has none at its ends
    assert found("breathing_crack") == [{"element": element} for element in (1, 2, 3)]
    assert found("delay") == [{}, {"node": 2}, {"node": 3}]
    assert effects["couple_unbalance"].places(STRUCTURE, (1,)) == []
    assert effects["gyroscopic_error"].places(STRUCTURE, (1,)) == []
    assert found("stiffness_error") == [{}]


def numbers(annotation, name):
    """Names of the options, and of the keys in them, that hold real numbers."""
    if hasattr(annotation, "__total__"):  # a dict with named keys
        for key, inner in annotation.__annotations__.items():
            yield from numbers(inner, key)
    elif annotation is float:
        yield name
    for part in get_args(annotation):
        yield from numbers(part, name)


@pytest.mark.parametrize("kind", ["rotor", "crack", "depth", "bearing", "effect"])
def test_numbers_among_the_options_have_their_unit_in_the_name(kind):
    checked = 0
    for plugin in ZOO.plugins[kind].values():
        for option, parameter in list(inspect.signature(plugin.function).parameters.items()):
            assert parameter.annotation is not parameter.empty or option in BY_ENGINE, option
            for name in numbers(parameter.annotation, option):
                unit = name.rsplit("_", 1)[-1]
                assert unit in UNITS, (plugin.name, name)
                checked += 1
    assert checked >= len(ZOO.plugins[kind]) / 2 > 0


def test_a_crack_whose_series_is_another_function_fails():
    wrong = Crack(
        "wrong", ZOO.get("crack", "switching").function, source="none", series=lambda order: {0: 0.5, 1: 0.3, -1: 0.3}
    )
    assert broken_invariants(wrong)


def test_a_crack_that_opens_beyond_one_fails():
    wrong = Crack("wrong", lambda a: 0.5 + 0.6 * np.cos(a), source="none", series=lambda n: {0: 0.5, 1: 0.3, -1: 0.3})
    assert broken_invariants(wrong)


def test_a_rotor_that_is_no_mechanical_system_fails():
    for wrong in ({"mass": -STRUCTURE.mass}, {"stiffness": 1j * STRUCTURE.stiffness}, {"static_load": np.zeros(2)}):
        with pytest.raises(BrokenInvariant):
            check_matrices(replace(STRUCTURE, **wrong))
            check_load(replace(STRUCTURE, **wrong))


def test_an_effect_that_means_something_else_in_time_fails():
    class Forgetful(Entry):
        """Its gain in frequency depends on the harmonic, though it claims to exist in time."""

        def gain_at(self, speed, harmonic):
            return np.ones(np.broadcast_shapes(np.shape(speed), np.shape(harmonic))) * (1 + 0.01 * np.asarray(harmonic))

    term = Term("wrong", (Parameter("wrong", "N/m", (Forgetful(np.eye(1), gain=np.ones_like),), 1.0),), {"wrong": 1.0})
    with pytest.raises(BrokenInvariant, match="differ"):
        check_table(term, 1)


def test_an_effect_without_unit_fails():
    with pytest.raises(BrokenInvariant, match="no unit"):
        check_units(Term("wrong", (Parameter("wrong", "", (Entry(np.eye(1)),), 1.0),)))


def test_an_effect_that_does_nothing_fails():
    term = Term("dead", (Parameter("dead", "N/m", (Entry(np.zeros((1, 1))),), 1.0),), {"dead": 1.0})
    with pytest.raises(Exception, match="do not depend on dead"):
        check_round_trip(term, STRUCTURE)


def planar(stiffness=(), damping=(), gain=None):
    """A bearing on the bench with some coefficients {direction: value}."""
    entries = [e for ab, k in dict(stiffness).items() for e in planar_entries(ab, np.array([[-k]]), 0, gain)]
    entries += [e for ab, c in dict(damping).items() for e in planar_entries(ab, np.array([[-c]]), 1, gain)]
    return Term("wrong", (Parameter("wrong", "1", tuple(entries), 1.0),), {"wrong": 1.0}, carries=True)


def test_a_bearing_that_is_not_finite_at_some_speed_fails():
    check_finite(planar({"xx": 1e5}))
    with pytest.raises(PluginError, match="not finite at 150 rad/s"):
        check_finite(planar({"xx": 1e5}, gain=lambda w: np.where(w == 150.0, np.nan, 1.0)))


def test_a_bearing_that_lets_the_shaft_fall_or_lifts_it_fails():
    free = replace(STRUCTURE, stiffness=np.zeros((1, 1)))
    check_carries(planar({"xx": 1e5, "yy": 1e5}), free)
    with pytest.raises(BrokenInvariant, match="falls through"):
        check_carries(planar(damping={"xx": 1e3, "yy": 1e3}), free)
    with pytest.raises(BrokenInvariant, match="rises against its weight"):
        check_carries(planar({"xx": -1e5, "yy": 1e5}), free)


def test_a_bearing_whose_damping_feeds_some_motion_fails():
    spring = {"xx": 1e5, "xy": 3e4, "yx": -3e4, "yy": 2e5}
    check_positive_damping(planar(spring, {"xx": 300.0, "xy": 50.0, "yx": 50.0, "yy": 20.0}))
    with pytest.raises(BrokenInvariant, match="gains energy from its damping"):
        check_positive_damping(planar(spring, {"xx": 300.0, "xy": 90.0, "yx": 90.0, "yy": 20.0}))


def test_a_bearing_that_is_not_symmetric_fails():
    check_symmetric(planar({"xx": 1e5, "xy": 3e4, "yx": 3e4, "yy": 2e5}, {"xx": 300.0}))
    for stiffness, damping in (({"xy": 3e4, "yx": -3e4}, {}), ({}, {"xy": 20.0})):
        with pytest.raises(BrokenInvariant, match="feed a whirl"):
            check_symmetric(planar({"xx": 1e5, **stiffness}, {"xx": 300.0, **damping}))


def test_a_bearing_is_held_to_what_it_claims_and_to_saying_its_checks():
    whirling = next(p for p in ZOO.plugins["bearing"].values() if not p.symmetric)
    bearing_is_what_it_claims(whirling)
    with pytest.raises(BrokenInvariant, match="feed a whirl"):
        bearing_is_what_it_claims(replace(whirling, symmetric=True))
    numbers_checked(whirling)
    with pytest.raises(BrokenInvariant, match="'checked' is empty"):
        numbers_checked(replace(whirling, checked=""))


def test_a_spectrum_that_is_too_sure_fails():
    honest = ZOO.get("spectrum", "regression")

    def overconfident(signal, time, speed, harmonics):
        """A plugin with half the standard deviation it has."""
        amplitude, covariance = honest.function(signal, time, speed, harmonics)
        return amplitude, covariance / 4

    assert broken_invariants(SpectrumMethod("wrong", overconfident, source="none"))


def test_a_spectrum_with_a_wrong_phase_fails():
    def off(signal, time, speed, harmonics):
        """One sample of phase too much."""
        amplitude, covariance = ZOO.get("spectrum", "fft").function(signal, time, speed, harmonics)
        return amplitude * np.exp(1j * np.array(harmonics) * speed * (time[1] - time[0])), covariance

    assert broken_invariants(SpectrumMethod("wrong", off, source="none"))


def test_an_estimator_that_is_off_by_a_thousandth_fails():
    def off(problem):
        """Good, but for one thousandth."""
        good = ZOO.get("estimator", "least_squares").function(problem)
        return Estimate(good.names, good.theta * 1.001, good.covariance, good.misfit)

    assert broken_invariants(Estimator("wrong", off, source="none"))


def test_a_plugin_without_source_fails():
    def nameless(structure):
        return []

    assert broken_invariants(Effect("wrong", nameless, source=""))


def loaded_modules(code):
    """Top-level modules a fresh interpreter has after some code, that it did not have before."""
    program = f"import sys; before = set(sys.modules); {code}; print(' '.join(sorted(set(sys.modules) - before)))"
    return {
        m.split(".")[0]
        for m in subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True
        ).stdout.split()
    }


def test_importing_the_package_imports_nothing_heavy():
    assert loaded_modules("import rotorstudy") <= {"rotorstudy", *sys.stdlib_module_names}


def test_loading_the_zoo_imports_nothing_heavy():
    found = loaded_modules("import rotorstudy; rotorstudy.registry()")
    assert {"numpy", "pluggy"} <= found
    assert not found & {"scipy", "xarray", "matplotlib", "pandas", "pydantic", "netCDF4"}


@pytest.mark.parametrize(
    ("kind", "name", "flag", "broken"),
    [
        ("spectrum", "fft", "any_length", "incomplete turns"),
        ("spectrum", "regression", "tolerates_wrong_speed", "off by a thousandth"),
        ("spectrum", "regression", "tolerates_outliers", "spikes"),
        ("estimator", "least_squares", "uses_covariance", "noisier"),
        ("estimator", "least_squares", "fits_output", "offset of the sensor"),
        ("estimator", "least_squares", "handles_rank_deficiency", "trade off"),
        ("estimator", "maximum_likelihood", "tolerates_outliers", "fifty"),
        ("estimator", "huber", "fits_output", "offset of the sensor"),
        ("estimator", "ridge", "handles_rank_deficiency", "trade off"),
        ("estimator", "weighted_least_squares", "uses_covariance", "noisier"),
    ],
)
def test_a_flag_that_is_not_true_fails_by_its_own_claim_alone(kind, name, flag, broken):
    """The last three deny what they can do: flags that are checked both ways."""
    plugin = ZOO.get(kind, name)
    found = broken_invariants(replace(plugin, **{flag: not getattr(plugin, flag)}))
    assert len(found) == 1 and broken in next(iter(found))


def test_an_estimator_that_is_too_sure_fails():
    def overconfident(problem):
        """Half the standard deviation it has."""
        good = ZOO.get("estimator", "least_squares").function(problem)
        return replace(good, covariance=good.covariance / 4)

    found = broken_invariants(Estimator("wrong", overconfident, source="none"))
    assert any("95 % intervals" in claim for claim in found)


def test_a_method_that_does_not_state_the_jitter_of_its_marks_fails():
    def sure(signal, time, speed, harmonics, marks):
        """Order tracking with the covariance of white noise alone."""
        amplitude, covariance = ZOO.get("spectrum", "order_tracking").function(signal, time, speed, harmonics, marks)
        return amplitude, 0.1 * covariance

    found = broken_invariants(SpectrumMethod("wrong", sure, source="none", uses_marks=True))
    assert any("jitter" in claim for claim in found)
