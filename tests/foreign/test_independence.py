"""The simulator is independent of the package: it shares no code with what is compared with it (and `lint-imports`)."""

import re
from pathlib import Path

import pytest

import rotorstudy.blind.machines

FOLDERS = Path(rotorstudy.blind.machines.__file__).parent, Path("benchmarks/named_machines")
FILES = [path for folder in FOLDERS for path in sorted(folder.glob("**/*.py"))]


def foreign(text):
    """What a file imports of the project but for the simulator itself, or by name."""
    found = re.findall(r"(?:from|import) ((?:rotorstudy|plugins|workflow)[\w.]*)|(import_module|__import__)", text)
    return [one or other for one, other in found if not f"{one}.".startswith("rotorstudy.blind.machines.")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_nothing_there_imports_the_package(path):
    assert foreign(path.read_text(encoding="utf-8")) == []


def test_the_check_finds_imports():
    text = "def f():\n    from rotorstudy.blind.machinery import x\n    import plugins.crack\n    __import__('os')\n"
    assert foreign(text) == ["rotorstudy.blind.machinery", "plugins.crack", "__import__"]
