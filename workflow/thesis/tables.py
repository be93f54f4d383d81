"""Tables for readers: printed values and ours side by side. The presentation writes them to files."""

from typing import NamedTuple

import pandas as pd


class Table(NamedTuple):
    """A table with its title and note.

    note : a text, or a list of a text and bullet points;  digits : significant digits of every number on the page
    """

    rows: pd.DataFrame
    title: str
    note: str | list[str]
    digits: int = 6


def in_table_order(scored):
    """Rows ordered by table number, 4.9 before 4.10; the order within a table stays."""
    numbers = scored.table.map(lambda name: tuple(int(part) for part in name.split(".")))
    return scored.iloc[sorted(range(len(scored)), key=lambda i: numbers.iloc[i])].reset_index(drop=True)


def in_micrometres(scored):
    """Lengths in µm instead of m, for display."""
    small = scored.unit == "m"
    lengths = {key: (scored[key] * 1e6).round(9).where(small, scored[key]) for key in ("published", "computed")}
    return scored.assign(**lengths, unit=scored.unit.where(~small, "µm"))


def side_by_side(scored, rows, columns):
    """Rows of a scoreboard for readers: published and ours next to each other, lengths in µm, by key columns."""
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


def table_name(number):
    """ "2.5" -> "table_2_5", the name of its files."""
    return f"table_{number}".replace(".", "_")


def scored_tables(scored, described):
    """{"table_2_5": Table} of printed values and ours side by side, of rows of the scoreboard.

    described : number like "2.5" -> (title, note, key columns of the rows, key columns of the columns)
    """
    return {
        table_name(number): Table(
            side_by_side(scored[scored.table == number], down, across), f"Table {number}: {title}", note
        )
        for number, (title, note, down, across) in described.items()
    }
