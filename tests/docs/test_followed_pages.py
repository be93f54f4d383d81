"""Pages that a reader follows, run from top to bottom in a folder: what they say is found."""

import io
import json
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from rotorstudy.commands.line import main
from rotorstudy.diagnosis.search import search
from rotorstudy.model.registry import Registry, plugin_folders, using

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"```(\w+)(?: file=(\S+))?\n(.*?)```", re.DOTALL)
TRIED = ("bearing_change", "foundation_change", "unbalance")


def followed(page):
    """What the commands of a page print, in the current folder, where its blocks of a file are written."""
    said = io.StringIO()
    with redirect_stdout(said):
        for language, file, text in BLOCK.findall((ROOT / "docs" / page).read_text(encoding="utf-8")):
            if text.startswith("effects:"):  # they replace those of the rig
                text = re.sub(r"effects:\n(  - .*\n)+", text, Path("rig.yaml").read_text())
            if file:
                Path(file).write_text(text)
                continue
            for program, *arguments in map(shlex.split, text.splitlines()):
                with using(Registry(plugin_folders())):  # a new process would see the files that are there now
                    assert (language, program) == ("sh", "rotorstudy") and main(arguments) == 0, arguments
    return said.getvalue()


@pytest.mark.usefixtures("unrendered", "unhidden")  # its pictures are drawn in tests of each command
def test_the_tutorial_finds_and_repairs_what_it_hides(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = followed("tutorial.md")
    verdict = json.loads(Path("diagnosis/verdict.json").read_text())
    assert verdict["verdict"] == "cause" and not [f for f in verdict["findings"] if f["severity"] != "note"]
    (cause,) = verdict["causes"]
    assert cause["effect"] == "support_anisotropy" and cause["where"] == {"node": 5}
    found = cause["parameters"]["support_anisotropy"]
    assert abs(found["value"] - 2e5) < 4 * found["std"] < 4e4
    size, std, angle = map(float, re.search(r"plane 3: (\S+) ± (\S+) g mm at (\S+) ±", said).groups())
    assert abs(size - 45) < 4 * std < 4 and abs(angle - 220) < 2


@pytest.mark.usefixtures("unrendered", "unhidden", "few_speeds")
def test_the_page_on_a_machine_in_a_plant_finds_the_worn_bearing(tmp_path, monkeypatch):
    """With two effects instead of all, to save time; the page was written with all."""

    def fewer(model, settings):
        found, failures = search_candidates(model, settings)
        return [one for one in found if one.effect in TRIED], failures

    search_candidates = search.candidates
    monkeypatch.setattr(search, "candidates", fewer)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    followed("a_machine_in_a_plant.md")
    folders = ("analysis", "sound", "change")
    analysis, *others = (Path(folder, "index.html").read_text(encoding="utf-8") for folder in folders)
    assert "first forward mode (2149.3 rpm, 54 % of the speed) has the logarithmic decrement 0.615" in analysis
    assert "measured at 0.19 of the clearance at 52° from gravity at 4002 rpm" in analysis
    assert all("Shaft centreline" in page for page in others)
    sound, change = (json.loads(Path(name, "verdict.json").read_text()) for name in ("sound", "change"))
    assert sound["verdict"] == "nothing" and change["verdict"] == "cause"
    journals = {one["name"]: one for one in change["findings"] if one["name"].startswith("journal")}
    assert journals["journal in place"]["where"] == "bearing NDE" and journals["journal moved"]["where"] == "bearing DE"
    page = (ROOT / "docs" / "a_machine_in_a_plant.md").read_text(encoding="utf-8")
    assert journals["journal moved"]["text"] in " ".join(page.replace("\n> ", " ").split())
    (cause,) = change["causes"]
    assert cause["effect"] == "bearing_change" and cause["where"] == {"node": 4, "number": "radial_clearance_m"}
    (found,) = cause["parameters"].values()
    assert abs(found["value"] - 0.35) < 3 * found["std"] < 0.06  # the films of the model are linear


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """What the commands of the page on adding a model print."""
    with pytest.MonkeyPatch.context() as changed:
        changed.chdir(tmp_path_factory.mktemp("page"))
        changed.setenv("ROTORSTUDY_PLUGINS", "")
        return followed("adding_a_model.md")


def test_the_plugins_of_every_kind_hold_every_invariant(models):
    assert "\nfails" not in models and len(re.findall(r"(\d+) of \1 hold", models)) == 5


def test_the_stiffness_loss_is_found_again_by_the_name_of_the_new_crack(models):
    found = re.findall(r"stiffness_loss +(\S+) ± (\S+)", models)
    assert len(found) == 3  # as it is, by the new estimator, by the new spectrum method
    for value, std in found:
        assert abs(float(value) - 1e5) < 4 * float(std) < 1e4


@pytest.mark.parametrize(("name", "true"), [("clamping", 500), ("clamping_phase", 60), ("friction", 1.5)])
def test_the_new_effect_is_found_again(models, name, true):
    """A complex amplitude on a tilt, and a force that is nonlinear in the velocity."""
    value, std = map(float, re.search(rf"\n{name} +(\S+) ± (\S+)", models).groups())
    assert abs(value - true) < 4 * std < 0.01 * true
