"""The page on adding a model, run from top to bottom in an empty folder."""

import io
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from rotorstudy.commands.line import main
from rotorstudy.model.registry import Registry, plugin_folders, using

PAGE = (Path(__file__).parents[2] / "docs" / "adding_a_model.md").read_text()
BLOCK = re.compile(r"```(\w+)(?: file=(\S+))?\n(.*?)```", re.DOTALL)


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What the blocks said, each run in one folder."""
    heard = io.StringIO()
    with pytest.MonkeyPatch.context() as changed, redirect_stdout(heard):
        changed.chdir(tmp_path_factory.mktemp("page"))
        changed.setenv("ROTORSTUDY_PLUGINS", "")
        for language, file, text in BLOCK.findall(PAGE):
            if file:
                Path(file).write_text(text)
                continue
            for program, *arguments in map(shlex.split, text.splitlines()):
                with using(Registry(plugin_folders())):  # a new process would see the files that are there now
                    assert (language, program) == ("sh", "rotorstudy") and main(arguments) == 0, arguments
    return heard.getvalue()


def test_the_plugins_of_every_kind_hold_every_invariant(said):
    assert "\nfails" not in said and len(re.findall(r"(\d+) of \1 hold", said)) == 5


def test_the_stiffness_loss_is_found_again_by_the_name_of_the_new_crack(said):
    found = re.findall(r"stiffness_loss +(\S+) ± (\S+)", said)
    assert len(found) == 3  # as it is, by the new estimator, by the new spectrum method
    for value, std in found:
        assert abs(float(value) - 1e5) < 4 * float(std) < 1e4


@pytest.mark.parametrize(("name", "true"), [("clamping", 500), ("clamping_phase", 60), ("friction", 1.5)])
def test_the_new_effect_is_found_again(said, name, true):
    """A complex amplitude on a tilt, and a force that is nonlinear in the velocity."""
    value, std = map(float, re.search(rf"\n{name} +(\S+) ± (\S+)", said).groups())
    assert abs(value - true) < 4 * std < 0.01 * true
