"""What the README shows works as shown."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import foreign_page
import numpy as np
import pytest

from rotorstudy import harmonic_response, load_rig, registry
from rotorstudy.commands.line import main
from thesis.scoreboard import published

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def run(arguments, folder, **environment):
    environment = {**os.environ, "MPLBACKEND": "Agg", **environment}
    # the time is for what hangs; no claim on speed
    return subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=600, env=environment)


def test_the_crack_in_one_file_is_found_and_used(tmp_path, monkeypatch, capsys, command):
    code = next(block for block in blocks("python") if "@Crack" in block)
    (place,) = re.findall(r"Save this as `(\S+)`", README)
    (tmp_path / place).parent.mkdir()
    (tmp_path / place).write_text(code)
    rig = (ROOT / "examples" / "jeffcott.yaml").read_text()
    rig = rig.replace("kind: switching", "kind: jammed\n    open_share: 0.2")
    (tmp_path / "rig.yaml").write_text(rig)
    monkeypatch.chdir(tmp_path)
    assert main(["plugins"]) == 0 and "jammed" in capsys.readouterr().out
    assert main(["simulate", "rig.yaml", "--speeds", "88", "--out", "r.nc"]) == 0
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert "unknown crack" in command("simulate", "../rig.yaml", "--speeds", "88", "--out", "s.nc", status=1).err


def test_the_crack_in_one_file_is_found_by_an_installed_package_too(tmp_path):
    """As README says it: `pip install .`, the file in the folder where one works; and the clone's own cracks named."""
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--target"]
    done = run([*install, str(tmp_path / "site"), str(ROOT)], tmp_path)
    assert done.returncode == 0, done.stderr
    code = next(block for block in blocks("python") if "@Crack" in block)
    (tmp_path / "rotorstudy_plugins").mkdir()
    (tmp_path / "rotorstudy_plugins" / "jammed.py").write_text(code)
    shown = [sys.executable, "-m", "rotorstudy", "plugins", "--kind", "crack"]
    found = run(shown, tmp_path, PYTHONPATH=str(tmp_path / "site"), ROTORSTUDY_PLUGINS=str(ROOT / "plugins" / "cracks"))
    assert found.returncode == 0 and "jammed" in found.stdout and "breathing" in found.stdout, found.stderr


def test_the_python_example_runs_and_draws(tmp_path):
    code = next(block for block in blocks("python") if "load_rig" in block)
    found = run([sys.executable, "-c", code.replace("examples/", f"{ROOT}/examples/")], tmp_path)
    assert found.returncode == 0, found.stderr
    assert (tmp_path / "full_spectrum.png").stat().st_size > 5000


@pytest.mark.usefixtures("unrendered", "few_speeds")  # pictures and curves of these commands have tests of their own
def test_the_shell_examples_run(tmp_path, monkeypatch):
    """In this process: as commands of their own, each would spend more than a second on imports."""
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("rotorstudy ")]
    for line in lines:
        arguments = shlex.split(line.split("#")[0].replace("examples/", f"{ROOT}/examples/"))
        assert main(arguments[1:]) == 0, line
    assert len(lines) >= 5
    verdict = json.loads((tmp_path / "demo" / "diagnosis" / "verdict.json").read_text())
    assert verdict["summary"] in README.replace("\n> ", " ")


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.yaml")), ids=lambda path: path.name)
def test_every_example_rig_vibrates(path):
    model = load_rig(path)
    assert np.isfinite(harmonic_response(model, [88.0], [0, 1, -1])).all()
    if not path.stem.endswith("_diagnosis"):  # those start from a rotor without unbalance: it is what they look for
        assert np.abs(harmonic_response(model, [88.0], [1])).max() > 1e-9


def test_the_readme_counts_printed_values_and_effects_that_are_tried_right():
    count = len(published(ROOT / "workflow" / "reference"))
    assert f"each of {count} printed values" in " ".join(README.split())
    tried = [effect for effect in registry().plugins["effect"].values() if effect.candidate]
    assert f"none of the {len(tried)} effects that are tried" in " ".join(README.split())


def test_the_numbers_of_the_independent_simulator_follow_from_its_cases():
    rows = foreign_page.read_rows()
    for path, text in foreign_page.pages(rows).items():
        assert text == path.read_text(encoding="utf-8"), f"{path.name}: run benchmarks/foreign_page.py"
    page = foreign_page.PAGE
    for mark, some in rows.items():
        assert foreign_page.pages({mark: some[1:]})[page] != page.read_text(encoding="utf-8")
