"""The page on adding a model, run from top to bottom in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "adding_a_model.md").read_text()
BLOCK = re.compile(r"```(\w+)(?: file=(\S+))?\n(.*?)```", re.DOTALL)


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """The folder after every block was run, and what the shell blocks said."""
    folder = tmp_path_factory.mktemp("page")
    tool = folder / "bin"
    tool.mkdir()
    (tool / "rotorstudy").write_text(f'#!/bin/sh\nexec {sys.executable} -m rotorstudy "$@"\n')
    (tool / "rotorstudy").chmod(0o755)
    path = f"{tool}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "MPLBACKEND": "Agg", "ROTORSTUDY_PLUGINS": "zoo", "PATH": path}
    (folder / "zoo").mkdir()
    said = []
    for language, file, text in BLOCK.findall(PAGE):
        if file:
            (folder / file).write_text(text)
            continue
        run = {"sh": ["sh", "-e", "-c"], "python": [sys.executable, "-c"]}[language]
        found = subprocess.run([*run, text], cwd=folder, env=environment, capture_output=True, text=True, timeout=600)
        assert found.returncode == 0, (text, found.stdout, found.stderr)
        said.append(found.stdout)
    return folder, "\n".join(said)


def test_every_block_runs_and_both_figures_are_there(followed):
    folder, _ = followed
    for name in ("cracks.png", "bearings.png"):
        assert (folder / name).stat().st_size > 5000


def test_the_plugins_of_every_kind_hold_every_invariant(followed):
    _, said = followed
    assert "\nfails" not in said and len(re.findall(r"(\d+) of \1 hold", said)) == 5


def test_the_stiffness_loss_is_found_again_by_the_name_of_the_new_crack(followed):
    _, said = followed
    found = re.findall(r"stiffness_loss +(\S+) ± (\S+)", said)
    assert len(found) == 3  # as it is, by the new estimator, by the new spectrum method
    for value, half in found:
        assert abs(float(value) - 1e5) < 2 * float(half) < 1e4  # twice the 95 % interval


def test_the_new_effect_is_found_again(followed):
    _, said = followed
    value, half = map(float, re.search(r"steam_stiffness +(\S+) ± (\S+)", said).groups())
    assert abs(value - 5e3) < 2 * half < 5e3
