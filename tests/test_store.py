"""Files are whole or not there, bring back what was put in to the bit, come out the same twice, and say whence."""

import hashlib
import json
import re
import subprocess
import sys

import numpy as np
import pytest
from one_line_errors import refused

from rotorstudy import __version__, registry
from rotorstudy.presentation.plots import figure, save_figure
from rotorstudy.store import as_complex, atomic, dataset, load, provenance, save, whole_folder, write_text

VALUES = np.array([[1 + 2j, -3e-9j, 0], [np.pi, 1e-300 + 1e300j, -0.5]])


def sample(values=VALUES):
    variables = {"displacement": (("speed", "harmonic"), values, "m", "harmonic"),
                 "misfit": (("speed",), np.array([1.0, 2.0]), "1", "misfit")}  # fmt: skip
    coordinates = {"speed": ([88.0, 308.0], "rad/s", "spin speed"), "harmonic": ([0, 1, -1], "1", "harmonic")}
    return dataset(variables, coordinates, title="sample")


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_write_that_fails_or_writes_nothing_keeps_the_old_file_and_leaves_nothing_behind(tmp_path):
    path = tmp_path / "kept.nc"
    save(sample(), path)
    old = path.read_bytes()
    with pytest.raises((ValueError, TypeError)):  # xarray's own: NetCDF has no type for a dict
        save(sample().assign(bad=("speed", np.array([{}, {}], object))), path)
    with pytest.raises(RuntimeError), atomic(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    with pytest.raises(FileNotFoundError), atomic(path):
        pass
    assert path.read_bytes() == old and names(tmp_path) == ["kept.nc"]
    save(sample(VALUES.conj()), path)
    assert path.read_bytes() != old


def test_what_a_killed_process_left_is_removed_and_what_another_one_writes_is_not(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = [f".{stem}.{process}.partial.txt" for process in (ended.pid, 1) for stem in ("a", "b")]
    for name in left:
        (tmp_path / name).write_text("half")
    write_text(tmp_path / "a.txt", "whole")
    assert names(tmp_path) == sorted([*left[1:], "a.txt"])


@pytest.mark.parametrize("exists", [True, False])
def test_a_temporary_folder_lies_in_one_that_exists_as_that_may_be_a_disk_of_its_own(exists, tmp_path):
    if exists:
        write_text(tmp_path / "out" / "old.txt", "kept")
    with whole_folder(tmp_path / "out") as temporary:
        assert temporary.parent == (tmp_path / "out" if exists else tmp_path)
        write_text(temporary / "figures" / "a.txt", "x")
    assert names(tmp_path) == ["out"] and names(tmp_path / "out") == ["figures", *["old.txt"] * exists]


def test_a_folder_that_cannot_be_made_is_named_as_it_was_given(tmp_path):
    write_text(tmp_path / "file", "x")
    refused(whole_folder(tmp_path / "file" / "out").__enter__, "file/out: cannot be written (Not a directory)")


def test_complex_values_come_back_bit_for_bit_and_real_ones_stay_real(tmp_path):
    save(sample(), tmp_path / "x.nc")
    found = load(tmp_path / "x.nc")
    assert as_complex(found.displacement).tobytes() == VALUES.tobytes()
    assert np.array_equal(as_complex(found.displacement.transpose("part", "harmonic", "speed")), VALUES.T)
    assert found.displacement.dims == ("speed", "harmonic", "part") and found.misfit.dims == ("speed",)
    assert "part" not in sample(VALUES.real).coords
    for name in (*found.data_vars, *found.coords):
        assert found[name].attrs["units"] and found[name].attrs["long_name"]


def test_a_loaded_file_can_be_overwritten_at_once(tmp_path):
    save(sample(), tmp_path / "x.nc")
    save(load(tmp_path / "x.nc").assign_attrs(title="again"), tmp_path / "x.nc")
    assert load(tmp_path / "x.nc").attrs["title"] == "again"


def test_two_saves_are_the_same_bytes_and_another_value_gives_other_ones(tmp_path):
    for name, values in (("a", VALUES), ("b", VALUES), ("c", VALUES + 1e-15)):
        save(sample(values), tmp_path / f"{name}.nc")
    first, second, other = ((tmp_path / f"{name}.nc").read_bytes() for name in "abc")
    assert first == second != other


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_two_pictures_are_the_same_bytes(tmp_path, kind):
    for name in ("a", "b"):
        picture, axes = figure()
        axes[0, 0].plot([1, 2, 3])
        save_figure(picture, tmp_path / f"{name}.{kind}")
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_provenance_has_version_commit_configuration_plugins_and_seed_and_survives_the_file(tmp_path):
    jeffcott, switching = registry().get("rotor", "jeffcott"), registry().get("crack", "switching")
    found = provenance({"b": 2, "a": [1.5, "x"]}, [switching, jeffcott, switching], seed=np.int64(7))
    assert found["seed"] == 7 and "seed" not in provenance({"a": 1})
    assert found["Conventions"].startswith("CF-") and found["rotorstudy_version"] == __version__
    assert re.fullmatch(r"[0-9a-f]{40}.*|not a git checkout", found["git_commit"])
    assert found["plugins"] == f"jeffcott {jeffcott.version}, switching {switching.version}"
    assert found["configuration_sha256"] == hashlib.sha256(json.dumps({"a": [1.5, "x"], "b": 2}).encode()).hexdigest()
    save(sample().assign_attrs(found), tmp_path / "x.nc")
    assert {key: load(tmp_path / "x.nc").attrs[key] for key in found} == found


def test_provenance_depends_on_the_configuration_and_not_on_its_order():
    def digest(configuration):
        return provenance(configuration)["configuration_sha256"]

    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})
    assert digest({"a": 1, "b": 2}) != digest({"a": 1, "b": 3})
    assert digest({0: 0.25, 1: 0.3}) != digest({0: 0.25, 1: 0.31})
    assert digest({"node_of_label": {1: 2, "disc 1": 2}}) != digest({})
