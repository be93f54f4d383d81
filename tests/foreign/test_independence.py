"""The simulator is independent of the package: it shares no code with what it is compared to."""

import ast
from pathlib import Path

import pytest

HERE = Path(__file__).parent
JUDGED = {"rotorstudy", "plugins"}
# the modules that may compare the two
USES_THE_PACKAGE = {
    "test_package_against_foreign.py",
    "test_package_against_foreign_balance.py",
    "test_package_against_foreign_films.py",
    "test_package_against_foreign_places.py",
    "test_package_against_foreign_verdicts.py",
}


def imports(path):
    """Top names of all modules a file imports, also by name through importlib."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "relative" if node.level else node.module.split(".")[0]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) in (
            "import_module",
            "__import__",
        ):
            yield "by name"


INDEPENDENT = sorted(path for path in HERE.glob("**/*.py") if path.name not in USES_THE_PACKAGE)


@pytest.mark.parametrize("path", INDEPENDENT, ids=lambda path: path.name)
def test_nothing_here_imports_the_package(path):
    found = set(imports(path))
    assert not found & (JUDGED | {"relative", "by name"})
    if not path.name.startswith("test_"):
        assert found <= {
            "foreign",
            "numpy",
            "scipy",
            "xarray",
            "dataclasses",
            "collections",
            "functools",
            "json",
            "pathlib",
        }


def test_the_check_finds_imports(tmp_path):
    path = tmp_path / "bad.py"
    path.write_text("def f():\n    from rotorstudy.models import x\n    import plugins.crack\n    __import__('os')\n")
    assert set(imports(path)) == {"rotorstudy", "plugins", "by name"}
