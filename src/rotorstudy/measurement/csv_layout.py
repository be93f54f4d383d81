"""The layout of a CSV file, guessed from its first lines: separator, decimal sign, header, rows of units."""

import json
import re
from pathlib import Path
from typing import NamedTuple

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.conventions import CsvLayout

LINES = 400  # read
FIRST = 4096  # bytes, of which one at least is no space
ROWS = 3  # at least of data
SEPARATORS = (";", "\t", ",")
DECIMALS = (".", ",")
UNIT = re.compile(
    r"\W*(s|sec|ms|us|um|µm|μm|mm|mils?|m|v|mv|rpm|hz|rad|rad/s|deg|degrees?|°|g|mm/s|in/s|ips|m/s2?|-|1)?"
    r"\W*(p-?p|pk|pk-?pk|0-pk?|peak|peak.to.peak|rms|lag|lead)?\W*"
)


class Layout(NamedTuple):
    """How a CSV file is written.

    csv   : CsvLayout
    names : (column,) of the header
    units : (column,) text below the header; empty where there is none
    """

    csv: CsvLayout
    names: list[str]
    units: list[str]


def guess_layout(path):
    """The Layout of a CSV file with one row of names and rows of numbers below it.

    Parameters
    ----------
    path : path

    Returns
    -------
    Layout

    Raises
    ------
    RotorstudyError
        If there is no such file, or no table of numbers below a row of names.
    """
    path = Path(path)
    if not path.is_file():
        raise RotorstudyError(f"record file '{path}' does not exist")
    _check_not_empty(path)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        lines = [line.rstrip("\r\n") for line, _ in zip(file, range(LINES), strict=False)]
    ways = [(separator, decimal) for separator in SEPARATORS for decimal in DECIMALS if separator != decimal]
    rows, _, separator, decimal = max(
        (_table(lines, *way) + way for way in ways), key=lambda found: len(found[0]) * found[1]
    )
    if len(rows) < ROWS or rows[0] == 0:
        raise RotorstudyError(
            f"{path}: no table of numbers below a row of names in its first {LINES} lines; it needs a header and "
            f"{ROWS} rows"
        )
    cells = [[cell.strip().strip('"') for cell in line.split(separator)] for line in lines[: rows[0]]]
    width = len(lines[rows[0]].split(separator))
    header = rows[0] - 1
    while header > 0 and len(cells[header - 1]) == width and _is_units(cells[header]):
        header -= 1
    below = rows[0] - header - 1
    layout = CsvLayout(separator=separator, decimal=decimal, skip_rows=header, unit_rows=below)
    return Layout(layout, cells[header], cells[header + 1] if below else [""] * width)


def header_of(path, layout):
    """Names of the columns of a text file, and the text of the row of units below each, as its CsvLayout states.

    raises : RotorstudyError for an empty file
    """
    _check_not_empty(path)
    with Path(path).open(encoding="utf-8-sig", errors="replace") as file:
        lines = [line.rstrip("\r\n") for line, _ in zip(file, range(layout.skip_rows + 2), strict=False)]
    rows = [[cell.strip().strip('"').strip() for cell in line.split(layout.separator)] for line in lines]
    names = rows[layout.skip_rows] if len(rows) > layout.skip_rows else [""]
    units = rows[-1] if layout.unit_rows and len(rows) == layout.skip_rows + 2 else []
    return names, [*units, *[""] * len(names)][: len(names)]


def _check_not_empty(path):
    with Path(path).open("rb") as file:
        if not file.read(FIRST).strip():
            raise RotorstudyError(f"{path}: the file is empty; export it again, or leave it out")


def layout_hint(path, stated):
    """'; it looks like csv: {separator: ";"}' if a text file looks otherwise than its CsvLayout states, else ''."""
    try:
        found = guess_layout(path).csv
    except RotorstudyError:
        return ""
    other = found.model_dump(exclude_defaults=True)
    return f"; the file looks like 'csv: {json.dumps(other)}' in 'measurement:'" if found != stated else ""


def _table(lines, separator, decimal):
    """Longest run of lines that are rows of the same table: their numbers (from 0), and how many cells are numbers."""
    best, count, start, width = range(0), 0, 0, -1
    for i, line in enumerate(lines):
        cells = line.split(separator)
        numeric, filled = sum(_is_number(cell, decimal) for cell in cells), sum(bool(cell.strip()) for cell in cells)
        if not numeric or numeric < filled / 2:
            width = -1
            continue
        if len(cells) != width:
            start, width = i, len(cells)
        if i + 1 - start > len(best):
            best, count = range(start, i + 1), numeric
    return best, count


def _is_number(cell, decimal):
    text = cell.strip().strip('"')
    if decimal == ",":
        text = "x" if "." in text else text.replace(",", ".")
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_units(cells):
    """Whether the cells of a row are units, not names; a name such as `s` beside others is one."""
    return all(UNIT.fullmatch(cell.lower()) for cell in cells)
