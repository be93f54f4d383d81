"""`rotorstudy new` writes files that work; `rotorstudy check` says what holds in a file and what does not."""

import os
import subprocess
import sys

import pytest
from one_line_errors import refused

from rotorstudy import registry
from rotorstudy.authoring.files import PLACEHOLDERS, check_file, left_to_write, new_plugin
from rotorstudy.errors import PluginError
from rotorstudy.model.kinds import KINDS


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
