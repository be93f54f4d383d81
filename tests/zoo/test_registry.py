"""How plugins are found, and what is said when one is wrong."""

import os
import subprocess
import sys

import pytest

from rotorstudy.errors import PluginError, RotorstudyError
from rotorstudy.model.registry import Registry

GOOD = '''
from rotorstudy.plugins import Crack, hookimpl


def {name}(angle):
    """Always open."""
    return 0 * angle + 1


@hookimpl
def rotorstudy_crack():
    return Crack("{name}", {name}, source="a test", series=lambda order: {{0: 1.0}})
'''


def write(folder, **files):
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    return folder


def test_a_file_in_a_folder_is_found(tmp_path):
    zoo = Registry([write(tmp_path / "a", mine=GOOD.format(name="mine"))], entry_points=False)
    assert zoo.get("crack", "mine").summary == "Always open."
    assert zoo.get("crack", "mine").file == str(tmp_path / "a" / "mine.py")


def test_folders_may_hold_files_of_the_same_name(tmp_path):
    folders = [write(tmp_path / name, mine=GOOD.format(name=name)) for name in ("a", "b")]
    assert set(Registry(folders, entry_points=False).plugins["crack"]) == {"a", "b"}


def test_two_plugins_of_one_name_clash_and_both_files_are_named(tmp_path):
    folder = write(tmp_path / "a", first=GOOD.format(name="mine"), second=GOOD.format(name="mine"))
    with pytest.raises(PluginError, match=r"two plugins are called crack 'mine': .*first\.py and .*second\.py"):
        Registry([folder], entry_points=False)


def test_a_file_that_does_not_import_is_named_with_its_line_and_the_rest_loads(tmp_path):
    broken = "import numpy as np\n\nx = undefined_name\n"
    folder = write(tmp_path / "a", broken=broken, typo="def f(:\n", good=GOOD.format(name="mine"))
    zoo = Registry([folder], entry_points=False)
    assert "mine" in zoo.plugins["crack"]
    assert len(zoo.failures) == 2
    assert any("broken.py:3: NameError" in failure for failure in zoo.failures)
    assert any("typo.py:1: SyntaxError" in failure for failure in zoo.failures)


def test_an_unknown_name_recalls_what_did_not_load(tmp_path):
    folder = write(tmp_path / "a", broken="1 / 0\n", good=GOOD.format(name="mine"))
    with pytest.raises(
        RotorstudyError, match=r"unknown crack 'mein'.*did you mean 'mine'.*broken\.py:1: ZeroDivisionError"
    ):
        Registry([folder], entry_points=False).get("crack", "mein")


def test_a_misspelt_hook_is_reported_and_does_not_spoil_the_next_file(tmp_path):
    wrong = GOOD.format(name="wrong").replace("def rotorstudy_crack", "def rotorstudy_crak")
    folder = write(tmp_path / "a", a_wrong=wrong, b_good=GOOD.format(name="mine"))
    zoo = Registry([folder], entry_points=False)
    assert len(zoo.failures) == 1 and "a_wrong.py" in zoo.failures[0] and "rotorstudy_crak" in zoo.failures[0]
    assert "mine" in zoo.plugins["crack"]


def test_a_hook_that_returns_something_else_is_reported(tmp_path):
    text = "from rotorstudy.plugins import hookimpl\n\n@hookimpl\ndef rotorstudy_crack():\n    return 'switching'\n"
    zoo = Registry([write(tmp_path / "a", wrong=text)], entry_points=False)
    assert len(zoo.failures) == 1 and "must return a Crack, not str" in zoo.failures[0]


def test_a_hook_that_fails_is_reported(tmp_path):
    text = "from rotorstudy.plugins import hookimpl\n\n@hookimpl\ndef rotorstudy_crack():\n    return 1 / 0\n"
    zoo = Registry([write(tmp_path / "a", wrong=text, good=GOOD.format(name="mine"))], entry_points=False)
    assert len(zoo.failures) == 1 and "wrong.py:5: ZeroDivisionError" in zoo.failures[0]
    assert "mine" in zoo.plugins["crack"]


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(PluginError, match=r"plugin folder '.*none' does not exist"):
        Registry([tmp_path / "none"], entry_points=False)


def run(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **environment}
    ).stdout


LIST = "import rotorstudy; print(sorted(rotorstudy.registry().plugins['crack']), rotorstudy.registry().failures)"


def test_the_variable_names_further_folders(tmp_path):
    folders = [str(write(tmp_path / name, mine=GOOD.format(name=name))) for name in ("one", "two")]
    found = run(LIST, ROTORSTUDY_PLUGINS=os.pathsep.join(folders))
    assert "'one'" in found and "'two'" in found and "'switching'" in found and found.strip().endswith("[]")


def test_an_installed_distribution_is_found_by_entry_point(tmp_path):
    (tmp_path / "their_cracks.py").write_text(GOOD.format(name="theirs"))
    info = tmp_path / "their_cracks-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-cracks\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[rotorstudy]\ntheirs = their_cracks\n")
    found = run(LIST, PYTHONPATH=str(tmp_path))
    assert "'theirs'" in found and found.strip().endswith("[]")
    assert "'theirs'" not in run(LIST)


def test_a_plugin_with_a_matrix_of_the_wrong_shape_or_nan_is_named_with_the_shapes(tmp_path):
    text = """
import numpy as np

from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.plugins import Entry, Parameter


def wrong(structure):
    \"\"\"A spring with too many columns.\"\"\"
    return [Parameter("wrong", "N/m", (Entry(np.array(MATRIX)),), typical=1.0)]


@hookimpl
def rotorstudy_effect():
    return Effect("wrong", wrong, source="a test")
"""
    build = (
        "import rotorstudy; rotorstudy.build_model({'rotor': {'kind': 'jeffcott', 'mass_kg': 1.0, "
        "'stiffness_N_per_m': 1.0}, 'effects': [{'kind': 'wrong', 'wrong_N_per_m': 1.0}]})"
    )
    for matrix, words in (("[[1.0, 2.0]]", "shape (1, 2); on 'z' it must be (1, 1)"), ("[[np.nan]]", "is not finite")):
        folder = write(tmp_path / "a", wrong=text.replace("MATRIX", matrix))
        found = subprocess.run(
            [sys.executable, "-c", build],
            capture_output=True,
            text=True,
            env={**os.environ, "ROTORSTUDY_PLUGINS": str(folder)},
        )
        assert "plugin 'wrong'" in found.stderr and words in found.stderr
