"""Every plugin of the library holds every invariant of its kind; for wrong ones see test_negative_controls.py."""

import inspect
import subprocess
import sys
from dataclasses import replace
from typing import get_args

import pytest
from machines import shaft

from rotorstudy import build_model, registry
from rotorstudy.authoring.invariants import invariants_of
from rotorstudy.authoring.invariants.bench import bench_structure

ZOO = registry()
STRUCTURE = bench_structure()
BY_ENGINE = ("structure", "sensors", "angle", "depth_ratio")  # arguments that are no options
UNITS = {"kg", "m", "m2", "m3", "s2", "N", "Pa", "ratio", "share", "xx", "xy", "yx", "yy", "participation", "s", "rad"}


def test_the_whole_zoo_loads():
    assert ZOO.failures == []


@pytest.mark.parametrize(
    ("plugin", "check"),
    [pytest.param(p, check, id=f"{kind}-{p.name}-{check.__name__}") for kind, p in ZOO for check in invariants_of(p)],
)
def test_it_holds_every_invariant_of_its_kind(plugin, check):
    """And no more than it claims: a claim that it does not make is tried too, and must not be true of it."""
    check(plugin)


def bad_confounders(effects):
    """Confounders that do not exist, or lack what separates them."""
    told = [(effect.name, *of) for effect in effects.values() for of in effect.confounders.items()]
    return [(name, other) for name, other, separation in told if other not in effects or len(separation) < 11]


def test_confounders_exist_and_are_told_apart_by_what_one_of_both_says():
    effects = ZOO.plugins["effect"]
    assert bad_confounders(effects) == []
    assert bad_confounders({name: effect for name, effect in effects.items() if name != "runout"})
    assert bad_confounders({**effects, "bow": replace(effects["bow"], confounders={"runout": "size"})})
    told = {(name, other): text for name in effects for other, text in ZOO.confounders(name).items()}
    assert len(told) > 100 and all(told[other, name] == text for (name, other), text in told.items())


def test_places_are_the_nodes_the_sensors_or_the_elements():
    rotor = shaft(0.6, 3)
    free = build_model({"rotor": rotor}).structure
    effects = ZOO.plugins["effect"]

    def found(name):
        return effects[name].places(free, (2, 3))

    assert found("unbalance") == [{"node": node} for node in (1, 2, 3, 4)]
    assert found("probe_gain") == [{"node": node} for node in (2, 3)]
    stretches = [{"element": 1}, {"element": 2}, {"element": 3}]
    stretches += [{"element": 1, "last_element": 2}, {"element": 2, "last_element": 3}]
    whole = {"element": 1, "last_element": 3}
    assert found("internal_damping") == stretches
    # a shaft without supports has no bow at its ends
    assert found("bow") == [{"node": node} for node in (2, 3)] + [*stretches, whole]
    assert (found("transverse_crack"), found("breathing_crack")) == ([{}], [])  # of a solid shaft
    free = build_model({"rotor": {**rotor, "inner_diameter_m": 0.01}}).structure
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
    assert checked > 0


def loaded_modules(code):
    """Top-level modules a fresh interpreter has after some code, that it did not have before."""
    program = f"import sys; before = set(sys.modules); {code}; print(' '.join(sorted(set(sys.modules) - before)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return {module.split(".")[0] for module in done.stdout.split()}


def test_importing_the_package_and_loading_the_zoo_import_nothing_heavy():
    assert loaded_modules("import rotorstudy") <= {"rotorstudy", *sys.stdlib_module_names}
    found = loaded_modules("import rotorstudy; rotorstudy.registry()")
    assert "numpy" in found
    assert not found & {"scipy", "xarray", "matplotlib", "pandas", "pydantic", "netCDF4"}
