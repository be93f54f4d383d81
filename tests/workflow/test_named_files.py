"""What binds a job to its files: figures and tables by name, results by name, and the code that a function needs."""

import os
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from rotorstudy.errors import RotorstudyError
from rotorstudy.presentation.plots import figure, save_figures
from rotorstudy.presentation.tables import write_tables
from rotorstudy.store import dataset, save
from rotorstudy.studies import workflow
from rotorstudy.studies.workflow import called, code_digest, imported_files, named_function, opened, run_script
from thesis.tables import Table

SCRIPT = Path(__file__).parents[2] / "workflow" / "scripts" / "study.py"


class Params(dict):
    """Items by name as attributes, too, as Snakemake has them."""

    __getattr__ = dict.__getitem__


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
    with pytest.raises(RotorstudyError, match="no file is named for the figure: figure_2_4"):
        save_figures(one, [])
    assert list(tmp_path.iterdir()) == []


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
    with pytest.raises(RotorstudyError, match="no table was made for: table_2_2"):
        write_tables(tables, [*paths, tmp_path / "table_2_2.csv"])


def test_results_among_the_inputs_are_opened_by_name(tmp_path):
    for name in ("one", "two"):
        save(dataset({"x": ((), 1.0, "1", name)}, {}), tmp_path / f"{name}.nc")
    paths = [str(tmp_path / f"{name}.nc") for name in ("one", "two")]
    found = opened({"bias": paths[0], "monte_carlo": paths, "config": "a.yaml", "plugins": []})
    assert found["bias"].x.long_name == "one"
    assert {name: data.x.long_name for name, data in found["monte_carlo"].items()} == {"one": "one", "two": "two"}
    assert set(found) == {"bias", "monte_carlo"}


def test_a_function_is_called_with_its_params_and_the_results_among_the_inputs(tmp_path):
    save(dataset({"x": ((), 1.0, "1", "one")}, {}), tmp_path / "one.nc")
    params = {"function": "builtins.dict", "load": "builtins.open", "code": "1f", "rig": "thesis"}
    fake = SimpleNamespace(params=Params(params), input={"bias": str(tmp_path / "one.nc"), "config": "a.yaml"})
    found = called(fake, {}, reasons="why.yaml")
    assert set(found) == {"rig", "bias", "reasons"} and found["rig"] == "thesis" and float(found["bias"].x) == 1


def test_a_job_depends_on_the_module_of_its_function_and_on_no_other_stage():
    def stages(function):
        files = map(Path, imported_files(SCRIPT, function))
        return {f"{file.parent.name}/{file.stem}" for file in files}

    assert callable(named_function("rotorstudy.studies.whirl.whirl"))
    whirl, bias = stages("rotorstudy.studies.whirl.whirl"), stages("rotorstudy.studies.identify.bias")
    assert {"studies/whirl", "studies/common", "response/whirl"} <= whirl
    assert {"studies/identify", "studies/simulate"} <= bias
    others = {f"studies/{name}" for name in ("sensors", "variants", "stability", "weight_dominance", "cracks")}
    for needed in (whirl, bias):
        assert not needed & others
        assert not {name for name in needed if name.partition("/")[0] in ("thesis", "presentation")}
    assert not whirl & {"studies/identify", "studies/simulate"}


def test_what_a_script_names_is_found_with_what_that_imports_inside_functions(tmp_path):
    script = tmp_path / "odd.py"
    script.write_text("def f():\n    from rotorstudy.yaml_file import (  # why\n        read_yaml,\n    )\n")
    assert [Path(file).stem for file in imported_files(script)] == ["errors", "yaml_file"]
    text = Path(workflow.__file__).with_name("unbalance_response.py").read_text(encoding="utf-8")
    inside = tmp_path / "inside.py"
    inside.write_text(text)
    assert {"rig_items", "resonance"} <= {Path(file).stem for file in imported_files(inside)}


def test_a_job_runs_again_after_any_change_of_its_code(tmp_path, monkeypatch):
    """The digest, a param of every rule, depends on the content of each file and on nothing else."""
    files = [tmp_path / "a.py", tmp_path / "b.py"]
    for file in files:
        file.write_text("x = 1\n")
    monkeypatch.setattr(workflow, "imported_files", lambda *_: files)
    before = code_digest(SCRIPT)
    files[0].touch()
    workflow._file_digest.cache_clear()
    assert code_digest(SCRIPT) == before
    files[1].write_text("x = 2\n")
    workflow._file_digest.cache_clear()
    assert code_digest(SCRIPT) != before


def test_a_script_runs_in_a_process_of_its_own_and_its_failure_is_told(tmp_path):
    script, said = tmp_path / "odd.py", tmp_path / "said.txt"
    script.write_text(
        "import os, pathlib, sys\n"
        "pathlib.Path(snakemake.output).write_text(str(os.getpid()))\n"
        "sys.exit(snakemake.params)\n"
    )
    run_script(script, SimpleNamespace(output=str(said), params=0))
    assert int(said.read_text()) != os.getpid()
    with pytest.raises(RotorstudyError, match=r"odd\.py ended with 3; see odd\.log"):
        run_script(script, SimpleNamespace(output=str(said), params=3, log=["odd.log"]))
