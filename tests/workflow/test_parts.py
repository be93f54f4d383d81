"""Parts of the workflow: index, files by name, what binds a job to its code, pinned versions, locks."""

import json
import os
import re
import subprocess
import sys
import time
import tomllib
from importlib.metadata import distributions
from pathlib import Path

import pandas as pd
import pytest
from one_line_errors import refused
from packaging.requirements import Requirement

from jobs import run
from jobs.index_page import write_index
from jobs.plan import Job
from jobs.report import captioned
from jobs.run import code_digest, imported_files, named_function, opened, run_job
from jobs.shown import write_tables
from rotorstudy import RotorstudyError
from rotorstudy.presentation.pages import Table
from rotorstudy.presentation.plots import figure, save_figures
from rotorstudy.store import dataset, save
from rotorstudy.studies.common import RESULTS
from rotorstudy.studies.plausibility import WORDS
from rotorstudy.yaml_file import read_yaml

ROOT = Path(__file__).parents[2]
WHIRL, BIAS = "rotorstudy.studies.analyses.whirl", "rotorstudy.studies.identify.bias"


def files(folder, *names):
    return [folder / f"{name}.{kind}" for kind in ("png", "svg") for name in names]


def test_a_figure_goes_to_the_files_of_its_name_whatever_their_order(tmp_path):
    wide, narrow = figure(width=5)[0], figure(width=2)[0]
    save_figures({"wide": wide, "narrow": narrow}, files(tmp_path, "narrow", "wide"))
    sizes = {name: (tmp_path / f"{name}.svg").read_text().partition('width="')[2][:3] for name in ("wide", "narrow")}
    assert sizes == {"wide": "360", "narrow": "144"}
    assert all(path.is_file() for path in files(tmp_path, "wide", "narrow"))


def test_a_missing_or_an_extra_figure_is_named_and_nothing_is_written(tmp_path):
    one = {"figure_2_4": figure()[0]}
    with pytest.raises(RotorstudyError, match=r"no figure was made for: figure_2_6 \(made: figure_2_4\)"):
        save_figures(one, files(tmp_path, "figure_2_4", "figure_2_6"))
    refused(lambda: save_figures(one, []), "no file is named for the figure: figure_2_4")
    assert list(tmp_path.iterdir()) == []


def test_a_new_figure_without_a_caption_or_a_function_is_named():
    for stated in ({"kind": "study.spectra"}, {"caption": 3}, None):
        refused(
            lambda stated=stated: captioned("chapter_2", {"orbit": stated}), "'orbit' of chapter_2 needs 'caption:'"
        )
    assert captioned("cracks", {"losses": "Losses."}) == {"losses": {"caption": "Losses."}}
    said = "unknown function 'spectrum' in thesis.figures.study; did you mean 'spectra'? (known: breathing_function, "
    refused(lambda: named_function("thesis.figures.study.spectrum"), said)


def test_a_table_goes_to_the_files_of_its_name_and_a_missing_one_is_named(tmp_path):
    tables = {name: Table(pd.DataFrame({"a": [name]}), name, "A note.") for name in ("table_2_1", "variants")}
    paths = [tmp_path / f"{name}.{kind}" for kind in ("csv", "html") for name in ("variants", "table_2_1")]
    write_tables(tables, paths)
    for name in tables:
        assert (tmp_path / f"{name}.csv").read_text() == f"a\n{name}\n"
        assert f"<h1>{name}</h1>" in (tmp_path / f"{name}.html").read_text()
    scored = Table(pd.DataFrame({"a (µm): thesis": [1.0], "a (µm): status": ["explained"]}), "Scored", "A note.")
    write_tables({"scored": scored}, [tmp_path / "chapter" / "scored.html"], tmp_path / "index.html")
    page = (tmp_path / "chapter" / "scored.html").read_text()
    assert 'href="../index.html"' in page and 'href="../scoreboard.html"' in page
    refused(lambda: write_tables(tables, [*paths, tmp_path / "table_2_2.csv"]), "no table was made for: table_2_2")


def test_results_among_the_inputs_are_opened_by_name(tmp_path):
    for name in ("one", "two"):
        save(dataset({"x": ((), 1.0, "1", name)}, {}), tmp_path / f"{name}.nc")
    paths = [str(tmp_path / f"{name}.nc") for name in ("one", "two")]
    found = opened({"bias": paths[0], "monte_carlo": paths, "config": "a.yaml", "plugins": []})
    assert found["bias"].x.long_name == "one"
    assert {name: data.x.long_name for name, data in found["monte_carlo"].items()} == {"one": "one", "two": "two"}
    assert (found["config"], found["plugins"]) == ("a.yaml", [])  # other files by their paths


def test_a_job_depends_on_the_module_of_its_function_and_on_no_other_stage():
    def stages(function):
        files = map(Path, imported_files("jobs.datasets.compute", function))
        return {f"{file.parent.name}/{file.stem}" for file in files}

    whirl, bias = stages(WHIRL), stages(BIAS)
    assert {"jobs/datasets", "studies/analyses", "studies/common", "response/whirl"} <= whirl
    assert {"studies/identify", "studies/simulate"} <= bias
    others = {"studies/sensors", "studies/cracks", "studies/growth"}
    for needed in (whirl, bias):
        assert not needed & others
        assert not {name for name in needed if name.partition("/")[0] in ("thesis", "presentation")}
    assert not whirl & {"studies/identify", "studies/simulate"}
    assert "studies/analyses" not in bias
    imported_inside = {"plots", "captions"}  # a function
    assert imported_inside <= {Path(file).stem for file in imported_files("rotorstudy.commands.diagnose.run")}


def test_a_job_runs_again_after_any_change_of_its_code(tmp_path, monkeypatch):
    """The digest, a param of every rule, depends on the content of each file and on nothing else."""
    files = [tmp_path / "a.py", tmp_path / "b.py"]
    for file in files:
        file.write_text("x = 1\n")
    monkeypatch.setattr(run, "imported_files", lambda *_: files)
    before = code_digest(WHIRL)
    files[0].touch()
    run._file_digest.cache_clear()
    assert code_digest(WHIRL) == before
    files[1].write_text("x = 2\n")
    run._file_digest.cache_clear()
    assert code_digest(WHIRL) != before


def test_a_job_runs_in_a_process_of_its_own_and_its_failure_is_told(tmp_path):
    """Functions of the standard library in place of one of ours: what is given is passed by name."""
    log, copy = [str(tmp_path / "logs" / "odd.log")], tmp_path / "copy.txt"
    (tmp_path / "one.txt").write_text("1\n")
    copied = Job("copied", "shutil.copyfile", "", {"src": str(tmp_path / "one.txt")}, {"dst": str(copy)})
    run_job(copied, copied.inputs, copied.outputs, {}, 1, log)
    assert copy.read_text() == "1\n"
    refused = Job("odd", "rotorstudy.studies.cracks.load_cracks", "", {"path": "none.yaml"})
    with pytest.raises(RotorstudyError, match=r"odd ended with 1; see .*odd\.log"):
        run_job(refused, refused.inputs, refused.outputs, {}, 1, log)
    assert "error: file 'none.yaml' does not exist" in Path(log[0]).read_text()


def test_every_kind_of_results_and_every_finding_on_a_rig_is_made_somewhere():
    code = {
        file: file.read_text() for folder in ("src/rotorstudy", "workflow") for file in (ROOT / folder).rglob("*.py")
    }
    of_replays = ROOT / "workflow/thesis/templates/results.yaml"
    for stated, function in ((RESULTS, "results"), (of_replays, "replay_results")):
        made = [kind for text in code.values() for kind in re.findall(rf'\b{function}\(\s*"(\w+)"', text)]
        assert sorted(made) == sorted(read_yaml(stated).keys() - {"coordinates"})
    checks = "".join(code[ROOT / "src/rotorstudy/studies" / name] for name in ("plausibility.py", "rig_check.py"))
    findings = re.findall(r"^\w+: (.+?): ", WORDS.read_text(), re.MULTILINE)
    assert sorted(findings) == sorted(re.findall(r'\btold\("(.+?)"', checks))


SUMMARY = "Something <is> missing."


def test_every_page_and_figure_is_linked(tmp_path):
    report = tmp_path / "report.rst"
    files = ["scoreboard.html", "scoreboard.csv", "chapter_2/tables/table_2_1.html", "chapter_2/figures/figure_2_4.png",
             "diagnosis/chapter_3/index.html", "diagnosis/chapter_3/verdict.json", "new_chapter/page.html"]  # fmt: skip
    for file in files:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("status\nreproduced\nreproduced\nexplained\n")
    (tmp_path / "diagnosis/chapter_3/verdict.json").write_text(json.dumps({"summary": SUMMARY}))
    write_index(tmp_path / "index.html", [tmp_path / file for file in files], report)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    links = re.findall(r'href="([^"#]+)"', page)
    assert set(links) == {file for file in files if file.endswith((".html", ".png"))}
    assert "Of 3 printed values: 2 reproduced, 1 explained." in page
    assert "measured records: chapter 3</a></h2>" in page and "<p>Something &lt;is&gt; missing.</p>" in page
    assert page.index("Something &lt;is") < page.index("Of 3 printed")  # what a machine owner wants to know comes first
    assert "**The thesis, recomputed.** Of 3 printed values: 2 reproduced, 1 explained." in report.read_text()
    assert f"chapter 3.** {SUMMARY}" in report.read_text()
    assert "New chapter" in page and "Blind tests" not in page


PIN = re.compile(
    r"^([A-Za-z0-9._-]+)==([^\s;]+)(?: ;[^\\]*)? \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)", re.M
)
OWN = {"rotorstudy", "pip", "setuptools", "wheel"}  # the project, and what makes an environment


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pins(text):
    """{name: version} of the lines that have a hash; every line has to be of one."""
    left = PIN.sub("", text)
    assert all(line.startswith("#") for line in left.splitlines() if line), left[:200]
    return {plain(name): version for name, version, _ in PIN.findall(text)}


def test_every_installed_package_is_pinned_with_hashes(request):
    pinned = pins((request.config.rootpath / "environment.txt").read_text())
    installed = {plain(one.metadata["Name"]): one.version for one in distributions()}
    assert {name: version for name, version in installed.items() if pinned.get(name) != version}.keys() <= OWN


def test_what_the_project_asks_for_is_pinned(request):
    project = tomllib.loads((request.config.rootpath / "pyproject.toml").read_text())
    asked = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    asked += [*project["project"]["optional-dependencies"]["uff"], *project["dependency-groups"]["dev"]]
    pinned = pins((request.config.rootpath / "environment.txt").read_text())
    for one in map(Requirement, asked):
        assert one.specifier.contains(pinned[plain(one.name)], prereleases=True), one


def test_a_line_without_a_hash_is_seen():
    good = "a-b==1.0 \\\n    --hash=sha256:" + "0" * 64 + "\n"
    assert pins(good) == {"a-b": "1.0"}
    for wrong in ("c==1.0\n", "c>=1.0\n", "c==1.0 \\\n    --hash=md5:12\n"):
        with pytest.raises(AssertionError):
            pins(good + wrong)


@pytest.mark.parametrize("name", ["snakemake", "another"])
def test_the_lock_of_a_dead_run_is_removed_and_that_of_a_living_one_kept(name, tmp_path, request):
    lock = tmp_path / ".snakemake" / "locks" / "0.output.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("results/a.nc\n")
    waiting = [sys.executable, "-c", "import time; print(flush=True); time.sleep(600)", name]
    with subprocess.Popen(waiting, cwd=tmp_path, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        call = [sys.executable, str(request.config.rootpath / "workflow" / "unlock.py")]
        said = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True).stderr
        process.kill()
    assert lock.exists() == (name == "snakemake") and said.startswith("locked" if lock.exists() else "unlocked")
    assert (str(process.pid) in said) == lock.exists()


def test_files_from_the_future_get_the_date_of_now_and_no_others(tmp_path, request):
    (tmp_path / "results").mkdir()
    early, late = tmp_path / "results" / "early.nc", tmp_path / "results" / "late.nc"
    for path, seconds in ((early, -3600), (late, 86400)):
        path.write_text(path.name)
        os.utime(path, (time.time() + seconds,) * 2)
    before = early.stat().st_mtime
    call = [sys.executable, str(request.config.rootpath / "workflow" / "unlock.py")]
    said = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True).stderr
    assert said.startswith("dated in the future") and ": 1 files" in said and early.stat().st_mtime == before
    assert abs(late.stat().st_mtime - time.time()) < 60
