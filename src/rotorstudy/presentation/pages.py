"""HTML pages from templates, each a single self-contained file; and tables, as CSV for programs and as such pages."""

import base64
import os
import re
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # importing it takes half a second
    from pandas import DataFrame

from rotorstudy.store import atomic, write_text

LONG, SHORT = 80, 24  # characters: a longer column is widened, a shorter one is not wrapped
MARKS = {"explained": "doubtful", "not reproducible": "bad"}  # cells that a reader looks for


class Table(NamedTuple):
    """Rows, and what a page of them says."""

    rows: "DataFrame"
    title: str = ""
    note: str | list[str] = ""  # a text, or a list of a text and bullet points
    digits: int = 6  # significant digits of every number on the page
    shown: dict | None = None  # heading -> DataFrame, instead of the rows
    choose: tuple = ()  # columns by which, and by any text, a reader may select the rows of what has them all
    below: str | None = None  # column of long texts, each shown below its row instead of beside it


@cache
def _environment():
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    style = {"undefined": StrictUndefined, "trim_blocks": True, "lstrip_blocks": True}
    made = Environment(loader=PackageLoader("rotorstudy.presentation"), autoescape=select_autoescape(), **style)
    made.globals["vendored"] = _vendored
    return made


def _vendored(name):
    """The text of a script or a style beside the templates, to be put into a page as it is."""
    from markupsafe import Markup

    return Markup((Path(__file__).with_name("templates") / name).read_text(encoding="utf-8"))


def render(template: str, **data) -> str:
    """A page, or a text (.txt), from a template of `presentation/templates`; in a page every value is escaped.

    template : a page extends `base.html`, which needs `title` and takes `links` (text -> address, shown at the top)
    data     : values by the names that the template uses; a missing one raises `jinja2.UndefinedError`
    """
    return _environment().get_template(template).render(**data)


def to_index(page: str | Path, index: str | Path | None) -> dict[str, str]:
    """Link from a page to the page of all results, as text -> relative address; none without one."""
    return {"All results": address(page, index)} if index else {}


def address(page: str | Path, target: str | Path) -> str:
    """Address of a file, relative to a page that links to it."""
    return Path(os.path.relpath(target, Path(page).parent)).as_posix()


def pictures(files, titles):
    """{name: title, caption, source} of figures; files: name -> PNG, titles: name -> (title, caption), in order."""
    shown = {name: told for name, told in titles.items() if name in files}
    return {name: {"title": a, "caption": b, "source": inline_png(files[name])} for name, (a, b) in shown.items()}


def inline_png(picture: bytes | str | Path) -> str:
    """A PNG, as bytes or the path of a file, as a data URI for `<img src>`."""
    content = picture if isinstance(picture, bytes) else Path(picture).read_bytes()
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"


def write_csv(table, path):
    """Write a DataFrame as CSV, atomically; numbers with all digits."""
    with atomic(path) as temporary:
        table.to_csv(temporary, index=False)


def write_html(path, table, links=None):
    """Write the page of a Table; links : text -> address, relative to the page, of pages to go to from its top."""
    note = [table.note] if isinstance(table.note, str) else table.note
    shown = {"": table.rows} if table.shown is None else table.shown
    tables = {heading: cells(rows, table.digits, table.below) for heading, rows in shown.items()}
    told = {"title": table.title, "note": note, "choose": table.choose}
    write_text(path, render("tables.html", **told, tables=tables, marks=MARKS, links=links or {}))


def cells(table, digits=6, below=None):
    """A DataFrame as the macro `show.table` takes it; below : a column of texts shown below their rows, or none."""
    texts = [_cell(value, digits) for value in table.get(below, [])]
    table = table.drop(columns=below, errors="ignore") if below else table
    groups, columns = _grouped([_heading(str(name)) for name in table.columns])
    kinds = [_kind(column) for _, column in table.items()]
    rows = [
        [(kind, _cell(value, digits)) for kind, value in zip(kinds, row, strict=True)]
        for row in zip(*(column for _, column in table.items()), strict=True)
    ]
    return {"columns": columns, "groups": groups, "rows": rows, "below": texts}


def _grouped(names):
    """Columns "amplitude: thesis", "amplitude: here" as (group, number of columns), and the names within the groups."""
    parts = [name.rpartition(": ") for name in names]
    groups = [(group, len(list(run))) for group, run in groupby(group for group, _, _ in parts)]
    if max((count for group, count in groups if group), default=1) < 2:
        return [], names
    return groups, [name for _, _, name in parts]


def _heading(name):
    """noise_percent -> noise (%), last_digit -> last digit, ratio (1) -> ratio; a symbol such as c_H stays."""
    return re.sub(r"(?<=\w{3})_", " ", re.sub(r"_percent$", " (%)", name.removesuffix(" (1)")))


def _kind(column):
    if column.dtype.kind in "iuf":
        return "number"
    longest = column.astype(str).str.len().max()
    return "long" if longest > LONG else "short" if longest <= SHORT else "text"


def _cell(value, digits):
    if isinstance(value, float):
        return "" if value != value else f"{float(f'{value:.{digits}g}'):.12g}"  # 63640, not 6.364e+04
    return "" if value is None else str(value)
