"""Imports point one way: workflow -> rotorstudy <- plugins; the machine knows no model by name."""

import ast
import sys
from pathlib import Path

import pytest

from rotorstudy.model.registry import registry

ROOT = Path(__file__).parents[2]
MACHINE = sorted((ROOT / "src" / "rotorstudy").rglob("*.py"))
PLUGINS = sorted((ROOT / "plugins").rglob("*.py"))


def imported(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def strings(text):
    return {n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant) and isinstance(n.value, str)}


def offences(text, allowed_names=()):
    """Modules of plugins or workflow that a file of the machine imports, and models it names."""
    modules = [
        m for m in imported(text) if m.split(".")[0] in ("plugins", "workflow", "snakemake") or "rotorstudy_plugin" in m
    ]
    models = {plugin.name for kind, plugin in registry() if kind in ("rotor", "crack", "depth", "bearing")}
    return modules + sorted(models & strings(text))


@pytest.mark.parametrize("path", MACHINE, ids=lambda p: p.name)
def test_the_machine_knows_no_plugin(path):
    assert offences(path.read_text()) == []


def test_the_check_finds_an_offence():
    assert offences("from plugins.cracks import switching") == ["plugins.cracks"]
    assert offences("kind = 'jeffcott'") == ["jeffcott"]


@pytest.mark.parametrize("path", PLUGINS, ids=lambda p: p.name)
def test_plugins_import_the_machine_and_no_other_plugin(path):
    roots = {module.split(".")[0] for module in imported(path.read_text())}
    assert roots <= {"rotorstudy", "numpy", "scipy", *sys.stdlib_module_names}


def crossings(text, forbidden):
    """Modules of another half that a file imports."""
    return [module for module in imported(text) if module.startswith(forbidden)]


def test_the_diagnosis_knows_nothing_of_what_injects_and_the_other_way_round():
    diagnosis = sorted((ROOT / "src" / "rotorstudy" / "diagnosis").glob("*.py"))
    blind = sorted((ROOT / "src" / "rotorstudy" / "blind").glob("*.py"))
    assert diagnosis and blind
    for path in diagnosis:
        assert crossings(path.read_text(), "rotorstudy.blind") == [], path
    for path in blind:
        if path.name != "run.py":  # which hands the measurement over
            assert crossings(path.read_text(), "rotorstudy.diagnosis") == [], path
    assert crossings("from rotorstudy.diagnosis.search import search", "rotorstudy.diagnosis")


def test_no_file_names_a_folder_outside_the_project():
    for path in [*MACHINE, *PLUGINS, *(ROOT / "workflow").rglob("*.py"), *(ROOT / "workflow").rglob("*.yaml")]:
        assert "../" not in path.read_text().replace("../scripts", ""), path
