"""Files are whole or not there, bring back what was put in, and come out the same twice."""

import subprocess
import sys

import numpy as np
import pytest

from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import figure, save_figure
from rotorstudy.store import as_complex, atomic, dataset, load, provenance, save, write_text


def sample():
    values = np.array([[1 + 2j, 3 - 4j]])
    return dataset(
        {"displacement": (("speed", "harmonic"), values, "m", "full spectrum")},
        {"speed": ([88.0], "rad/s", "spin speed"), "harmonic": ([1, -1], "1", "harmonic")},
        title="sample",
    )


def test_complex_values_come_back(tmp_path):
    save(sample(), tmp_path / "a.nc")
    found = load(tmp_path / "a.nc")
    assert as_complex(found.displacement).tolist() == [[1 + 2j, 3 - 4j]]
    assert found.displacement.attrs["units"] == "m" and list(found.part.values) == ["real", "imag"]


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with pytest.raises(RuntimeError), atomic(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_what_a_killed_process_left_is_removed_and_what_another_one_writes_is_not(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    names = [f".{stem}.{process}.partial.txt" for process in (ended.pid, 1) for stem in ("a", "b")]
    for name in names:
        (tmp_path / name).write_text("half")
    write_text(tmp_path / "a.txt", "whole")
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*names[1:], "a.txt"])


def test_two_saves_are_the_same_bytes(tmp_path):
    for name in ("a.nc", "b.nc"):
        save(sample(), tmp_path / name)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_two_pictures_are_the_same_bytes(tmp_path, kind):
    for name in ("a", "b"):
        picture, axes = figure()
        axes[0, 0].plot([1, 2, 3])
        save_figure(picture, tmp_path / f"{name}.{kind}")
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_provenance_says_where_a_file_comes_from_and_changes_with_the_configuration():
    plugin = registry().get("crack", "switching")
    found = provenance({"a": 1}, [plugin], seed=5)
    assert found["seed"] == 5 and found["plugins"].startswith("switching ") and len(found["git_commit"]) >= 12
    assert provenance({"a": 2}, [plugin])["configuration_sha256"] != found["configuration_sha256"]
    assert "seed" not in provenance({"a": 1})
