"""What README and the pages show works as shown, and their numbers and links are right."""

import io
import json
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import foreign_page
import numpy as np
import pandas as pd
import pytest
import yaml
from peers import run as peers

from rotorstudy import build_model, harmonic_response, load_rig, registry
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.search import search
from rotorstudy.model.registry import Registry, plugin_folders, using
from rotorstudy.model.rig import OTHER, SECTIONS
from rotorstudy.studies.rig_check import check_rig
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


def test_the_numbers_beside_other_packages_are_those_of_the_rows():
    rows = pd.read_csv(peers.ROWS)
    for path, text in peers.pages(rows).items():
        assert text == path.read_text(encoding="utf-8"), f"{path.name}: run benchmarks/peers/run.py with --page"
    slower = peers.pages(rows.assign(ratio=0.5 * rows.ratio))  # other rows, other pages
    assert all(text != path.read_text(encoding="utf-8") for path, text in slower.items())


def test_the_costs_of_large_models_are_those_of_the_rows():
    import scaling  # which states the number of threads

    rows = pd.read_csv(scaling.ROWS)
    shown = scaling.PAGE.read_text(encoding="utf-8")
    assert scaling.page(rows) == shown, "run benchmarks/scaling.py --page"
    assert scaling.page(rows.assign(seconds=2 * rows.seconds)) != shown


PAGES = sorted((ROOT / "docs").glob("*.md"))


def dead_links(page, text):
    """Links of a page to files that do not exist, or to headings that their page does not have."""
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if not link.startswith("http")]
    return [link for link in links if not leads_somewhere(page, *link.partition("#")[::2])]


def leads_somewhere(page, file, heading):
    other = page.parent / file if file else page
    if not heading or not other.exists():
        return other.exists()
    headings = re.findall(r"^#+ (.*)", other.read_text(encoding="utf-8"), re.MULTILINE)
    return heading in [re.sub(r"[^\w -]", "", one.lower()).replace(" ", "-") for one in headings]


def test_links_lead_somewhere():
    for page in [*PAGES, ROOT / "README.md", ROOT / "CHANGELOG.md"]:
        assert dead_links(page, page.read_text(encoding="utf-8")) == [], page.name
    text = "[a](nowhere.md#b) [c](#d) [e](https://example.org) [f](index.md) [g](diagnosis.md#settings) [h](api.md#i)"
    assert dead_links(ROOT / "docs" / "index.md", text) == ["nowhere.md#b", "#d", "api.md#i"]


def test_every_page_is_in_the_navigation_of_the_site():
    navigation = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert sorted(name for entry in navigation for name in entry.values()) == [page.name for page in PAGES]


def test_the_page_on_the_rig_file_explains_every_section(tmp_path):
    text = (ROOT / "docs" / "your_rig.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)) == {*SECTIONS, *OTHER}
    (example,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    rig = yaml.safe_load(example.replace("2e7", "2.0e+7").replace("1e-5", "1.0e-5"))
    assert abs(harmonic_response(build_model(rig), [100.0], [1])[0, 0, 12]) > 1e-7  # its unbalance moves the disc
    (tmp_path / "rig.yaml").write_text(example, encoding="utf-8")
    assert {finding.name for finding in check_rig(tmp_path / "rig.yaml").findings} == {"measurement"}  # it has none


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
