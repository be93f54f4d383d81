"""The page on adding a model, run from top to bottom in an empty folder."""

import io
import os
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from rotorstudy.commands.line import main
from rotorstudy.model.registry import Registry, plugin_folders, using

PAGE = (Path(__file__).parents[2] / "docs" / "adding_a_model.md").read_text()
BLOCK = re.compile(r"```(\w+)(?: file=(\S+))?\n(.*?)```", re.DOTALL)


def run(language, text):
    """Run a block in this process: as processes of their own, its commands would spend most of the time on imports."""
    if language == "python":
        exec(compile(text, "block of the page", "exec"), {"__name__": "__main__"})
        return
    for program, *arguments in map(shlex.split, text.splitlines()):
        if program == "export":
            os.environ.update(one.split("=") for one in arguments)
        elif program == "mkdir":
            Path(arguments[-1]).mkdir()
        else:
            assert program == "rotorstudy"
            assert main(arguments) == 0, arguments


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """The folder after every block was run, and what the blocks said."""
    folder, said = tmp_path_factory.mktemp("page"), io.StringIO()
    with pytest.MonkeyPatch.context() as changed, redirect_stdout(said):
        changed.chdir(folder)
        changed.setenv("ROTORSTUDY_PLUGINS", "")
        for language, file, text in BLOCK.findall(PAGE):
            if file:
                Path(file).write_text(text)
                continue
            with using(Registry(plugin_folders())):  # a new process would see the files that are there now
                run(language, text)
    return folder, said.getvalue()


def test_every_block_runs_and_the_figure_is_there(followed):
    _folder, _ = followed


def test_the_plugins_of_every_kind_hold_every_invariant(followed):
    _, said = followed
    assert "\nfails" not in said and len(re.findall(r"(\d+) of \1 hold", said)) == 6


def test_the_stiffness_loss_is_found_again_by_the_name_of_the_new_crack(followed):
    _, said = followed
    found = re.findall(r"stiffness_loss +(\S+) ± (\S+)", said)
    assert len(found) == 3  # as it is, by the new estimator, by the new spectrum method
    for value, std in found:
        assert abs(float(value) - 1e5) < 4 * float(std) < 1e4


@pytest.mark.parametrize(
    ("name", "true"), [("tilt_anisotropy", 500), ("tilt_anisotropy_phase", 60), ("dry_friction", 1.5)]
)
def test_the_new_effects_are_found_again(followed, name, true):
    """A complex amplitude on a tilt, and a force that is nonlinear in the velocity."""
    _, said = followed
    value, std = map(float, re.search(rf"{name} +(\S+) ± (\S+)", said).groups())
    assert abs(value - true) < 4 * std < 0.01 * true
