"""The simulator is independent of the package: it shares no code with what is compared with it (and `lint-imports`)."""

import ast
from pathlib import Path

import pytest

import rotorstudy.blind.machines

HERE = Path(rotorstudy.blind.machines.__file__).parent
NAMED = Path("benchmarks/named_machines")
FILES = [path for folder in (HERE, NAMED) for path in sorted(folder.glob("**/*.py"))]
OWN = "rotorstudy.blind.machines"
BY_NAME = ("import_module", "__import__")
ALLOWED = {"numpy", "scipy", "xarray", "yaml", "dataclasses", "collections", "functools", "pathlib"}


def imports(path):
    """Names of all modules a file imports, the own ones as `own`, also by name through importlib."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            own = not node.level and f"{node.module}.".startswith(f"{OWN}.")
            yield "own" if own else "relative" if node.level else node.module.split(".")[0]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) in BY_NAME:
            yield "by name"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_nothing_there_imports_the_package(path):
    assert set(imports(path)) <= {*ALLOWED, "own"}


def test_the_check_finds_imports(tmp_path):
    path = tmp_path / "bad.py"
    path.write_text(
        "def f():\n    from rotorstudy.blind.machinery import x\n    import plugins.crack\n    __import__('os')\n"
    )
    assert set(imports(path)) == {"rotorstudy", "plugins", "by name"}
