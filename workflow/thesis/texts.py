"""Pages of tables with the titles and notes of templates/pages.yaml."""

from pathlib import Path

from rotorstudy.presentation.pages import Table
from rotorstudy.yaml_file import read_yaml

STATED = read_yaml(Path(__file__).with_name("templates") / "pages.yaml")


def page(name, rows, further_notes=(), digits=6, shown=None, choose=(), below=None, **numbers):
    """The Table of rows with the title and note of its name; numbers : what stands for {name} in these."""
    title, *note = (text.format(**numbers) for text in STATED[name])
    return Table(rows, title, [*note, *further_notes], digits, shown, choose, below)
