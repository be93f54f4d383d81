"""Tables for readers: CSV for programs, one self-contained HTML page for people."""

from html import escape

from rotorstudy.presentation.pages import render
from rotorstudy.store import atomic, write_text

LONG, SHORT = 80, 24  # characters: a longer column of text is given room, a shorter one is not broken
CSS = """
body { font-family: sans-serif; margin: 1.5em; color: #222; }
p, ul { max-width: 60em; }
table { border-collapse: collapse; font-size: 0.85em; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.5em; text-align: left; vertical-align: top; }
th { background: #f0f0f0; }
td.number { text-align: right; white-space: nowrap; }
td.short { white-space: nowrap; }
td.text, td.long { white-space: pre-line; }
td.text { min-width: 12em; }
td.long { min-width: 22em; }
"""


def write_csv(table, path):
    """A DataFrame as CSV, atomically; numbers with the digits that bring them back."""
    with atomic(path) as temporary:
        table.to_csv(temporary, index=False)


def write_html(path, title, note, tables, digits=6):
    """A page with a title, a note on what to look at, and DataFrames by heading ({heading: table}).

    note : a text, or a list whose first is a text and the others points of a list;  digits : of every number
    """
    note = [note] if isinstance(note, str) else note
    tables = {heading: cells(table, digits) for heading, table in tables.items()}
    write_text(path, render("tables.html", title=title, note=note, tables=tables))


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
    return {"columns": [str(name) for name in table.columns], "rows": rows}


def html_table(table, digits=6):
    """A DataFrame as HTML; every cell has the class of its column: number, short, long or text."""
    found = cells(table, digits)
    lines = ["".join(f"<th>{escape(name)}</th>" for name in found["columns"])]
    lines += ["".join(f'<td class="{kind}">{escape(text)}</td>' for kind, text in row) for row in found["rows"]]
    body = "\n".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table>\n{body}\n</table>"


def _kind(column):
    if column.dtype.kind in "iuf":
        return "number"
    longest = column.astype(str).str.len().max()
    return "long" if longest > LONG else "short" if longest <= SHORT else "text"


def _cell(value, digits):
    if isinstance(value, float):
        return "" if value != value else f"{float(f'{value:.{digits}g}'):.12g}"  # 63640, not 6.364e+04
    return "" if value is None else str(value)


def write_table(table, csv, html, title, note, digits=6):
    """The same DataFrame as CSV and as a page."""
    write_csv(table, csv)
    write_html(html, title, note, {"": table}, digits)


def in_table_order(scored):
    """Rows by table as people count: 5.5 before 5.6, 4.9 before 4.10; the order within a table stays."""
    numbers = scored.table.map(lambda name: tuple(int(part) for part in name.split(".")))
    return scored.iloc[sorted(range(len(scored)), key=lambda i: numbers.iloc[i])].reset_index(drop=True)


def in_micrometres(scored):
    """Lengths in um instead of m, for display."""
    small = scored.unit == "m"
    lengths = {key: (scored[key] * 1e6).round(9).where(small, scored[key]) for key in ("published", "computed")}
    return scored.assign(**lengths, unit=scored.unit.where(~small, "um"))


def side_by_side(scored, rows, columns):
    """A scored table as people read it: published and ours next to each other, lengths in um.

    scored : rows of a scoreboard;  rows, columns : key columns that go down and across
    """
    scored = in_micrometres(scored)
    mixed = scored.groupby(columns, dropna=False).unit.nunique().max() > 1
    rows = [*rows, "unit"] if mixed else rows
    wide = scored.drop_duplicates([*rows, *columns], keep="first")
    result = wide[rows].drop_duplicates().reset_index(drop=True)
    for key, part in wide.groupby(columns, sort=False, dropna=False):
        label = ", ".join(str(k) for k in key if str(k) not in ("", "nan"))
        label = label if mixed else f"{label} ({part.unit.iloc[0]})"
        part = part[[*rows, "published", "computed", "status"]]
        names = {"published": f"{label}: thesis", "computed": f"{label}: here", "status": f"{label}: status"}
        result = result.merge(part.rename(columns=names), on=rows, how="left")
    return result


def write_scored_tables(scored, tables, csv, html):
    """The tables of a chapter, published and ours side by side.

    tables : name like "2.5" -> (title, note, key columns that go down, key columns that go across)
    csv, html : paths, in the order of `tables`
    """
    for (name, (title, note, down, across)), sheet, page in zip(tables.items(), csv, html, strict=True):
        write_table(
            side_by_side(scored[scored.table == name], down, across), sheet, page, f"Table {name}: {title}", note
        )
