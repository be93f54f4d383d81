"""How plugins are found, and what is said when one is wrong: the rest of the library stays whole."""

import os
import sys
from pathlib import Path

import pytest

from rotorstudy import RotorstudyError, registry
from rotorstudy.commands.line import main
from rotorstudy.errors import PluginError
from rotorstudy.model.registry import Registry, plugin_folders

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
