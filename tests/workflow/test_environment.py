"""environment.txt pins everything that is installed, with hashes, and holds what pyproject.toml asks for."""

import re
import tomllib
from importlib.metadata import distributions

import pytest
from packaging.requirements import Requirement

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
