"""The page on a machine in a plant, run from top to bottom: what it says is found."""

import json
import re
import shlex
from pathlib import Path

import pytest

from rotorstudy.commands.line import main
from rotorstudy.diagnosis.search import search

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "a_machine_in_a_plant.md").read_text(encoding="utf-8")
TRIED = ("bearing_change", "foundation_change", "unbalance")


@pytest.mark.usefixtures("unrendered", "unhidden", "few_speeds")
def test_the_page_finds_the_worn_bearing(tmp_path, monkeypatch):
    """With two effects instead of all, to save time; the page was written with all."""

    def fewer(model, settings):
        found, failures = search_candidates(model, settings)
        return [one for one in found if one.effect in TRIED], failures

    search_candidates = search.candidates
    monkeypatch.setattr(search, "candidates", fewer)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for text in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL):
        program, *arguments = shlex.split(text)
        assert program == "rotorstudy" and main([*arguments, "--quiet"]) == 0, arguments
    said = (tmp_path / "analysis" / "index.html").read_text(encoding="utf-8")
    assert "first forward mode (2149.3 rpm, 54 % of the speed) has the logarithmic decrement 0.615" in said
    assert "measured at 0.19 of the clearance at 52° from gravity at 4002 rpm" in said
    assert all(
        "Shaft centreline" in Path(name, "index.html").read_text(encoding="utf-8") for name in ("sound", "change")
    )
    sound, change = (json.loads(Path(name, "verdict.json").read_text()) for name in ("sound", "change"))
    assert sound["verdict"] == "nothing" and change["verdict"] == "cause"
    journals = {one["name"]: one for one in change["findings"] if one["name"].startswith("journal")}
    assert journals["journal in place"]["where"] == "bearing NDE" and journals["journal moved"]["where"] == "bearing DE"
    assert journals["journal moved"]["text"] in " ".join(PAGE.replace("\n> ", " ").split())
    (cause,) = change["causes"]
    assert cause["effect"] == "bearing_change" and cause["where"] == {"node": 4, "number": "radial_clearance_m"}
    (found,) = cause["parameters"].values()
    assert abs(found["value"] - 0.35) < 3 * found["std"] < 0.06  # the films of the model are linear
