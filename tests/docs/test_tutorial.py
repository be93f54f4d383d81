"""The tutorial, run from top to bottom in an empty folder: what it says is found."""

import io
import json
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from rotorstudy.commands.line import main

PAGE = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text()


@pytest.mark.usefixtures("unrendered", "unhidden")  # its pictures are drawn in tests of each command
def test_the_tutorial_finds_and_repairs_what_it_hides(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = io.StringIO()
    with redirect_stdout(said):
        for language, file, text in re.findall(r"```(\w+)(?: file=(\S+))?\n(.*?)```", PAGE, re.DOTALL):
            if text.startswith("effects:"):  # they replace those of the rig
                text = re.sub(r"effects:\n(  - .*\n)+", text, Path("rig.yaml").read_text())
            if language == "yaml":
                Path(file).write_text(text)
            for program, *arguments in map(shlex.split, text.splitlines()) if language == "sh" else ():
                assert program == "rotorstudy" and main(arguments) == 0, arguments
    verdict = json.loads(Path("diagnosis/verdict.json").read_text())
    assert verdict["verdict"] == "cause" and not [f for f in verdict["findings"] if f["severity"] != "note"]
    (cause,) = verdict["causes"]
    assert cause["effect"] == "support_anisotropy" and cause["where"] == {"node": 5}
    found = cause["parameters"]["support_anisotropy"]
    assert abs(found["value"] - 2e5) < 4 * found["std"] < 4e4
    size, std, angle = map(float, re.search(r"plane 3: (\S+) ± (\S+) g mm at (\S+) ±", said.getvalue()).groups())
    assert abs(size - 45) < 4 * std < 4 and abs(angle - 220) < 2
