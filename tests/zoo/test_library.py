"""The library of plugins: found, checked, written anew, shown on its page; a wrong one leaves the rest whole."""

import inspect
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from machines import shaft
from one_line_errors import refused

from jobs.plugin_pages import plugin_library, shown
from jobs.shown import write_tables
from rotorstudy import RotorstudyError, build_model, registry
from rotorstudy.authoring.facts import tables
from rotorstudy.authoring.files import PLACEHOLDERS, check_file, left_to_write, new_plugin
from rotorstudy.authoring.invariants import invariants_of
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.commands.line import main
from rotorstudy.errors import PluginError
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.registry import Registry, plugin_folders, using

CRACK = '''from rotorstudy.plugins import Crack


@Crack(source="a test", series=lambda order: {{0: 1.0}})
def {name}(angle):
    """Always open."""
    return 0 * angle + 1
'''


def write(folder, name, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.py").write_text(text)
    return folder / f"{name}.py"


def alone(*folders):
    return Registry(folders, entry_points=False)


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A folder of installed distributions, which a registry made by Registry(plugin_folders()) sees."""
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in ("a_fake_plugin", "b_fake_plugin"):
        sys.modules.pop(name, None)


def distribution(folder, module, text):
    """An installed distribution with one entry point, as pip leaves it."""
    write(folder, module, text)
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[rotorstudy]\n{module} = {module}\n")


def test_a_file_in_a_folder_is_found_and_its_version_changes_with_it(tmp_path):
    file = write(tmp_path, "mine", CRACK.format(name="mine"))
    found = alone(tmp_path).get("crack", "mine")
    assert (found.summary, found.file) == ("Always open.", str(file))
    first = found.version
    assert alone(tmp_path).get("crack", "mine").version == first
    file.write_text(file.read_text() + "\n# changed\n")
    assert alone(tmp_path).get("crack", "mine").version != first


HOOK = "from rotorstudy.plugins import Crack, Effect, hookimpl\n\n@hookimpl\ndef rotorstudy_crack():\n    return "
MADE = f"{HOOK}[Crack(name, lambda angle: 1 + 0 * angle, 'a test') for name in ('one', 'two')]\n"
WRONG = [
    (MADE.replace("def rotorstudy_crack", "def rotorstudy_crak"), "rotorstudy_crak"),
    (MADE.replace("@hookimpl\n", ""), "write @hookimpl above"),
    (f"{HOOK}1 / 0\n", "a_broken.py:5: ZeroDivisionError"),
    (MADE + CRACK.format(name="wrong"), "rotorstudy_crack and @Crack above a function; state"),
    *((f"{HOOK}{what}\n", "must return a Crack") for what in ("None", "Crack", "[3]", "Effect('e', len, source='a')")),
    (CRACK.format(name="wrong").replace("@Crack", "@Crak"), "a_broken.py:4: NameError: name 'Crak'"),
    (CRACK.format(name="wrong").replace('"a test"', '""'), "Crack 'wrong' has no source; name the paper"),
    *(
        (f"{HOOK}[]\n\n@Effect(source='a test', {stated})\ndef mine(structure):\n    return []\n", words)
        for stated, words in (
            ("base_rate='often'", "base_rate = 'often' in @Effect of 'mine': input should be a valid number"),
            ("fold=0", "fold = 0 in @Effect of 'mine': input should be greater than or equal to 1"),
            ("acts_on='sensors'", "acts_on = 'sensors' in @Effect of 'mine': input should be 'rotor' or 'output'"),
            ("feared={'size': 1}", "key 'feared.largest' is missing in @Effect of 'mine'"),
            ("positive=('drag')", "positive = 'drag' in @Effect of 'mine': input should be a valid boolean"),
            ("shape={'gap_m': 0.1}", "shape.gap_m = 0.1 in @Effect of 'mine': input should be a valid tuple"),
        )
    ),
    (CRACK.format(name="wrong").replace('"a test"', "1 / 0"), "a_broken.py:4: ZeroDivisionError"),
    (
        CRACK.format(name="wrong").replace('source="a test"', 'sourse="a test"'),
        "unknown property 'sourse' in @Crack; did",
    ),
    ("from rotorstudy.plugins import Crack\n\n@Crack\ndef f(angle):\n    return 1\n", "write @Crack(source=...)"),
    ("import numpy as np\n\nx = undefined_name\n", "a_broken.py:3: NameError"),
    ("def f(:\n", "a_broken.py:1: SyntaxError"),
    ("raise ValueError\n", "a_broken.py:1: ValueError"),
    ("raise RuntimeError('')\n", "a_broken.py:1: RuntimeError"),
    ("raise RuntimeError('a\\nb')\n", "a_broken.py:1: RuntimeError: a"),
    ("import json\n\n\njson.loads('{')\n", "a_broken.py:4: JSONDecodeError"),  # not the line of what it calls
    *((f"x = 1\nraise {one}('no')\n", f"a_broken.py:2: {one}: no") for one in ("BaseException", "GeneratorExit")),
    ("x = 1\nraise SystemExit('no')\n", "a_broken.py:2: SystemExit: no"),
]


@pytest.mark.parametrize(("text", "words"), WRONG)
def test_a_file_that_is_wrong_is_named_in_one_line_and_the_rest_loads(tmp_path, text, words):
    broken = write(tmp_path, "a_broken", text)  # before the good one in the order of the folder
    write(tmp_path, "b_good", CRACK.format(name="good"))
    zoo = alone(tmp_path)
    (failure,) = zoo.failures
    assert str(broken) in failure and words in failure and "\n" not in failure
    assert set(zoo.plugins["crack"]) == {"good"}


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(PluginError, match=r"plugin folder '.*none' does not exist"):
        alone(tmp_path / "none")


def test_files_of_one_name_in_folders_of_one_name_both_load(tmp_path):
    """As a user's own cracks/ folder beside the project's."""
    folders = [tmp_path / "one" / "cracks", tmp_path / "two" / "cracks"]
    for folder, name in zip(folders, ("first", "second"), strict=True):
        write(folder, "mine", CRACK.format(name=name))
    zoo = alone(*folders)
    assert zoo.failures == []
    assert set(zoo.plugins["crack"]) == {"first", "second"}


def test_two_plugins_of_one_name_clash_and_both_files_are_named(tmp_path):
    write(tmp_path, "first", CRACK.format(name="mine"))
    write(tmp_path, "second", CRACK.format(name="mine").replace("+ 1", "+ 0.5"))
    with pytest.raises(PluginError, match=r"two plugins are called crack 'mine': .*first\.py and .*second\.py"):
        alone(tmp_path)


def test_a_name_of_the_projects_own_zoo_cannot_be_taken(tmp_path, monkeypatch, capsys):
    mine = write(tmp_path, "mine", CRACK.format(name="switching"))
    monkeypatch.setenv("ROTORSTUDY_PLUGINS", str(tmp_path))
    status, said = main(["plugins"]), capsys.readouterr().err
    assert status == 1 and said.startswith("error: ") and said.count("\n") == 1
    assert str(mine) in said and str(Path("cracks") / "switching.py") in said


def test_the_variable_names_further_folders(tmp_path, monkeypatch):
    for name in ("one", "two"):
        write(tmp_path / name, "mine", CRACK.format(name=name))
    folders = os.pathsep.join(str(tmp_path / name) for name in ("one", "two"))
    monkeypatch.setenv("ROTORSTUDY_PLUGINS", folders)
    assert {"one", "two", "switching"} <= set(registry().plugins["crack"]) and registry().failures == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("\nimport a_module_nobody_has\n", "a_module_nobody_has"),
        (CRACK.format(name="wrong").replace("@Crack", "@Crak"), "name 'Crak' is not defined"),
    ],
)
def test_an_installed_distribution_that_is_wrong_is_named_and_the_next_loads(installed, text, words):
    distribution(installed, "a_fake_plugin", text)
    distribution(installed, "b_fake_plugin", CRACK.format(name="installed"))
    zoo = Registry(plugin_folders())
    assert len(zoo.failures) == 1 and "a_fake_plugin" in zoo.failures[0] and words in zoo.failures[0]
    assert {"switching", "installed"} <= set(zoo.plugins["crack"])


def test_a_module_that_makes_its_plugins_implements_the_hook_of_pluggy(tmp_path):
    write(tmp_path, "made", MADE)
    assert set(alone(tmp_path).plugins["crack"]) == {"one", "two"}


def test_two_plugins_of_one_function_are_taken_from_a_folder_below(tmp_path):
    text = CRACK.format(name="one").replace("@Crack", "@Crack(name='two', source='a test')\n@Crack")
    write(tmp_path / "below" / "deeper", "both", text)
    assert set(alone(tmp_path).plugins["crack"]) == {"one", "two"}


def test_a_folder_listed_twice_is_read_once(tmp_path, monkeypatch):
    write(tmp_path, "mine", CRACK.format(name="listed_twice"))
    monkeypatch.setenv("ROTORSTUDY_PLUGINS", os.pathsep.join([str(tmp_path), "", str(tmp_path / ".." / tmp_path.name)]))
    assert plugin_folders()[1:] == (tmp_path.resolve(),)
    found = set(registry().plugins["crack"])
    monkeypatch.delenv("ROTORSTUDY_PLUGINS")
    assert found == {*registry().plugins["crack"], "listed_twice"}


def test_a_name_far_from_all_is_answered_with_those_known():
    with pytest.raises(RotorstudyError, match=r"^unknown crack 'zzz' \(known: .*switching") as refused:
        registry().get("crack", "zzz")
    assert "did you mean" not in str(refused.value)


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


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_file_works_and_holds_every_invariant(kind, tmp_path):
    path = new_plugin(kind, "brand_new", tmp_path)
    assert left_to_write(path) == [*PLACEHOLDERS] and "# " in path.read_text()  # it is commented
    rows = check_file(path)
    assert len(rows) >= 2 and {row[:2] for row in rows} == {(kind, "brand_new")}
    assert [row for row in rows if row[-1].state == "fails"] == []
    assert "brand_new" not in registry().plugins[kind]  # it was looked at, not added to the zoo of this process


def test_a_file_that_still_says_what_the_template_says_is_reminded(tmp_path, command):
    path = new_plugin("crack", "brand_new", tmp_path)
    assert "note: source and checked in" in command("check", path).out
    path.write_text(path.read_text().replace(PLACEHOLDERS["source"], "a paper"))
    assert left_to_write(path) == ["checked"]


@pytest.mark.parametrize(
    ("kind", "old", "new", "claim"),
    [
        ("crack", "/ 2) ** 2\n", "/ 2) ** 2 + 0.1\n", "between 0 (closed)"),
        ("spectrum", "np.eye(len(lines)) / samples", "np.eye(len(lines)) / samples / 4", "states the covariance"),
    ],
)
def test_a_wrong_file_is_found_out_by_the_right_claim(kind, old, new, claim, tmp_path, command):
    """Of all claims: test_negative_controls.py."""
    path = new_plugin(kind, "brand_new", tmp_path)
    path.write_text(path.read_text().replace(old, new))
    failing = [line for line in command("check", path, status=1).out.splitlines() if line.startswith("fails")]
    assert any(claim in line for line in failing)


DRAG = """import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, Parameter


@Effect(source="drag of a bluff body", checked="on a circular orbit a damper c r w")
def drag(structure, node: int | None = None):
    \"\"\"Drag of a disc in a fluid: force -c |dz/dt| dz/dt.\"\"\"
    force = NonlinearForce(structure.unit(node)[None], lambda z, velocity, still: -np.abs(velocity) * velocity)
    scales = structure.scales
    usual = 0.02 * scales.critical_damping(node) / (scales.frequency * scales.length)
    return [Parameter("drag", "N s^2/m^2", (), typical=usual, force=force)]
"""


def test_a_fault_that_every_check_meets_is_said_once(tmp_path, command):
    path = new_plugin("effect", "drag", tmp_path)
    path.write_text(path.read_text().replace("    here = ", "    here = 1 / 0\n    here = "))
    said, found = command("check", path, status=1).out, json.loads(command("check", path, "--json", status=1).out)
    assert said.count("ZeroDivisionError") == 1 and said.count("for the same reason") == said.count("fails") - 1 > 0
    wrong = [one["wrong"] for one in found["checks"] if one["state"] == "fails"]
    assert len(wrong) == said.count("fails") and all("ZeroDivisionError" in one for one in wrong)  # for a program, each


def test_a_weak_force_in_time_is_not_blamed_for_what_the_bench_is_off_without_it(tmp_path, command):
    (tmp_path / "drag.py").write_text(DRAG)
    assert "fails" not in command("check", tmp_path / "drag.py").out


@pytest.mark.parametrize(
    ("text", "words"),
    [("def f(:", "SyntaxError"), ("x = 1", "contains no plugin"), ("import nothing_here", "No module named")],
)
def test_a_file_that_is_no_plugin_is_told_so(text, words, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(PluginError, match=words):
        check_file(path)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("crak", "mine"), "did you mean 'crack'"),
        (("rgi", "mine"), "did you mean 'rig'"),
        (("crack", "My Crack"), "lower-case"),
        (("crack", "class"), "no keyword of Python"),
        (("crack", "é"), "lower-case"),
        (("crack", "switching"), "exists"),
    ],
)
def test_what_cannot_be_written_is_told(arguments, words, tmp_path):
    refused(lambda: new_plugin(*arguments, tmp_path), words)
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_never_overwritten(tmp_path):
    new_plugin("crack", "brand_new", tmp_path)
    refused(lambda: new_plugin("crack", "brand_new", tmp_path), "choose another name")
    refused(lambda: check_file(tmp_path / "nothing.py"), "does not exist")


def test_a_distribution_installed_with_pip_joins_the_zoo(tmp_path):
    """The real route: build tests/zoo/distribution, install it into a folder, find its crack by entry point."""
    here = os.path.join(os.path.dirname(__file__), "distribution")
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps",
         "--no-index", "--no-build-isolation", "--target", str(tmp_path), here],
        check=True,
    )  # fmt: skip
    code = (
        "import rotorstudy; from rotorstudy.authoring.invariants import outcomes\n"
        "plugin = rotorstudy.registry().get('crack', 'from_a_distribution')\n"
        "failed = [one for one in outcomes(plugin) if one.state == 'fails']\n"
        "print(plugin.file, failed, rotorstudy.registry().failures)"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert found.stdout.split()[0].startswith(str(tmp_path)) and found.stdout.strip().endswith("[] []")


def test_every_plugin_is_on_the_page_with_its_source_and_checks():
    found = tables()
    assert set(found) == set(KINDS)
    for kind, table in found.items():
        assert list(table.name) == sorted(registry().plugins[kind])
        assert table["source"].str.len().min() > 3 and table["checked against"].str.len().min() > 10
    assert found["bearing"].parameters.str.contains("typically").all()
    assert all(found[kind].claims.str.len().max() > 5 for kind in ("spectrum", "estimator", "bearing"))


def test_a_plugin_of_another_folder_is_on_the_page(tmp_path):
    path = new_plugin("bearing", "mine", tmp_path)
    with using(Registry(plugin_folders(), files=[path])):
        row = tables()["bearing"].set_index("name").loc["mine"]
    # ten times the stiffness of the rotor that the page takes its sizes from
    assert "bearing_stiffness_N_per_m (typically 7.6e+06)" in row.parameters
    assert "mine" not in set(tables()["bearing"].name)


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_says_all_that_the_table_says_in_few_columns(kind):
    table = tables()[kind]
    page = shown(table)
    assert list(page["name"].str.split("\n").str[0]) == list(table["name"]) and len(page.columns) <= 4
    for (_, row), (_, facts) in zip(page.iterrows(), table.iterrows(), strict=True):
        said = " ".join(row)
        assert all(part in said for text in facts for part in text.split("; "))


def test_the_page_and_its_table_are_written(tmp_path):
    write_tables(plugin_library(), [tmp_path / "zoo.html", tmp_path / "zoo.csv"])
    page, table = ((tmp_path / f"zoo.{suffix}").read_text() for suffix in ("html", "csv"))
    assert all(plugin.name in page and plugin.name in table for _, plugin in registry())


def test_one_plugin_on_the_command_line(capsys, command):
    said = command("plugins", "--name", "short_journal").out
    for words in ("bearing short_journal", "load_N", "viscosity_Pa_s", "bearing_scale", "source"):
        assert words in said
    assert main(["plugins", "--name", "linear"]) == main(["plugins", "--name", "finite_element"]) == 0
    said = capsys.readouterr().out  # the keys of every choice, and those inside lists
    assert "isotropic or anisotropic" in said and "bearing_stiffness_xy_N_per_m" in said
    assert "discs with node, mass_kg?" in said
    assert "did you mean 'short_journal'" in command("plugins", "--name", "short_jurnal", status=1).err
