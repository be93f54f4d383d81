"""Tables for readers: CSV for programs, one self-contained HTML page for people."""

import re

from rotorstudy.presentation.named_files import files_by_name
from rotorstudy.presentation.pages import render
from rotorstudy.store import atomic, write_text

LONG, SHORT = 80, 24  # characters: a longer column is widened, a shorter one is not wrapped


def write_csv(table, path):
    """Write a DataFrame as CSV, atomically; numbers with all digits."""
    with atomic(path) as temporary:
        table.to_csv(temporary, index=False)


def write_html(path, title, note, tables, digits=6, choose=()):
    """Write a page with a title, a note and DataFrames by heading ({heading: table}).

    Parameters
    ----------
    path : path
    title : str
    note : str or list of str
        A text, or a text and bullet points.
    tables : dict
        Heading -> DataFrame; the heading may be empty.
    digits : int
        Significant digits of every number.
    choose : sequence of str
        Columns by whose values, and by any text, a reader may select the rows of a table that has them all.
    """
    note = [note] if isinstance(note, str) else note
    tables = {heading: cells(table, digits) for heading, table in tables.items()}
    write_text(path, render("tables.html", title=title, note=note, tables=tables, choose=choose))


def cells(table, digits=6):
    """A DataFrame as the macro `show.table` takes it.

    Parameters
    ----------
    table : pandas.DataFrame
    digits : int
        Significant digits of every number.

    Returns
    -------
    dict
        `columns`, the headings, and `rows`, each a list of (class, text); the class is that of the column: number,
        short, text or long.
    """
    kinds = [_kind(column) for _, column in table.items()]
    rows = [
        [(kind, _cell(value, digits)) for kind, value in zip(kinds, row, strict=True)]
        for row in zip(*(column for _, column in table.items()), strict=True)
    ]
    return {"columns": [_heading(str(name)) for name in table.columns], "rows": rows}


def _heading(name):
    """noise_percent -> noise (%), last_digit -> last digit."""
    return re.sub(r"_percent$", " (%)", name).replace("_", " ")


def _kind(column):
    if column.dtype.kind in "iuf":
        return "number"
    longest = column.astype(str).str.len().max()
    return "long" if longest > LONG else "short" if longest <= SHORT else "text"


def _cell(value, digits):
    if isinstance(value, float):
        return "" if value != value else f"{float(f'{value:.{digits}g}'):.12g}"  # 63640, not 6.364e+04
    return "" if value is None else str(value)


def write_tables(tables, paths):
    """Write every table to the files of its name: .csv for programs, .html for people.

    Parameters
    ----------
    tables : dict
        name -> `rotorstudy.thesis.tables.Table`.
    paths : iterable of path
        Files to be written: table_2_1.csv holds the table "table_2_1".

    Raises
    ------
    RotorstudyError
        Names of tables and of files differ; nothing is written then.
    """
    for name, files in files_by_name("table", tables, paths).items():
        table = tables[name]
        for path in files:
            if path.suffix == ".csv":
                write_csv(table.rows, path)
            else:
                write_html(path, table.title, table.note, {"": table.rows}, table.digits)
