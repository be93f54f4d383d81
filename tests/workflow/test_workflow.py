"""The whole workflow on the tiny configuration, in a copy that a test may edit: complete, repeatable, resumed."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
import yaml
from page_checks import problems

from jobs.settings import read_settings
from rotorstudy.authoring.files import new_plugin
from rotorstudy.studies.config import load_study
from rotorstudy.studies.identify import monte_carlo
from thesis.scoreboard import published

ROOT = Path(__file__).parents[2]
SOME_TARGETS = ["results/chapter_2/monte_carlo/physical/Single_speed_88.nc", "results/chapter_3/identification.nc"]


def command(project, folder, *arguments, config, cores=2):
    """What `subprocess` needs to run Snakemake with the copied package instead of the installed one."""
    base = [sys.executable, "-m", "snakemake", "--snakefile", project / "Snakefile", "--configfile", config]
    # as profiles/default/config.yaml has it
    options = ["--directory", folder, "--cores", cores, "--scheduler", "greedy", "--force-use-threads"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    environment = {**os.environ, "PYTHONPATH": str(project / "src")}
    return {"args": [*map(str, base), *map(str, options), *arguments], "env": environment, **pipes}


def run(project, folder, *arguments, config, cores=2, failing=False):
    """What Snakemake says, and whether it failed as it should."""
    found = subprocess.run(**command(project, folder, *arguments, config=config, cores=cores), timeout=1200)
    assert bool(found.returncode) == failing, found.stdout
    return found.stdout


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A copy of what the workflow is made of, with coarser pictures, which are still wider than a narrow window."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("src", "plugins", "workflow"):
        # bytecode comes along, it saves compiling; but not what another process is just writing
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("*.pyc.*"))
    shutil.copy(ROOT / "Snakefile", folder)
    plots, fine = folder / "src" / "rotorstudy" / "presentation" / "plots.py", '"savefig.dpi": 200'
    assert fine in plots.read_text()
    plots.write_text(plots.read_text().replace(fine, '"savefig.dpi": 110'))
    return folder


@pytest.fixture(scope="module")
def whole(project):
    """The tiny configuration."""
    return project / "workflow" / "config" / "test" / "config.yaml"


@pytest.fixture(scope="module")
def some(whole, tmp_path_factory):
    """One study and one replay of the tiny configuration: all that SOME_TARGETS need, and sooner planned."""
    config = yaml.safe_load(whole.read_text())
    parts = {kind: {one: config[kind][one]} for kind, one in (("studies", "chapter_2"), ("replays", "chapter_3"))}
    path = tmp_path_factory.mktemp("some") / "config.yaml"
    path.write_text(yaml.safe_dump({key: config[key] for key in ("results", "reference")} | parts))
    return path


@pytest.fixture(scope="module")
def built(project, whole, tmp_path_factory):
    folder = tmp_path_factory.mktemp("built")
    run(project, folder, config=whole)
    return folder


def changed_study(project, old, new):
    """Text of the tiny study of Chapter 2 with one change, for a file anywhere."""
    folder = project / "workflow" / "config"
    text = (folder / "test" / "chapter_2.yaml").read_text()
    assert old in text
    return text.replace(old, new).replace("../chapter_2.yaml", str(folder / "chapter_2.yaml"))


def planned(said):
    """Jobs of each rule, from what Snakemake says before it runs or plans them."""
    jobs = {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", said, re.M)}
    assert jobs.pop("total") == sum(jobs.values()) > 0
    return jobs


def test_everything_is_there_and_nothing_is_left_to_do(built, whole, project):
    later = (time.time() + 86400,) * 2  # a file that is only dated anew, as after the clock was set, reruns nothing
    os.utime(project / "workflow" / "config" / "test" / "chapter_7.yaml", later)
    assert "Nothing to be done" in run(project, built, "--dry-run", config=whole)
    assert not list(built.rglob("*.partial*"))
    for kind, least in (("png", 20), ("svg", 20), ("csv", 15), ("nc", 15)):
        assert len(list((built / "results").rglob(f"*.{kind}"))) >= least


def test_every_page_is_sound(built, tmp_path):
    pages = sorted((built / "results").rglob("*.html"))
    assert {"index.html", "scoreboard.html", "errata.html", "advice.html", "table_4_10.html"} <= {p.name for p in pages}
    assert problems(pages, tmp_path) == []
    index = built / "results" / "index.html"
    answers = re.findall("<section>.*?</section>", index.read_text(), re.DOTALL)
    assert answers and all("<img" in answer for answer in answers)
    for page in pages:
        links = re.findall('href="([^"#]+)"', page.read_text())
        assert page == index or os.path.relpath(index, page.parent) in links, page
        assert all((page.parent / link).is_file() for link in links), page


def test_no_rule_needs_the_number_of_cores():
    """A report is made without --cores, and a rule that asks for all of them stops it."""
    assert "workflow.cores" not in (ROOT / "Snakefile").read_text()


def test_scoreboard_has_a_row_for_every_printed_value_and_a_reason_where_it_differs(built):
    scored = pd.read_csv(built / "results" / "scoreboard.csv", dtype={"table": str, "item": str})
    assert len(scored) == len(published(ROOT / "workflow" / "reference")) > 0
    assert set(scored.status) == {"reproduced", "explained", "not reproducible"}
    assert scored[scored.status != "reproduced"].reason.str.len().min() > 40
    assert scored.computed.notna().all()


def test_chapter_4_comes_back_to_the_digit_but_for_one_misprint(built):
    scored = pd.read_csv(built / "results" / "chapter_4" / "scored.csv", dtype={"table": str, "item": str})
    spectra = scored[scored.table != "4.10"]
    # the phases of a whole reference signal are round-off, there and here
    round_off = (spectra.quantity == "reference phase") & spectra.case.str.endswith(", complete cycles")
    other = spectra[~round_off & (spectra.status != "reproduced")]
    assert set(zip(other.table, other.case, other.item, strict=True)) == {("4.2", "20 Hz, complete cycles", "7")}
    exact = scored[(scored.table == "4.10") & (scored.noise_percent == 0)]
    assert len(exact) == 15 and (exact.status == "reproduced").all()


def test_errata_quote_numbers(built):
    errata = pd.read_csv(built / "results" / "errata.csv")
    assert len(errata) >= 15
    assert not errata.evidence.str.contains("[{}]|nan").any()
    text = " ".join(errata.evidence)
    for numbers in (
        "Of 18 printed values 18 are reproduced with the reversed sign, 8 with the right one",
        "the steady state gives 32 with the printed sign, 11 with the right one",
        "Of 18 values the printed headings reproduce 1, the swapped ones 18",
        "1.800 kg, which has 67.9 Hz",
        "With the phases as printed the same harmonics are only within 16 %",
    ):
        assert numbers in text


def test_netcdf_files_carry_units_and_provenance(built):
    paths = list((built / "results").rglob("*.nc"))
    assert len(paths) >= 15
    for path in paths:
        with xr.open_dataset(path) as data:
            for key in ("rotorstudy_version", "git_commit", "configuration_sha256", "plugins", "title"):
                assert key in data.attrs, (path, key)
            for name in [*data.data_vars, *data.coords]:
                assert "units" in data[name].attrs, (path, name)
                assert "long_name" in data[name].attrs, (path, name)


def test_a_killed_run_resumes_on_one_core_with_the_bytes_of_two(built, project, some, tmp_path):
    target = tmp_path / SOME_TARGETS[0]
    log = tmp_path / "results/logs/monte_carlo_physical_chapter_2.log"
    call = command(project, tmp_path, SOME_TARGETS[0], config=some) | {"stdout": subprocess.DEVNULL}
    process = subprocess.Popen(**call, start_new_session=True)
    while not log.exists() and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert log.exists()  # the job had begun
    if target.exists():  # the job may have been quicker than the kill; then the file must be whole
        assert target.read_bytes() == (built / SOME_TARGETS[0]).read_bytes()
    assert list((tmp_path / ".snakemake" / "locks").iterdir())  # which stops a run by itself; `make` removes it first
    unlock = [sys.executable, str(project / "workflow" / "unlock.py")]
    said = subprocess.run(unlock, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True).stderr
    assert said.startswith("unlocked")
    run(project, tmp_path, "--rerun-incomplete", "--", *SOME_TARGETS, config=some, cores=1)
    for name in SOME_TARGETS:
        assert (tmp_path / name).read_bytes() == (built / name).read_bytes()


def test_another_seed_gives_other_numbers(built, project, tmp_path):
    """Negative control of the test above."""
    text = changed_study(project, "  trials: 20", "  trials: 20\n  seed: 1")
    (tmp_path / "study.yaml").write_text(text)
    study = load_study(tmp_path / "study.yaml")
    other = monte_carlo(study, rig="physical", case=Path(SOME_TARGETS[0]).stem)
    with xr.open_dataset(built / SOME_TARGETS[0]) as same:
        assert (other.estimate != same.estimate).all()
        xr.testing.assert_equal(other.without_noise, same.without_noise)


def test_a_mistake_stops_before_anything_runs(project, some, tmp_path):
    (tmp_path / "study.yaml").write_text(changed_study(project, "crack_scales:", "crack_scale:"))
    study = f"studies={{chapter_2: {tmp_path / 'study.yaml'}}}"
    said = run(project, tmp_path, "--config", study, config=some, failing=True)
    assert "Traceback" not in said
    assert "unknown key 'crack_scale'" in said and "did you mean 'crack_scales'" in said
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("folder", ["results", "TMPDIR"])
def test_a_folder_that_cannot_be_written_to_is_a_mistake(tmp_path, monkeypatch, folder):
    monkeypatch.chdir(tmp_path)
    words = "results, where results are written, is not a folder"
    if folder == "TMPDIR":
        monkeypatch.setenv("TMPDIR", str(tmp_path / "missing"))
        words = f"{tmp_path}/missing, stated by TMPDIR, is not a folder"
    else:
        (tmp_path / "results").write_text("a file\n")
    with pytest.raises(SystemExit, match=f"error: {words}"):
        read_settings({"results": "results"})


@contextmanager
def edited(path, old, new):
    """A file with the first of some text replaced, for a while; then it has its content and its date again."""
    before, text = path.stat(), path.read_text()
    assert old in text
    try:
        path.write_text(text.replace(old, new, 1))
        yield
    finally:
        path.write_text(text)
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def test_a_changed_value_reruns_its_dependents_alone(built, project, whole):
    """Jobs are counted."""
    path = project / "workflow" / "config" / "test" / "chapter_7.yaml"
    with edited(path, "trials: {count: 2", "trials: {count: 3"):
        plan = planned(run(project, built, "--dry-run", config=whole))
    assert plan == {"crack_study": 1, "figures_crack_study": 1, "index": 1, "all": 1}


def test_editing_a_plugin_reruns_what_used_it(built, project, whole):
    """Snakemake is told which plugin files a job depends on: an estimator concerns identification, not records."""
    plugin = project / "plugins" / "estimators" / "maximum_likelihood.py"
    with edited(plugin, "\n", "\n# touched by a test\n"):
        os.utime(plugin, (time.time() + 5,) * 2)
        plan = planned(run(project, built, "--dry-run", config=whole))
    assert {"monte_carlo_physical_chapter_2", "identify_chapter_2", "identify_chapter_3"} <= set(plan)
    assert not {"simulate_chapter_2", "spectra_chapter_2", "analyses_chapter_2", "records_chapter_3"} & set(plan)


COMPARISON, FIGURE = "results/compare/comparison.nc", "results/chapter_7/figures/smallest_crack.png"


@pytest.fixture(scope="module")
def continued(built, project, whole, tmp_path_factory):
    """A copy of what was built, with one estimator more and one result damaged, and what a run says that goes on."""
    folder = tmp_path_factory.mktemp("continued")
    new_plugin("estimator", "newcomer", folder / "zoo")
    shutil.copytree(built, folder / "copy")  # a job that fails deletes its figures
    path = folder / "copy" / "results" / "chapter_7" / "limits.nc"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    zoo = f"plugin_folders=[{folder / 'zoo'}]"
    goes_on = ("--keep-going", "--config", zoo, "--", COMPARISON, FIGURE)
    return folder / "copy", run(project, folder / "copy", *goes_on, config=whole, failing=True)


def test_a_damaged_result_is_named_by_the_job_that_reads_it(continued):
    assert "limits.nc: not a readable NetCDF file; a result is made again if you delete" in continued[1]


def test_an_estimator_in_one_file_joins_the_comparison_and_nothing_else_runs_again(built, continued):
    copy, said = continued
    reader = {"figures_crack_study": 1}  # of the damaged result
    assert planned(said) == {"compare_estimates_newcomer_0": 1, "compare": 1, **reader}
    with xr.open_dataset(copy / COMPARISON) as after, xr.open_dataset(built / COMPARISON) as before:
        assert set(after.estimator.values) - set(before.estimator.values) == {"newcomer"}
        shared = {"estimator": before.estimator.values}
        for name in ("bias", "scatter", "rmse", "efficiency", "coverage", "failed"):
            xr.testing.assert_equal(after[name].sel(shared), before[name])
        best = after.efficiency.sel(
            estimator="newcomer", spectrum_method="regression", fault="whole revolutions", noise=1
        )
        assert (best.median("parameter") > 0.3).all()  # six trials know a standard deviation to 30 %
    assert "newcomer" in (copy / "results/compare/ranking.csv").read_text()


def test_the_comparison_knows_what_a_fault_does(built):
    with xr.open_dataset(built / "results/compare/comparison.nc") as data:
        fit = data.sel(estimator="maximum_likelihood", spectrum_method="regression", noise=1)
        over = (fit.efficiency**-0.5).median("parameter")
        assert (over.sel(fault="whole revolutions") < 1.6).all()  # on the bound, as far as six trials tell
        assert (over.sel(fault="1 % outliers") > 5).all()
        off = data.rmse.sel(estimator="maximum_likelihood", fault="whole revolutions", noise=0) / abs(data.true)
        # records without noise or fault give the truth: the fit stops at 1e-4 of its standard deviation, which such
        # records state as round-off; two methods seek the speed or the marks and stop at 1e-4 of it
        searching = ["sine_fit", "order_tracking"]
        assert off.sel(rotor="first test rig").drop_sel(spectrum_method=searching).max() < 1e-6
        assert off.sel(rotor="first test rig").max() < 1e-3
        # harmonics nobody asked for drop out of whole revolutions for most methods, but are noise to robust_regression
        assert off.drop_sel(spectrum_method=[*searching, "robust_regression"]).max() < 1e-6
        assert off.sel(rotor="2-DOF", spectrum_method="robust_regression").max() > 1e-3
