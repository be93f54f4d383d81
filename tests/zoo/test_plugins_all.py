"""Every plugin of the zoo holds every invariant of its kind; a wrong one of each kind does not."""

import inspect
import subprocess
import sys
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from rotorstudy import Entry, Estimate, Parameter, Term, registry
from rotorstudy.invariants import (
    BrokenInvariant,
    bench_structure,
    broken_invariants,
    check_load,
    check_matrices,
    check_round_trip,
    check_table,
    check_units,
    invariants_of,
)
from rotorstudy.plugins import KINDS, Crack, Effect, Estimator, SpectrumMethod

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
    from rotorstudy.plugins import Hooks

    assert getattr(Hooks, f"rotorstudy_{kind}").__doc__
    assert KINDS[kind].__doc__


@pytest.mark.parametrize(
    ("plugin", "check"),
    [pytest.param(p, check, id=f"{kind}-{p.name}-{check.__name__}") for kind, p in ZOO for check in invariants_of(p)],
)
def test_it_holds_every_invariant_of_its_kind(plugin, check):
    check(plugin)


@pytest.mark.parametrize("plugin", ZOO.plugins["effect"].values(), ids=lambda p: p.name)
def test_its_twins_exist_and_what_separates_them_is_said(plugin):
    for twin, separation in plugin.twins:
        assert twin in ZOO.plugins["effect"] and len(separation) > 10


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
    for plugin in ZOO.plugins[kind].values():
        for option, parameter in list(inspect.signature(plugin.function).parameters.items()):
            assert parameter.annotation is not parameter.empty or option in BY_ENGINE, option
            for name in numbers(parameter.annotation, option):
                unit = name.rsplit("_", 1)[-1]
                assert unit in UNITS, (plugin.name, name)


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

    term = Term("wrong", (Parameter("wrong", "N/m", (Forgetful(np.eye(1)),), 1.0),), {"wrong": 1.0})
    with pytest.raises(BrokenInvariant, match="differ"):
        check_table(term, 1)


def test_an_effect_without_unit_fails():
    with pytest.raises(BrokenInvariant, match="no unit"):
        check_units(Term("wrong", (Parameter("wrong", "", (Entry(np.eye(1)),), 1.0),)))


def test_an_effect_that_does_nothing_fails():
    term = Term("dead", (Parameter("dead", "N/m", (Entry(np.zeros((1, 1))),), 1.0),), {"dead": 1.0})
    with pytest.raises(Exception, match="do not depend on dead"):
        check_round_trip(term, STRUCTURE)


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
