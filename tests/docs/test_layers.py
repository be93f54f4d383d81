"""Imports point one way, as pyproject.toml declares; the package knows no model by name."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import rotorstudy.plugins
from rotorstudy import registry

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "rotorstudy"
PACKAGE = sorted(SOURCE.rglob("*.py"))
PLUGINS = sorted((ROOT / "plugins").rglob("*.py"))
TEMPLATES = sorted((SOURCE / "authoring" / "templates").glob("*.py"))
GENERAL = sorted(
    path for path in PACKAGE if path.relative_to(SOURCE).parts[0] != "blind" and not path.name.startswith("chapter_")
)  # blind/ writes the answers that a diagnosis must give, which are names; Chapter 7 is about one model

NAMED = {  # what the package may name: a dimension, parts of rigs, defaults of studies, and parts of rotors of ROSS
    "phase_reference", "internal_damping", "unbalance", "regression", "maximum_likelihood",
    "least_squares", "finite_element", "linear", "speed_tabulated", "flexible_pedestal", "seal",
    "stiffness_proportional_damping",
}  # fmt: skip


def imported(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def strings(text):
    return {n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant) and isinstance(n.value, str)}


def contracts(config):
    """What import-linter says: its exit status and text."""
    code = "import sys; from importlinter.cli import lint_imports_command; sys.exit(lint_imports_command())"
    call = [sys.executable, "-c", code, "--config", str(config), "--no-cache", "--no-logo"]
    found = subprocess.run(call, capture_output=True, text=True, cwd=ROOT, timeout=600)
    return found.returncode, found.stdout + found.stderr


def test_the_contracts_see_imports_inside_functions(tmp_path):
    """The command line imports late, in its functions. (That imports hold the contracts is checked by `make check`.)"""
    config = tmp_path / "pyproject.toml"
    config.write_text(
        '[tool.importlinter]\nroot_package = "rotorstudy"\n[[tool.importlinter.contracts]]\nname = "turned round"\n'
        'type = "layers"\nlayers = ["response", "commands"]\ncontainers = ["rotorstudy"]\n'
    )
    status, said = contracts(config)
    assert status == 1 and "rotorstudy.commands.simulate -> rotorstudy.response" in said


def test_the_contracts_see_modules_that_import_each_other_in_a_circle(tmp_path, monkeypatch):
    circle = {
        "__init__": "",
        "a": "def late():\n    from around import b",
        "b": "from around.c import d",
        "c": "import around.a",
    }
    (tmp_path / "around").mkdir()
    for name, text in circle.items():
        (tmp_path / "around" / f"{name}.py").write_text(text)
    _, _, own = (ROOT / "pyproject.toml").read_text().partition('id = "circles"\n')
    contract = own.partition("\n\n")[0].replace("rotorstudy", "around")
    config = tmp_path / "pyproject.toml"
    config.write_text(f'[tool.importlinter]\nroot_package = "around"\n[[tool.importlinter.contracts]]\n{contract}\n')
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    status, said = contracts(config)
    assert status == 1 and "No modules import each other in a circle BROKEN" in said


def test_plugins_py_offers_what_plugins_need():
    """It imports by name when first used, which import-linter does not see."""
    folders = {module.split(".")[0] for module in rotorstudy.plugins._MODULE.values()}
    assert folders <= {"model", "response", "measurement", "inference", "errors"}


def foreign_imports(text):
    """Modules of plugins or workflow that a file of the package imports."""
    others = ("plugins", "workflow", "thesis", "snakemake")
    return [m for m in imported(text) if m.split(".")[0] in others or "_plugin_" in m]


def models_named(text):
    """Plugins of any kind that a file names."""
    return sorted({plugin.name for _, plugin in registry()} & strings(text))


def test_the_package_imports_no_plugin():
    assert {path.name: found for path in PACKAGE if (found := foreign_imports(path.read_text()))} == {}
    assert foreign_imports("def late():\n    from plugins.cracks import switching") == ["plugins.cracks"]


def test_the_package_names_no_other_plugin():
    assert {word for path in GENERAL for word in models_named(path.read_text())} <= NAMED
    for name in ("jeffcott", "switching", "strip_integration", "short_journal", "probe_gain", "fft", "huber"):
        assert models_named(f"kind = {name!r}") == [name]


def wrong_imports(text):
    """What a plugin file imports besides rotorstudy.plugins, numpy, scipy and the standard library."""
    allowed = {"numpy", "scipy", *sys.stdlib_module_names}
    return [m for m in imported(text) if m != "rotorstudy.plugins" and m.split(".")[0] not in allowed]


def test_a_plugin_file_imports_from_rotorstudy_plugins_alone():
    assert {path.name: wrong for path in [*PLUGINS, *TEMPLATES] if (wrong := wrong_imports(path.read_text()))} == {}
    modules = ("rotorstudy.model.terms", "pandas", "rotorstudy", "numpy.linalg", "rotorstudy.plugins")
    assert wrong_imports("\n".join(f"from {module} import a" for module in modules)) == [*modules[:3]]
    assert wrong_imports("import pandas") == ["pandas"]


def paths_outside(path, text):
    """Relative paths in a file that leave the project."""
    found = re.findall(r"(?:\.\./)+[\w./]*", text)
    return [one for one in found if not (path.parent / one).resolve().is_relative_to(ROOT)]


def test_no_file_names_a_folder_outside_the_project():
    for path in [*PACKAGE, *PLUGINS, *(ROOT / "workflow").rglob("*.py"), *(ROOT / "workflow").rglob("*.yaml")]:
        assert paths_outside(path, path.read_text()) == []
    assert paths_outside(ROOT / "workflow" / "a.yaml", "../../other/rig.yaml") == ["../../other/rig.yaml"]
