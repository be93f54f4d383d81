"""Tables for readers: CSV for programs, one self-contained HTML page for people."""

from rotorstudy.store import atomic, write_text

CSS = """
body { font-family: sans-serif; margin: 1.5em; color: #222; max-width: 90em; }
table { border-collapse: collapse; font-size: 0.85em; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.5em; text-align: right; }
th { background: #f0f0f0; }
td { white-space: nowrap; }
td:last-child { text-align: left; white-space: normal; }
"""


def write_csv(table, path):
    """A DataFrame as CSV, atomically; numbers with the digits that bring them back."""
    with atomic(path) as temporary:
        table.to_csv(temporary, index=False)


def write_html(path, title, note, tables):
    """A page with a title, a note on what to look at, and DataFrames by heading ({heading: table})."""
    parts = [f"<h1>{title}</h1>", f"<p>{note}</p>"]
    for heading, table in tables.items():
        parts += [
            f"<h2>{heading}</h2>",
            table.rename_axis(columns=None).to_html(index=False, float_format=_number, na_rep="", border=0),
        ]
    body = "\n".join(parts)
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{CSS}</style>'
    write_text(path, f"{head}{body}</html>\n")


def _number(value):
    return f"{value:.6g}"


def write_table(table, csv, html, title, note):
    """The same DataFrame as CSV and as a page."""
    write_csv(table, csv)
    write_html(html, title, note, {"": table})


def side_by_side(scored, rows, columns):
    """A scored table as people read it: published and ours next to each other.

    scored : rows of a scoreboard;  rows, columns : key columns that go down and across
    """
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
